// SPDX-License-Identifier: GPL-3.0-or-later
// A level as buffers for drawing: triangles by material, normals; and what is new of positions, UVs and colours.

const bits = new Int32Array(1);
const float = new Float32Array(bits.buffer);
const real = (word) => {
  bits[0] = word < 0 ? word & 0x7fffffff : ~word;
  return float[0];
};
const linear = (byte) => (byte <= 10.31475 ? byte / 3294.6 : ((byte / 255 + 0.055) / 1.055) ** 2.4);

/** Picks what is drawn of a mesh's attributes, and keeps what the page already has. */
export class Picture {
  constructor(mesh) {
    this.mesh = mesh;
    this.sent = 0; // wedges that the page has
    const find = (domains, test) => mesh.attributes.find((one) => domains.includes(one.domain) && !one.name.startsWith('.') && test(one));
    const meta = mesh.head.meta ?? {};
    const active = (name) => (one) => !name || one.name === name;
    const isUv = (one) => one.kind === 'f' && one.size === 4 && one.components === 2;
    const isColour = (one) => one.components === 4 && ((one.kind === 'f' && one.size === 4) || (one.kind === 'u' && one.size === 1));
    const corner = ['corner'];
    const both = ['corner', 'vertex'];
    this.uv = find(corner, (one) => isUv(one) && active(meta.uv)(one)) ?? find(corner, isUv);
    this.colour = find(both, (one) => isColour(one) && active(meta.color)(one)) ?? find(both, isColour);
    this.normal = mesh.attributes.find((one) => one.domain === 'corner' && one.name === '.normals' && one.components === 3);
    this.material = find(['face'], (one) => one.name === 'material_index' && one.columns.length === 1);
    this.flat = find(['face'], (one) => one.name === 'sharp_face' && one.columns.length === 1);
    this.faceColumns = [this.material, this.flat].map((one) => one?.columns[0]);
  }

  /** What the page has to change for the level with so many places. */
  take(places, wire) {
    const { mesh } = this;
    const limit = mesh.starts ? mesh.starts[places] : places;
    const faces = mesh.facesAfter[places - 1] ?? 0;
    const { index, groups } = this.triangles(limit, faces);
    const out = { index, groups, places, faces: index.length / 3, first: this.sent };
    if (!this.normal) out.normals = this.normals(index, limit);
    if (wire) out.wire = wireOf(index);
    if (limit > this.sent) {
      Object.assign(out, this.fresh(this.sent, limit));
      this.sent = limit;
    }
    return out;
  }

  /** The level's corners as wedges, sorted by material slot; and the groups: [first corner, count, slot, flat]. */
  triangles(limit, faces) {
    const { mesh } = this;
    const ancestor = new Int32Array(mesh.wedgeCount);
    for (let w = 0; w < limit; w++) ancestor[w] = w;
    for (let w = limit; w < ancestor.length; w++) ancestor[w] = ancestor[mesh.wedgeParents[w]];
    const extra = mesh.head.extra;
    const total = extra + faces;
    const [material, flat] = this.faceColumns;
    const keys = material || flat ? new Int32Array(total) : null;
    const counts = [];
    for (let face = 0; keys && face < total; face++) {
      // words of floats apart, small whole numbers are stored as they are; slots below 0 are none
      const slot = material ? Math.max(0, Math.min(this.slot(material[face]), 255)) : 0;
      keys[face] = 2 * slot + (flat ? flat[face] & 1 : 0);
      counts[keys[face]] = (counts[keys[face]] ?? 0) + 1;
    }
    const groups = [];
    const place = [];
    let at = 0;
    counts.forEach((count, key) => {
      groups.push([at, 3 * count, key >> 1, key & 1]);
      place[key] = at;
      at += 3 * count;
    });
    if (!keys) groups.push([0, 3 * total, 0, 0]);
    const index = new Uint32Array(3 * total);
    const { turned } = mesh;
    for (let face = 0; face < total; face++) {
      const [from, f] = face < extra ? [mesh.extraWedges, face] : [mesh.wedges, face - extra];
      const to = keys ? place[keys[face]] : 3 * face;
      if (keys) place[keys[face]] = to + 3;
      const swap = turned && face >= extra ? turned[f] : 0;
      index[to] = ancestor[from[3 * f]];
      index[to + 1 + swap] = ancestor[from[3 * f + 1]];
      index[to + 2 - swap] = ancestor[from[3 * f + 2]];
    }
    return { index, groups };
  }

