// SPDX-License-Identifier: GPL-3.0-or-later
// The corners around a splitting place: which follows which, where its arc runs, and what that expects of the new place.
import { bitLength } from './coder.js';
import { check } from './container.js';

const STEP = 6; // numbers a corner in `ring`: three of its p; then
const NEXT = 3; // its successor; where it has none, an end of the fan, which comes after the corners
const LED = 4; // how many corners it is the successor of
const HALVES = Float64Array.from({ length: 64 }, (_, n) => 2 ** -n);

/**
 * A function that follows the arcs of a batch's splits: their corners, their ends, and mean, spread and normal of each one's ring.
 * `points` has four numbers a place; `shift` is the grid's.
 */
export function makeFan(points, shift) {
  let size = 0; // corners that there is room for
  let ring;
  let toward;
  let score;

  /**
   * Fetch the ring, and link each corner to its successor. Each place's fourth number tells at which corner it was last met
   * as p: so no search is needed. Gives how many corners and ends there are.
   */
  function link(corners, first, degree) {
    const found = ring;
    for (let c = 0, r = 0, at = 3 * first + 1; c < degree; c++, r += STEP, at += 3) {
      const p = 4 * corners[at];
      found[r] = points[p];
      found[r + 1] = points[p + 1];
      found[r + 2] = points[p + 2];
      found[r + LED] = 0;
      points[p + 3] = c;
    }
    let ends = degree;
    for (let c = 0, at = 3 * first + 2; c < degree; c++, at += 3) {
      const place = corners[at];
      let next = points[4 * place + 3];
      if (next < 0 || next >= degree || corners[3 * (first + next) + 1] !== place) {
        next = ends++;
        found[STEP * next] = points[4 * place];
        found[STEP * next + 1] = points[4 * place + 1];
        found[STEP * next + 2] = points[4 * place + 2];
        found[STEP * next + LED] = -1;
      }
      found[STEP * c + NEXT] = next;
      found[STEP * next + LED]++;
    }
    return ends;
  }

  /** Score how likely an arc starts at each corner: how far its corners lie where the ring pulls the vertex. */
  function rate(v, degree, ends, length) {
    const found = ring;
    const pull = toward;
    const vx = points[v] >> shift;
    const vy = points[v + 1] >> shift;
    const vz = points[v + 2] >> shift;
    let x = 0;
    let y = 0;
    let z = 0;
    for (let r = 0; r < STEP * ends; r += STEP) {
      const times = found[r + LED] + 1; // an end counts once, a corner once more for each that it follows
      x += times * ((found[r] >> shift) - vx);
      y += times * ((found[r + 1] >> shift) - vy);
      z += times * ((found[r + 2] >> shift) - vz);
    }
    x = Math.floor(x / degree);
    y = Math.floor(y / degree);
    z = Math.floor(z / degree);
    for (let c = 0, r = 0; c < ends; c++, r += STEP) {
      pull[c] = x * ((found[r] >> shift) - vx) + y * ((found[r + 1] >> shift) - vy) + z * ((found[r + 2] >> shift) - vz);
    }
    const steps = length < 8 ? length : 8;
    for (let c = 0; c < degree; c++) {
      let d = found[STEP * c + NEXT];
      let sum = pull[c] + pull[d];
      for (let step = 1; step < steps && d < degree; step++) {
        sum += pull[d];
        d = found[STEP * d + NEXT];
        sum += pull[d];
      }
      score[c] = sum;
    }
  }

  /** The corner with the rank-th highest score; of equal ones the lower row first, then the lower face. */
  function nth(corners, first, degree, rank) {
    const rating = score;
    const before = (a, b) => {
      const i = corners[3 * (first + a)];
      const j = corners[3 * (first + b)];
      return i % 3 === j % 3 ? i < j : i % 3 < j % 3;
    };
    if (rank > 15) {
      const order = Array.from({ length: degree }, (_, c) => c);
      return order.sort((a, b) => rating[b] - rating[a] || (before(a, b) ? -1 : 1))[rank];
    }
    for (; ; rank--) {
      let best = 0;
      for (let c = 1; c < degree; c++) {
        if (rating[c] > rating[best] || (rating[c] === rating[best] && before(c, best))) best = c;
      }
      if (rank === 0) return best;
      rating[best] = -Infinity;
    }
  }

  /** Follow an arc from its start; write down its corners, its ends, and mean, spread and normal of its ring. */
  function walk(arcs, i, corners, first, degree, start) {
    const found = ring;
    const { corner, mean } = arcs;
    const steps = arcs.length[i];
    const v = 4 * arcs.vertex[i];
    const vx = points[v];
    const vy = points[v + 1];
    const vz = points[v + 2];
    let r = STEP * start;
    let ax = (found[r] - vx) >> shift;
    let ay = (found[r + 1] - vy) >> shift;
    let az = (found[r + 2] - vz) >> shift;
    let nx = 0;
    let ny = 0;
    let nz = 0;
    let sx = vx + found[r];
    let sy = vy + found[r + 1];
    let sz = vz + found[r + 2];
    let at = arcs.begin[i];
    let last = start;
    for (let step = 0, c = start; step < steps; step++) {
      check(c < degree && at < corner.length);
      corner[at++] = corners[3 * (first + c)];
      last = c;
      c = found[r + NEXT];
      r = STEP * c;
      const x = found[r];
      const y = found[r + 1];
      const z = found[r + 2];
      const bx = (x - vx) >> shift;
      const by = (y - vy) >> shift;
      const bz = (z - vz) >> shift;
      nx += ay * bz - az * by;
      ny += az * bx - ax * bz;
      nz += ax * by - ay * bx;
      sx += x;
      sy += y;
      sz += z;
      ax = bx;
      ay = by;
      az = bz;
    }
    arcs.begin[i + 1] = at;
    arcs.start[i] = corners[3 * (first + start)];
    arcs.last[i] = corners[3 * (first + last)];
    arcs.x[i] = corners[3 * (first + start) + 1];
    arcs.y[i] = corners[3 * (first + last) + 2];
    // at the end of a fan a split says which faces open
    const isFirst = found[STEP * start + LED] === 0;
    const isLast = found[STEP * last + NEXT] >= degree;
    if (isFirst || isLast || steps === 0) arcs.asked.push(i, steps === 0 ? 2 : isFirst && isLast ? 1 : 0);
    lean(arcs, i, nx, ny, nz);
    const count = 2 * (steps + 2);
    const mx = (mean[3 * i] = Math.floor((2 * sx + steps + 2) / count));
    const my = (mean[3 * i + 1] = Math.floor((2 * sy + steps + 2) / count));
    const mz = (mean[3 * i + 2] = Math.floor((2 * sz + steps + 2) / count));
    let sum = Math.abs(vx - mx) + Math.abs(vy - my) + Math.abs(vz - mz);
    r = STEP * start;
    for (let step = 0; step <= steps; step++, r = STEP * found[r + NEXT]) {
      sum += Math.abs(found[r] - mx) + Math.abs(found[r + 1] - my) + Math.abs(found[r + 2] - mz);
    }
    arcs.spread[i] = Math.floor((2 * sum) / count);
  }

  return (arcs, first, corners, rank) => {
    for (let i = 0; i < rank.length; i++) {
      const degree = first[i + 1] - first[i];
      if (degree > size) {
        size = 2 * degree;
        ring = new Int32Array(2 * STEP * size);
        toward = new Float64Array(2 * size);
        score = new Float32Array(size);
      }
      check(rank[i] < degree);
      const ends = link(corners, first[i], degree);
      rate(4 * arcs.vertex[i], degree, ends, arcs.length[i]);
      walk(arcs, i, corners, first[i], degree, nth(corners, first[i], degree, rank[i]));
    }
  };
}

/** Keep twelve bits of a normal, and the axis along which it is largest. */
function lean({ normal, axis }, i, x, y, z) {
  const longest = Math.max(Math.abs(x), Math.abs(y), Math.abs(z));
  const scale = longest < 4096 ? 1 : HALVES[bitLength(longest) - 12];
  const a = Math.abs((normal[3 * i] = Math.floor(x * scale)));
  const b = Math.abs((normal[3 * i + 1] = Math.floor(y * scale)));
  const c = Math.abs((normal[3 * i + 2] = Math.floor(z * scale)));
  axis[i] = c > a && c > b ? 2 : b > a ? 1 : 0;
}
