// SPDX-License-Identifier: GPL-3.0-or-later
// A batch of vertex splits: who splits, how long the arc is, where it starts, what opens; then carried out.
import { Model } from './coder.js';
import { StreamError } from './container.js';
import { Fan } from './fan.js';

const ESCAPE = 15;
const damaged = (what) => new StreamError(`The file is damaged: ${what}.`);

export class Connectivity {
  constructor(places) {
    this.flag = new Model(64, 2);
    this.length = new Model(16, 16);
    this.start = new Model(128, 16);
    this.sides = new Model(3, 4);
    this.torn = new Model(2, 2);
    this.degree = new Int32Array(places);
    this.label = new Int32Array(places).fill(-1); // which split a place is in
    this.fan = new Fan();
    this.corners = new Int32Array(0);
  }

  /** Take in the faces of the base. */
  base(faces, count) {
    for (let at = 0; at < 3 * count; at++) this.degree[faces[at]]++;
  }

  /** Read a batch from the mesh's coder and carry it out; gives corners that moved and the face beside each new one. */
  batch(mesh, placesAfter, facesAfter) {
    const { coder, places: n } = mesh;
    const vertex = coder.flags(this.flag, this.degree, n);
    const k = vertex.length;
    if (n + k !== placesAfter) throw damaged('a batch holds other counts than its table');
    const first = new Int32Array(k + 1);
    for (let i = 0; i < k; i++) {
      this.label[vertex[i]] = i;
      first[i + 1] = first[i] + this.degree[vertex[i]];
    }
    const length = this.small(coder, this.length, contexts(first, null));
    const rank = this.small(coder, this.start, contexts(first, length));
    const corners = this.gather(mesh.faces, mesh.faceCount, first);
    const arcs = this.fan.arcs(mesh, vertex, first, corners, length, rank);
    this.opens(coder, arcs, mesh.geometry);
    const moved = this.move(mesh, vertex, arcs);
    const third = this.thirds(mesh, vertex, arcs);
    mesh.geometry.read(mesh, vertex, arcs);
    const beside = this.grow(mesh, vertex, arcs, third, facesAfter);
    for (let i = 0; i < k; i++) this.label[vertex[i]] = -1;
    mesh.places = n + k;
    mesh.faceCount += beside.length;
    return { moved, beside };
  }

  /** Numbers that are mostly below 15; the others follow as plain bits. */
  small(coder, model, context) {
    const out = Int32Array.from(coder.symbols(model, context, context.length));
    for (let i = 0; i < out.length; i++) if (out[i] === ESCAPE) out[i] = Math.min(coder.bits(32), 0x7fffffff);
    return out;
  }

  /** Corners at splitting places, place by place: 3 * face + row, and the places that follow and precede there. */
  gather(faces, count, first) {
    const { label } = this;
    const size = 3 * first[first.length - 1];
    if (this.corners.length < size) this.corners = new Int32Array(2 * size);
    const out = this.corners;
    const fill = first.map((at) => 3 * at);
    for (let at = 0; at < 3 * count; at += 3) {
      const a = faces[at];
      const b = faces[at + 1];
      const c = faces[at + 2];
      const i = label[a];
      const j = label[b];
      const k = label[c];
      if (i >= 0) {
        const to = fill[i];
        fill[i] = to + 3;
        out[to] = at;
        out[to + 1] = b;
        out[to + 2] = c;
      }
      if (j >= 0) {
        const to = fill[j];
        fill[j] = to + 3;
        out[to] = at + 1;
        out[to + 1] = c;
        out[to + 2] = a;
      }
      if (k >= 0) {
        const to = fill[k];
        fill[k] = to + 3;
        out[to] = at + 2;
        out[to + 1] = a;
        out[to + 2] = b;
      }
    }
    return out;
  }

  /** Which faces open: bit 0 `before`, bit 1 `after`; asked only at the ends of fans. */
  opens(coder, arcs, geometry) {
    const { asked, askedContext, there, x, y, length } = arcs;
    const sides = coder.symbols(this.sides, askedContext, asked.length);
    for (let at = 0; at < asked.length; at++) {
      const i = asked[at];
      if (sides[at] === 0) throw damaged('a split opens no face');
      there[i] = sides[at];
      if (length[i] > 0) continue;
      // beside a lone corner both new edges end at the same ring vertex
      if (there[i] & 1) x[i] = y[i];
      else y[i] = x[i];
      geometry.expectBare(arcs, i);
    }
  }

