// SPDX-License-Identifier: GPL-3.0-or-later
// <eso-viewer src="mesh.esopm">, or one tag: <script type="module" src="viewer.js" data-src="mesh.esopm"></script>
import { countText, makePanel } from './panel.js';

const USUAL = {
  budget: 0, frame: 0, error: 0, memory: 0, level: 1, colours: 'material', shading: 'smooth', up: 'z', theme: 'light dark', wire: false,
  paused: false,
};
const CAP = 2e5; // triangles at first where the time of a picture matters
const LARGEST = 1e9;

/** Settings from the tag, then from the page's address where the tag says so. */
function readSettings(element) {
  const query = new URLSearchParams(element.hasAttribute('from-url') ? location.search : '');
  const settings = {};
  for (const [name, usual] of Object.entries(USUAL)) {
    const word = query.get(name) ?? element.getAttribute(name);
    const number = Number.parseFloat(word);
    if (typeof usual === 'string') settings[name] = word ?? usual;
    else if (typeof usual === 'boolean') settings[name] = word !== null && !['0', 'false', 'no'].includes(word);
    else settings[name] = number >= 0 && number < Infinity ? number : usual;
  }
  settings.memory ||= 256 * (navigator.deviceMemory ?? 4); // MB: a quarter of what is there
  return settings;
}

/**
 * Start the worker, also where this file lies on another server than the page. What to load goes along as its name: a message would
 * wait until this thread has read three.js.
 */
function makeWorker(what) {
  const name = JSON.stringify(what);
  const given = globalThis.ESO_WORKER;
  if (given) return new Worker(given, { name });
  const url = new URL('./worker.js', import.meta.url).href;
  const text = new Blob([`import ${JSON.stringify(url)};`], { type: 'text/javascript' });
  return new Worker(url.startsWith(`${location.origin}/`) ? url : URL.createObjectURL(text), { type: 'module', name });
}

class EsoViewer extends HTMLElement {
  connectedCallback() {
    begin(this);
  }

  disconnectedCallback() {
    this.close();
  }
}
customElements.define('eso-viewer', EsoViewer);

