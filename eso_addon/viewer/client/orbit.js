// SPDX-License-Identifier: GPL-3.0-or-later
// The camera's way around the model: one finger or the left button turns, two fingers or the right button move,
// pinch and wheel come closer; arrow keys turn, plus and minus come closer.

export class Orbit {
  /** `moved` is called after each change. */
  constructor(canvas, moved) {
    Object.assign(this, { canvas, moved, pointers: new Map() });
    this.target = [0, 0, 0];
    this.azimuth = 0.55;
    this.height = 0.35;
    this.distance = 3;
    this.radius = 1;
    canvas.style.touchAction = 'none';
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('pointerdown', (event) => this.down(event));
    canvas.addEventListener('pointermove', (event) => this.drag(event));
    for (const name of ['pointerup', 'pointercancel']) canvas.addEventListener(name, (event) => this.pointers.delete(event.pointerId));
    canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 16 : 1;
      this.zoom(Math.exp(Math.max(-90, Math.min(event.deltaY * lines, 90)) * 0.002));
    }, { passive: false });
    canvas.addEventListener('dblclick', () => this.home());
    canvas.addEventListener('keydown', (event) => this.key(event));
  }

  /** Look at a ball from the front, a little from the side and above. */
  frame(center, radius) {
    this.radius = radius;
    this.start = { target: [...center], distance: this.fit(radius) };
    this.home();
  }

  fit(radius) {
    const aspect = Math.min(this.free ?? 1, this.canvas.clientWidth / Math.max(this.canvas.clientHeight, 1)) || 1;
    return (radius * 1.05) / Math.sin(Math.atan(Math.tan((this.fov ?? 35) * (Math.PI / 360)) * aspect));
  }

  home() {
    if (!this.start) return;
    Object.assign(this, { target: [...this.start.target], distance: this.start.distance, azimuth: 0.55, height: 0.35 });
    this.moved();
  }

  down(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.canvas.focus({ preventScroll: true });
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
  }

  drag(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const at = [event.clientX, event.clientY];
    const [dx, dy] = [at[0] - before[0], at[1] - before[1]];
    if (this.pointers.size === 1) {
      if (event.buttons & 6 || event.shiftKey) this.shift(dx, dy);
      else this.turn(dx, dy);
    } else {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)[1];
      const apart = (point) => Math.hypot(point[0] - other[0], point[1] - other[1]) || 1;
      this.zoom(apart(before) / apart(at));
      this.shift(dx / 2, dy / 2);
    }
    this.pointers.set(event.pointerId, at);
  }

  turn(dx, dy) {
    const scale = 4 / Math.max(Math.min(this.canvas.clientWidth, this.canvas.clientHeight), 200);
    this.azimuth -= dx * scale;
    this.height = Math.max(-1.55, Math.min(this.height + dy * scale, 1.55));
    this.moved();
  }

  shift(dx, dy) {
    const scale = (2 * this.distance * Math.tan((this.fov ?? 35) * (Math.PI / 360))) / Math.max(this.canvas.clientHeight, 1);
    const [right, up] = this.axes();
    for (let i = 0; i < 3; i++) this.target[i] += scale * (up[i] * dy - right[i] * dx);
    this.moved();
  }

  zoom(factor) {
    this.distance = Math.max(this.radius * 0.02, Math.min(this.distance * factor, this.radius * 60));
    this.moved();
  }

  key(event) {
    const step = { ArrowLeft: [-20, 0], ArrowRight: [20, 0], ArrowUp: [0, -20], ArrowDown: [0, 20] }[event.key];
    if (step) this.turn(...step);
    else if (event.key === '+' || event.key === '=') this.zoom(0.9);
    else if (event.key === '-') this.zoom(1.1);
    else if (event.key === 'Home') this.home();
    else return;
    event.preventDefault();
  }

  /** The picture's right and up in the scene, Y up. */
  axes() {
    const { azimuth: a, height: h } = this;
    return [[Math.cos(a), 0, -Math.sin(a)], [-Math.sin(a) * Math.sin(h), Math.cos(h), -Math.cos(a) * Math.sin(h)]];
  }

  position() {
    const { azimuth: a, height: h, distance: d, target: t } = this;
    return [t[0] + d * Math.sin(a) * Math.cos(h), t[1] + d * Math.sin(h), t[2] + d * Math.cos(a) * Math.cos(h)];
  }
}
