// SPDX-License-Identifier: GPL-3.0-or-later
// SHA-256 (FIPS 180-4): browsers keep their own for pages that came by https.

const fraction = (x) => ((x - Math.floor(x)) * 4294967296) | 0;
const primes = [];
for (let n = 2; primes.length < 64; n++) if (primes.every((p) => n % p)) primes.push(n);
const K = Int32Array.from(primes, (p) => fraction(Math.cbrt(p)));

export class Sha256 {
  constructor() {
    this.state = Int32Array.from(primes.slice(0, 8), (p) => fraction(Math.sqrt(p)));
    this.rest = new Uint8Array(64);
    this.fill = 0;
    this.size = 0;
    this.w = new Int32Array(64);
  }

  update(array) {
    const bytes = new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
    let at = 0;
    this.size += bytes.length;
    while (at < bytes.length) {
      if (!this.fill && bytes.length - at >= 64) {
        for (; bytes.length - at >= 64; at += 64) this.block(bytes, at);
        continue;
      }
      const part = bytes.subarray(at, at + 64 - this.fill);
      this.rest.set(part, this.fill);
      at += part.length;
      this.fill = (this.fill + part.length) & 63;
      if (!this.fill) this.block(this.rest, 0);
    }
  }

  block(bytes, at) {
    const { w, state } = this;
    for (let i = 0; i < 16; i++, at += 4) {
      w[i] = (bytes[at] << 24) | (bytes[at + 1] << 16) | (bytes[at + 2] << 8) | bytes[at + 3];
    }
    for (let i = 16; i < 64; i++) {
      const x = w[i - 15];
      const y = w[i - 2];
      const s0 = ((x >>> 7) | (x << 25)) ^ ((x >>> 18) | (x << 14)) ^ (x >>> 3);
      const s1 = ((y >>> 17) | (y << 15)) ^ ((y >>> 19) | (y << 13)) ^ (y >>> 10);
      w[i] = (w[i - 16] + s0 + w[i - 7] + s1) | 0;
    }
    let [a, b, c, d, e, f, g, h] = state;
    for (let i = 0; i < 64; i++) {
      const s1 = ((e >>> 6) | (e << 26)) ^ ((e >>> 11) | (e << 21)) ^ ((e >>> 25) | (e << 7));
      const t1 = (h + s1 + ((e & f) ^ (~e & g)) + K[i] + w[i]) | 0;
      const s0 = ((a >>> 2) | (a << 30)) ^ ((a >>> 13) | (a << 19)) ^ ((a >>> 22) | (a << 10));
      const t2 = (s0 + ((a & b) ^ (a & c) ^ (b & c))) | 0;
      h = g;
      g = f;
      f = e;
      e = (d + t1) | 0;
      d = c;
      c = b;
      b = a;
      a = (t1 + t2) | 0;
    }
    [a, b, c, d, e, f, g, h].forEach((value, i) => (state[i] += value));
  }

  hex() {
    const bits = this.size * 8;
    this.update(Uint8Array.of(128, ...new Uint8Array((119 - (this.size % 64)) % 64)));
    const tail = new DataView(new ArrayBuffer(8));
    tail.setUint32(0, bits / 4294967296);
    tail.setUint32(4, bits);
    this.update(tail);
    return Array.from(this.state, (value) => (value >>> 0).toString(16).padStart(8, '0')).join('');
  }
}
