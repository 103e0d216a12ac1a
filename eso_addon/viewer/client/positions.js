// SPDX-License-Identifier: GPL-3.0-or-later
// Where the new places are: expected from the mesh around them, in whole numbers alone; the rest is read.
import { Model, bitLength, sizeClass } from './coder.js';
import { StreamError } from './container.js';

const CLASSES = 72;
const FAR = 2 ** 27;
const HALF_EVEN = 6755399441055744; // adding and taking away 1.5 * 2^52 rounds halves to even
const bits = new Int32Array(1);
const float = new Float32Array(bits.buffer);

const floatAt = (place) => {
  bits[0] = place >= 0 ? place : (-1 - place) | 0x80000000;
  return float[0];
};
const placeOf = (value) => {
  float[0] = value;
  return bits[0] >= 0 ? bits[0] : -1 - (bits[0] & 0x7fffffff);
};
const cut = (n) => Math.max(-FAR, Math.min(n, FAR));

export class Positions {
  constructor([kind, scale, x, y, z, shift]) {
    const sound = [0, 1, 2].includes(kind) && scale > 0 && [scale, x, y, z].every(Number.isFinite) && shift >= 0;
    if (!sound || shift >= 32) throw new StreamError('The header of the file is damaged.');
    Object.assign(this, { kind, scale, origin: [x, y, z], shift });
    this.models = [0, 1, 2].map(() => new Model(CLASSES, CLASSES, true));
  }

  /** Put a place's number where it belongs; gives it on the grid of predictions. */
  place(mesh, at, axis, number) {
    let value;
    let point;
    if (this.kind === 2) {
      value = floatAt(number);
      point = Number.isFinite(value) ? cut(value * this.scale) + HALF_EVEN - HALF_EVEN : 0;
      bits[0] = number >= 0 ? number : (-1 - number) | 0x80000000;
      mesh.positionBits ??= new Int32Array(mesh.positions.buffer); // a signalling NaN must keep its bits
      mesh.positionBits[3 * at + axis] = bits[0];
    } else {
      point = cut(number);
      value = (this.kind ? point / this.scale : point * this.scale) + this.origin[axis];
      mesh.positions[3 * at + axis] = value;
    }
    mesh.points[3 * at + axis] = point;
    return point;
  }

  read(b) {
    const { vertex, coder, mesh, n } = b;
    const k = vertex.length;
    const { mean, normal, axis, spread } = this.expect(b);
    const scale = spread.slice();
    const moved = [new Float64Array(k), new Float64Array(k)];
    for (let step = 0; step < 3; step++) {
      coder.run(this.models[step]);
      for (let i = 0; i < k; i++) {
        const at = (axis[i] + 1 + step) % 3;
        const own = mesh.points[3 * vertex[i] + at];
        let expected = mean[3 * i + at];
        if (step === 2) {
          const lean = normal[3 * i + ((axis[i] + 1) % 3)] * moved[0][i] + normal[3 * i + ((axis[i] + 2) % 3)] * moved[1][i];
          expected = own - Math.floor(lean / (normal[3 * i + axis[i]] || 1));
        }
        const point = this.one(b, n + i, at, expected, scale[i]);
        if (step === 2) continue;
        moved[step][i] = point - own;
        scale[i] = Math.floor((spread[i] + 3 * Math.abs(point - mean[3 * i + at]) + 1) / 2);
      }
      coder.learn();
    }
  }

  one({ coder, mesh }, at, axis, expected, scale) {
    const size = sizeClass(scale);
    if (this.kind !== 2) return this.place(mesh, at, axis, coder.number(size) + expected);
    const exponent = bitLength(Math.abs(expected) + scale);
    const context = Math.max(0, Math.min(size + 2 * (24 - exponent), CLASSES - 1));
    const number = coder.number(context) + placeOf(expected / this.scale);
    return this.place(mesh, at, axis, Math.max(-(2 ** 31), Math.min(number, 2 ** 31 - 1)));
  }

  /** Mean and spread of each new place's ring, normal of its arc, and the axis along which that is largest. */
  expect(b) {
    const { vertex, x, start, length, next, p, q, mesh } = b;
    const { points } = mesh;
    const { shift } = this;
    const k = vertex.length;
    const mean = new Float64Array(3 * k);
    const normal = new Float64Array(3 * k);
    const axis = new Uint8Array(k);
    const spread = new Float64Array(k);
    const total = new Float64Array(3);
    for (let i = 0; i < k; i++) {
      const v = 3 * vertex[i];
      const size = length[i] + 2;
      let [nx, ny, nz] = [0, 0, 0];
      for (let a = 0; a < 3; a++) total[a] = points[v + a] + points[3 * x[i] + a];
      for (let step = 0, c = start[i]; step < length[i]; step++, c = next[c]) {
        const s = 3 * p[c];
        const t = 3 * q[c];
        const px = (points[s] - points[v]) >> shift;
        const py = (points[s + 1] - points[v + 1]) >> shift;
        const pz = (points[s + 2] - points[v + 2]) >> shift;
        const qx = (points[t] - points[v]) >> shift;
        const qy = (points[t + 1] - points[v + 1]) >> shift;
        const qz = (points[t + 2] - points[v + 2]) >> shift;
        nx += py * qz - pz * qy;
        ny += pz * qx - px * qz;
        nz += px * qy - py * qx;
        for (let a = 0; a < 3; a++) total[a] += points[t + a];
      }
      const excess = Math.max(bitLength(Math.max(Math.abs(nx), Math.abs(ny), Math.abs(nz))) - 12, 0);
      [nx, ny, nz].forEach((value, a) => (normal[3 * i + a] = Math.floor(value / 2 ** excess)));
      for (let a = 1; a < 3; a++) if (Math.abs(normal[3 * i + a]) > Math.abs(normal[3 * i + axis[i]])) axis[i] = a;
      let sum = 0;
      for (let a = 0; a < 3; a++) {
        const m = (mean[3 * i + a] = Math.floor((2 * total[a] + size) / (2 * size)));
        sum += Math.abs(points[v + a] - m) + Math.abs(points[3 * x[i] + a] - m);
        for (let step = 0, c = start[i]; step < length[i]; step++, c = next[c]) sum += Math.abs(points[3 * q[c] + a] - m);
      }
      spread[i] = Math.floor(sum / size);
    }
    return { mean, normal, axis, spread };
  }
}
