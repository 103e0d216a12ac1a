// SPDX-License-Identifier: GPL-3.0-or-later
// Symbols by rANS on lanes, with frequencies learnt from the batches before; plain bits.
import { check } from './container.js';

const SCALE = 4096;
const BUCKETS = 256; // of 16 slots each: where the search for a symbol begins

/** What reads the symbols and bits of a mesh's batches; `states`: 4 bytes a lane. */
export function makeCoder(states) {
  const state = new Int32Array(states.slice().buffer);
  let words;
  let word;
  let plain;
  let bit;

  /** Go on with the next batch's words and plain bits. */
  function feed(symbols, bits) {
    words = new Uint16Array(symbols.slice().buffer);
    plain = new Uint32Array(bits.slice().buffer);
    word = bit = 0;
  }

  /** A number of so many plain bits, up to 53. */
  function bits(width) {
    if (width > 32) return bits(32) + bits(width - 32) * 4294967296;
    const at = bit >>> 5;
    const shift = bit & 31;
    bit += width;
    check(bit <= 32 * plain.length);
    let value = plain[at] >>> shift;
    if (shift + width > 32) value |= plain[at + 1] << (32 - shift);
    return width === 32 ? value >>> 0 : value & ((1 << width) - 1);
  }

  /** A model: { read, choose }, two functions that read symbols and learn from them. */
  function model(contexts, symbols, shared) {
    const counts = new Int32Array(contexts * symbols);
    const fresh = new Int32Array(contexts * symbols);
    const across = new Float64Array(contexts + symbols); // counts of symbol - context
    const met = new Uint8Array(contexts); // 2: in this run, 1: in one before
    const start = new Uint16Array(contexts * (symbols + 1));
    const bucket = new Uint8Array(contexts * BUCKETS);
    const weight = new Float64Array(symbols);

    /** Work out frequencies of one context: only those that a run meets are needed. */
    function prepare(context) {
      let total = 0;
      let most = 0;
      for (let s = 0; s < symbols; s++) {
        weight[s] = 32 * counts[context * symbols + s] + 1;
        if (shared) weight[s] += Math.floor((across[s - context + contexts] * 128) / contexts);
        total += weight[s];
        if (weight[s] > weight[most]) most = s;
      }
      let left = SCALE;
      for (let s = 0; s < symbols; s++) left -= weight[s] = 1 + Math.floor((weight[s] * (SCALE - symbols)) / total);
      weight[most] += left;
      let to = context * (symbols + 1);
      let low = 0;
      for (let s = 0, b = 0; s < symbols; s++) {
        start[to++] = low;
        low += weight[s];
        for (; b < (low + 15) >> 4; b++) bucket[context * BUCKETS + b] = s;
      }
      start[to] = SCALE;
      met[context] = 2;
    }

    function learn(at) {
      word = at;
      check(word <= words.length);
      for (let c = 0; c < contexts; c++) {
        if (met[c] === 0) continue;
        met[c] = 1;
        for (let s = 0, at = c * symbols; s < symbols; s++, at++) {
          counts[at] = (counts[at] >> 1) + fresh[at];
          across[s - c + contexts] += fresh[at];
          fresh[at] = 0;
        }
      }
    }

    /** Symbols, one for each context. */
    function read(context) {
      const count = context.length;
      for (let i = 0; i < count; i++) if (met[context[i]] < 2) prepare(context[i]);
      const out = new Uint8Array(count);
      const lanes = state.length;
      let at = word;
      for (let i = 0, lane = 0; i < count; i++) {
        const c = context[i];
        const x = state[lane];
        const slot = x & (SCALE - 1);
        let s = bucket[c * BUCKETS + (slot >> 4)];
        const row = c * (symbols + 1);
        while (slot >= start[row + s + 1]) s++;
        const low = start[row + s];
        let next = (Math.imul(start[row + s + 1] - low, x >>> 12) + slot - low) | 0;
        if (next >>> 16 === 0) next = (next << 16) | words[at++];
        state[lane] = next;
        if (++lane === lanes) lane = 0;
        out[i] = s;
        fresh[c * symbols + s]++;
      }
      learn(at);
      return out;
    }

    /** The places that are chosen, by a symbol 0 or 1 for each that has a degree: the same as `read`, in half the time. */
    function choose(degree, places) {
      const chosen = new Int32Array(places);
      const lanes = state.length;
      for (let c = 1; c < contexts; c++) prepare(c);
      let at = word;
      let count = 0;
      for (let v = 0, lane = 0; v < places; v++) {
        if (degree[v] === 0) continue;
        const c = degree[v] < 20 ? degree[v] : 20;
        const none = start[3 * c + 1]; // slots of the symbol 0
        const x = state[lane];
        const slot = x & (SCALE - 1);
        const flag = (none - 1 - slot) >>> 31;
        let next = (Math.imul(flag ? SCALE - none : none, x >>> 12) + slot - (flag ? none : 0)) | 0;
        if (next >>> 16 === 0) next = (next << 16) | words[at++];
        state[lane] = next;
        if (++lane === lanes) lane = 0;
        fresh[2 * c + flag]++;
        chosen[count] = v;
        count += flag;
      }
      learn(at);
      return chosen.subarray(0, count);
    }

    return { read, choose };
  }

  /** Numbers with a sign: their classes are given, the bits below them come as they are. */
  function numbers(classes) {
    const out = new Float64Array(classes.length);
    for (let i = 0; i < classes.length; i++) {
      const c = classes[i];
      if (c === 0) continue;
      const value = bits(Math.max(c >> 1, 1));
      const half = c < 2 ? 1 : (2 + (c & 1)) * POWERS[(c >> 1) - 1] + Math.floor(value / 2);
      out[i] = value % 2 ? -half : half;
    }
    return out;
  }

  return { feed, bits, model, numbers };
}

const POWERS = Float64Array.from({ length: 64 }, (_, n) => 2 ** n);

/** Bits of a whole number below 2 to the 53rd. */
export const bitLength = (n) => (n < 4294967296 ? 32 - Math.clz32(n) : 64 - Math.clz32(n / 4294967296));

/** The class of a size below 2 to the 31st. */
export function sizeClass(n) {
  if (n < 2) return n;
  const length = 32 - Math.clz32(n);
  return 2 * length - 4 + (n >> (length - 2));
}
