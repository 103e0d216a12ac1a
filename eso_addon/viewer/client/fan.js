// SPDX-License-Identifier: GPL-3.0-or-later
// The corners around a splitting place: which follows which, where its arc runs, and what that expects of the new place.
import { bitLength } from './coder.js';
import { check } from './container.js';

const STEP = 6; // numbers a corner in `ring`: three of its p; then
const NEXT = 3; // its successor; where it has none, an end of the fan, which comes after the corners
const LED = 4; // how many corners it is the successor of
const HALVES = Float64Array.from({ length: 64 }, (_, n) => 2 ** -n);

// for the corners of one place at a time: its ring, how each of these pulls, two of them, and all of an arc
const scratch = { ring: null, pull: null, toward: null, score: new Float32Array(0) };

function makeRoom(size) {
  scratch.ring = new Int32Array(2 * STEP * size);
  scratch.pull = new Float64Array(2 * size);
  scratch.toward = new Float64Array(size);
  scratch.score = new Float32Array(size);
}

/**
 * Fetch the ring, and link each corner to its successor. Each place's fourth number tells at which corner it was last met
 * as p: so no search is needed. Gives how many corners and ends there are.
 */
function link(points, ring, corners, first, degree) {
  for (let c = 0, r = 0, at = 3 * first + 1; c < degree; c++, r += STEP, at += 3) {
    const p = 4 * corners[at];
    ring[r] = points[p];
    ring[r + 1] = points[p + 1];
    ring[r + 2] = points[p + 2];
    ring[r + LED] = 0;
    points[p + 3] = c;
  }
  let ends = degree;
  for (let c = 0, at = 3 * first + 2; c < degree; c++, at += 3) {
    const place = corners[at];
    let next = points[4 * place + 3];
    if (next < 0 || next >= degree || corners[3 * (first + next) + 1] !== place) {
      next = ends++;
      ring[STEP * next] = points[4 * place];
      ring[STEP * next + 1] = points[4 * place + 1];
      ring[STEP * next + 2] = points[4 * place + 2];
      ring[STEP * next + LED] = -1;
    }
    ring[STEP * c + NEXT] = next;
    ring[STEP * next + LED]++;
  }
  return ends;
}

/** Score how likely an arc starts at each corner: how far its corners lie where the ring pulls the vertex. */
function rate(points, shift, ring, v, degree, ends, length) {
  const { pull, toward, score } = scratch;
  const vx = points[v] >> shift;
  const vy = points[v + 1] >> shift;
  const vz = points[v + 2] >> shift;
  let x = 0;
  let y = 0;
  let z = 0;
  for (let r = 0; r < STEP * ends; r += STEP) {
    const times = ring[r + LED] + 1; // an end counts once, a corner once more for each that it follows
    x += times * ((ring[r] >> shift) - vx);
    y += times * ((ring[r + 1] >> shift) - vy);
    z += times * ((ring[r + 2] >> shift) - vz);
  }
  x = Math.floor(x / degree);
  y = Math.floor(y / degree);
  z = Math.floor(z / degree);
  for (let c = 0, r = 0; c < ends; c++, r += STEP) {
    pull[c] = x * ((ring[r] >> shift) - vx) + y * ((ring[r + 1] >> shift) - vy) + z * ((ring[r + 2] >> shift) - vz);
  }
  const steps = length < 8 ? length : 8;
  for (let c = 0; c < degree; c++) toward[c] = pull[c] + pull[ring[STEP * c + NEXT]];
  for (let c = 0; c < degree; c++) {
    let sum = toward[c];
    let d = ring[STEP * c + NEXT];
    for (let step = 1; step < steps && d < degree; step++) {
      sum += toward[d];
      d = ring[STEP * d + NEXT];
    }
    score[c] = sum;
  }
}

/** Whether one corner has a lower row than another, or the same and a lower face. */
function isLower(corners, one, other) {
  const row = corners[one] % 3 - corners[other] % 3;
  return row ? row < 0 : corners[one] < corners[other];
}

