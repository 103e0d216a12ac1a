// SPDX-License-Identifier: GPL-3.0-or-later
// The picture: buffers of the meshes' levels, objects, materials, light and camera.
import {
  Box3, BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, Group, HemisphereLight, LineBasicMaterial,
  LineSegments, Matrix4, Mesh, MeshStandardMaterial, PerspectiveCamera, Scene, Sphere, Frustum, Vector3, WebGLRenderer,
  DataTexture, NearestFilter, RepeatWrapping, SRGBColorSpace,
} from './three.module.js';
import { Orbit } from './orbit.js';

const CLAY = 0xb9bfc9;

export class View {
  /** `drawn` is called after each picture; `moved` when the camera has moved. */
  constructor(canvas, { drawn, moved, below }) {
    this.canvas = canvas;
    this.drawn = drawn;
    this.below = below; // gives the pixels that are covered at the bottom
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true, powerPreference: 'high-performance' });
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(35, 1, 0.1, 100);
    this.root = new Group();
    this.scene.add(this.root, this.camera);
    this.sky = new HemisphereLight(0xffffff, 0x8d8f9c, 1.1);
    this.scene.add(this.sky);
    for (const [x, y, z, strength] of [[-1, 1.4, 1.2, 2.1], [1.6, 0.3, 0.6, 0.7], [0.2, 0.6, -1.4, 0.9]]) {
      const lamp = new DirectionalLight(0xffffff, strength);
      lamp.position.set(x, y, z);
      this.camera.add(lamp, lamp.target);
    }
    this.orbit = new Orbit(canvas, () => {
      this.redraw();
      moved();
    });
    this.orbit.fov = this.camera.fov;
    this.meshes = [];
    this.show = { wire: false, colours: 'material', shading: 'smooth' };
    this.lines = new LineBasicMaterial({ color: 0x18202c, transparent: true, opacity: 0.45 });
    this.resizer = new ResizeObserver(() => this.resize());
    this.resizer.observe(canvas);
    canvas.addEventListener('webglcontextrestored', () => this.redraw());
  }

  /** Make room for the meshes that the header names. */
  open(meshes, meta) {
    this.meta = meta;
    this.meshes = meshes.map((mesh) => ({ ...mesh, geometry: new BufferGeometry(), objects: [], faces: 0, box: new Box3() }));
    const plain = meshes.map((_, mesh) => ({ mesh, matrix: null }));
    for (const object of meta.objects?.length ? meta.objects : plain) {
      const own = this.meshes[object.mesh];
      const node = new Mesh(own.geometry, []);
      node.name = object.name ?? '';
      node.frustumCulled = false;
      if (object.matrix) node.matrix.set(...object.matrix);
      node.matrixAutoUpdate = false;
      node.slots = object.materials ?? own.meta.materials ?? [];
      own.objects.push(node);
      this.root.add(node);
    }
  }

  /** Turn the scene's up into the picture's: 'z' or 'y'. */
  turnUp(up) {
    this.root.rotation.x = up === 'y' ? 0 : -Math.PI / 2;
    this.root.updateMatrixWorld(true);
    if (this.framed) this.frame();
  }

  /** Take a mesh's new level over into the buffers. */
  apply(change) {
    const mesh = this.meshes[change.mesh];
    const { geometry } = mesh;
    const wedges = mesh.wedges;
    this.fill(geometry, 'position', change.positions, 3, wedges, change.first);
    if (change.positions) this.grow(mesh, change.positions);
    this.fill(geometry, 'normal', change.normals, 4, wedges, 0, true);
    this.fill(geometry, 'normal', change.custom, 3, wedges, change.first);
    this.fill(geometry, 'uv', change.uvs, 2, wedges, change.first);
    this.fill(geometry, 'color', change.colours, 3, wedges, change.first);
    this.fillIndex(geometry, change.index, 3 * (mesh.room.faces + mesh.extra));
    mesh.faces = change.faces;
    mesh.places = change.places;
    geometry.clearGroups();
    geometry.setDrawRange(0, change.index.length);
    change.groups.forEach(([start, count], number) => geometry.addGroup(start, count, number));
    for (const node of mesh.objects) {
      node.groups = change.groups;
      node.material = change.groups.map(([, , slot, flat]) => this.material(mesh, node.slots[slot], flat));
    }
    if (change.wire) this.wireOf(mesh, change.wire);
    this.redraw();
  }

  /** Write into a buffer of an attribute from one row on; all levels share it, so it is only ever added to. */
  fill(geometry, name, array, size, rows, first, normalized = false) {
    if (!array) return;
    let attribute = geometry.getAttribute(name);
    if (!attribute) {
      attribute = new BufferAttribute(new array.constructor(size * rows), size, normalized);
      geometry.setAttribute(name, attribute);
    }
    attribute.array.set(array, size * first);
    attribute.addUpdateRange(size * first, array.length);
    attribute.needsUpdate = true;
  }

  fillIndex(geometry, index, room) {
    if (!geometry.index) geometry.setIndex(new BufferAttribute(new Uint32Array(room), 1));
    geometry.index.array.set(index);
    geometry.index.addUpdateRange(0, index.length);
    geometry.index.needsUpdate = true;
  }

  wireOf(mesh, index) {
    const faces = 6 * (mesh.room.faces + mesh.extra);
    mesh.wire ??= new BufferGeometry();
    for (const name of Object.keys(mesh.geometry.attributes)) mesh.wire.setAttribute(name, mesh.geometry.attributes[name]);
    this.fillIndex(mesh.wire, index, faces);
    mesh.wire.setDrawRange(0, index.length);
    for (const node of mesh.objects) {
      if (node.lines) continue;
      node.lines = new LineSegments(mesh.wire, this.lines);
      node.lines.frustumCulled = false;
      node.add(node.lines);
    }
  }

  /** The material of a slot; made once for each look. */
  material(mesh, number, flat) {
    const { colours, wire, shading } = this.show;
    const given = this.meta.materials?.[number];
    const painted = colours !== 'plain' && mesh.geometry.hasAttribute('color') && colours !== 'uv';
    const isFlat = shading === 'flat' || Boolean(flat);
    const checked = colours === 'uv' && mesh.geometry.hasAttribute('uv');
    const key = [given && colours === 'material' ? number : '-', painted, isFlat, checked, wire].join();
    this.made ??= new Map();
    if (!this.made.has(key)) {
      const color = new Color(CLAY);
      if (painted || checked) color.set(0xffffff);
      if (given?.color && colours === 'material') color.setRGB(...given.color.slice(0, 3));
      const alpha = colours === 'material' ? given?.color?.[3] ?? 1 : 1;
      this.made.set(key, new MeshStandardMaterial({
        color, roughness: 0.62, side: DoubleSide, flatShading: isFlat, vertexColors: painted, map: checked ? checker() : null,
        transparent: alpha < 1, opacity: alpha, polygonOffset: wire, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
      }));
    }
    return this.made.get(key);
  }

  /** Change how meshes are shown: { wire, colours, shading }. */
  look(show) {
    Object.assign(this.show, show);
    for (const mesh of this.meshes) {
      for (const node of mesh.objects) {
        if (node.lines) node.lines.visible = this.show.wire;
        if (node.groups) node.material = node.groups.map(([, , slot, flat]) => this.material(mesh, node.slots[slot], flat));
      }
    }
    this.redraw();
  }

  /** Lines and shadow side for a dark or a light page. */
  theme(dark) {
    this.sky.groundColor.set(dark ? 0x3d414d : 0x8d8f9c);
    this.sky.intensity = dark ? 0.9 : 1.15;
    this.redraw();
  }

  grow(mesh, positions) {
    const point = new Vector3();
    for (let i = 0; i < positions.length; i += 3) mesh.box.expandByPoint(point.fromArray(positions, i));
  }

  /** Look at all that is there, as far as it is known by now. */
  frame() {
    const all = this.bounds();
    if (all.isEmpty()) return;
    const ball = all.getBoundingSphere(new Sphere());
    this.ball = ball;
    this.framed = true;
    this.orbit.frame(ball.center.toArray(), ball.radius || 1);
  }

  bounds() {
    this.root.updateMatrixWorld(true);
    const all = new Box3();
    for (const mesh of this.meshes) {
      for (const node of mesh.objects) if (!mesh.box.isEmpty()) all.union(mesh.box.clone().applyMatrix4(node.matrixWorld));
    }
    return all;
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    // the middle of what the bar leaves free
    const shift = Math.min(this.below(), 0.5 * height);
    this.camera.setViewOffset(width, height, 0, shift / 2, width, height);
    this.orbit.free = (height - shift) / height;
    if (this.ball && !this.sized) this.orbit.frame(this.ball.center.toArray(), this.ball.radius || 1);
    this.redraw();
  }

  aim() {
    const { camera, orbit } = this;
    camera.position.fromArray(orbit.position());
    camera.up.fromArray(orbit.axes()[1]);
    camera.lookAt(...orbit.target);
    const far = orbit.distance + 4 * orbit.radius;
    camera.near = Math.max(orbit.distance - 3 * orbit.radius, far / 5000);
    camera.far = far;
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld(true);
  }

  /** What the camera sees of each mesh: { visible, scale }, scale in pixels a unit at its nearest point. */
  views() {
    this.aim();
    const { camera } = this;
    const frustum = new Frustum().setFromProjectionMatrix(
      new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse));
    const pixels = (this.canvas.clientHeight * Math.min(window.devicePixelRatio || 1, 2)) / (2 * Math.tan((camera.fov * Math.PI) / 360));
    return this.meshes.map((mesh) => {
      const view = { visible: mesh.box.isEmpty(), scale: 0 };
      for (const node of mesh.box.isEmpty() ? [] : mesh.objects) {
        const box = mesh.box.clone().applyMatrix4(node.matrixWorld);
        // a coarse level may be smaller than the whole
        if (!frustum.intersectsBox(box.clone().expandByScalar(0.05 * box.getSize(new Vector3()).length()))) continue;
        view.visible = true;
        const distance = Math.max(box.distanceToPoint(camera.position), camera.near);
        view.scale = Math.max(view.scale, (node.matrixWorld.getMaxScaleOnAxis() * pixels) / distance);
      }
      return view;
    });
  }

  redraw() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame((time) => {
      this.asked = false;
      if (!this.canvas.clientWidth) return;
      this.aim();
      this.renderer.render(this.scene, this.camera);
      this.drawn(time);
    });
  }
}

let made;

/** A chequered texture that shows a UV map. */
function checker() {
  if (made) return made;
  const bytes = new Uint8Array(4 * 64).map((_, i) => {
    const [x, y] = [(i >> 2) & 7, i >> 5];
    const light = (x + y) & 1;
    return [light ? 235 : 90 + 12 * x, light ? 238 : 110, light ? 242 : 90 + 12 * y, 255][i & 3];
  });
  made = new DataTexture(bytes, 8, 8);
  made.magFilter = NearestFilter;
  made.colorSpace = SRGBColorSpace;
  made.wrapS = made.wrapT = RepeatWrapping;
  made.repeat.set(4, 4);
  made.needsUpdate = true;
  return made;
}
