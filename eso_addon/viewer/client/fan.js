// SPDX-License-Identifier: GPL-3.0-or-later
// The corners around a splitting place: which follows which, where its arc runs, and what that expects of the new place.
import { bitLength } from './coder.js';
import { StreamError } from './container.js';

const HALVES = Float64Array.from({ length: 64 }, (_, n) => 2 ** -n);
const damaged = (what) => new StreamError(`The file is damaged: ${what}.`);

export class Fan {
  constructor() {
    this.split = 0;
    this.room(64);
  }

  room(size) {
    this.size = size;
    this.p = new Int32Array(size);
    this.next = new Int32Array(size);
    this.linked = new Int32Array(size); // where each corner was last found to be a successor
    // the ring's places at p and q of each corner, from the splitting place; twice the offset of their middle
    for (const name of ['px', 'py', 'pz', 'qx', 'qy', 'qz']) this[name] = new Int32Array(size);
    for (const name of ['ox', 'oy', 'oz', 'toward']) this[name] = new Float64Array(size);
    this.score = new Float32Array(size);
  }

  /** Find the arcs of all splits, and mean, spread and normal of each one's ring. */
  arcs(mesh, vertex, first, corners, length, rank) {
    const k = vertex.length;
    let total = 0;
    for (let i = 0; i < k; i++) {
      const degree = first[i + 1] - first[i];
      if (degree > this.size) this.room(2 * degree);
      if (length[i] > degree) throw damaged('a split leaves the surface');
      if (rank[i] >= degree) throw damaged('a split starts nowhere');
      total += length[i];
    }
    const out = {
      length, arcFirst: new Int32Array(k + 1), arcCorner: new Int32Array(total), startCorner: new Int32Array(k),
      lastCorner: new Int32Array(k), x: new Int32Array(k), y: new Int32Array(k), there: new Uint8Array(k).fill(3),
      asked: [], askedContext: [], mean: new Int32Array(3 * k), normal: new Float64Array(3 * k), axis: new Uint8Array(k),
      spread: new Int32Array(k), vertex, points: mesh.points,
    };
    const { points } = mesh;
    const { shift } = mesh.geometry;
    for (let i = 0; i < k; i++) {
      const degree = first[i + 1] - first[i];
      const closed = this.link(points, corners, first[i], degree, 4 * vertex[i], shift);
      this.rate(degree, length[i]);
      const start = this.nth(corners, 3 * first[i], degree, rank[i]);
      this.walk(out, i, points, corners, 3 * first[i], degree, start, 4 * vertex[i], shift, closed);
    }
    return out;
  }

  /**
   * Link each corner to its successor, and fetch the ring. Each place's fourth number tells at which corner it was last
   * met as p: so no search is needed. Says whether every corner has a successor and is one.
   */
  link(points, corners, first, degree, v, shift) {
    const { p, next, linked, px, py, pz, qx, qy, qz, ox, oy, oz } = this;
    const split = ++this.split;
    const vx = points[v];
    const vy = points[v + 1];
    const vz = points[v + 2];
    for (let c = 0, at = 3 * first + 1; c < degree; c++, at += 3) {
      const place = corners[at];
      p[c] = place;
      const from = 4 * place;
      px[c] = points[from];
      py[c] = points[from + 1];
      pz[c] = points[from + 2];
      points[from + 3] = first + c;
    }
    let closed = true;
    const cx = 2 * (vx >> shift);
    const cy = 2 * (vy >> shift);
    const cz = 2 * (vz >> shift);
    for (let c = 0, at = 3 * first + 2; c < degree; c++, at += 3) {
      const place = corners[at];
      const from = 4 * place;
      const x = points[from];
      const y = points[from + 1];
      const z = points[from + 2];
      const met = points[from + 3] - first;
      qx[c] = x;
      qy[c] = y;
      qz[c] = z;
      ox[c] = (px[c] >> shift) + (x >> shift) - cx;
      oy[c] = (py[c] >> shift) + (y >> shift) - cy;
      oz[c] = (pz[c] >> shift) + (z >> shift) - cz;
      if (met >= 0 && met < degree && p[met] === place) {
        next[c] = met;
        if (linked[met] === split) closed = false; // of two corners: then some other is of none
        linked[met] = split;
      } else {
        next[c] = -1;
        closed = false;
      }
    }
    return closed;
  }

  /** Score how likely an arc starts at each corner: how far its corners lie where the ring pulls the vertex. */
  rate(degree, length) {
    const { next, ox, oy, oz, toward, score } = this;
    let x = 0;
    let y = 0;
    let z = 0;
    for (let c = 0; c < degree; c++) {
      x += ox[c];
      y += oy[c];
      z += oz[c];
    }
    x = Math.floor(x / degree);
    y = Math.floor(y / degree);
    z = Math.floor(z / degree);
    for (let c = 0; c < degree; c++) toward[c] = x * ox[c] + y * oy[c] + z * oz[c];
    const steps = length < 8 ? length : 8;
    for (let c = 0; c < degree; c++) {
      let sum = toward[c];
      for (let step = 1, d = next[c]; step < steps && d >= 0; step++, d = next[d]) sum += toward[d];
      score[c] = sum;
    }
  }

