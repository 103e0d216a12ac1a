// SPDX-License-Identifier: GPL-3.0-or-later
// <eso-viewer src="mesh.esopm">, or one tag: <script type="module" src="viewer.js" data-src="mesh.esopm"></script>
import { Panel, countText } from './panel.js';

const NUMBERS = { budget: 0, frame: 0, error: 0, memory: 0, level: 1 };
const WORDS = { colours: 'material', shading: 'smooth', up: 'z', theme: 'auto', wire: '', paused: '' };
const isOn = (word) => word !== undefined && word !== null && !['', '0', 'false', 'no'].includes(String(word));

class EsoViewer extends HTMLElement {
  connectedCallback() {
    if (this.panel) return;
    this.settings = this.readSettings();
    this.panel = new Panel(this.attachShadow({ mode: 'open' }), {
      play: () => this.pause(!this.settings.paused),
      level: (level) => this.level(level),
      wire: () => this.wire(!this.settings.wire),
      set: (name, value) => this.set(name, value),
      again: () => this.again(),
    });
    this.state = { received: 0, shown: 0, faces: 0, rate: 0, errors: [], there: 0, bytes: 0 };
    this.frames = [];
    this.watchTheme();
    this.begin();
  }

  disconnectedCallback() {
    this.worker?.terminate();
    this.view?.resizer.disconnect();
    this.view?.renderer.dispose();
  }

  /** Settings from the tag, then from the page's address where the tag says so. */
  readSettings() {
    const query = this.hasAttribute('from-url') ? new URLSearchParams(location.search) : new URLSearchParams();
    const said = (name) => query.get(name) ?? this.getAttribute(name);
    const settings = {};
    for (const [name, usual] of Object.entries(NUMBERS)) {
      const number = Number.parseFloat(said(name));
      settings[name] = number >= 0 && Number.isFinite(number) ? number : usual;
    }
    for (const [name, usual] of Object.entries(WORDS)) settings[name] = said(name) ?? usual;
    settings.level = Math.min(settings.level, 1);
    for (const name of ['wire', 'paused']) settings[name] = query.has(name) && !query.get(name) ? true : isOn(settings[name]);
    if (!settings.memory) settings.memory = 256 * (navigator.deviceMemory ?? 4); // MB: a quarter of what is there
    return settings;
  }

  watchTheme() {
    const { theme } = this.settings;
    const media = matchMedia('(prefers-color-scheme: dark)');
    const apply = () => {
      const dark = theme === 'dark' || (theme !== 'light' && media.matches);
      this.toggleAttribute('dark', dark);
      this.view?.theme(dark);
    };
    this.applyTheme = apply;
    media.addEventListener('change', apply);
    apply();
  }

  begin() {
    const { panel, settings } = this;
    for (const name of ['budget', 'frame', 'error', 'colours', 'shading', 'up']) panel.setting(name, settings[name]);
    panel.title(this.getAttribute('name') ?? (this.getAttribute('src') ?? '').split('/').pop().replace(/\.esopm$/, ''));
    panel.paused(settings.paused);
    panel.wire(settings.wire);
    panel.find('.level').value = 1000 * settings.level;
    panel.state('loading');
    this.open();
    this.ready = this.makeView(); // while the worker is at work already
  }

  async makeView() {
    const { panel, settings } = this;
    try {
      const { View } = await import('./view.js');
      this.view = new View(panel.canvas, {
        drawn: (time) => this.drawn(time), moved: () => this.look(), below: () => panel.height(),
      });
    } catch {
      this.worker.terminate();
      panel.state('');
      panel.message('This browser cannot draw in 3D: WebGL is missing or switched off.', false);
      this.say('failed');
      return;
    }
    panel.canvas.addEventListener('webglcontextlost', (event) => {
      event.preventDefault();
      panel.message('The graphics card has given up the picture. It comes back when the browser allows.', false);
    });
    panel.canvas.addEventListener('webglcontextrestored', () => panel.message(''));
    this.view.look({ wire: settings.wire, colours: settings.colours, shading: settings.shading });
    this.view.turnUp(settings.up);
    this.applyTheme();
  }

  open() {
    this.worker = makeWorker();
    this.worker.onmessage = async ({ data }) => {
      await this.ready;
      if (this.view) this.heard(data);
    };
    this.worker.onerror = (event) => {
      event.preventDefault();
      this.panel.message('The page has come to a halt: load it anew.', false);
    };
    const { budget, error, level, memory, paused, wire } = this.settings;
    this.asked = level;
    this.worker.postMessage({
      type: 'open', url: new URL(this.getAttribute('src') ?? '', document.baseURI).href,
      base64: document.getElementById(this.getAttribute('held'))?.textContent,
      wish: { budget, error, level, paused, memory: memory * 1e6, cap: this.settings.frame ? 2e5 : Infinity },
    });
    if (wire) this.worker.postMessage({ type: 'wire', on: true });
  }