/** The corner with the rank-th highest score; of equal ones the lower row first, then the lower face. */
function nth(score, corners, first, degree, rank) {
  if (rank > 15) {
    const order = Array.from({ length: degree }, (_, c) => c);
    return order.sort((a, b) => score[b] - score[a] || (isLower(corners, 3 * (first + a), 3 * (first + b)) ? -1 : 1))[rank];
  }
  for (; ; rank--) {
    let best = 0;
    for (let c = 1; c < degree; c++) {
      if (score[c] > score[best] || (score[c] === score[best] && isLower(corners, 3 * (first + c), 3 * (first + best)))) best = c;
    }
    if (rank === 0) return best;
    score[best] = -Infinity;
  }
}

/** Follow an arc from its start; write down its corners, its ends, and mean, spread and normal of its ring. */
function walk(points, shift, ring, arcs, i, corners, first, degree, start) {
  const { corner, mean } = arcs;
  const steps = arcs.length[i];
  const v = 4 * arcs.vertex[i];
  const vx = points[v];
  const vy = points[v + 1];
  const vz = points[v + 2];
  let r = STEP * start;
  let ax = (ring[r] - vx) >> shift;
  let ay = (ring[r + 1] - vy) >> shift;
  let az = (ring[r + 2] - vz) >> shift;
  let nx = 0;
  let ny = 0;
  let nz = 0;
  let sx = vx + ring[r];
  let sy = vy + ring[r + 1];
  let sz = vz + ring[r + 2];
  let at = arcs.begin[i];
  let last = start;
  for (let step = 0, c = start; step < steps; step++) {
    check(c < degree && at < corner.length);
    corner[at++] = corners[3 * (first + c)];
    last = c;
    c = ring[r + NEXT];
    r = STEP * c;
    const x = ring[r];
    const y = ring[r + 1];
    const z = ring[r + 2];
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
  const isFirst = ring[STEP * start + LED] === 0;
  const isLast = ring[STEP * last + NEXT] >= degree;
  if (isFirst || isLast || steps === 0) arcs.asked.push(i, steps === 0 ? 2 : isFirst && isLast ? 1 : 0);
  lean(arcs, i, nx, ny, nz);
  const count = 2 * (steps + 2);
  const mx = (mean[3 * i] = Math.floor((2 * sx + steps + 2) / count));
  const my = (mean[3 * i + 1] = Math.floor((2 * sy + steps + 2) / count));
  const mz = (mean[3 * i + 2] = Math.floor((2 * sz + steps + 2) / count));
  let sum = Math.abs(vx - mx) + Math.abs(vy - my) + Math.abs(vz - mz);
  r = STEP * start;
  for (let step = 0; step <= steps; step++, r = STEP * ring[r + NEXT]) {
    sum += Math.abs(ring[r] - mx) + Math.abs(ring[r + 1] - my) + Math.abs(ring[r + 2] - mz);
  }
  arcs.spread[i] = Math.floor((2 * sum) / count);
}

/**
 * Follow the arcs of a batch's splits: their corners, their ends, and mean, spread and normal of each one's ring; `corners` are as
 * `gather` gives them, from `first` on for each split, `points` have four numbers a place.
 */
export function follow(points, shift, arcs, first, corners, rank) {
  const { vertex, length } = arcs;
  for (let i = 0; i < rank.length; i++) {
    const begin = first[i];
    const degree = first[i + 1] - begin;
    if (degree > scratch.score.length) makeRoom(2 * degree);
    check(rank[i] < degree);
    const { ring, score } = scratch;
    const ends = link(points, ring, corners, begin, degree);
    rate(points, shift, ring, 4 * vertex[i], degree, ends, length[i]);
    walk(points, shift, ring, arcs, i, corners, begin, degree, nth(score, corners, begin, degree, rank[i]));
  }
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