  /** The corner with the rank-th highest score; of equal ones the lower row first, then the lower face. */
  nth(corners, first, degree, rank) {
    const { score } = this;
    const lower = (i, j) => {
      const a = corners[first + 3 * i];
      const b = corners[first + 3 * j];
      return a % 3 !== b % 3 ? a % 3 < b % 3 : a < b;
    };
    if (rank > 15) {
      const order = Array.from({ length: degree }, (_, c) => c);
      return order.sort((i, j) => (score[i] !== score[j] ? score[j] - score[i] : lower(i, j) ? -1 : 1))[rank];
    }
    let best = 0;
    for (let c = 1; c < degree; c++) if (score[c] > score[best] || (score[c] === score[best] && lower(c, best))) best = c;
    for (let round = 0; round < rank; round++) {
      const before = best;
      const limit = score[before];
      best = -1;
      for (let c = 0; c < degree; c++) {
        if (score[c] > limit || c === before || (score[c] === limit && lower(c, before))) continue;
        if (best < 0 || score[c] > score[best] || (score[c] === score[best] && lower(c, best))) best = c;
      }
    }
    return best;
  }

  /** Follow the arc from its start; write down its corners, its ends, and mean, spread and normal of the ring. */
  walk(out, i, points, corners, first, degree, start, v, shift, closed) {
    const { next, px, py, pz, qx, qy, qz } = this;
    const { arcCorner } = out;
    const steps = out.length[i];
    const vx = points[v];
    const vy = points[v + 1];
    const vz = points[v + 2];
    const rx = px[start];
    const ry = py[start];
    const rz = pz[start];
    let nx = 0;
    let ny = 0;
    let nz = 0;
    let sx = vx + rx;
    let sy = vy + ry;
    let sz = vz + rz;
    let to = out.arcFirst[i];
    let last = start;
    for (let step = 0, c = start; step < steps; step++, c = next[c]) {
      if (c < 0) throw damaged('a split leaves the surface');
      const x = qx[c];
      const y = qy[c];
      const z = qz[c];
      const ax = (px[c] - vx) >> shift;
      const ay = (py[c] - vy) >> shift;
      const az = (pz[c] - vz) >> shift;
      const bx = (x - vx) >> shift;
      const by = (y - vy) >> shift;
      const bz = (z - vz) >> shift;
      nx += ay * bz - az * by;
      ny += az * bx - ax * bz;
      nz += ax * by - ay * bx;
      sx += x;
      sy += y;
      sz += z;
      arcCorner[to++] = corners[first + 3 * c];
      last = c;
    }
    out.arcFirst[i + 1] = to;
    out.startCorner[i] = corners[first + 3 * start];
    out.lastCorner[i] = corners[first + 3 * last];
    out.x[i] = this.p[start];
    out.y[i] = corners[first + 3 * last + 2];
    if (!closed || steps === 0) this.ask(out, i, degree, start, last);
    this.normal(out, i, nx, ny, nz);
    const size = steps + 2;
    const mx = Math.floor((2 * sx + size) / (2 * size));
    const my = Math.floor((2 * sy + size) / (2 * size));
    const mz = Math.floor((2 * sz + size) / (2 * size));
    let sum = Math.abs(vx - mx) + Math.abs(vy - my) + Math.abs(vz - mz) + Math.abs(rx - mx) + Math.abs(ry - my) + Math.abs(rz - mz);
    for (let step = 0, c = start; step < steps; step++, c = next[c]) {
      sum += Math.abs(qx[c] - mx) + Math.abs(qy[c] - my) + Math.abs(qz[c] - mz);
    }
    out.mean[3 * i] = mx;
    out.mean[3 * i + 1] = my;
    out.mean[3 * i + 2] = mz;
    out.spread[i] = Math.floor(sum / size);
  }

  /** Note that a split at the end of a fan says which faces open. */
  ask(out, i, degree, start, last) {
    const { next } = this;
    let isFirst = true; // no corner's successor
    for (let c = 0; c < degree; c++) if (next[c] === start) isFirst = false;
    const isLast = next[last] < 0;
    const bare = out.length[i] === 0;
    if (!isFirst && !isLast && !bare) return;
    out.asked.push(i);
    out.askedContext.push(bare ? 2 : isFirst && isLast ? 1 : 0);
  }

  /** Keep twelve bits of a normal, and the axis along which it is largest. */
  normal(out, i, x, y, z) {
    const longest = Math.max(Math.abs(x), Math.abs(y), Math.abs(z));
    if (longest >= 4096) {
      const scale = HALVES[bitLength(longest) - 12];
      x = Math.floor(x * scale);
      y = Math.floor(y * scale);
      z = Math.floor(z * scale);
    }
    out.normal[3 * i] = x;
    out.normal[3 * i + 1] = y;
    out.normal[3 * i + 2] = z;
    const a = Math.abs(y) > Math.abs(x) ? 1 : 0;
    out.axis[i] = Math.abs(z) > Math.abs(a ? y : x) ? 2 : a;
  }
}