  /** Move the corners of all arcs to the new places; gives them step by step, as their wedges are stored. */
  move({ faces, plain, places: n }, vertex, { length, arcFirst, arcCorner }) {
    const { degree } = this;
    let most = 0;
    for (let i = 0; i < vertex.length; i++) {
      const end = arcFirst[i + 1];
      for (let at = arcFirst[i]; at < end; at++) faces[arcCorner[at]] = n + i;
      degree[vertex[i]] -= length[i];
      degree[n + i] = length[i];
      if (length[i] > most) most = length[i];
    }
    if (plain) return null;
    const fill = new Int32Array(most + 1);
    for (let i = 0; i < vertex.length; i++) for (let step = 0; step < length[i]; step++) fill[step + 1]++;
    for (let step = 0; step < most; step++) fill[step + 1] += fill[step];
    const moved = new Int32Array(arcFirst[vertex.length]);
    for (let i = 0; i < vertex.length; i++) {
      for (let step = 0; step < length[i]; step++) moved[fill[step]++] = arcCorner[arcFirst[i] + step];
    }
    return moved;
  }

  /** Third corners of the new faces, `before` and `after` of each split; asks for the diagonals of torn edges. */
  thirds({ faces, coder, places: n }, vertex, { x, y, there, startCorner, lastCorner, length }) {
    const { label } = this;
    const k = vertex.length;
    const third = new Int32Array(2 * k);
    const torn = []; // openings whose edge opens from the other end too, and those there; as side * k + split
    const other = [];
    for (let side = 0; side < 2; side++) {
      const ends = side ? y : x;
      for (let i = 0; i < k; i++) {
        if (((there[i] >> side) & 1) === 0) continue;
        const ring = ends[i];
        const j = label[ring];
        if (j >= 0) {
          const v = vertex[i];
          const partner = there[j] & 1 && x[j] === v ? j : there[j] & 2 && y[j] === v ? k + j : -1;
          if (partner >= 0) {
            torn.push(side * k + i);
            other.push(partner);
            continue;
          }
        }
        // the neighbour of the new face holds the ring's place as it is after the batch; a lone face beside a lone
        // corner lies at the other side of it
        const isLast = length[i] ? side : 1 - side;
        const at = isLast ? lastCorner[i] : startCorner[i];
        const row = at % 3;
        third[2 * i + side] = faces[at - row + ((row + 1 + isLast) % 3)];
      }
    }
    if (!torn.length) return third;
    let asked = 0;
    for (let t = 0; t < torn.length; t++) if (torn[t] <= other[t]) asked++;
    const answers = coder.symbols(this.torn, new Uint8Array(asked), asked);
    const diagonal = new Uint8Array(2 * k);
    for (let t = 0, at = 0; t < torn.length; t++) if (torn[t] <= other[t]) diagonal[torn[t]] = answers[at++];
    for (let t = 0; t < torn.length; t++) {
      const own = torn[t];
      const i = own < k ? own : own - k;
      const side = own < k ? 0 : 1;
      const upper = diagonal[Math.min(own, other[t])] === (other[t] >= k ? 1 : 0);
      const ring = side ? y[i] : x[i];
      third[2 * i + side] = upper ? n + label[ring] : ring;
    }
    return third;
  }

  /** Add new places and faces; gives the face in which the arc beside each new one starts. */
  grow(mesh, vertex, { startCorner, there }, third, facesAfter) {
    const { faces, faceCount: m, places: n, parents, facesAfter: counts } = mesh;
    const { extra } = mesh.head;
    const { degree } = this;
    const beside = new Int32Array(facesAfter - m);
    let face = m;
    for (let i = 0; i < vertex.length; i++) {
      const v = vertex[i];
      const u = n + i;
      for (let side = 0; side < 2; side++) {
        if (((there[i] >> side) & 1) === 0) continue;
        if (face >= facesAfter) throw damaged('a batch holds more than its table says');
        beside[face - m] = ((startCorner[i] / 3) | 0) + extra;
        const at = 3 * face++;
        const last = third[2 * i + side];
        faces[at] = side ? v : u;
        faces[at + 1] = side ? u : v;
        faces[at + 2] = last;
        degree[u]++;
        degree[v]++;
        degree[last]++;
      }
      parents[u] = v;
      counts[u] = face;
    }
    return beside.subarray(0, face - m);
  }
}

/** Contexts by degree, and by length where that is known. */
function contexts(first, length) {
  const out = new Uint8Array(first.length - 1);
  for (let i = 0; i < out.length; i++) {
    const degree = Math.min(first[i + 1] - first[i], 15);
    out[i] = length ? degree * 8 + Math.min(length[i], 7) : degree;
  }
  return out;
}
