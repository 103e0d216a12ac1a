// SPDX-License-Identifier: GPL-3.0-or-later
// A level as buffers for drawing: triangles by material, normals; and what is new of positions, UVs and colours.

const float = new Float32Array(1);
const bits = new Int32Array(float.buffer);
const real = (word) => {
  bits[0] = word < 0 ? word & 0x7fffffff : ~word;
  return float[0];
};
const linear = (byte) => (byte <= 10.31475 ? byte / 3294.6 : ((byte / 255 + 0.055) / 1.055) ** 2.4);

/** A function that gives what the page has to change for the level with so many places, with lines of its triangles or not. */
export function makePicture(mesh) {
  const { head, starts, wedges, wedgePlace, wedgeVertex, wedgeParents, facesAfter, turned } = mesh;
  const { uv, color } = head.meta ?? {};
  const find = (domains, fits, name) => {
    const found = mesh.attributes.filter((one) => domains.includes(one.domain) && one.name[0] !== '.' && fits(one));
    return found.find((one) => one.name === name) ?? found[0];
  };
  const named = (domain, name) => mesh.attributes.find((one) => one.domain === domain && one.name === name);
  const uvs = find(['corner'], ({ type, components }) => type === 'f4' && components === 2, uv);
  const colours = find(['corner', 'vertex'], ({ type, components }) => ['f4', 'u1'].includes(type) && components === 4, color);
  const custom = named('corner', '.normals');
  const material = named('face', 'material_index')?.columns[0];
  const flat = named('face', 'sharp_face')?.columns[0];
  let sent = 0; // wedges that the page has

  /** The level's corners as wedges, sorted by material slot; and the groups: [first corner, count, slot, flat]. */
  function triangles(limit, faces) {
    const ancestor = new Int32Array(mesh.wedgeCount);
    for (let w = 0; w < ancestor.length; w++) ancestor[w] = w < limit ? w : ancestor[wedgeParents[w]];
    const keys = new Uint16Array(faces);
    const counts = [];
    for (let face = 0; face < faces; face++) {
      const slot = material ? Math.max(0, Math.min(material[face], 255)) : 0;
      const key = (keys[face] = 2 * slot + (flat ? flat[face] & 1 : 0));
      counts[key] = (counts[key] ?? 0) + 3;
    }
    const groups = [];
    const place = [];
    let end = 0;
    counts.forEach((count, key) => {
      groups.push([end, count, key >> 1, key & 1]);
      place[key] = end;
      end += count;
    });
    const index = new Uint32Array(end);
    for (let face = 0; face < faces; face++) {
      const to = place[keys[face]];
      const swap = turned ? turned[face] : 0;
      place[keys[face]] = to + 3;
      index[to] = ancestor[wedges[3 * face]];
      index[to + 1 + swap] = ancestor[wedges[3 * face + 1]];
      index[to + 2 - swap] = ancestor[wedges[3 * face + 2]];
    }
    return { index, groups };
  }

  /** Normals of vertices, weighted by area; of 16 bits. Wedges of a place share theirs. */
  function normals(index, limit) {
    const { positions, places } = mesh;
    const sum = new Float64Array(3 * places); // products of large or small numbers leave float32
    for (let i = 0; i < index.length; i += 3) {
      const a = 3 * wedgePlace[index[i]];
      const b = 3 * wedgePlace[index[i + 1]];
      const c = 3 * wedgePlace[index[i + 2]];
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
      const at = 3 * wedgePlace[wedge];
      const scale = 32767 / (Math.sqrt(sum[at] ** 2 + sum[at + 1] ** 2 + sum[at + 2] ** 2) || 1);
      for (let axis = 0; axis < 3; axis++) out[4 * wedge + axis] = sum[at + axis] * scale;
    }
    return out;
  }

  /** `width` floats for each wedge from the last that was sent up to `limit`; what is no number would spoil the whole picture. */
  function values(limit, width, read) {
    const out = new Float32Array(width * (limit - sent));
    for (let wedge = sent, at = 0; wedge < limit; wedge++) {
      for (let i = 0; i < width; i++) {
        const value = read(wedge, i);
        out[at++] = Number.isFinite(value) ? value : 0;
      }
    }
    return out;
  }

  const reader = ({ columns, domain }, decode) => (wedge, i) => decode(columns[i][domain === 'vertex' ? wedgeVertex[wedge] : wedge]);

  return (places, wire) => {
    const limit = starts[places];
    const { index, groups } = triangles(limit, facesAfter[places - 1] ?? 0);
    const buffers = []; // three's name, numbers a wedge, the first wedge, and the numbers
    const add = (name, width, read) => buffers.push([name, width, sent, values(limit, width, read)]);
    if (!custom) buffers.push(['normal', 4, 0, normals(index, limit)]);
    if (limit > sent) {
      add('position', 3, (wedge, axis) => mesh.positions[3 * wedgePlace[wedge] + axis]);
      if (uvs) add('uv', 2, reader(uvs, real));
      if (custom) add('normal', 3, reader(custom, real));
      if (colours) add('color', 3, reader(colours, colours.type === 'f4' ? real : linear));
      sent = limit;
    }
    return { index, groups, buffers, wire: wire && wireOf(index) };
  };
}

/** Lines of all triangles' sides. */
function wireOf(index) {
  return new Uint32Array(2 * index.length).map((_, at) => {
    const corner = (at + 1) >> 1;
    return index[at % 6 === 5 ? corner - 3 : corner];
  });
}
