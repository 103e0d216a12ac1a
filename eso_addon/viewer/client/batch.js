// SPDX-License-Identifier: GPL-3.0-or-later
// A batch of vertex splits: who splits, how long the arc is, where it starts, what opens; then carried out.
import { Model } from './coder.js';
import { StreamError } from './container.js';

const ESCAPE = 15;
const FEW = 24; // corners at a vertex that are compared one by one

export class Connectivity {
  constructor() {
    this.flag = new Model(64, 2);
    this.length = new Model(16, 16);
    this.start = new Model(128, 16);
    this.sides = new Model(3, 4);
    this.torn = new Model(2, 2);
    this.degree = null;
  }

  /** Read a batch from the mesh's coder and carry it out; gives corners that moved and the face beside each new one. */
  batch(mesh, placesAfter, facesAfter) {
    const { faces, coder, places: n } = mesh;
    const b = { n, m: mesh.faceCount, mesh, coder };
    this.flags(b);
    const { vertex, label } = b;
    const k = vertex.length;
    if (n + k !== placesAfter) throw new StreamError('The file is damaged: a batch holds other counts than its table.');
    this.gather(b);
    this.lengths(b);
    this.starts(b);
    this.opens(b);
    const arcs = this.walk(b);
    // positions are read after the torn edges; corners move in between, and third corners look at moved faces
    b.moved = arcs.moved;
    for (let i = 0; i < arcs.moved.length; i++) faces[arcs.moved[i]] = n + arcs.split[i];
    const third = this.thirds(b);
    mesh.geometry.read(b);
    let at = b.m;
    const beside = new Int32Array(2 * k);
    for (let i = 0; i < k; i++) {
      const [v, u] = [vertex[i], n + i];
      const face = Math.floor(b.corner[b.start[i]] / 3) + mesh.head.extra;
      for (let side = 0; side < 2; side++) {
        if (!((b.there[i] >> side) & 1)) continue;
        if (at >= facesAfter) throw new StreamError('The file is damaged: a batch holds more than its table says.');
        beside[at - b.m] = face;
        faces[3 * at] = side ? v : u;
        faces[3 * at + 1] = side ? u : v;
        faces[3 * at++ + 2] = third[2 * i + side];
      }
      mesh.parents[u] = v;
      mesh.facesAfter[u] = at;
    }
    mesh.places = n + k;
    mesh.faceCount = at;
    for (const v of vertex) label[v] = -1;
    return { moved: arcs.moved, beside: beside.subarray(0, at - b.m) };
  }

  flags(b) {
    const { mesh, coder, n, m } = b;
    const room = mesh.parents.length;
    this.degree ??= new Int32Array(room);
    this.label ??= new Int32Array(room).fill(-1);
    const degree = this.degree;
    degree.fill(0, 0, n);
    for (let at = 0; at < 3 * m; at++) degree[mesh.faces[at]]++;
    coder.run(this.flag);
    const chosen = [];
    for (let v = 0; v < n; v++) {
      if (degree[v] && coder.symbol(degree[v] < 20 ? degree[v] : 20)) {
        this.label[v] = chosen.length;
        chosen.push(v);
      }
    }
    coder.learn();
    b.vertex = chosen;
    b.label = this.label;
  }

  /** The corners at splitting vertices, vertex by vertex, each vertex's by slot; and their successors. */
  gather(b) {
    const { vertex, label, m, mesh } = b;
    const k = vertex.length;
    const first = (b.first = new Int32Array(k + 1));
    for (let i = 0; i < k; i++) first[i + 1] = first[i] + this.degree[vertex[i]];
    const count = first[k];
    const corner = (b.corner = new Int32Array(count)); // 3 * face + row
    const p = (b.p = new Int32Array(count));
    const q = (b.q = new Int32Array(count));
    const next = (b.next = new Int32Array(count).fill(-1));
    const linked = (b.linked = new Uint8Array(count)); // is some corner's successor
    const fill = first.slice(0, k);
    const faces = mesh.faces;
    for (let row = 0; row < 3; row++) {
      const after = row === 2 ? -2 : 1;
      const before = row === 0 ? 2 : -1;
      for (let at = row; at < 3 * m; at += 3) {
        const i = label[faces[at]];
        if (i < 0) continue;
        const c = fill[i]++;
        corner[c] = at;
        p[c] = faces[at + after];
        q[c] = faces[at + before];
      }
    }
    for (let i = 0; i < k; i++) {
      const [begin, end] = [first[i], first[i + 1]];
      const byP = end - begin > FEW ? new Map() : null;
      if (byP) for (let c = begin; c < end; c++) byP.set(p[c], c);
      for (let c = begin; c < end; c++) {
        let found = -1;
        if (byP) found = byP.get(q[c]) ?? -1;
        else for (let d = begin; d < end; d++) if (p[d] === q[c]) found = d;
        if (found >= 0) linked[(next[c] = found)] = 1;
      }
    }
  }

