// SPDX-License-Identifier: GPL-3.0-or-later
// A mesh on its way up: places, faces, wedges and attributes, grown block by block.
import { makeSplits, split } from './batch.js';
import { makeColumns } from './columns.js';
import { check, inflate } from './container.js';
import { makeGrid, put } from './positions.js';

/** `head`: the mesh's entry of the header. `room`: { places, faces } that its arrays shall hold. */
export function makeMesh(head, room) {
  const n = room.places;
  const m = room.faces + head.extra;
  const wedged = head.needs.includes('wedges');
  const w = wedged ? head.wedges : n;
  const same = new Int32Array(n + 1).map((_, at) => at);
  const ints = (count) => new Int32Array(count);
  const positions = new Float32Array(3 * n);
  const faces = ints(3 * m);
  const parents = ints(n).fill(-1);
  const rows = { vertex: head.vertices, corner: w, face: m, side: m, edge: head.edges };
  return {
    head, wedged, positions, faces, parents, // faces have places; those beside the splits come first
    positionBits: new Int32Array(positions.buffer), // a signalling NaN must keep its bits
    points: ints(4 * n), // on the grid of predictions; the fourth number is for `link`
    facesAfter: ints(n), // faces once each place is there
    // wedges of each place, of each corner; where there are none, places are their wedges, and these their vertices
    starts: wedged ? ints(n + 1) : same,
    wedges: wedged ? ints(3 * m) : faces,
    wedgePlace: wedged ? ints(w) : same,
    wedgeVertex: wedged ? ints(w) : same,
    wedgeParents: wedged ? ints(w).fill(-1) : parents,
    turned: head.needs.includes('turned') ? new Uint8Array(m) : null,
    edges: ints(2 * head.edges),
    attributes: head.attributes.map((entry) => makeAttribute(entry, rows)),
    places: 0, faceCount: 0, wedgeCount: 0, vertexCount: 0,
    grid: makeGrid(head.grid),
    splits: null,
  };
}

/** Read the base block. */
export async function base(mesh, bytes, places, count) {
  const { head, faces, edges } = mesh;
  const states = bytes.length - 4 * head.lanes;
  const columns = makeColumns(await inflate(bytes.subarray(0, states)));
  const [deltas, running] = columns;
  for (let axis = 0; axis < 3; axis++) running(4, places).forEach((number, place) => put(mesh, place, axis, number));
  const readPairs = (out, at, step, number, rows) => {
    const first = running(4, number);
    first.forEach((value, i) => (out[at + step * i] = value));
    for (let row = 1; row < rows; row++) deltas(4, number).forEach((delta, i) => (out[at + step * i + row] = first[i] + delta));
  };
  readPairs(faces, 3 * head.extra, 3, count, 3);
  readPairs(faces, 0, 3, head.extra, 3);
  mesh.places = places;
  mesh.faceCount = head.extra + count;
  check(faces.subarray(0, 3 * mesh.faceCount).every((place) => place >>> 0 < places));
  mesh.facesAfter.fill(mesh.faceCount, 0, places);
  mesh.splits = makeSplits(mesh, bytes.subarray(states));
  readPlaces(mesh, columns, 0);
  readWedges(mesh, columns, null, 0);
  readFaceValues(mesh, columns, 0, new Int32Array(mesh.faceCount));
  readPairs(edges, 0, 2, head.edges, 2);
  readValues(mesh, columns, 'edge', 0, new Int32Array(head.edges));
}

/** Read a batch and carry it out. */
export async function batch(mesh, bytes, places, count) {
  const [symbols, plain] = new Uint32Array(bytes.slice(0, 8).buffer);
  const end = 8 + symbols + plain;
  check(end <= bytes.length && plain % 4 === 0 && symbols % 2 === 0);
  const { places: first, faceCount: firstFace } = mesh;
  const columns = makeColumns(await inflate(bytes.subarray(end)));
  const arcs = split(mesh, bytes.subarray(8, 8 + symbols), bytes.subarray(8 + symbols, end), places, count + mesh.head.extra);
  readPlaces(mesh, columns, first);
  readWedges(mesh, columns, arcs, firstFace);
  readFaceValues(mesh, columns, firstFace, arcs.besides);
}

