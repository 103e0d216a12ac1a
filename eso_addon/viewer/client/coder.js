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
    this.met = new Uint8Array(contexts);
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
    const { contexts, symbols, counts, fresh, shared, ready, met } = this;
    for (let c = 0; c < contexts; c++) {
      met[c] |= ready[c];
      ready[c] = 0;
      if (met[c] === 0) continue; // nothing to halve yet
      for (let s = 0, at = c * symbols; s < symbols; s++, at++) {
        const more = fresh[at];
        counts[at] = (counts[at] >> 1) + more;
        if (more === 0) continue;
        if (shared !== null) shared[s - c + contexts] += more;
        fresh[at] = 0;
      }
    }
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

  /** Read symbols, one for each context, and learn from them. */
  symbols(model, contexts, count) {
    const { state, lanes, words } = this;
    const { ready, bucket, start, fresh, symbols } = model;
    const out = new Uint8Array(count);
    let word = this.word;
    for (let i = 0, lane = 0; i < count; i++) {
      const context = contexts[i];
      if (ready[context] === 0) model.prepare(context);
      let x = state[lane];
      const slot = x & (SCALE - 1);
      const row = context * (symbols + 1);
      let at = row + bucket[context * BUCKETS + (slot >> 4)];
      while (slot >= start[at + 1]) at++;
      const low = start[at];
      x = (Math.imul(start[at + 1] - low, x >>> 12) + slot - low) | 0;
      if (x >>> 16 === 0) x = (x << 16) | words[word++];
      state[lane] = x;
      if (++lane === lanes) lane = 0;
      out[i] = at - row;
      fresh[at - context]++;
    }
    this.word = word;
    if (word > words.length) throw new StreamError('The file is damaged: a batch ends too early.');
    model.learn();
    return out;
  }

  /** Which places of `degree` are chosen, by a flag for each that is above 0. */
  flags(model, degree, places) {
    const { state, lanes, words } = this;
    const { ready, start, fresh } = model;
    const chosen = new Int32Array(places + 1);
    let word = this.word;
    let k = 0;
    for (let v = 0, lane = 0; v < places; v++) {
      const d = degree[v];
      if (d === 0) continue;
      const context = d < 20 ? d : 20;
      if (ready[context] === 0) model.prepare(context);
      const none = start[3 * context + 1]; // slots of the flag 0
      let x = state[lane];
      const slot = x & (SCALE - 1);
      const flag = (none - 1 - slot) >>> 31;
      x = flag ? (Math.imul(SCALE - none, x >>> 12) + slot - none) | 0 : (Math.imul(none, x >>> 12) + slot) | 0;
      if (x >>> 16 === 0) x = (x << 16) | words[word++];
      state[lane] = x;
      if (++lane === lanes) lane = 0;
      fresh[2 * context + flag]++;
      chosen[k] = v;
      k += flag;
    }
    this.word = word;
    if (word > words.length) throw new StreamError('The file is damaged: a batch ends too early.');
    model.learn();
    return chosen.subarray(0, k);
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

  /** Numbers with a sign, one for each context: classes as symbols, the bits below them as they are. */
  numbers(model, contexts, count) {
    const classes = this.symbols(model, contexts, count);
    const out = new Float64Array(count);
    for (let i = 0; i < count; i++) {
      const c = classes[i];
      if (c === 0) continue;
      const length = c < 2 ? 0 : (c >> 1) - 1;
      const value = this.bits(length + 1);
      let magnitude = 1;
      if (c > 1) magnitude = length < 28 ? ((2 + (c & 1)) << length) + (value >>> 1) : (2 + (c & 1)) * 2 ** length + Math.floor(value / 2);
      out[i] = value % 2 ? -magnitude : magnitude;
    }
    return out;
  }
}

/** Bits of a whole number below 2 to the 53rd. */
export const bitLength = (n) => (n < 4294967296 ? 32 - Math.clz32(n) : 64 - Math.clz32(n / 4294967296));

/** The class of a size below 2 to the 31st. */
export function sizeClass(n) {
  if (n < 2) return n;
  const length = 32 - Math.clz32(n);
  return 2 * length - 4 + (n >> (length - 2));
}
