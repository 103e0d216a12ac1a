// SPDX-License-Identifier: GPL-3.0-or-later
// The file's frame: magic, version, header, table of blocks. docs/format.md says what each byte is.

/** What went wrong with the file or the line; `again`: asking once more may help. */
export class StreamError extends Error {
  constructor(message, again = false) {
    super(message);
    this.again = again;
  }
}

export const FIXED = 24; // bytes before the header
const MAGIC = [0x89, 0x45, 0x53, 0x4f, 0x50, 0x4d, 0x0d, 0x0a];
const KNOWN = ['wedges', 'attributes', 'extra-faces', 'edges', 'turned', 'quantised'];
const ROW = 24;

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

/** Refuse what no writer writes. */
export function check(sound, what = 'The file is damaged.') {
  if (!sound) throw new StreamError(what);
}

/** Unpack raw deflate; two bytes of it hold nothing. */
export async function inflate(bytes) {
  if (bytes.length < 3) return new Uint8Array(0);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate-raw'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const view = (bytes) => new DataView(bytes.buffer, bytes.byteOffset);

/** Read the first 24 bytes: how long header and table are together with them, and what the header needs. */
export function readFixed(bytes) {
  check(MAGIC.every((value, at) => bytes[at] === value), 'This is not an .esopm file.');
  const data = view(bytes);
  const [version, flags] = [8, 10].map((at) => data.getUint16(at, true));
  check(version === 1 && !flags, `The file has version ${version}.${flags}; this page knows version 1.0. Update the page.`);
  const [header, table, crc] = [12, 16, 20].map((at) => data.getUint32(at, true));
  return { header, table, crc, end: FIXED + header + table };
}

/** Read header and table: { header, meshes, rows, end }, rows with begin, length, crc, places, faces, error, mesh. */
export async function readHead(bytes, { header: size, crc, end }) {
  const body = bytes.subarray(FIXED, end);
  check(crc32(body) === crc, 'The header of the file is damaged.');
  const header = JSON.parse(new TextDecoder().decode(await inflate(body.subarray(0, size))));
  const { meshes } = header;
  const unknown = meshes.flatMap((mesh) => mesh.needs).filter((name) => !KNOWN.includes(name));
  check(!unknown.length, `The file needs what this page does not know: ${unknown}. Update the page.`);
  const count = view(body).getUint32(size, true);
  const planes = await inflate(body.subarray(size + 4));
  check(planes.length === count * ROW);
  const data = new DataView(planes.map((_, at) => planes[(at % ROW) * count + Math.floor(at / ROW)]).buffer);
  const rows = [];
  for (let at = 0; at < count * ROW; at += ROW) {
    const [length, crc, places, faces, , mesh] = [0, 4, 8, 12, 16, 20].map((field) => data.getUint32(at + field, true));
    check(meshes[mesh]);
    rows.push({ begin: end, length, crc, places, faces, error: data.getFloat32(at + 16, true), mesh });
    end += length;
  }
  return { header, meshes, rows, end };
}
