// SPDX-License-Identifier: GPL-3.0-or-later
// Symbols by rANS on lanes, with frequencies learnt from the batches before; plain bits.
import { check } from './container.js';

const SCALE = 4096;
const BUCKETS = 256; // of 16 slots each: where the search for a symbol begins
const POWERS = Float64Array.from({ length: 64 }, (_, n) => 2 ** n);

/** What has been read so far; `states`: 4 bytes a lane. */
export const makeCoder = (states) => ({ state: new Int32Array(states.slice().buffer), words: null, word: 0, plain: null, bit: 0 });

/** Go on with the next batch's words and plain bits. */
export function feed(coder, words, plain) {
  coder.words = new Uint16Array(words.slice().buffer);
  coder.plain = new Uint32Array(plain.slice().buffer);
  coder.word = coder.bit = 0;
}

export const makeModel = (contexts, symbols, shared = false) => ({
  contexts, symbols, shared,
  counts: new Int32Array(contexts * symbols),
  fresh: new Int32Array(contexts * symbols),
  across: new Float64Array(contexts + symbols), // counts of symbol - context
  met: new Uint8Array(contexts), // 2: in this run, 1: in one before
  start: new Uint16Array(contexts * (symbols + 1)),
  bucket: new Uint8Array(contexts * BUCKETS),
  weight: new Float64Array(symbols),
});

/** Work out frequencies of one context: only those that a run meets are needed. */
function prepare({ contexts, symbols, shared, counts, across, met, start, bucket, weight }, context) {
  let total = 0;
  let most = 0;
  for (let s = 0; s < symbols; s++) {
    let k = 32 * counts[context * symbols + s] + 1;
    if (shared) k += Math.floor((across[s - context + contexts] * 128) / contexts);
    weight[s] = k;
    total += k;
    if (k > weight[most]) most = s;
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

/** Learn from a run, whose words end at `word`. */
function learn(coder, { contexts, symbols, counts, fresh, across, met }, word) {
  coder.word = word;
  check(word <= coder.words.length);
  for (let c = 0; c < contexts; c++) {
    if (met[c] === 0) continue;
    met[c] = 1;
    for (let s = 0, at = c * symbols; s < symbols; s++, at++) {
      const more = fresh[at];
      counts[at] = (counts[at] >> 1) + more;
      if (more === 0) continue;
      across[s - c + contexts] += more;
      fresh[at] = 0;
    }
  }
}

/** Read symbols, one for each context. */
export function read(coder, model, context) {
  const { state, words } = coder;
  const { symbols, met, bucket, start, fresh } = model;
  const count = context.length;
  for (let i = 0; i < count; i++) if (met[context[i]] < 2) prepare(model, context[i]);
  const out = new Uint8Array(count);
  const lanes = state.length;
  let { word } = coder;
  for (let i = 0, lane = 0; i < count; i++) {
    const c = context[i];
    const slot = state[lane] & (SCALE - 1);
    const row = c * (symbols + 1);
    let at = row + bucket[c * BUCKETS + (slot >> 4)];
    while (slot >= start[at + 1]) at++;
    const low = start[at];
    let x = (Math.imul(start[at + 1] - low, state[lane] >>> 12) + slot - low) | 0;
    if (x >>> 16 === 0) x = (x << 16) | words[word++];
    state[lane] = x;
    if (++lane === lanes) lane = 0;
    out[i] = at - row;
    fresh[at - c]++;
  }
  learn(coder, model, word);
  return out;
}

/** The places that are chosen, by a symbol 0 or 1 for each that has a degree: the same as `read`, in half the time. */
export function choose(coder, model, degree, places) {
  const { state, words } = coder;
  const { start, fresh, contexts } = model;
  const chosen = new Int32Array(places);
  const lanes = state.length;
  for (let c = 1; c < contexts; c++) prepare(model, c);
  let { word } = coder;
  let count = 0;
  for (let v = 0, lane = 0; v < places; v++) {
    const d = degree[v];
    if (d === 0) continue;
    const c = d < 20 ? d : 20;
    const none = start[3 * c + 1]; // slots of the symbol 0
    const slot = state[lane] & (SCALE - 1);
    const flag = (none - 1 - slot) >>> 31;
    let x = (Math.imul(flag ? SCALE - none : none, state[lane] >>> 12) + slot - (flag ? none : 0)) | 0;
    if (x >>> 16 === 0) x = (x << 16) | words[word++];
    state[lane] = x;
    if (++lane === lanes) lane = 0;
    fresh[2 * c + flag]++;
    chosen[count] = v;
    count += flag;
  }
  learn(coder, model, word);
  return chosen.subarray(0, count);
}

/** A number of so many plain bits, up to 53. */
export function bits(coder, width) {
  if (width > 32) return bits(coder, 32) + bits(coder, width - 32) * 4294967296;
  const { plain, bit } = coder;
  const at = bit >>> 5;
  const shift = bit & 31;
  coder.bit = bit + width;
  check(bit + width <= 32 * plain.length);
  let value = plain[at] >>> shift;
  if (shift + width > 32) value |= plain[at + 1] << (32 - shift);
  return width === 32 ? value >>> 0 : value & ((1 << width) - 1);
}

/** Numbers with a sign: their classes as symbols, the bits below them as they are. */
export function numbers(coder, model, context) {
  const classes = read(coder, model, context);
  const out = new Float64Array(classes.length);
  for (let i = 0; i < classes.length; i++) {
    const c = classes[i];
    if (c === 0) continue;
    const value = bits(coder, c < 2 ? 1 : c >> 1);
    const length = (c >> 1) - 1;
    let size = 1;
    if (c > 55) size = (2 + (c & 1)) * POWERS[length] + Math.floor(value / 2); // leaves 32 bits
    else if (c > 1) size = ((2 + (c & 1)) << length) + (value >>> 1);
    out[i] = value % 2 ? -size : size;
  }
  return out;
}

/** Bits of a whole number below 2 to the 53rd. */
export const bitLength = (n) => (n < 4294967296 ? 32 - Math.clz32(n) : 64 - Math.clz32(n / 4294967296));

/** The class of a size below 2 to the 31st. */
export function sizeClass(n) {
  if (n < 2) return n;
  const length = 32 - Math.clz32(n);
  return 2 * length - 4 + (n >> (length - 2));
}
