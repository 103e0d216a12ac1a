// SPDX-License-Identifier: GPL-3.0-or-later
// Where the bytes come from: byte ranges of a file on a server, or bytes that the page holds.

/** What went wrong on the line; `again`: asking once more may help. */
export class LineError extends Error {
  constructor(message, again) {
    super(message);
    this.again = again;
  }
}

export class Line {
  constructor(url) {
    this.url = url;
    this.ranges = true; // until the server refuses them
    this.size = 0; // of the file, 0 while unknown
  }

  /** Yield the bytes from `begin` up to `end`, which may be Infinity; past it where the server knows no ranges. */
  async *read(begin, end, signal) {
    const headers = { Range: `bytes=${begin}-${end < Infinity ? end - 1 : ''}` };
    if (this.tag && begin) headers['If-Range'] = this.tag;
    const response = await this.ask(headers, signal);
    const reader = response.body.getReader();
    let skip = this.ranges ? 0 : begin;
    let at = begin;
    try {
      for (;;) {
        const { done, value } = await reader.read().catch(() => {
          throw new LineError('The connection broke off.', true);
        });
        if (done) break;
        const part = value.subarray(Math.min(skip, value.length));
        skip -= value.length - part.length;
        if (!part.length) continue;
        at += part.length;
        yield part;
      }
    } finally {
      reader.cancel().catch(() => {});
    }
    if (at < Math.min(end, this.size || Infinity) && end < Infinity) throw new LineError('The connection broke off.', true);
  }

  async ask(headers, signal) {
    let response;
    try {
      response = await fetch(this.url, { headers, signal, cache: 'no-store' });
    } catch {
      throw new LineError('The server does not answer.', true);
    }
    const { status } = response;
    if (status === 416) throw new LineError('The file is cut short on the server.', false);
    if (!response.ok) {
      const gone = status === 404 || status === 410;
      const text = gone ? `There is no such file on the server (${status}).` : `The server refuses the file (${status}).`;
      throw new LineError(text, status >= 500 || status === 408 || status === 429);
    }
    const tag = response.headers.get('ETag');
    if (this.tag && tag && tag !== this.tag) throw new LineError('The file on the server has changed: load the page anew.', false);
    if (tag && !tag.startsWith('W/')) this.tag = tag;
    this.ranges = status === 206;
    const total = this.ranges ? (response.headers.get('Content-Range') ?? '').split('/')[1] : response.headers.get('Content-Length');
    if (Number(total) && !response.headers.get('Content-Encoding')) this.size = Number(total);
    return response;
  }
}

/** Bytes that the page itself holds. */
export class Held {
  constructor(bytes) {
    this.bytes = bytes;
    this.size = bytes.length;
    this.ranges = true;
  }

  async *read(begin, end) {
    const stop = Math.min(end, this.size);
    if (begin >= stop) throw new LineError('The file is cut short.', false);
    for (let at = begin; at < stop; at += 1 << 16) yield this.bytes.subarray(at, Math.min(at + (1 << 16), stop));
  }
}
