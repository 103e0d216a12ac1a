// SPDX-License-Identifier: GPL-3.0-or-later
// Where places are: on the grid of predictions, and as float32.
import { check } from './container.js';

const FAR = 2 ** 27;
const HALF_EVEN = 6755399441055744; // adding and taking away 1.5 * 2^52 rounds halves to even
const FLOATS = 2;
const float = new Float32Array(1);
const word = new Int32Array(float.buffer);

const cut = (n) => (n > FAR ? FAR : n < -FAR ? -FAR : n);

export function makeGrid([kind, scale, x, y, z, shift]) {
  check([0, 1, FLOATS].includes(kind) && scale > 0 && [scale, x, y, z].every(Number.isFinite) && shift >= 0 && shift < 32);
  return { kind, scale, origin: Float64Array.of(x, y, z), shift, floats: kind === FLOATS };
}

/** Put a place's number where it belongs; gives it on the grid of predictions. */
export function put({ grid, points, positions, positionBits }, place, axis, number) {
  const { kind, scale, origin } = grid;
  const at = 3 * place + axis;
  let point = cut(number);
  if (kind === FLOATS) {
    positionBits[at] = number >= 0 ? number : (-1 - number) | 0x80000000;
    const value = positions[at];
    point = Number.isFinite(value) ? cut(value * scale) + HALF_EVEN - HALF_EVEN : 0;
  } else positions[at] = (kind ? point / scale : point * scale) + origin[axis];
  points[4 * place + axis] = point;
  return point;
}

/** The place of a prediction among all float32. */
export function placeOf({ scale }, point) {
  float[0] = point / scale;
  return word[0] >= 0 ? word[0] : -1 - (word[0] & 0x7fffffff);
}
