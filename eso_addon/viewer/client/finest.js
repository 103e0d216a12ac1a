// SPDX-License-Identifier: GPL-3.0-or-later
// The finest mesh that is there, as Python's `restore` gives it, and its hash.
import { sha256 } from './hash.js';

const WORDS = { 1: Uint8Array, 2: Uint16Array, 4: Uint32Array };
const bytesOf = (array) => new Uint8Array(array.buffer, array.byteOffset, array.byteLength);

/**
 * The mesh as it is now: { vertices, faces, edges, attributes: [{domain, name, bytes}] }, as in Python; where `turn` says
 * so with each face from its lowest vertex on.
 */
export function finest(mesh, turn) {
  const { wedges, wedgeVertex, wedgePlace, positionBits: from, turned, faceCount } = mesh;
  const order = new Uint8Array(3 * faceCount); // rows of the stored faces, as the original has them
  const entries = new Int32Array(3 * faceCount); // wedges
  const faces = new Int32Array(3 * faceCount);
  for (let at = 0; at < faces.length; at += 3) {
    const swap = turned ? turned[at / 3] : 0;
    const a = wedgeVertex[wedges[at]];
    const b = wedgeVertex[wedges[at + 1 + swap]];
    const c = wedgeVertex[wedges[at + 2 - swap]];
    const first = !turn || (a <= b && a <= c) ? 0 : b <= c ? 1 : 2;
    for (let i = 0; i < 3; i++) {
      const row = (first + i) % 3;
      order[at + i] = swap && row ? 3 - row : row;
      entries[at + i] = wedges[at + order[at + i]];
      faces[at + i] = wedgeVertex[entries[at + i]];
    }
  }
  const vertices = new Float32Array(3 * mesh.vertexCount);
  const to = new Int32Array(vertices.buffer);
  for (let w = 0; w < mesh.wedgeCount; w++) {
    for (let axis = 0; axis < 3; axis++) to[3 * wedgeVertex[w] + axis] = from[3 * wedgePlace[w] + axis];
  }
  const rows = { vertex: mesh.vertexCount, corner: entries.length, face: faceCount, side: faces.length, edge: mesh.edges.length / 2 };
  const attributes = mesh.attributes.map(({ domain, name, type, width, columns }) => {
    const each = domain === 'side' ? columns.length / 3 : columns.length; // columns a row
    const out = new WORDS[width](rows[domain] * each);
    for (let row = 0, at = 0; row < rows[domain]; row++) {
      let [source, column] = [row, 0];
      if (domain === 'corner') source = entries[row];
      if (domain === 'side') [source, column] = [Math.floor(row / 3), order[row] * each];
      for (let i = 0; i < each; i++) {
        const value = columns[column + i][source];
        out[at++] = type === 'f4' ? (value < 0 ? value & 0x7fffffff : ~value) : value;
      }
    }
    return { domain, name, bytes: bytesOf(out) };
  });
  return { vertices, faces, edges: mesh.edges, attributes };
}

/** SHA-256 of the finest mesh, each face from its lowest vertex on; hex. */
export function digest(mesh) {
  const { vertices, faces, edges, attributes } = finest(mesh, true);
  const parts = [...[vertices, faces, edges].map(bytesOf), ...attributes.map(({ bytes }) => bytes)];
  const whole = new Uint8Array(parts.reduce((sum, { length }) => sum + length, 0));
  let at = 0;
  for (const part of parts) {
    whole.set(part, at);
    at += part.length;
  }
  return sha256(whole);
}
