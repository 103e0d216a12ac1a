// SPDX-License-Identifier: GPL-3.0-or-later
// The camera's way around the model: one finger or the left button turns, two fingers or the right button move,
// pinch and wheel come closer; arrow keys turn, plus and minus come closer.
import { MathUtils, Sphere, Spherical, Vector3 } from './three.module.js';

/** Move a camera around a ball; `moved` is called after each change. */
export function makeOrbit(canvas, camera, moved) {
  const slope = Math.tan(MathUtils.degToRad(camera.fov / 2));
  const fingers = new Map(); // where each one is that is down
  const target = new Vector3();
  const seat = new Spherical(); // where the camera is from there
  const ball = new Sphere(new Vector3(), 1); // what to look at at first
  const orbit = { target, seat, ball, free: 1, home, aim }; // free: the part of the picture's height that nothing covers

  /** Look from the front, a little from the side and above. */
  function home() {
    ball.radius ||= 1;
    target.copy(ball.center);
    seat.set((1.05 * ball.radius) / Math.sin(Math.atan(slope * Math.min(orbit.free, camera.aspect))), 1.2208, 0.55);
    aim();
  }

  function turn(dx, dy) {
    const scale = 4 / Math.max(Math.min(canvas.clientWidth, canvas.clientHeight), 200);
    seat.theta -= dx * scale;
    seat.phi = MathUtils.clamp(seat.phi - dy * scale, 0.02, 3.12);
    aim();
  }

  function shift(dx, dy) {
    const scale = (2 * seat.radius * slope) / canvas.clientHeight;
    target.add(new Vector3(-dx * scale, dy * scale, 0).applyQuaternion(camera.quaternion));
    aim();
  }

  function zoom(factor) {
    seat.radius = MathUtils.clamp(seat.radius * factor, 0.02 * ball.radius, 60 * ball.radius);
    aim();
  }

  /** Put the camera where it belongs. */
  function aim() {
    camera.position.setFromSpherical(seat).add(target);
    camera.lookAt(target);
    camera.far = seat.radius + 4 * ball.radius;
    camera.near = Math.max(seat.radius - 3 * ball.radius, camera.far / 5000);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    moved();
  }

  const keys = {
    ArrowLeft: () => turn(-20, 0), ArrowRight: () => turn(20, 0), ArrowUp: () => turn(0, -20), ArrowDown: () => turn(0, 20),
    '+': () => zoom(0.9), '=': () => zoom(0.9), '-': () => zoom(1.1), Home: home,
  };
  Object.assign(canvas, {
    ondblclick: home,
    oncontextmenu: () => false,
    onpointerdown({ pointerId, clientX, clientY }) {
      canvas.setPointerCapture(pointerId);
      fingers.set(pointerId, [clientX, clientY]);
    },
    onpointermove({ pointerId, clientX: x, clientY: y, buttons, shiftKey }) {
      const before = fingers.get(pointerId);
      if (!before) return;
      fingers.set(pointerId, [x, y]);
      const [dx, dy] = [x - before[0], y - before[1]];
      const other = [...fingers].find(([id]) => id !== pointerId)?.[1];
      if (other) {
        const apart = (point) => Math.hypot(point[0] - other[0], point[1] - other[1]) || 1;
        zoom(apart(before) / apart([x, y]));
        shift(dx / 2, dy / 2);
      } else if (buttons & 6 || shiftKey) shift(dx, dy);
      else turn(dx, dy);
    },
    onlostpointercapture: ({ pointerId }) => fingers.delete(pointerId),
    onwheel({ deltaY, deltaMode }) {
      zoom(Math.exp(MathUtils.clamp(deltaY * (deltaMode ? 16 : 1), -90, 90) * 0.002));
      return false;
    },
    onkeydown({ key }) {
      keys[key]?.();
      return !keys[key];
    },
  });
  return orbit;
}