/** Show what the element names; gives it its methods. */
function begin(element) {
  const settings = readSettings(element);
  const name = element.getAttribute('name');
  const source = element.getAttribute('src') ?? '';
  const state = { received: 0, bytes: 0, shown: 0, there: 0, faces: 0, rate: 0, splits: 0, errors: [], message: '', identical: false };
  const dumps = new Map();
  const { budget, error, level: part, paused, memory } = settings;
  const held = document.getElementById(element.getAttribute('held'))?.textContent;
  let cap = settings.frame ? CAP : LARGEST;
  const worker = makeWorker({
    url: held ? null : new URL(source, document.baseURI).href, wish: { budget, error, level: part, paused, memory: memory * 1e6, cap },
  });
  const post = (type, more) => worker.postMessage({ type, ...more });
  const wish = (one) => post('wish', { wish: one });
  let view;
  let views; // what the camera sees of each mesh
  let news; // the name of an event once the level is drawn
  let frames = [];
  let lastFrame = 0;
  let looking;
  let telling;

  const panel = makePanel(element.shadowRoot ?? element.attachShadow({ mode: 'open' }), set, again);
  Object.assign(element, {
    level, pause, wire, set, again, dump,
    close() {
      worker.terminate();
      view?.close();
    },
  });
  Object.defineProperty(element, 'stats', { get: () => ({ ...state, pixels: pixels() }) });
  element.style.colorScheme = settings.theme;
  for (const one of Object.keys(settings)) panel.setting(one, settings[one]);
  panel.title(name ?? source.split('/').pop().replace(/\.esopm$/, ''));

  if (held) post('held', { base64: held });
  if (settings.wire) post('wire', { on: true });
  const ready = show();
  worker.onmessage = async ({ data }) => {
    await ready;
    if (!view) return;
    heard[data.type](data);
    telling ||= setTimeout(tell, data.type === 'state' ? 80 : 0);
  };
  worker.onerror = (event) => {
    event.preventDefault();
    panel.message('The page has come to a halt: load it anew.');
  };

  async function show() {
    try {
      const { makeView } = await import('./view.js');
      element.view = view = makeView(panel.canvas, settings, { drawn, look, say: panel.message, below: panel.height });
    } catch {
      worker.terminate();
      panel.message('This browser cannot draw in 3D: WebGL is missing or switched off.');
      say('failed');
    }
  }

  // -- what the worker says ----------------------------------------------------------------------------------------

  const heard = {
    head(head) {
      const { meta, meshes, bytes, faces, tooMuch } = head;
      Object.assign(state, { bytes, faces });
      const names = (meta.objects ?? meshes.map((mesh) => mesh.meta)).map((one) => one.name);
      const own = meta.name ?? (names.length === 1 && names[0]);
      if (own && !name) panel.title(own);
      if (own && !name && element.hasAttribute('from-url')) document.title = `${own} – ESO LOD`;
      view.open(head);
      if (tooMuch) panel.message('The memory of this device holds a coarser level only: that is shown.');
      say('head');
    },

    level({ changes, first }) {
      view.apply(changes);
      news ??= 'level';
      if (!first) return;
      news = 'first';
      state.firstPicture = first;
      view.frame();
      look();
    },

    state(figures) {
      const ended = figures.time && !state.seconds;
      Object.assign(state, figures);
      if (!ended) return;
      state.seconds = figures.time / 1000;
      if (!state.identical) panel.message('What came is not what was sent: the file is damaged. Load it anew.', true);
      say('whole', figures);
    },

    trouble({ text, failed }) {
      Object.assign(state, { message: text, failed });
      panel.message(text, true);
      if (failed) say('failed', { text });
    },

    dump({ id, meshes }) {
      dumps.get(id)(meshes);
      dumps.delete(id);
    },
  };

  /** A picture is there: the worker may send the next level. */
  function drawn(time) {
    if (news) {
      post('drawn');
      say(news, { shown: state.shown });
      news = null;
    }
    // fewer triangles where pictures take longer than wanted, more where they are quick
    const took = time - lastFrame;
    lastFrame = time;
    const { shown, there } = state;
    if (!settings.frame || !shown) return;
    if (took < 1000) frames.push(took);
    if (frames.length < 4) {
      view.redraw(); // time is taken from pictures that follow each other
      return;
    }
    const part = settings.frame / frames.sort((a, b) => a - b)[2];
    const before = cap;
    frames = [];
    if (part < 0.87) cap = Math.max(Math.min(shown, cap) * Math.max(0.5, 0.95 * part), 500);
    else if (part > 1.18 && cap < 2 * there && shown >= 0.9 * Math.min(cap, there)) cap *= 1.25;
    if (cap === before) return;
    wish({ cap });
    view.redraw();
  }

  // -- what someone wants ------------------------------------------------------------------------------------------

  /** Change a setting: what the panel, the slider and the buttons do. */
  function set(key, value) {
    settings[key] = typeof USUAL[key] === 'number' ? Math.max(Number.parseFloat(value) || 0, 0) : value;
    panel.setting(key, settings[key]);
    if (key === 'frame') {
      cap = settings.frame ? CAP : LARGEST;
      frames = [];
      wish({ cap });
    } else if (key === 'wire') post('wire', { on: value });
    else wish({ [key]: settings[key] });
    view?.look();
    look();
    tell();
  }

  /** Stop loading, or go on. */
  function pause(on = true) {
    set('paused', on);
  }

  /** Go to a level: 0 is the base, 1 the whole; between them as the slider. */
  function level(part) {
    set('level', part);
  }

  function wire(on) {
    set('wire', on);
  }

  function again() {
    Object.assign(state, { message: '', failed: false });
    panel.message('');
    post('again');
  }

  /** Tell the worker what the camera sees. */
  function look() {
    looking ||= setTimeout(() => {
      looking = 0;
      if (!view) return;
      views = view.views();
      wish({ views });
      tell();
    }, 100);
  }

  /** The meshes that are there, byte for byte: [{ vertices, faces, edges, attributes }]. */
  function dump() {
    return new Promise((resolve) => {
      const id = Math.random();
      dumps.set(id, resolve);
      post('dump', { id });
    });
  }

  // -- what is told ------------------------------------------------------------------------------------------------

  /** The error on screen of what is shown, in pixels; -1 where unknown. */
  function pixels() {
    const seen = state.errors.map((error, mesh) => {
      const { visible, scale } = views?.[mesh] ?? {};
      return error && visible ? (error < 0 ? Infinity : error * scale) : 0;
    });
    const most = Math.max(-1, ...seen);
    return most < Infinity ? most : -1;
  }

  function tell() {
    clearTimeout(telling);
    telling = 0;
    const { shown, there, faces, identical, quantised, seconds, failed, waiting } = state;
    let text = shown ? 'refining' : 'loading';
    if (seconds) text = '';
    if (waiting) text = 'as fine as the view needs';
    if (shown && shown < there) text = `level of ${countText(shown)} triangles`;
    if (settings.paused && !seconds) text = 'paused';
    if (failed) text = 'stopped';
    const same = identical && shown === faces;
    if (same) text = quantised ? 'complete: equal to what was sent, hash checked' : 'identical to the original';
    panel.figures({ ...state, pixels: pixels() }, text, same);
  }

  function say(event, detail) {
    element.dispatchEvent(new CustomEvent(`eso-${event}`, { detail, bubbles: true, composed: true }));
  }
}

// the tag that brought this file becomes a viewer, where it says of what
for (const script of document.querySelectorAll('script[data-src]')) {
  if (script.src !== import.meta.url || script.esoDone) continue;
  script.esoDone = true;
  const viewer = document.createElement('eso-viewer');
  for (const [key, value] of Object.entries(script.dataset)) viewer.setAttribute(key.replace(/[A-Z]/g, '-$&'), value);
  if (script.closest('head')) document.body.append(viewer);
  else script.after(viewer);
}
