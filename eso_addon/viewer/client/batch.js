// SPDX-License-Identifier: GPL-3.0-or-later
// A batch of vertex splits: who splits, how long the arc is, where it starts, what opens, where it is; then carried out.
import { bitLength, bits, choose, feed, makeCoder, makeModel, numbers, read, sizeClass } from './coder.js';
import { check } from './container.js';
import { follow } from './fan.js';
import { placeOf, put } from './positions.js';

const ESCAPE = 15;
const CLASSES = 72;

/** What the splits of a mesh need, once its base is there; `states` as for the coder. */
export function makeSplits({ faces, faceCount, parents, head }, states) {
  const degree = new Int32Array(parents.length); // faces at each place
  for (let at = 3 * head.extra; at < 3 * faceCount; at++) degree[faces[at]]++;
  return {
    degree, coder: makeCoder(states), label: new Int32Array(parents.length).fill(-1), // which split a place is in
    flags: makeModel(21, 2), lengths: makeModel(16, 16), starts: makeModel(128, 16), sides: makeModel(3, 4), torn: makeModel(2, 2),
    axes: [0, 1, 2].map(() => makeModel(CLASSES, CLASSES, true)),
  };
}

/** Numbers that are mostly below 15; the others follow as plain bits. */
function small(coder, model, contexts) {
  const out = new Int32Array(read(coder, model, contexts));
  for (let i = 0; i < out.length; i++) if (out[i] === ESCAPE) out[i] = Math.min(bits(coder, 32), 0x7fffffff);
  return out;
}

/**
 * Corners at splitting places, split by split: 3 * face + row, and the places that follow and precede there. Meanwhile a
 * place's label says where its next corner goes.
 */
function gather({ faces, faceCount, head }, label, vertex, first) {
  const out = new Int32Array(3 * first[vertex.length]);
  for (let i = 0; i < vertex.length; i++) label[vertex[i]] = 3 * first[i];
  for (let at = 3 * head.extra; at < 3 * faceCount; at += 3) {
    const a = faces[at];
    const b = faces[at + 1];
    const c = faces[at + 2];
    const i = label[a];
    const j = label[b];
    const k = label[c];
    if (i >= 0) {
      label[a] = i + 3;
      out[i] = at;
      out[i + 1] = b;
      out[i + 2] = c;
    }
    if (j >= 0) {
      label[b] = j + 3;
      out[j] = at + 1;
      out[j + 1] = c;
      out[j + 2] = a;
    }
    if (k >= 0) {
      label[c] = k + 3;
      out[k] = at + 2;
      out[k + 1] = a;
      out[k + 2] = b;
    }
  }
  for (let i = 0; i < vertex.length; i++) label[vertex[i]] = i;
  return out;
}

/** Which faces open: bit 0 `before`, bit 1 `after`; asked only at the ends of fans. */
function open({ points, splits: { coder, sides } }, { asked, there, vertex, x, y, length, mean, spread }) {
  const found = read(coder, sides, Uint8Array.from(asked.filter((_, at) => at & 1)));
  found.forEach((side, at) => {
    const i = asked[2 * at];
    check(side);
    there[i] = side;
    if (length[i]) return;
    // beside a lone corner both new edges end at the same ring vertex
    if ((side & 1) === 0) {
      y[i] = x[i];
      return;
    }
    x[i] = y[i];
    let sum = 0;
    for (let a = 0; a < 3; a++) {
      const own = points[4 * vertex[i] + a];
      const end = points[4 * x[i] + a];
      const m = (mean[3 * i + a] = Math.floor((own + end + 1) / 2));
      sum += Math.abs(own - m) + Math.abs(end - m);
    }
    spread[i] = Math.floor(sum / 2);
  });
}

/** Move the corners of all arcs to the new places. */
function move({ faces, places: n, splits: { degree } }, { vertex, length, begin, corner }) {
  for (let i = 0; i < vertex.length; i++) {
    for (let at = begin[i]; at < begin[i + 1]; at++) faces[corner[at]] = n + i;
    degree[vertex[i]] -= length[i];
    degree[n + i] = length[i];
  }
}

/** Third corners of the new faces, `before` and `after` of each split; asks for the diagonals of torn edges. */
function thirds({ faces, places, splits: { coder, label, torn: model } }, { vertex, x, y, there, start, last, length }) {
  const k = vertex.length;
  const third = new Int32Array(2 * k);
  const torn = []; // openings whose edge opens from the other end too, and those there; as side * k + split
  for (let side = 0; side < 2; side++) {
    const ends = side ? y : x;
    for (let i = 0; i < k; i++) {
      if (((there[i] >> side) & 1) === 0) continue;
      const j = label[ends[i]];
      if (j >= 0) {
        const v = vertex[i];
        if (there[j] & 1 && x[j] === v) {
          torn.push(side * k + i, j);
          continue;
        }
        if (there[j] & 2 && y[j] === v) {
          torn.push(side * k + i, k + j);
          continue;
        }
      }
      // the neighbour of the new face holds the ring's place as it is after the batch; a lone face beside a lone
      // corner lies at the other side of it
      const isLast = length[i] ? side : 1 - side;
      const at = isLast ? last[i] : start[i];
      const row = at % 3;
      third[2 * i + side] = faces[at - row + ((row + 1 + isLast) % 3)];
    }
  }
  if (!torn.length) return third;
  let asked = 0;
  for (let t = 0; t < torn.length; t += 2) if (torn[t] <= torn[t + 1]) asked++;
  const answers = read(coder, model, new Uint8Array(asked));
  const diagonal = new Uint8Array(2 * k);
  for (let t = 0, at = 0; t < torn.length; t += 2) {
    const own = torn[t];
    const other = torn[t + 1];
    if (own <= other) diagonal[own] = answers[at++];
    const i = own % k;
    const ring = own < k ? x[i] : y[i];
    const upper = diagonal[Math.min(own, other)] === (other >= k ? 1 : 0);
    third[2 * i + (own < k ? 0 : 1)] = upper ? places + label[ring] : ring;
  }
  return third;
}