function makeAttribute([domain, name, dtype, shape], rows) {
  const known = /^[<|]([biuf])([1248])$/.exec(dtype);
  check(known && domain in rows && shape.length < 2);
  const size = Number(known[2]);
  const width = Math.min(size, 4);
  const components = shape[0] ?? 1;
  const items = components * (domain === 'side' ? 3 : 1) * (size / width);
  return {
    domain, name, components, width, type: known[1] + size,
    columns: Array.from({ length: items }, () => new Int32Array(rows[domain])),
  };
}

/** The corners of all arcs as their wedges are stored: the first of each split, then the second, and so on. */
function stepByStep({ length, begin, corner }) {
  const steps = [];
  length.forEach((count, i) => {
    for (let step = 0; step < count; step++) (steps[step] ??= []).push(corner[begin[i] + step]);
  });
  return steps.flat();
}

/** Wedges of the places from `first` on, and the attributes of their vertices and wedges. */
function readPlaces(mesh, columns, first) {
  const { starts, parents, wedgeParents, wedgeVertex, wedgePlace, places } = mesh;
  const [deltas] = columns;
  const begin = mesh.wedgeCount;
  const seen = mesh.vertexCount;
  let sources = wedgeParents.subarray(first, places); // of the new vertices
  if (mesh.wedged) {
    const several = [];
    deltas(4, places - first).forEach((more, i) => {
      const place = first + i;
      const at = starts[place];
      const end = at + more + 1;
      check(end > at && end <= wedgePlace.length);
      starts[place + 1] = end;
      const parent = parents[place];
      for (let wedge = at; wedge < end; wedge++) {
        wedgePlace[wedge] = place;
        if (parent < 0) continue;
        wedgeParents[wedge] = starts[parent];
        if (starts[parent + 1] > starts[parent] + 1) several.push(wedge);
      }
    });
    deltas(4, several.length).forEach((delta, i) => (wedgeParents[several[i]] += delta));
    const end = starts[places];
    const inner = deltas(1, end - begin - (places - first));
    sources = [];
    for (let wedge = begin, at = 0; wedge < end; wedge++) {
      const isFirst = wedge === starts[wedgePlace[wedge]];
      if (isFirst || (1 + inner[at++]) & 1) sources.push(wedgeVertex[wedgeParents[wedge]]);
      wedgeVertex[wedge] = seen + sources.length - 1;
    }
  }
  mesh.wedgeCount = starts[places];
  mesh.vertexCount = seen + sources.length;
  check(mesh.vertexCount <= mesh.head.vertices);
  readValues(mesh, columns, 'corner', begin, wedgeParents.subarray(begin, mesh.wedgeCount));
  readValues(mesh, columns, 'vertex', seen, sources);
}

/** Wedges of the arcs' corners, then of those of the faces from `firstFace` on. */
function readWedges({ wedged, starts, faces, wedges, faceCount }, [deltas], arcs, firstFace) {
  if (!wedged) return;
  const several = [];
  let width = 1;
  const look = (at) => {
    const begin = starts[faces[at]];
    const size = starts[faces[at] + 1] - begin;
    wedges[at] = begin;
    if (size > 1) several.push(at);
    if (size > 256) width = 4;
  };
  if (arcs) stepByStep(arcs).forEach(look);
  for (let at = 3 * firstFace; at < 3 * faceCount; at++) look(at);
  deltas(width, several.length).forEach((delta, i) => {
    const at = several[i];
    wedges[at] += width > 1 ? delta : delta & 255;
    check(wedges[at] >= starts[faces[at]] && wedges[at] < starts[faces[at] + 1]);
  });
}

function readFaceValues(mesh, columns, first, sources) {
  const { turned, faceCount, head } = mesh;
  readValues(mesh, columns, 'face', first, sources);
  readValues(mesh, columns, 'side', first, sources);
  const begin = Math.max(first, head.extra);
  if (turned) columns[0](1, faceCount - begin).forEach((delta, i) => (turned[begin + i] = delta & 1));
}

/** Rows of a domain's attributes from `first` on; each expects the value of its source row. */
function readValues({ attributes }, [deltas, running], domain, first, sources) {
  for (const attribute of attributes) {
    if (attribute.domain !== domain) continue;
    const { width } = attribute;
    const mask = width === 4 ? -1 : (1 << (8 * width)) - 1;
    for (const column of attribute.columns) {
      if (!first) {
        column.set(running(width, sources.length));
        continue;
      }
      // what is in the block itself is not known yet
      deltas(width, sources.length).forEach((delta, i) => {
        const from = sources[i] < first ? sources[i] : 0;
        column[first + i] = (delta + column[from]) & mask;
      });
    }
  }
}
