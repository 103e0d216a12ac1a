// SPDX-License-Identifier: GPL-3.0-or-later
// Columns of numbers, stored as planes of bytes.
import { check } from './container.js';

/** Two functions that read the next column: differences from what is expected; numbers that each expect the one before. */
export function makeColumns(raw) {
  let at = 0;

  /** `count` differences of `width` bytes, unfolded. */
  function deltas(width, count) {
    const out = new Int32Array(count);
    check(at + width * count <= raw.length);
    for (let plane = 0; plane < width; plane++) {
      for (let i = 0; i < count; i++) out[i] |= raw[at++] << (8 * plane);
    }
    for (let i = 0; i < count; i++) out[i] = (out[i] >>> 1) ^ -(out[i] & 1);
    return out;
  }

  /** Numbers that each expect the one before; below 2 to the 8 * width where unsigned. */
  function running(width, count) {
    const out = deltas(width, count);
    for (let i = 1; i < count; i++) out[i] += out[i - 1];
    return width < 4 ? out.map((value) => value & ((1 << (8 * width)) - 1)) : out;
  }

  return [deltas, running];
}