/** Read the positions of the new places: expected from the ring around them; the rest is read. */
function locate(mesh, { vertex, mean, normal, axis, spread }) {
  const { places, points, grid, splits: { coder, axes } } = mesh;
  const k = vertex.length;
  const scale = spread.slice();
  const lean = new Float64Array(k);
  const base = new Float64Array(k);
  const contexts = new Uint8Array(k);
  for (let step = 0; step < 3; step++) {
    for (let i = 0; i < k; i++) {
      const a = (axis[i] + 1 + step) % 3;
      let value = mean[3 * i + a];
      if (step === 2) value = points[4 * vertex[i] + a] - Math.floor(lean[i] / (normal[3 * i + a] || 1));
      let context = sizeClass(scale[i]);
      base[i] = value;
      if (grid.floats) {
        context += 2 * (24 - bitLength(Math.abs(value) + scale[i]));
        base[i] = placeOf(grid, value);
      }
      contexts[i] = context < 0 ? 0 : context < CLASSES ? context : CLASSES - 1;
    }
    const rest = numbers(coder, axes[step], contexts);
    for (let i = 0; i < k; i++) {
      const a = (axis[i] + 1 + step) % 3;
      const point = put(mesh, places + i, a, base[i] + rest[i]);
      if (step === 2) continue;
      lean[i] += normal[3 * i + a] * (point - points[4 * vertex[i] + a]);
      scale[i] = Math.floor((spread[i] + 3 * Math.abs(point - mean[3 * i + a]) + 1) / 2);
    }
  }
}

/** Add new places and faces; gives the face in which the arc beside each new one starts. */
function grow(mesh, { vertex, start, there }, third, until) {
  const { faces, faceCount, places, parents, facesAfter, splits: { degree, label } } = mesh;
  const besides = new Int32Array(until - faceCount);
  let face = faceCount;
  for (let i = 0; i < vertex.length; i++) {
    const v = vertex[i];
    const u = places + i;
    for (let side = 0; side < 2; side++) {
      if (((there[i] >> side) & 1) === 0) continue;
      check(face < until);
      besides[face - faceCount] = Math.floor(start[i] / 3);
      const last = third[2 * i + side];
      faces[3 * face] = side ? v : u;
      faces[3 * face + 1] = side ? u : v;
      faces[3 * face + 2] = last;
      degree[u]++;
      degree[v]++;
      degree[last]++;
      face++;
    }
    parents[u] = v;
    facesAfter[u] = face;
    label[v] = -1;
  }
  check(face === until);
  mesh.places += vertex.length;
  mesh.faceCount = face;
  return besides;
}

/**
 * Read the next batch of a mesh and carry it out; gives its arcs, and beside each new face the one in which its arc starts.
 */
export function split(mesh, symbols, plain, places, until) {
  const { points, grid, splits } = mesh;
  const { coder, degree, label } = splits;
  feed(coder, symbols, plain);
  const vertex = choose(coder, splits.flags, degree, mesh.places);
  const k = vertex.length;
  check(mesh.places + k === places);
  const first = new Int32Array(k + 1); // corner of each split
  const contexts = new Uint8Array(k);
  for (let i = 0; i < k; i++) {
    const corners = degree[vertex[i]];
    first[i + 1] = first[i] + corners;
    contexts[i] = corners < 15 ? corners : 15;
  }
  const length = small(coder, splits.lengths, contexts);
  let total = 0;
  for (let i = 0; i < k; i++) {
    check(length[i] <= degree[vertex[i]]);
    contexts[i] = 8 * contexts[i] + (length[i] < 7 ? length[i] : 7);
    total += length[i];
  }
  const rank = small(coder, splits.starts, contexts);
  const ints = (count) => new Int32Array(count);
  const arcs = {
    vertex, length, corner: ints(total), begin: ints(k + 1), start: ints(k), last: ints(k), x: ints(k), y: ints(k), asked: [],
    there: new Uint8Array(k).fill(3), mean: ints(3 * k), normal: new Float64Array(3 * k), axis: new Uint8Array(k), spread: ints(k),
  };
  follow(points, grid.shift, arcs, first, gather(mesh, label, vertex, first), rank);
  open(mesh, arcs);
  move(mesh, arcs);
  const third = thirds(mesh, arcs);
  locate(mesh, arcs);
  arcs.besides = grow(mesh, arcs, third, until);
  return arcs;
}
