// SPDX-License-Identifier: GPL-3.0-or-later
// The camera's way around the model: one finger or the left button turns, two fingers or the right button move,
// pinch and wheel come closer; arrow keys turn, plus and minus come closer.

const limit = (value, low, high) => Math.max(low, Math.min(value, high));

/** An object with target, azimuth, height and distance; `moved` is called after each change. */
export function makeOrbit(canvas, fov, moved) {
  const slope = Math.tan((fov * Math.PI) / 360);
  const pointers = new Map();
  const orbit = { target: [0, 0, 0], azimuth: 0.55, height: 0.35, distance: 3, radius: 1, free: 1, home, moved, frame, aim };
  let start;

  /** Look at a ball from the front, a little from the side and above. */
  function frame(center, radius) {
    const aspect = Math.min(orbit.free, canvas.clientWidth / canvas.clientHeight || 1);
    orbit.radius = radius;
    start = { target: center, distance: (radius * 1.05) / Math.sin(Math.atan(slope * aspect)), azimuth: 0.55, height: 0.35 };
    home();
  }

  function home() {
    Object.assign(orbit, start, { target: [...(start?.target ?? orbit.target)] });
    moved();
  }

  function turn(dx, dy) {
    const scale = 4 / Math.max(Math.min(canvas.clientWidth, canvas.clientHeight), 200);
    orbit.azimuth -= dx * scale;
    orbit.height = limit(orbit.height + dy * scale, -1.55, 1.55);
    moved();
  }

  function shift(dx, dy) {
    const scale = (2 * orbit.distance * slope) / (canvas.clientHeight || 1);
    const [right, up] = axes();
    orbit.target = orbit.target.map((value, i) => value + scale * (up[i] * dy - right[i] * dx));
    moved();
  }

  function zoom(factor) {
    orbit.distance = limit(orbit.distance * factor, orbit.radius * 0.02, orbit.radius * 60);
    moved();
  }

  /** The picture's right and up and what it looks away from, in the scene, Y up. */
  function axes() {
    const [x, y] = [orbit.azimuth, orbit.height].map(Math.cos);
    const [a, h] = [orbit.azimuth, orbit.height].map(Math.sin);
    return [[x, 0, -a], [-a * h, y, -x * h], [a * y, h, x * y]];
  }

  /** Put the camera where it belongs. */
  function aim(camera) {
    const [, up, back] = axes();
    const { target, distance, radius } = orbit;
    camera.position.fromArray(target.map((value, i) => value + distance * back[i]));
    camera.up.fromArray(up);
    camera.lookAt(...target);
    camera.far = distance + 4 * radius;
    camera.near = Math.max(distance - 3 * radius, camera.far / 5000);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
  }

  const keys = {
    ArrowLeft: () => turn(-20, 0), ArrowRight: () => turn(20, 0), ArrowUp: () => turn(0, -20), ArrowDown: () => turn(0, 20),
    '+': () => zoom(0.9), '=': () => zoom(0.9), '-': () => zoom(1.1), Home: home,
  };
  const actions = {
    contextmenu() {},
    pointerdown({ pointerId, clientX, clientY }) {
      canvas.setPointerCapture(pointerId);
      canvas.focus({ preventScroll: true });
      pointers.set(pointerId, [clientX, clientY]);
    },
    pointermove({ pointerId, clientX: x, clientY: y, buttons, shiftKey }) {
      const before = pointers.get(pointerId);
      if (!before) return;
      pointers.set(pointerId, [x, y]);
      const [dx, dy] = [x - before[0], y - before[1]];
      const other = [...pointers].find(([id]) => id !== pointerId)?.[1];
      if (other) {
        const apart = (point) => Math.hypot(point[0] - other[0], point[1] - other[1]) || 1;
        zoom(apart(before) / apart([x, y]));
        shift(dx / 2, dy / 2);
      } else if (buttons & 6 || shiftKey) shift(dx, dy);
      else turn(dx, dy);
    },
    pointerup: ({ pointerId }) => pointers.delete(pointerId),
    pointercancel: ({ pointerId }) => pointers.delete(pointerId),
    wheel: ({ deltaY, deltaMode }) => zoom(Math.exp(limit(deltaY * (deltaMode ? 16 : 1), -90, 90) * 0.002)),
    dblclick: home,
  };
  for (const [name, act] of Object.entries(actions)) {
    canvas.addEventListener(name, (event) => {
      if (name === 'wheel' || name === 'contextmenu') event.preventDefault();
      act(event);
    });
  }
  canvas.addEventListener('keydown', (event) => {
    if (!keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  });
  return orbit;
}