  // -- what the worker says ----------------------------------------------------------------------------------------

  heard(message) {
    const { panel } = this;
    if (message.type === 'head') this.headed(message);
    else if (message.type === 'level') this.levelled(message);
    else if (message.type === 'progress') {
      Object.assign(this.state, message);
      this.tellLater();
    } else if (message.type === 'trouble') {
      panel.message(message.text && `${message.text} What came is shown; trying again in ${Math.ceil(message.seconds)} s.`);
      this.trouble = message.text;
    } else if (message.type === 'failed') {
      this.failed = message.text;
      panel.message(message.text);
      this.say('failed', { text: message.text });
    } else if (message.type === 'whole') {
      this.whole = message;
      if (!message.identical) panel.message('What came is not what was sent: the file is damaged. Load it anew.');
      this.say('whole', message);
    } else if (message.type === 'dump') {
      this.dumps.get(message.id)(message.meshes);
      this.dumps.delete(message.id);
    }
    if (message.type !== 'progress') this.tell();
  }

  headed({ meta, meshes, rows, faces, bytes, tooMuch }) {
    this.head = { meta, rows, faces };
    Object.assign(this.state, { faces, bytes });
    this.base = rows.findLast((row, at) => at < meshes.length).total;
    const names = meshes.map((mesh) => mesh.meta.name).filter(Boolean);
    const name = meta.name ?? (meta.objects?.length === 1 ? meta.objects[0].name : names.length === 1 ? names[0] : null);
    if (name && !this.hasAttribute('name')) {
      this.panel.title(name);
      if (this.hasAttribute('from-url')) document.title = `${name} – ESO LOD`;
    }
    this.view.open(meshes, meta);
    if (tooMuch) this.panel.message('The memory of this device holds a coarser level only: that is shown.', false);
    if (this.settings.level !== this.asked) this.level(this.settings.level); // moved before the header was there
    this.say('head');
  }

  levelled({ changes, shown, first, used, time }) {
    for (const change of changes) this.view.apply(change);
    this.state.shown = shown;
    if (first) {
      this.view.turnUp(this.settings.up);
      this.view.frame();
      this.firstPicture = { bytes: used, time };
    }
    this.owed = true;
    this.view.redraw();
    this.newLevel = first ? 'first' : 'level';
    if (first) this.look();
  }

  /** A picture is there: the worker may send the next level. */
  drawn(time) {
    if (this.owed) {
      this.owed = false;
      this.worker.postMessage({ type: 'drawn' });
      this.say(this.newLevel, { shown: this.state.shown });
    }
    this.keepPace(time);
  }

  /** Fewer triangles where pictures take longer than wanted, more where they are quick. */
  keepPace(time) {
    const target = this.settings.frame;
    const took = time - (this.lastFrame ?? -1e9);
    this.lastFrame = time;
    if (!target || !this.state.shown) return;
    if (took < 1000) this.frames.push(took);
    if (this.frames.length < 4) {
      this.view.redraw(); // time is taken from pictures that follow each other
      return;
    }
    const median = this.frames.sort((a, b) => a - b)[2];
    this.frames = [];
    const { shown, there } = this.state;
    let cap = this.cap ?? 2e5;
    if (median > 1.15 * target) cap = Math.max(Math.min(shown, cap) * Math.max(0.5, (0.95 * target) / median), 500);
    else if (median < 0.85 * target && shown >= 0.9 * Math.min(cap, there)) cap = Math.min(cap * 1.25, 1e9);
    if (cap === this.cap) return;
    this.cap = cap;
    this.wish({ cap });
    if (shown < there || cap < there) this.view.redraw();
  }

  // -- what someone wants ------------------------------------------------------------------------------------------

  wish(wish) {
    this.worker?.postMessage({ type: 'wish', wish });
  }

  /** Stop loading, or go on. */
  pause(on = true) {
    this.settings.paused = on;
    this.panel.paused(on);
    this.wish({ paused: on });
    this.tell();
  }

  /** Go to a level: 0 is the base, 1 the whole; between them as the slider. */
  level(part) {
    this.settings.level = part;
    this.panel.find('.level').value = 1000 * part;
    if (!this.head) return;
    this.wish({ faces: part >= 1 ? Infinity : Math.round(this.base * (this.head.faces / this.base) ** part) });
    this.tell();
  }

