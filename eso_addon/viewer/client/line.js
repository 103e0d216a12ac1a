// SPDX-License-Identifier: GPL-3.0-or-later
// Where the bytes come from: byte ranges of a file on a server.
import { StreamError } from './container.js';

const broken = () => new StreamError('The connection broke off.', true);

/** A file on a server: { read, ranges, size }. */
export function makeLine(url) {
  const line = { read, ranges: true, size: 0 }; // until the server refuses ranges; 0 while unknown
  let tag;

  /** Yield the bytes from `begin` up to `end`; up to the last one where the server knows no ranges. */
  async function* read(begin, end, signal) {
    const response = await ask(`bytes=${begin}-${end - 1}`, signal);
    const reader = response.body.getReader();
    let at = line.ranges ? begin : 0;
    try {
      for (;;) {
        const { done, value } = await reader.read().catch(() => {
          throw broken();
        });
        if (done) break;
        at += value.length;
        if (at > begin) yield value.subarray(Math.max(value.length - at + begin, 0));
        begin = Math.max(begin, at);
      }
    } finally {
      reader.cancel().catch(() => {});
    }
    if (begin < (line.ranges ? Math.min(end, line.size || end) : line.size)) throw broken();
  }

  async function ask(Range, signal) {
    const headers = { Range };
    if (tag) headers['If-Range'] = tag;
    const response = await fetch(url, { headers, signal, cache: 'no-store' }).catch(() => {
      throw new StreamError('The server does not answer.', true);
    });
    const { status } = response;
    const header = (name) => response.headers.get(name) ?? '';
    if (!response.ok) {
      const text = { 404: 'There is no such file on the server', 416: 'The file is cut short on the server' }[status];
      throw new StreamError(`${text ?? 'The server refuses the file'} (${status}).`, status >= 500 || status === 429);
    }
    const fresh = header('ETag');
    if (tag && fresh && fresh !== tag) throw new StreamError('The file on the server has changed: load the page anew.');
    if (!fresh.startsWith('W/')) tag = fresh;
    line.ranges = status === 206;
    const total = Number(line.ranges ? header('Content-Range').split('/')[1] : header('Content-Length'));
    if (total && !header('Content-Encoding')) line.size = total;
    return response;
  }

  return line;
}