  lengths(b) {
    const { vertex, first, coder } = b;
    b.length = this.small(coder, this.length, vertex.length, (i) => Math.min(first[i + 1] - first[i], 15));
  }

  /** Numbers that are mostly below 15; the others follow as plain bits. */
  small(coder, model, count, context) {
    const out = new Int32Array(count);
    coder.run(model);
    for (let i = 0; i < count; i++) {
      const s = coder.symbol(context(i));
      out[i] = s === ESCAPE ? Math.min(coder.bits(32), 0x7fffffff) : s;
    }
    coder.learn();
    return out;
  }

  starts(b) {
    const { first, length, coder, vertex } = b;
    const score = this.scores(b);
    const context = (i) => Math.min(first[i + 1] - first[i], 15) * 8 + Math.min(length[i], 7);
    const rank = this.small(coder, this.start, vertex.length, context);
    const start = (b.start = new Int32Array(vertex.length));
    for (let i = 0; i < vertex.length; i++) {
      if (rank[i] >= first[i + 1] - first[i]) throw new StreamError('The file is damaged: a split starts nowhere.');
      start[i] = nth(score, first[i], first[i + 1], rank[i]);
    }
  }

  /** How likely an arc starts at each corner: how far its corners lie where the ring pulls the vertex. */
  scores(b) {
    const { first, p, q, next, length, vertex, mesh } = b;
    const { points } = mesh;
    const { shift } = mesh.geometry;
    const count = p.length;
    const toward = new Float64Array(count);
    const score = new Float32Array(count);
    for (let i = 0; i < vertex.length; i++) {
      const [begin, end] = [first[i], first[i + 1]];
      for (let axis = 0; axis < 3; axis++) {
        const center = 2 * (points[3 * vertex[i] + axis] >> shift);
        let pull = 0;
        for (let c = begin; c < end; c++) {
          pull += (points[3 * p[c] + axis] >> shift) + (points[3 * q[c] + axis] >> shift) - center;
        }
        pull = Math.floor(pull / (end - begin));
        for (let c = begin; c < end; c++) {
          toward[c] += pull * ((points[3 * p[c] + axis] >> shift) + (points[3 * q[c] + axis] >> shift) - center);
        }
      }
      const steps = Math.min(length[i], 8);
      for (let c = begin; c < end; c++) {
        let sum = toward[c];
        for (let step = 1, d = next[c]; step < steps && d >= 0; step++, d = next[d]) sum += toward[d];
        score[c] = sum;
      }
    }
    return score;
  }

  /** Which faces open: bit 0 `before`, bit 1 `after`; asked only at the ends of fans. */
  opens(b) {
    const { start, length, next, linked, coder } = b;
    const k = start.length;
    const there = (b.there = new Uint8Array(k).fill(3));
    const last = (b.last = new Int32Array(k));
    coder.run(this.sides);
    for (let i = 0; i < k; i++) {
      let c = start[i];
      if (length[i] > next.length) throw new StreamError('The file is damaged: a split leaves the surface.');
      for (let step = 1; step < length[i]; step++) {
        c = next[c];
        if (c < 0) throw new StreamError('The file is damaged: a split leaves the surface.');
      }
      last[i] = c;
      const atFirst = !linked[start[i]];
      const atLast = next[c] < 0;
      if (!(atFirst || atLast || !length[i])) continue;
      there[i] = coder.symbol(!length[i] ? 2 : atFirst && atLast ? 1 : 0);
      if (!there[i]) throw new StreamError('The file is damaged: a split opens no face.');
    }
    coder.learn();
  }

