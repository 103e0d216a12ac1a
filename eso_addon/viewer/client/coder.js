// SPDX-License-Identifier: GPL-3.0-or-later
// Symbols by rANS on lanes, with frequencies learnt from the batches before; plain bits.
import { StreamError } from './container.js';

const SCALE = 4096;
const BUCKETS = 256; // of 16 slots each: where the search for a symbol begins

export class Model {
  constructor(contexts, symbols, shared = false) {
    this.contexts = contexts;
    this.symbols = symbols;
    this.counts = new Int32Array(contexts * symbols);
    this.fresh = new Int32Array(contexts * symbols);
    this.shared = shared ? new Float64Array(contexts + symbols) : null;
    this.ready = new Uint8Array(contexts);
    this.start = new Uint16Array(contexts * (symbols + 1));
    this.bucket = new Uint8Array(contexts * BUCKETS);
    this.weight = new Float64Array(symbols);
  }

  /** Work out frequencies of one context: only those that a run meets are needed. */
  prepare(context) {
    const { contexts, symbols, counts, shared, start, bucket, weight } = this;
    let total = 0;
    let most = 0;
    for (let s = 0; s < symbols; s++) {
      let k = 32 * counts[context * symbols + s] + 1;
      if (shared) k += Math.floor((shared[s - context + contexts] * 128) / contexts);
      weight[s] = k;
      total += k;
      if (k > weight[most]) most = s;
    }
    let left = SCALE;
    for (let s = 0; s < symbols; s++) left -= weight[s] = 1 + Math.floor((weight[s] * (SCALE - symbols)) / total);
    weight[most] += left;
    const row = context * (symbols + 1);
    let at = 0;
    let b = context * BUCKETS;
    for (let s = 0; s < symbols; s++) {
      start[row + s] = at;
      at += weight[s];
      for (const end = context * BUCKETS + ((at + 15) >> 4); b < end; b++) bucket[b] = s;
    }
    start[row + symbols] = SCALE;
    this.ready[context] = 1;
  }

  learn() {
    const { contexts, symbols, counts, fresh, shared } = this;
    for (let c = 0, at = 0; c < contexts; c++) {
      for (let s = 0; s < symbols; s++, at++) {
        counts[at] = (counts[at] >> 1) + fresh[at];
        if (shared) shared[s - c + contexts] += fresh[at];
      }
    }
    fresh.fill(0);
    this.ready.fill(0);
  }
}

export class Coder {
  /** `states`: 4 bytes a lane. */
  constructor(states) {
    this.lanes = states.length >> 2;
    this.state = new Int32Array(states.slice().buffer);
  }

  /** Go on with the next batch's words and plain bits. */
  feed(words, plain) {
    this.words = new Uint16Array(words.slice().buffer);
    this.word = 0;
    this.plain = new Uint32Array(plain.length / 4 + 2);
    this.plain.set(new Uint32Array(plain.slice().buffer));
    this.limit = plain.length * 8;
    this.bit = 0;
  }

  run(model) {
    this.model = model;
    this.lane = 0;
  }

  symbol(context) {
    const { model, state } = this;
    if (!model.ready[context]) model.prepare(context);
    const lane = this.lane;
    this.lane = lane + 1 === this.lanes ? 0 : lane + 1;
    let x = state[lane];
    const slot = x & (SCALE - 1);
    let s = model.bucket[context * BUCKETS + (slot >> 4)];
    const start = model.start;
    let at = context * (model.symbols + 1) + s;
    while (slot >= start[at + 1]) at++;
    s = at - context * (model.symbols + 1);
    x = (Math.imul(start[at + 1] - start[at], x >>> 12) + slot - start[at]) | 0;
    if (x >>> 16 === 0) x = (x << 16) | this.words[this.word++];
    state[lane] = x;
    model.fresh[context * model.symbols + s]++;
    return s;
  }

  /** A number of so many plain bits, up to 53. */
  bits(width) {
    if (width > 32) {
      const low = this.bits(32);
      return low + this.bits(width - 32) * 4294967296;
    }
    const at = this.bit >>> 5;
    const shift = this.bit & 31;
    this.bit += width;
    if (this.bit > this.limit) throw new StreamError('The file is damaged: a batch has too few bits.');
    let value = this.plain[at] >>> shift;
    if (shift + width > 32) value |= this.plain[at + 1] << (32 - shift);
    return width === 32 ? value >>> 0 : (value & ((1 << width) - 1)) >>> 0;
  }

  /** The number with a sign: a class as a symbol, the bits below it as they are. */
  number(context) {
    const c = this.symbol(context);
    if (c === 0) return 0;
    const length = Math.max(c >> 1, 1) - 1;
    const value = this.bits(length + 1);
    const sign = value % 2 ? -1 : 1;
    if (c < 2) return sign;
    return sign * ((2 + (c & 1)) * 2 ** length + Math.floor(value / 2));
  }

  learn() {
    this.model.learn();
    if (this.word > this.words.length) throw new StreamError('The file is damaged: a batch ends too early.');
  }
}

/** Bits of a whole number below 2 to the 53rd. */
export const bitLength = (n) => (n < 4294967296 ? 32 - Math.clz32(n) : 64 - Math.clz32(n / 4294967296));

/** The class of a size, at most 71. */
export function sizeClass(n) {
  if (n < 2) return n;
  const length = bitLength(n);
  return Math.min(2 * length - 4 + Math.floor(n / 2 ** (length - 2)), 71);
}