  slot(word) {
    const { size } = this.material;
    return size === 1 ? (word << 24) >> 24 : size === 2 ? (word << 16) >> 16 : word;
  }

  /** Normals of vertices, weighted by area; of 16 bits. Wedges of a place share theirs. */
  normals(index, limit) {
    const { positions } = this.mesh;
    const place = this.placeOf(limit);
    const at = (wedge) => (place ? 3 * place[wedge] : 3 * wedge);
    const sum = new Float32Array(place ? 3 * this.mesh.places : 3 * limit);
    for (let i = 0; i < index.length; i += 3) {
      const a = at(index[i]);
      const b = at(index[i + 1]);
      const c = at(index[i + 2]);
      const ux = positions[b] - positions[a];
      const uy = positions[b + 1] - positions[a + 1];
      const uz = positions[b + 2] - positions[a + 2];
      const vx = positions[c] - positions[a];
      const vy = positions[c + 1] - positions[a + 1];
      const vz = positions[c + 2] - positions[a + 2];
      const x = uy * vz - uz * vy;
      const y = uz * vx - ux * vz;
      const z = ux * vy - uy * vx;
      sum[a] += x;
      sum[a + 1] += y;
      sum[a + 2] += z;
      sum[b] += x;
      sum[b + 1] += y;
      sum[b + 2] += z;
      sum[c] += x;
      sum[c + 1] += y;
      sum[c + 2] += z;
    }
    const out = new Int16Array(4 * limit);
    for (let wedge = 0; wedge < limit; wedge++) {
      const from = at(wedge);
      const scale = 32767 / (Math.sqrt(sum[from] ** 2 + sum[from + 1] ** 2 + sum[from + 2] ** 2) || 1);
      out[4 * wedge] = sum[from] * scale;
      out[4 * wedge + 1] = sum[from + 1] * scale;
      out[4 * wedge + 2] = sum[from + 2] * scale;
    }
    return out;
  }

  /** The place of each wedge; null where they are the same. */
  placeOf(limit) {
    const { starts, places } = this.mesh;
    if (!starts) return null;
    this.places ??= new Int32Array(this.mesh.wedgeParents.length);
    for (let place = this.placed ?? 0; place < places; place++) this.places.fill(place, starts[place], starts[place + 1]);
    this.placed = places;
    return this.places.subarray(0, limit);
  }

  /** Positions and attributes of wedges from `first` to `last`. */
  fresh(first, last) {
    const { mesh } = this;
    const place = this.placeOf(last);
    if (!place) this.rows = null;
    const positions = place ? new Float32Array(3 * (last - first)) : mesh.positions.slice(3 * first, 3 * last);
    for (let w = first; place && w < last; w++) {
      for (let axis = 0; axis < 3; axis++) positions[3 * (w - first) + axis] = mesh.positions[3 * place[w] + axis];
    }
    // what is not a number would spoil the whole picture
    for (let i = 0; i < positions.length; i++) if (!Number.isFinite(positions[i])) positions[i] = 0;
    const out = { positions };
    const values = (attribute, read, width) => {
      const array = new Float32Array(width * (last - first));
      for (let w = first; w < last; w++) {
        const row = attribute.domain === 'vertex' && mesh.wedgeVertex ? mesh.wedgeVertex[w] : w;
        for (let i = 0; i < width; i++) {
          const value = read(attribute.columns[i][row], i);
          array[width * (w - first) + i] = Number.isFinite(value) ? value : 0;
        }
      }
      return array;
    };
    if (this.uv) out.uvs = values(this.uv, real, 2);
    if (this.normal) out.custom = values(this.normal, real, 3);
    if (this.colour) out.colours = values(this.colour, this.colour.kind === 'f' ? real : linear, 3);
    return out;
  }
}

/** Lines of all triangles' sides. */
function wireOf(index) {
  const out = new Uint32Array(2 * index.length);
  for (let i = 0, at = 0; i < index.length; i += 3) {
    for (let row = 0; row < 3; row++) {
      out[at++] = index[i + row];
      out[at++] = index[i + ((row + 1) % 3)];
    }
  }
  return out;
}