  /** The corners of all arcs, step by step, and the ring vertices at the ends of each. */
  walk(b) {
    const { start, length, next, corner, p, q, there, last } = b;
    const k = start.length;
    let total = 0;
    let most = 0;
    for (let i = 0; i < k; i++) {
      total += length[i];
      most = Math.max(most, length[i]);
    }
    const stepEnd = new Int32Array(most + 1);
    for (let i = 0; i < k; i++) for (let step = 0; step < length[i]; step++) stepEnd[step + 1]++;
    for (let step = 0; step < most; step++) stepEnd[step + 1] += stepEnd[step];
    const moved = new Int32Array(total);
    const split = new Int32Array(total);
    const x = (b.x = new Int32Array(k));
    const y = (b.y = new Int32Array(k));
    for (let i = 0; i < k; i++) {
      for (let step = 0, c = start[i]; step < length[i]; step++, c = next[c]) {
        const at = stepEnd[step]++;
        moved[at] = corner[c];
        split[at] = i;
      }
      const bare = !length[i];
      y[i] = q[last[i]];
      x[i] = bare && there[i] & 1 ? y[i] : p[start[i]];
      if (bare && !(there[i] & 1)) y[i] = x[i];
    }
    return { moved, split };
  }

  /** Third corners of the new faces, `before` and `after` of each split; asks for the diagonals of torn edges. */
  thirds(b) {
    const { n, x, y, there, start, last, corner, p, q, vertex, label, coder, mesh } = b;
    const { faces } = mesh;
    const k = vertex.length;
    const third = new Int32Array(2 * k);
    const diagonal = new Uint8Array(2 * k); // by 2 * split + side
    const around = (at, row) => faces[at - (at % 3) + ((at + row) % 3)];
    // the opening at the edge's other end, as 2 * split + side, or -1
    const partner = (i, ring) => {
      const j = label[ring];
      if (j < 0) return -1;
      if (there[j] & 1 && x[j] === vertex[i]) return 2 * j;
      return there[j] & 2 && y[j] === vertex[i] ? 2 * j + 1 : -1;
    };
    const order = (opening) => (opening & 1) * k + (opening >> 1);
    let torn = false;
    coder.run(this.torn);
    for (let side = 0; side < 2; side++) {
      for (let i = 0; i < k; i++) {
        if (!((there[i] >> side) & 1)) continue;
        const own = 2 * i + side;
        const ring = side ? y[i] : x[i];
        const other = partner(i, ring);
        if (other >= 0) torn = true;
        if (other < 0) {
          const [a, z] = [around(corner[start[i]], 1), around(corner[last[i]], 2)];
          if (side) third[own] = there[i] === 2 && y[i] !== q[last[i]] ? a : z;
          else third[own] = there[i] === 1 && x[i] !== p[start[i]] ? z : a;
          continue;
        }
        if (order(own) <= order(other)) diagonal[own] = coder.symbol(0);
        else diagonal[own] = diagonal[other];
        third[own] = diagonal[own] === (other & 1) ? n + (other >> 1) : ring;
      }
    }
    if (torn) coder.learn();
    return third;
  }
}

/** The place of the rank-th highest score, the lower place first of equal ones. */
function nth(score, begin, end, rank) {
  if (rank > ESCAPE) {
    const order = Array.from({ length: end - begin }, (_, i) => begin + i);
    return order.sort((i, j) => score[j] - score[i] || i - j)[rank];
  }
  let best = -1;
  for (let round = 0; round <= rank; round++) {
    const before = best;
    best = -1;
    for (let c = begin; c < end; c++) {
      if (before >= 0 && !(score[c] < score[before] || (score[c] === score[before] && c > before))) continue;
      if (best < 0 || score[c] > score[best]) best = c;
    }
  }
  return best;
}
