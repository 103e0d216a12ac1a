// SPDX-License-Identifier: GPL-3.0-or-later
// Time meshoptimizer's simplify: node meshopt.mjs LIBRARY POSITIONS INDICES TARGET OUTPUT, prints JSON.
import { existsSync, readFileSync, writeFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [library, positionsFile, indicesFile, target, output] = process.argv.slice(2);
const { MeshoptSimplifier } = await import(pathToFileURL(library).href);
await MeshoptSimplifier.ready;

const read = (file, Type) => { const data = readFileSync(file); return new Type(data.buffer, data.byteOffset, data.length / 4); };
const positions = read(positionsFile, Float32Array);
const indices = read(indicesFile, Uint32Array);
const status = (field) => existsSync("/proc/self/status")
  ? 1024 * Number(readFileSync("/proc/self/status", "utf8").match(new RegExp(field + ":\\s*(\\d+)"))[1]) : 0;
const call = () => MeshoptSimplifier.simplify(indices, positions, 3, Number(target), 1e9);

if (existsSync("/proc/self/clear_refs")) writeFileSync("/proc/self/clear_refs", "5");
const held = status("VmRSS");
call(); // warm-up: compiles the code and grows the heap
const start = process.hrtime.bigint();
const [simplified] = call();
const seconds = Number(process.hrtime.bigint() - start) / 1e9;
const peak = Math.max(0, status("VmHWM") - held);
writeFileSync(output, new Uint8Array(simplified.buffer, simplified.byteOffset, simplified.byteLength));
console.log(JSON.stringify({ seconds, peak }));
