// SPDX-License-Identifier: GPL-3.0-or-later
// A mesh on its way up: places, faces, wedges and attributes, grown block by block.
import { Columns } from './columns.js';
import { StreamError, inflate } from './container.js';
import { Coder } from './coder.js';
import { Connectivity } from './batch.js';
import { Positions } from './positions.js';

const DOMAINS = ['vertex', 'corner', 'face', 'side', 'edge'];
const damaged = (what) => new StreamError(`The file is damaged: ${what}.`);

export class Mesh {
  /** `head`: the mesh's entry of the header. `room`: { places, faces } that its arrays shall hold. */
  constructor(head, room) {
    this.head = head;
    const n = room.places;
    const m = room.faces;
    this.wedged = head.needs.includes('wedges');
    this.turned = head.needs.includes('turned') ? new Uint8Array(m) : null;
    const w = this.wedged ? head.wedges : n;
    this.points = new Int32Array(4 * n); // on the grid of predictions; the fourth number is for `Fan`
    this.positions = new Float32Array(3 * n);
    this.positionBits = new Int32Array(this.positions.buffer); // a signalling NaN must keep its bits
    this.faces = new Int32Array(3 * m); // places, face by face
    this.parents = new Int32Array(n).fill(-1);
    this.facesAfter = new Int32Array(n); // faces once each place is there
    this.starts = this.wedged ? new Int32Array(n + 1) : null;
    this.wedges = this.wedged ? new Int32Array(3 * m) : this.faces; // of each corner
    this.wedgeParents = this.wedged ? new Int32Array(w).fill(-1) : this.parents;
    this.wedgeVertex = this.wedged ? new Int32Array(w) : null;
    this.places = this.faceCount = this.wedgeCount = this.vertexCount = 0;
    this.extra = new Int32Array(3 * head.extra);
    this.extraWedges = this.wedged ? new Int32Array(3 * head.extra) : this.extra;
    this.edges = new Int32Array(2 * head.edges);
    this.attributes = head.attributes.map((entry) => this.attribute(entry, { w, m: m + head.extra }));
    this.plain = !this.wedged && !this.turned && !this.attributes.length; // batches without columns
    this.connectivity = new Connectivity(n);
    this.geometry = new Positions(head.grid);
  }

  attribute([domain, name, dtype, shape], { w, m }) {
    const kind = /^[<|]([biuf])([1248])$/.exec(dtype);
    if (!kind || !DOMAINS.includes(domain) || shape.length > 1) throw damaged('an attribute is of no known kind');
    const size = Number(kind[2]);
    const width = Math.min(size, 4);
    const components = shape.length ? shape[0] : 1;
    const items = components * (domain === 'side' ? 3 : 1) * (size / width);
    const rows = { vertex: this.head.vertices, corner: w, face: m, side: m, edge: this.head.edges }[domain];
    const columns = Array.from({ length: items }, () => new Int32Array(rows));
    return { domain, name, kind: kind[1], size, width, components, columns };
  }

  /** Read the base block. */
  async base(bytes, places, faces) {
    const states = 4 * this.head.lanes;
    this.coder = new Coder(bytes.subarray(bytes.length - states));
    const columns = new Columns(await inflate(bytes.subarray(0, bytes.length - states)));
    for (let axis = 0; axis < 3; axis++) {
      const numbers = columns.running(4, places);
      for (let i = 0; i < places; i++) this.geometry.place(this, i, axis, numbers[i]);
    }
    this.readFaces(columns, this.faces, faces, places);
    this.readFaces(columns, this.extra, this.head.extra, places);
    this.places = places;
    this.faceCount = faces;
    this.facesAfter.fill(faces, 0, places);
    this.connectivity.base(this.faces, faces);
    this.readPlaces(columns, 0);
    const corners = Int32Array.from({ length: 3 * (this.head.extra + faces) }, (_, at) => at - 3 * this.head.extra);
    this.readWedges(columns, corners);
    this.readFaceValues(columns, new Int32Array(this.head.extra + faces), 0);
    const edge = columns.running(4, this.head.edges);
    const other = columns.deltas(4, this.head.edges);
    for (let i = 0; i < edge.length; i++) this.edges.set([edge[i], edge[i] + other[i]], 2 * i);
    this.readValues(columns, 'edge', 0, edge.length);
  }

  readFaces(columns, out, count, places) {
    const first = columns.running(4, count);
    for (let i = 0; i < count; i++) out[3 * i] = first[i];
    for (let row = 1; row < 3; row++) {
      const delta = columns.deltas(4, count);
      for (let i = 0; i < count; i++) out[3 * i + row] = first[i] + delta[i];
    }
    for (let i = 0; i < 3 * count; i++) if (out[i] >>> 0 >= places) throw damaged('a face names no vertex');
  }

  /** Read a batch and carry it out. */
  async batch(bytes, places, faces) {
    const [symbols, plain] = new Uint32Array(bytes.slice(0, 8).buffer);
    const end = 8 + symbols + plain;
    if (!(end <= bytes.length) || plain % 4 || symbols % 2) throw damaged("a batch's parts do not fit");
    const raw = this.plain ? null : await inflate(bytes.subarray(end));
    this.coder.feed(bytes.subarray(8, 8 + symbols), bytes.subarray(8 + symbols, end));
    const [first, firstFace] = [this.places, this.faceCount];
    const done = this.connectivity.batch(this, places, faces);
    if (this.places !== places || this.faceCount !== faces) throw damaged('a batch holds other counts than its table');
    if (this.plain) {
      this.vertexCount = this.wedgeCount = places;
      return;
    }
    const columns = new Columns(raw);
    this.readPlaces(columns, first);
    const corners = new Int32Array(done.moved.length + 3 * (faces - firstFace));
    corners.set(done.moved);
    for (let i = done.moved.length, at = 3 * firstFace; i < corners.length; i++, at++) corners[i] = at;
    this.readWedges(columns, corners);
    this.readFaceValues(columns, done.beside, this.head.extra + firstFace);
  }

