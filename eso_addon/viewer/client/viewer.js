// SPDX-License-Identifier: GPL-3.0-or-later
// <eso-viewer src="mesh.esopm">, or one tag: <script type="module" src="viewer.js" data-src="mesh.esopm"></script>
import { countText, makePanel } from './panel.js';

const USUAL = {
  budget: 0, frame: 0, error: 0, memory: 0, level: 1, colours: 'material', shading: 'smooth', up: 'z', theme: 'light dark', wire: false,
  paused: false,
};
const CAP = 2e5; // triangles at first where the time of a picture matters

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
  const state = { received: 0, bytes: 0, shown: 0, there: 0, faces: 0, rate: 0, splits: 0, pixels: -1, message: '', identical: false };
  let cap = settings.frame && CAP; // triangles at most; 0: as many as there are
  let view;
  let news; // the name of an event once the level is drawn
  let frames = [];
  let lastFrame = 0;
  let looking;
  let telling;

  const worker = makeWorker({ url: new URL(source, document.baseURI).href, wish: { ...settings, cap } });
  const post = (action, wishes, ports = []) => worker.postMessage([action, wishes], ports);
  const want = (wishes) => post('want', wishes);
  const panel = makePanel(element.shadowRoot ?? element.attachShadow({ mode: 'open' }), set, again);
  Object.assign(element, {
    set, again, dump,
    stats: state,
    /** Go to a level: 0 is the base, 1 the whole; between them as the slider. */
    level: (part) => set('level', part),
    /** Stop loading, or go on. */
    pause: (on = true) => set('paused', on),
    wire: (on) => set('wire', on),
    close() {
      worker.terminate();
      view?.close();
    },
  });
  element.style.colorScheme = settings.theme;
  for (const one of Object.keys(settings)) panel.setting(one, settings[one]);
  panel.title(name ?? source.split('/').pop().replace(/\.esopm$/, ''));

  const ready = show();
  worker.onmessage = async ({ data }) => {
    await ready;
    if (view) heard[data.type](data);
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
      const own = !name && (meta.name ?? (names.length === 1 && names[0]));
      if (own) panel.title(own);
      if (own && element.hasAttribute('from-url')) document.title = `${own} – ESO LOD`;
      view.open(head);
      if (tooMuch) panel.message('The memory of this device holds a coarser level only: that is shown.');
      say('head');
    },

    level({ changes, first }) {
      view.apply(changes);
      news = first ? 'first' : 'level';
      if (!first) return;
      state.firstPicture = first;
      view.frame();
    },

    state(figures) {
      const { message, failed, seconds } = state;
      Object.assign(state, figures);
      if (state.message !== message) panel.message(state.message, true);
      if (state.failed && !failed) say('failed', { text: state.message });
      if (state.seconds && !seconds) say('whole', figures);
      telling ||= setTimeout(tell, 80); // each time the page is laid out and painted anew
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
    want({ cap });
    view.redraw();
  }

  // -- what someone wants ------------------------------------------------------------------------------------------

  /** Change a setting: what the panel, the slider and the buttons do. */
  function set(key, value) {
    settings[key] = typeof USUAL[key] === 'number' ? Math.max(Number.parseFloat(value) || 0, 0) : value;
    panel.setting(key, settings[key]);
    if (key === 'frame') {
      cap = settings.frame && CAP;
      frames = [];
    }
    want({ [key]: settings[key], cap });
    view?.look();
    tell();
  }

  function again() {
    post('again');
  }

  /** Tell the worker what the camera sees. */
  function look() {
    looking ||= setTimeout(() => {
      looking = 0;
      want({ views: view.views() });
    }, 100);
  }

  /** The meshes that are there, byte for byte: [{ vertices, faces, edges, attributes }]. */
  function dump() {
    return new Promise((resolve) => {
      const { port1, port2 } = new MessageChannel();
      port1.onmessage = ({ data }) => resolve(data);
      post('dump', null, [port2]);
    });
  }

  // -- what is told ------------------------------------------------------------------------------------------------

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
    panel.figures(state, text, same);
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