  wire(on) {
    this.settings.wire = on;
    this.panel.wire(on);
    this.view?.look({ wire: on });
    this.worker?.postMessage({ type: 'wire', on });
  }

  set(name, value) {
    const number = name in NUMBERS;
    this.settings[name] = number ? Math.max(Number.parseFloat(value) || 0, 0) : value;
    this.panel.setting(name, this.settings[name]);
    if (name === 'colours' || name === 'shading') this.view?.look({ [name]: value });
    else if (name === 'up') this.view?.turnUp(value);
    else if (name === 'frame') {
      this.frames = [];
      this.cap = undefined;
      this.wish({ cap: this.settings.frame ? 2e5 : Infinity });
      this.view?.redraw();
    } else this.wish({ [name]: this.settings[name] });
    this.look();
  }

  again() {
    this.panel.message('');
    this.failed = null;
    this.worker.postMessage({ type: 'again' });
  }

  /** Tell the worker what the camera sees. */
  look() {
    if (this.looking || !this.head) return;
    this.looking = setTimeout(() => {
      this.looking = 0;
      this.views = this.view.views();
      this.wish({ views: this.views });
      this.tell();
    }, 100);
  }

  /** The meshes that are there, byte for byte: [{ vertices, faces, edges, attributes }]. */
  dump() {
    this.dumps ??= new Map();
    return new Promise((resolve) => {
      const id = Math.random();
      this.dumps.set(id, resolve);
      this.worker.postMessage({ type: 'dump', id });
    });
  }

  // -- what is told ------------------------------------------------------------------------------------------------

  /** What the bar says, as numbers. */
  get stats() {
    const { received, shown, faces, rate, there, bytes, splits, ranges, waiting } = this.state;
    return {
      received, bytes, shown, there, faces, splits, rate, pixels: this.pixels(), ranges, waiting,
      firstPicture: this.firstPicture, identical: Boolean(this.whole?.identical), seconds: this.whole && this.whole.time / 1000,
      message: this.failed ?? this.trouble ?? '',
    };
  }

  /** The error on screen of what is shown, in pixels; -1 where unknown. */
  pixels() {
    let most = this.state.errors.length ? 0 : -1;
    this.state.errors.forEach((error, mesh) => {
      const view = this.views?.[mesh];
      if (!view || (!view.visible && error)) return;
      if (error < 0) most = Infinity;
      else most = Math.max(most, error * view.scale);
    });
    return most === Infinity ? -1 : most;
  }

  tellLater() {
    this.telling ||= setTimeout(() => this.tell(), 80);
  }

  tell() {
    clearTimeout(this.telling);
    this.telling = 0;
    const { state, panel, settings } = this;
    panel.figures({ ...state, pixels: this.pixels(), base: this.base ?? 1, level: state.there });
    panel.find('.play').disabled = Boolean(this.whole);
    const all = this.whole && state.shown === state.faces;
    if (all && this.whole.identical) {
      panel.state(this.whole.quantised ? 'complete: equal to what was sent, hash checked' : 'identical to the original', true);
    } else if (this.failed) panel.state('stopped');
    else if (settings.paused && !this.whole) panel.state('paused');
    else if (state.shown && state.shown < state.there) panel.state(`level of ${countText(state.shown)} triangles`);
    else if (state.waiting) panel.state('as fine as the view needs');
    else panel.state(this.whole ? '' : state.shown ? 'refining' : 'loading');
  }

  say(name, detail) {
    this.dispatchEvent(new CustomEvent(`eso-${name}`, { detail, bubbles: true, composed: true }));
  }
}

/** Start the worker, also where this file lies on another server than the page. */
function makeWorker() {
  const given = globalThis.ESO_WORKER;
  if (given) return new Worker(given);
  const url = new URL('./worker.js', import.meta.url);
  if (url.origin === location.origin) return new Worker(url, { type: 'module' });
  const text = new Blob([`import ${JSON.stringify(url.href)};`], { type: 'text/javascript' });
  return new Worker(URL.createObjectURL(text), { type: 'module' });
}

customElements.define('eso-viewer', EsoViewer);

// the tag that brought this file becomes a viewer, where it says of what
for (const script of document.querySelectorAll('script[data-src]')) {
  if (script.src !== import.meta.url || script.esoDone) continue;
  script.esoDone = true;
  const viewer = document.createElement('eso-viewer');
  for (const { name, value } of script.attributes) if (name.startsWith('data-')) viewer.setAttribute(name.slice(5), value);
  if (script.closest('head')) document.body.append(viewer);
  else script.after(viewer);
}
