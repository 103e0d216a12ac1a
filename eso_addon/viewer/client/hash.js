// SPDX-License-Identifier: GPL-3.0-or-later
// SHA-256 (FIPS 180-4): browsers keep their own for pages that came by https or from this computer.

const hex = (words) => Array.from(words, (word) => (word >>> 0).toString(16).padStart(8, '0')).join('');
const turn = (x, n) => (x >>> n) | (x << (32 - n));
const fraction = (x) => ((x - Math.floor(x)) * 4294967296) | 0;

/** The hash of some bytes, in hex. */
export async function sha256(bytes, crypto = globalThis.crypto?.subtle) {
  if (!crypto) return hex(slowly(bytes));
  const hash = new DataView(await crypto.digest('SHA-256', bytes));
  return hex([0, 4, 8, 12, 16, 20, 24, 28].map((at) => hash.getInt32(at)));
}

function slowly(bytes) {
  const primes = [];
  for (let n = 2; primes.length < 64; n++) if (primes.every((p) => n % p)) primes.push(n);
  const k = Int32Array.from(primes, (p) => fraction(Math.cbrt(p)));
  const state = Int32Array.from(primes.slice(0, 8), (p) => fraction(Math.sqrt(p)));
  const padded = new Uint8Array((bytes.length + 72) & ~63);
  padded.set(bytes);
  padded[bytes.length] = 128;
  const data = new DataView(padded.buffer);
  data.setUint32(padded.length - 8, bytes.length / 536870912);
  data.setUint32(padded.length - 4, bytes.length * 8);
  const w = new Int32Array(64);
  for (let at = 0; at < padded.length; at += 64) {
    for (let i = 0; i < 16; i++) w[i] = data.getInt32(at + 4 * i);
    for (let i = 16; i < 64; i++) {
      const x = w[i - 15];
      const y = w[i - 2];
      w[i] = w[i - 16] + (turn(x, 7) ^ turn(x, 18) ^ (x >>> 3)) + w[i - 7] + (turn(y, 17) ^ turn(y, 19) ^ (y >>> 10));
    }
    let [a, b, c, d, e, f, g, h] = state;
    for (let i = 0; i < 64; i++) {
      const first = h + (turn(e, 6) ^ turn(e, 11) ^ turn(e, 25)) + ((e & f) ^ (~e & g)) + k[i] + w[i];
      const second = (turn(a, 2) ^ turn(a, 13) ^ turn(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
      [a, b, c, d, e, f, g, h] = [(first + second) | 0, a, b, c, (d + first) | 0, e, f, g];
    }
    [a, b, c, d, e, f, g, h].forEach((value, i) => (state[i] += value));
  }
  return state;
}
