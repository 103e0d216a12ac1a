// SPDX-License-Identifier: GPL-3.0-or-later
// Write a mesh as Draco and as .glb with Draco: node viewer.mjs LIBRARY POSITIONS INDICES BITS OUTPUT, without ending.
import { readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";

const [library, positionsFile, indicesFile, bits, output] = process.argv.slice(2);
const draco = createRequire(import.meta.url)(library);
const read = (file, Type) => { const data = readFileSync(file); return new Type(data.buffer, data.byteOffset, data.length / 4); };
const positions = read(positionsFile, Float32Array);
const indices = read(indicesFile, Uint32Array);
const encoder = await draco.createEncoderModule({});
const [builder, mesh, coder, out] = [new encoder.MeshBuilder(), new encoder.Mesh(), new encoder.Encoder(), new encoder.DracoInt8Array()];
builder.AddFacesToMesh(mesh, indices.length / 3, indices);
const id = builder.AddFloatAttributeToMesh(mesh, encoder.POSITION, positions.length / 3, 3, positions);
coder.SetAttributeQuantization(encoder.POSITION, Number(bits));
coder.SetEncodingMethod(encoder.MESH_EDGEBREAKER_ENCODING);
coder.SetSpeedOptions(3, 3);
const length = coder.EncodeMeshToDracoBuffer(mesh, out);
const data = Buffer.alloc((length + 3) & ~3);
for (let at = 0; at < length; at++) data.writeInt8(out.GetValue(at), at);
writeFileSync(`${output}.drc`, data.subarray(0, length));

const low = [Infinity, Infinity, Infinity];
const high = low.map((value) => -value);
positions.forEach((value, at) => { low[at % 3] = Math.min(low[at % 3], value); high[at % 3] = Math.max(high[at % 3], value); });
const extension = "KHR_draco_mesh_compression";
let text = JSON.stringify({
  asset: { version: "2.0" }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }],
  extensionsUsed: [extension], extensionsRequired: [extension],
  accessors: [{ componentType: 5126, count: positions.length / 3, type: "VEC3", min: low, max: high },
    { componentType: 5125, count: indices.length, type: "SCALAR" }],
  meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1, mode: 4,
    extensions: { [extension]: { bufferView: 0, attributes: { POSITION: id } } } }] }],
  bufferViews: [{ buffer: 0, byteOffset: 0, byteLength: length }], buffers: [{ byteLength: data.length }],
});
text += " ".repeat((4 - (text.length % 4)) % 4);
const head = Buffer.alloc(20);
[0x46546c67, 2, 28 + text.length + data.length, text.length, 0x4e4f534a].forEach((value, at) => head.writeUInt32LE(value, 4 * at));
const chunk = Buffer.alloc(8);
chunk.writeUInt32LE(data.length, 0);
chunk.writeUInt32LE(0x004e4942, 4);
writeFileSync(`${output}.glb`, Buffer.concat([head, Buffer.from(text), chunk, data]));
