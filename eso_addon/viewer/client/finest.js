// SPDX-License-Identifier: GPL-3.0-or-later
// The finest mesh that is there, as Python's `restore` gives it, and its hash.
import { Sha256 } from './hash.js';

/** The mesh as it is now: { vertices, faces, edges, attributes: [{domain, name, bytes}] }, as in Python. */
export function finest(mesh) {
  const { wedgeVertex } = mesh;
  const entries = cornerWedges(mesh);
  const faces = wedgeVertex ? entries.map((wedge) => wedgeVertex[wedge]) : entries.slice();
  let vertices = mesh.positions.slice(0, 3 * mesh.places);
  if (wedgeVertex) {
    vertices = new Float32Array(3 * mesh.vertexCount);
    const [to, from] = [new Int32Array(vertices.buffer), new Int32Array(mesh.positions.buffer)];
    for (let place = 0; place < mesh.places; place++) {
      for (let wedge = mesh.starts[place]; wedge < mesh.starts[place + 1]; wedge++) {
        for (let axis = 0; axis < 3; axis++) to[3 * wedgeVertex[wedge] + axis] = from[3 * place + axis];
      }
    }
  }
  const attributes = mesh.attributes.map((attribute) => ({
    domain: attribute.domain,
    name: attribute.name,
    bytes: rowsOf(mesh, attribute, entries),
  }));
  return { vertices, faces, edges: mesh.edges, attributes };
}

/** The wedge of each corner, in the original's winding, faces beside the splits first. */
function cornerWedges(mesh) {
  const extra = mesh.extraWedges.length;
  const out = new Int32Array(extra + 3 * mesh.faceCount);
  out.set(mesh.extraWedges);
  out.set(mesh.wedges.subarray(0, 3 * mesh.faceCount), extra);
  if (mesh.turned) {
    for (let face = 0; face < mesh.faceCount; face++) {
      if (!mesh.turned[face]) continue;
      const at = extra + 3 * face;
      [out[at + 1], out[at + 2]] = [out[at + 2], out[at + 1]];
    }
  }
  return out;
}

/** An attribute's bytes as they are in memory; those of corners and sides face by face. */
function rowsOf(mesh, { domain, kind, size, width, columns }, entries) {
  const faces = entries.length / 3;
  const rows = { vertex: mesh.vertexCount, corner: entries.length, face: faces, side: faces, edge: mesh.edges.length / 2 }[domain];
  const items = columns.length;
  const out = new Uint8Array(rows * items * width);
  const data = new DataView(out.buffer);
  const write = { 1: 'setUint8', 2: 'setUint16', 4: 'setUint32' }[width];
  const real = kind === 'f' && size === 4;
  const each = items / 3; // of a side
  for (let row = 0; row < rows; row++) {
    const from = domain === 'corner' ? entries[row] : row;
    const swap = domain === 'side' && row >= mesh.head.extra && mesh.turned?.[row - mesh.head.extra];
    for (let item = 0; item < items; item++) {
      let column = item;
      if (swap && item >= each) column = item >= 2 * each ? item - each : item + each;
      let value = columns[column][from];
      if (real) value = value < 0 ? value & 0x7fffffff : ~value;
      data[write]((row * items + item) * width, value, true);
    }
  }
  return out;
}

/** SHA-256 of the finest mesh, each face from its lowest vertex on; hex. */
export async function digest(mesh) {
  const { vertices, faces, edges, attributes } = finest(mesh);
  const first = new Uint8Array(faces.length / 3);
  for (let face = 0, at = 0; at < faces.length; face++, at += 3) {
    const a = faces[at];
    const b = faces[at + 1];
    const c = faces[at + 2];
    if (a <= b && a <= c) continue;
    const row = (first[face] = b <= c ? 1 : 2);
    faces[at] = row === 1 ? b : c;
    faces[at + 1] = row === 1 ? c : a;
    faces[at + 2] = row === 1 ? a : b;
  }
  const parts = [vertices, faces, edges];
  for (const { domain, bytes } of attributes) parts.push(domain === 'corner' || domain === 'side' ? turn(bytes, first) : bytes);
  if (!globalThis.crypto?.subtle) {
    const sha = new Sha256();
    for (const part of parts) sha.update(part);
    return sha.hex();
  }
  const whole = new Uint8Array(parts.reduce((sum, part) => sum + part.byteLength, 0));
  let at = 0;
  for (const part of parts) {
    whole.set(new Uint8Array(part.buffer, part.byteOffset, part.byteLength), at);
    at += part.byteLength;
  }
  const hash = new Uint8Array(await crypto.subtle.digest('SHA-256', whole));
  return Array.from(hash, (byte) => byte.toString(16).padStart(2, '0')).join('');
}

/** Values of corners, each face's from its `first` on. */
function turn(bytes, first) {
  const out = new Uint8Array(bytes.length);
  const each = first.length ? bytes.length / first.length / 3 : 0;
  for (let face = 0, at = 0; face < first.length; face++) {
    for (let row = 0; row < 3; row++) {
      const from = (3 * face + ((row + first[face]) % 3)) * each;
      for (let i = 0; i < each; i++) out[at++] = bytes[from + i];
    }
  }
  return out;
}
