// SPDX-License-Identifier: GPL-3.0-or-later
// Columns of numbers, stored as planes of bytes.
import { StreamError } from './container.js';

export class Columns {
  constructor(raw) {
    this.raw = raw;
    this.at = 0;
  }

  /** Differences from what is expected, unfolded: `count` numbers of `width` bytes. */
  deltas(width, count) {
    const { raw, at } = this;
    const out = new Int32Array(count);
    if (at + width * count > raw.length) throw new StreamError('The file is damaged: a block ends too early.');
    for (let plane = 0; plane < width; plane++) {
      const first = at + plane * count;
      for (let i = 0; i < count; i++) out[i] |= raw[first + i] << (8 * plane);
    }
    for (let i = 0; i < count; i++) out[i] = (out[i] >>> 1) ^ -(out[i] & 1);
    this.at = at + width * count;
    return out;
  }

  /** Numbers that each expect the one before; below 2 to the 8 * width where unsigned. */
  running(width, count) {
    const out = this.deltas(width, count);
    const mask = width === 4 ? -1 : (1 << (8 * width)) - 1;
    for (let i = 1; i < count; i++) out[i] += out[i - 1];
    if (width < 4) for (let i = 0; i < count; i++) out[i] &= mask;
    return out;
  }
}
