// SPDX-License-Identifier: GPL-3.0-or-later
// The picture: buffers of the meshes' levels, objects, materials, light and camera.
import {
  Box3, BufferAttribute, BufferGeometry, Color, DataTexture, DirectionalLight, DoubleSide, Frustum, Group, HemisphereLight,
  LineBasicMaterial, LineSegments, Matrix4, Mesh, MeshPhongMaterial, PerspectiveCamera, RepeatWrapping, Scene, SRGBColorSpace,
  Vector3, WebGLRenderer,
} from './three.module.js';
import { makeOrbit } from './orbit.js';

const CLAY = 0xb9bfc9;
const LAMPS = [[-1, 1.4, 1.2, 2.1], [1.6, 0.3, 0.6, 0.7], [0.2, 0.6, -1.4, 0.9]]; // from where, how strong

/**
 * Draw on a canvas as `settings` say: { wire, colours, shading, up }. `drawn` is called after each picture, `look` when the camera has
 * moved, `say` with what is to be said; `below` gives the pixels that are covered at the bottom.
 */
export function makeView(canvas, settings, { drawn, look: moved, say, below }) {
  const renderer = new WebGLRenderer({ canvas, antialias: !isSoftware(), alpha: true, powerPreference: 'high-performance' });
  const scene = new Scene();
  const root = new Group();
  const camera = new PerspectiveCamera(35, 1, 0.1, 100);
  const lines = new LineBasicMaterial({ color: 0x18202c, transparent: true, opacity: 0.45 });
  const materials = new Map();
  const meshes = [];
  let given = []; // materials of the file
  let asked = false;
  scene.add(root, camera, new HemisphereLight(0xffffff, 0x6b6e7a, 1));
  for (const [x, y, z, strength] of LAMPS) {
    const lamp = new DirectionalLight(0xffffff, strength);
    lamp.position.set(x, y, z);
    camera.add(lamp, lamp.target);
  }
  const orbit = makeOrbit(canvas, camera, () => {
    redraw();
    moved();
  });
  const resizer = new ResizeObserver(resize);
  resizer.observe(canvas);
  canvas.addEventListener('webglcontextlost', () => say('The graphics card has given up the picture. It comes back when the browser allows.'));
  canvas.addEventListener('webglcontextrestored', () => {
    say('');
    redraw();
  });

  /** Make room for the meshes that the header names. */
  function open(head) {
    given = head.meta.materials ?? [];
    for (const mesh of head.meshes) {
      const [geometry, wire] = [new BufferGeometry(), new BufferGeometry()];
      wire.attributes = geometry.attributes;
      meshes.push({ ...mesh, geometry, wire, box: new Box3(), nodes: [], groups: [] });
    }
    const plain = meshes.map((_, mesh) => ({ mesh }));
    for (const object of head.meta.objects?.length ? head.meta.objects : plain) {
      const mesh = meshes[object.mesh];
      const node = new Mesh(mesh.geometry, []);
      node.name = object.name ?? '';
      node.matrixAutoUpdate = false;
      if (object.matrix) node.matrix.set(...object.matrix);
      node.slots = object.materials ?? mesh.meta.materials ?? [];
      node.add(new LineSegments(mesh.wire, lines));
      node.traverse((one) => { one.frustumCulled = false; });
      mesh.nodes.push(node);
      root.add(node);
    }
    look();
  }

  /** Take the meshes' new levels over into the buffers; null: as it is. All levels share them, so they are only ever added to. */
  function apply(changes) {
    changes.forEach((change, at) => {
      if (!change) return;
      const mesh = meshes[at];
      const { geometry, wire, wedges, corners, box } = mesh;
      for (const [name, size, first, array] of change.buffers) {
        if (!geometry.hasAttribute(name)) {
          const whole = array.BYTES_PER_ELEMENT < 4; // stands for parts of one
          geometry.setAttribute(name, new BufferAttribute(new array.constructor(size * wedges), size, whole));
        }
        put(geometry.getAttribute(name), array, size * first);
        if (name === 'position') box.union(new Box3().setFromArray(array));
      }
      putIndex(geometry, change.index, corners);
      if (change.wire) putIndex(wire, change.wire, 2 * corners);
      mesh.groups = change.groups;
      geometry.clearGroups();
      mesh.groups.forEach(([start, count], number) => geometry.addGroup(start, count, number));
    });
    look();
  }

  /** Write into a buffer from one number on. */
  function put(attribute, array, first) {
    attribute.array.set(array, first);
    attribute.addUpdateRange(first, array.length);
    attribute.needsUpdate = true;
  }

  function putIndex(geometry, index, room) {
    if (!geometry.index) geometry.setIndex(new BufferAttribute(new Uint32Array(room), 1));
    put(geometry.index, index, 0);
    geometry.setDrawRange(0, index.length);
  }

  /** The material of a slot; made once for each look. */
  function material(mesh, number, sharp) {
    const { colours, wire, shading } = settings;
    const color = colours === 'material' && given[number]?.color;
    const vertexColors = colours === 'material' && mesh.geometry.hasAttribute('color');
    const map = colours === 'uv' && mesh.geometry.hasAttribute('uv') ? checker : null;
    const flatShading = shading === 'flat' || Boolean(sharp);
    const key = [color, vertexColors, flatShading, map, wire].join();
    if (!materials.has(key)) {
      const [red, green, blue, opacity = 1] = color || [];
      materials.set(key, new MeshPhongMaterial({
        color: color ? new Color(red, green, blue) : vertexColors || map ? 0xffffff : CLAY,
        specular: 0x1c1c1c, shininess: 12, side: DoubleSide, flatShading, vertexColors, map, transparent: opacity < 1, opacity,
        polygonOffset: wire, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
      }));
    }
    return materials.get(key);
  }

  /** Show all as the settings say. */
  function look() {
    const tilt = settings.up === 'y' ? 0 : -Math.PI / 2;
    for (const mesh of meshes) {
      for (const node of mesh.nodes) {
        node.material = mesh.groups.map(([, , slot, flat]) => material(mesh, node.slots[slot], flat));
        node.children[0].visible = settings.wire && Boolean(mesh.wire.index);
      }
    }
    const tilted = root.rotation.x !== tilt;
    root.rotation.x = tilt;
    root.updateMatrixWorld(true);
    if (tilted) frame();
    redraw();
  }

  /** Look at all that is there, as far as it is known by now. */
  function frame() {
    const all = new Box3();
    for (const { box, nodes } of meshes) for (const node of nodes) all.union(box.clone().applyMatrix4(node.matrixWorld));
    if (all.isEmpty()) return;
    all.getBoundingSphere(orbit.ball);
    orbit.home();
  }

  const density = () => Math.min(window.devicePixelRatio, 2);

  function resize() {
    const { clientWidth: width, clientHeight: height } = canvas;
    if (!width || !height) return;
    renderer.setPixelRatio(density());
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    // the middle of what the bar leaves free
    const shift = Math.min(below(), 0.5 * height);
    camera.setViewOffset(width, height, 0, shift / 2, width, height);
    orbit.free = (height - shift) / height;
    orbit.home();
  }

  /** What the camera sees of each mesh: { visible, scale }, scale in pixels a unit at its nearest point. */
  function views() {
    const frustum = new Frustum().setFromProjectionMatrix(
      new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse));
    const pixels = (canvas.clientHeight * density() * camera.projectionMatrix.elements[5]) / 2;
    return meshes.map(({ box, nodes }) => {
      const view = { visible: box.isEmpty(), scale: 0 };
      for (const node of box.isEmpty() ? [] : nodes) {
        const place = box.clone().applyMatrix4(node.matrixWorld);
        place.expandByScalar(0.05 * place.getSize(new Vector3()).length()); // a coarse level may be smaller than the whole
        if (!frustum.intersectsBox(place)) continue;
        const distance = Math.max(place.distanceToPoint(camera.position), camera.near);
        view.visible = true;
        view.scale = Math.max(view.scale, (node.matrixWorld.getMaxScaleOnAxis() * pixels) / distance);
      }
      return view;
    });
  }

  function redraw() {
    if (asked) return;
    asked = true;
    requestAnimationFrame((time) => {
      asked = false;
      if (!canvas.clientWidth) return;
      renderer.render(scene, camera);
      drawn(time);
    });
  }

  function close() {
    resizer.disconnect();
    renderer.dispose();
  }

  return { renderer, scene, camera, root, orbit, meshes, open, apply, look, frame, views, redraw, close };
}

/** Whether the processor draws: smooth edges then take three quarters of a picture's time. */
function isSoftware() {
  const gl = document.createElement('canvas').getContext('webgl2');
  const info = gl?.getExtension('WEBGL_debug_renderer_info');
  const name = gl?.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
  gl?.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

/** A chequered texture that shows a UV map. */
const checker = new DataTexture(new Uint8Array(256).map((_, i) => {
  const [x, y] = [(i >> 2) & 7, i >> 5];
  const light = (x + y) & 1;
  return [light ? 235 : 90 + 12 * x, light ? 238 : 110, light ? 242 : 90 + 12 * y, 255][i & 3];
}), 8, 8);
checker.colorSpace = SRGBColorSpace;
checker.wrapS = checker.wrapT = RepeatWrapping;
checker.repeat.set(4, 4);
checker.needsUpdate = true;
