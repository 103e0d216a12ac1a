// SPDX-License-Identifier: GPL-3.0-or-later
// The file's frame: magic, version, header, table of blocks. docs/format.md says what each byte is.

export class StreamError extends Error {}

export const FIXED = 24; // bytes before the header
const MAGIC = [0x89, 0x45, 0x53, 0x4f, 0x50, 0x4d, 0x0d, 0x0a];
const KNOWN = ['wedges', 'attributes', 'extra-faces', 'edges', 'turned', 'quantised'];
const ROW = 24;
const LARGEST = 1 << 28; // bytes that a block may unpack to

const CRC = new Int32Array(256).map((_, n) => {
  for (let k = 0; k < 8; k++) n = n & 1 ? (n >>> 1) ^ 0xedb88320 : n >>> 1;
  return n;
});

/** CRC-32 as in zlib, unsigned. */
export function crc32(bytes) {
  let crc = -1;
  for (let i = 0; i < bytes.length; i++) crc = CRC[(crc ^ bytes[i]) & 255] ^ (crc >>> 8);
  return ~crc >>> 0;
}

/** Unpack raw deflate. */
export async function inflate(bytes, limit = LARGEST) {
  if (!bytes.length) return new Uint8Array(0);
  const parts = [];
  let size = 0;
  const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate-raw')).getReader();
  try {
    for (let part = await reader.read(); !part.done; part = await reader.read()) {
      parts.push(part.value);
      if ((size += part.value.length) > limit) throw 0;
    }
  } catch {
    reader.cancel().catch(() => {});
    throw new StreamError('The file is damaged: a block cannot be unpacked.');
  }
  if (parts.length === 1) return parts[0];
  const whole = new Uint8Array(size);
  let at = 0;
  for (const part of parts) {
    whole.set(part, at);
    at += part.length;
  }
  return whole;
}

const view = (bytes) => new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);

/** Read the first 24 bytes: how long header and table are. */
export function readFixed(bytes) {
  if (MAGIC.some((value, at) => bytes[at] !== value)) throw new StreamError('This is not an .esopm file.');
  const data = view(bytes);
  const [version, flags] = [data.getUint16(8, true), data.getUint16(10, true)];
  if (version !== 1 || flags) {
    throw new StreamError(`The file has version ${version}.${flags}; this page knows version 1.0. Update the page.`);
  }
  const sizes = { header: data.getUint32(12, true), table: data.getUint32(16, true), crc: data.getUint32(20, true) };
  if (sizes.header > 1 << 26 || sizes.table > 1 << 26) throw new StreamError('The header of the file is damaged.');
  return sizes;
}

/** Read header and table: { header, rows, end }, rows with begin, length, crc, places, faces, error, mesh. */
export async function readHead(bytes, sizes) {
  const body = bytes.subarray(FIXED, FIXED + sizes.header + sizes.table);
  if (crc32(body) !== sizes.crc) throw new StreamError('The header of the file is damaged.');
  let header;
  try {
    header = JSON.parse(new TextDecoder().decode(await inflate(body.subarray(0, sizes.header), 1 << 24)));
  } catch {
    throw new StreamError('The header of the file is damaged.');
  }
  const { meshes } = header;
  for (const mesh of meshes) {
    const unknown = mesh.needs.filter((name) => !KNOWN.includes(name));
    if (unknown.length) throw new StreamError(`The file needs what this page does not know: ${unknown}. Update the page.`);
  }
  const table = body.subarray(sizes.header);
  const count = view(table).getUint32(0, true);
  const raw = await inflate(table.subarray(4), count * ROW);
  if (raw.length !== count * ROW) throw new StreamError('The table of the file is damaged.');
  const plain = new Uint8Array(count * ROW);
  for (let at = 0; at < ROW; at++) for (let row = 0; row < count; row++) plain[row * ROW + at] = raw[at * count + row];
  const data = view(plain);
  let begin = FIXED + sizes.header + sizes.table;
  const rows = [];
  for (let at = 0; at < count * ROW; at += ROW) {
    const [length, crc, places, faces] = [0, 4, 8, 12].map((field) => data.getUint32(at + field, true));
    const mesh = data.getUint32(at + 20, true);
    if (!meshes[mesh]) throw new StreamError('The table of the file is damaged.');
    rows.push({ begin, length, crc, places, faces, error: data.getFloat32(at + 16, true), mesh });
    begin += length;
  }
  return { header, meshes, rows, end: begin };
}
