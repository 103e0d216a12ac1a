// SPDX-License-Identifier: GPL-3.0-or-later
// Where the new places are: expected from the mesh around them, in whole numbers alone; the rest is read.
import { Model, bitLength, sizeClass } from './coder.js';
import { StreamError } from './container.js';

const CLASSES = 72;
const FAR = 2 ** 27;
const HALF_EVEN = 6755399441055744; // adding and taking away 1.5 * 2^52 rounds halves to even
const bits = new Int32Array(1);
const float = new Float32Array(bits.buffer);

/** The place of a number among all float32. */
function placeOf(value) {
  float[0] = value;
  return bits[0] >= 0 ? bits[0] : -1 - (bits[0] & 0x7fffffff);
}
const cut = (n) => Math.max(-FAR, Math.min(n, FAR));

export class Positions {
  constructor([kind, scale, x, y, z, shift]) {
    const sound = [0, 1, 2].includes(kind) && scale > 0 && [scale, x, y, z].every(Number.isFinite) && shift >= 0;
    if (!sound || shift >= 32) throw new StreamError('The header of the file is damaged.');
    Object.assign(this, { kind, scale, origin: Float64Array.of(x, y, z), shift });
    this.models = [0, 1, 2].map(() => new Model(CLASSES, CLASSES, true));
  }

  /** Put a place's number where it belongs; gives it on the grid of predictions. */
  place(mesh, place, axis, number) {
    const at = 3 * place + axis;
    let point;
    if (this.kind === 2) {
      mesh.positionBits[at] = number >= 0 ? number : (-1 - number) | 0x80000000;
      const value = mesh.positions[at];
      point = Number.isFinite(value) ? cut(value * this.scale) + HALF_EVEN - HALF_EVEN : 0;
    } else {
      point = cut(number);
      mesh.positions[at] = (this.kind ? point / this.scale : point * this.scale) + this.origin[axis];
    }
    mesh.points[4 * place + axis] = point;
    return point;
  }

  /** Read the positions of a batch. */
  read(mesh, vertex, { mean, normal, axis, spread }) {
    const { coder, points, places } = mesh;
    const k = vertex.length;
    const scale = spread.slice();
    const lean = new Float64Array(k);
    const expected = new Float64Array(k);
    const base = new Float64Array(k);
    const contexts = new Uint8Array(k);
    for (let step = 0; step < 3; step++) {
      for (let i = 0; i < k; i++) {
        const a = (axis[i] + 1 + step) % 3;
        let value = mean[3 * i + a];
        if (step === 2) value = points[4 * vertex[i] + a] - Math.floor(lean[i] / (normal[3 * i + a] || 1));
        expected[i] = base[i] = value;
        let context = sizeClass(scale[i]);
        if (this.kind === 2) {
          base[i] = placeOf(value / this.scale);
          context += 2 * (24 - bitLength(Math.abs(value) + scale[i]));
        }
        contexts[i] = context < 0 ? 0 : context < CLASSES ? context : CLASSES - 1;
      }
      const rest = coder.numbers(this.models[step], contexts, k);
      for (let i = 0; i < k; i++) {
        const a = (axis[i] + 1 + step) % 3;
        let number = base[i] + rest[i];
        if (this.kind === 2) number = Math.max(-2147483648, Math.min(number, 2147483647));
        const point = this.place(mesh, places + i, a, number);
        if (step === 2) continue;
        lean[i] += normal[3 * i + a] * (point - points[4 * vertex[i] + a]);
        scale[i] = Math.floor((spread[i] + 3 * Math.abs(point - mean[3 * i + a]) + 1) / 2);
      }
    }
  }

  /** Mean and spread of a split without an arc: its ring is its own place and one more. */
  expectBare({ mean, normal, axis, spread, vertex, points, x }, i) {
    let sum = 0;
    for (let a = 0; a < 3; a++) {
      const own = points[4 * vertex[i] + a];
      const end = points[4 * x[i] + a];
      const m = (mean[3 * i + a] = Math.floor((2 * (own + end) + 2) / 4));
      sum += Math.abs(own - m) + Math.abs(end - m);
      normal[3 * i + a] = 0;
    }
    axis[i] = 0;
    spread[i] = Math.floor(sum / 2);
  }
}