  /** Wedges of the places from `first` on, and the attributes of their vertices and wedges. */
  readPlaces(columns, first) {
    const last = this.places;
    const begin = this.wedgeCount;
    const { starts, parents, wedgeParents, wedgeVertex } = this;
    const seen = this.vertexCount;
    if (!this.wedged) {
      this.wedgeCount = this.vertexCount = last;
      this.readValues(columns, 'corner', begin, last, parents);
      this.readValues(columns, 'vertex', begin, last, parents);
      return;
    }
    const counts = columns.deltas(4, last - first);
    for (let place = first; place < last; place++) {
      starts[place + 1] = starts[place] + counts[place - first] + 1;
      if (!(starts[place + 1] > starts[place] && starts[place + 1] <= this.head.wedges)) throw damaged('too many wedges');
    }
    const end = starts[last];
    const several = [];
    for (let place = first; place < last; place++) {
      const parent = parents[place];
      const many = parent >= 0 && starts[parent + 1] - starts[parent] > 1;
      for (let wedge = starts[place]; wedge < starts[place + 1]; wedge++) {
        wedgeParents[wedge] = parent < 0 ? -1 : starts[parent];
        if (many) several.push(wedge);
      }
    }
    const local = columns.deltas(4, several.length);
    several.forEach((wedge, i) => (wedgeParents[wedge] += local[i]));
    const inner = columns.deltas(1, end - begin - (last - first));
    const fresh = [];
    for (let place = first, at = 0; place < last; place++) {
      for (let wedge = starts[place]; wedge < starts[place + 1]; wedge++) {
        if (wedge === starts[place] || (1 + inner[at++]) & 1) fresh.push(wedge);
        wedgeVertex[wedge] = seen + fresh.length - 1;
      }
    }
    this.wedgeCount = end;
    this.vertexCount = seen + fresh.length;
    if (this.vertexCount > this.head.vertices) throw damaged('too many vertices');
    // a value is expected to be that of the wedge it merges into, and another wedge's that of the one before
    const source = (wedge) => (wedgeParents[wedge] < 0 ? wedge - 1 : wedgeParents[wedge]);
    const own = new Int32Array(end);
    for (let wedge = begin; wedge < end; wedge++) own[wedge] = source(wedge);
    this.readValues(columns, 'corner', begin, end, own);
    const ofVertex = new Int32Array(this.vertexCount);
    fresh.forEach((wedge, i) => (ofVertex[seen + i] = own[wedge] < 0 ? -1 : wedgeVertex[own[wedge]]));
    this.readValues(columns, 'vertex', seen, this.vertexCount, ofVertex);
  }

  /** Wedges of corners, by their places in `faces`; negative ones are those of the faces beside the splits. */
  readWedges(columns, corners) {
    if (!this.wedged) return;
    const { starts, faces, wedges, extra, extraWedges } = this;
    const place = (at) => (at < 0 ? extra[extra.length + at] : faces[at]);
    let largest = 1;
    const several = [];
    for (const at of corners) {
      const p = place(at);
      const size = starts[p + 1] - starts[p];
      if (at < 0) extraWedges[extra.length + at] = starts[p];
      else wedges[at] = starts[p];
      if (size > 1) several.push(at);
      if (size > largest) largest = size;
    }
    const width = largest <= 256 ? 1 : 4;
    const local = columns.deltas(width, several.length);
    several.forEach((at, i) => {
      const number = width === 1 ? local[i] & 255 : local[i];
      if (number >>> 0 >= starts[place(at) + 1] - starts[place(at)]) throw damaged('a corner has no such wedge');
      if (at < 0) extraWedges[extra.length + at] += number;
      else wedges[at] += number;
    });
  }

  readFaceValues(columns, beside, first) {
    const last = first + beside.length;
    const source = new Int32Array(last);
    source.set(beside, first);
    this.readValues(columns, 'face', first, last, source);
    this.readValues(columns, 'side', first, last, source);
    if (!this.turned) return;
    const extra = this.head.extra;
    const turned = columns.deltas(1, Math.max(last - extra, 0) - Math.max(first - extra, 0));
    for (let i = 0; i < turned.length; i++) this.turned[Math.max(first - extra, 0) + i] = turned[i] & 1;
  }

  /** Rows `first` to `last` of a domain's attributes; each expects the value of its source row. */
  readValues(columns, domain, first, last, source) {
    for (const attribute of this.attributes) {
      if (attribute.domain !== domain) continue;
      const { width } = attribute;
      const mask = width === 4 ? -1 : (1 << (8 * width)) - 1;
      for (const column of attribute.columns) {
        if (!first) {
          column.set(columns.running(width, last));
          continue;
        }
        const delta = columns.deltas(width, last - first);
        for (let row = first; row < last; row++) {
          const at = source[row]; // what is in the block itself is not known yet
          column[row] = (delta[row - first] + column[at >= 0 && at < first ? at : 0]) & mask;
        }
      }
    }
  }
}
