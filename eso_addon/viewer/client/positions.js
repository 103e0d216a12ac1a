// SPDX-License-Identifier: GPL-3.0-or-later
// Where places are: on the grid of predictions, and as float32.
import { check } from './container.js';

const FAR = 2 ** 27;
const HALF_EVEN = 6755399441055744; // adding and taking away 1.5 * 2^52 rounds halves to even

const cut = (n) => Math.max(-FAR, Math.min(n, FAR));

/** What turns numbers of the file into `points` (four a place) and `positions`, and predictions into numbers. */
export function makeGrid([kind, scale, x, y, z, shift], points, positions) {
  check([0, 1, 2].includes(kind) && scale > 0 && [scale, x, y, z].every(Number.isFinite) && shift >= 0 && shift < 32);
  const origin = [x, y, z];
  const bits = new Int32Array(positions.buffer); // a signalling NaN must keep its bits
  const float = new Float32Array(1);
  const word = new Int32Array(float.buffer);

  /** Put a place's number where it belongs; gives it on the grid of predictions. */
  function put(place, axis, number) {
    const at = 3 * place + axis;
    let point = cut(number);
    if (kind === 2) {
      bits[at] = number >= 0 ? number : (-1 - number) | 0x80000000;
      point = Number.isFinite(positions[at]) ? cut(positions[at] * scale) + HALF_EVEN - HALF_EVEN : 0;
    } else positions[at] = (kind ? point / scale : point * scale) + origin[axis];
    points[4 * place + axis] = point;
    return point;
  }

  /** The number that stands for a prediction: with kind 2 its place among all float32. */
  function numberOf(point) {
    if (kind < 2) return point;
    float[0] = point / scale;
    return word[0] >= 0 ? word[0] : -1 - (word[0] & 0x7fffffff);
  }

  return { put, numberOf, shift, floats: kind === 2 };
}
