// SPDX-License-Identifier: GPL-3.0-or-later
// Buttons, slider, figures and messages around the picture.
import { STYLE } from './style.js';

const icon = (path) => `<svg viewBox="0 0 24 24" aria-hidden="true">${path}</svg>`;
const PAUSE = icon('<path d="M9 5v14M15 5v14"/>');
const PLAY = icon('<path d="M8 5l11 7-11 7z"/>');
const BASE = icon('<path d="M12 4l8 14H4z"/>');
const WHOLE = icon('<path d="M12 4l8 14H4zM12 4v14M8 11h8M8 11l4 7 4-7"/>');
const WIRE = icon('<path d="M12 3l8 4.5v9L12 21l-8-4.5v-9zM12 12l8-4.5M12 12v9M12 12L4 7.5"/>');
const GEAR = icon('<path d="M4 7h9M17 7h3M4 17h3M11 17h9"/><circle cx="15" cy="7" r="2"/><circle cx="9" cy="17" r="2"/>');

const button = (name, label, content, more = '') =>
  `<button type="button" class="${name}" title="${label}" aria-label="${label}" ${more}>${content}</button>`;
const select = (name, label, options) =>
  `<label>${label}<select name="${name}">${options.map(([value, text]) => `<option value="${value}">${text}</option>`).join('')}</select></label>`;
const figure = (name, label) => `<div><dt>${label}</dt><dd class="${name}">–</dd></div>`;

const BODY = `<style>${STYLE}</style>
<canvas tabindex="0" role="img" aria-label="The model: drag to turn, pinch or wheel to come closer, arrow keys turn"></canvas>
<div class="title"><b></b><span class="state" role="status"></span></div>
<div class="message card" role="alert" hidden><span></span>${button('again', 'Try again', 'Try again')}</div>
<div class="bar card">
<div class="row">${button('play', 'Pause loading', PAUSE)}${button('base', 'Back to the base', BASE)}
<div class="slide"><i></i><input class="level" type="range" min="0" max="1000" value="1000" aria-label="Level of detail"></div>
${button('whole', 'All that there is', WHOLE)}${button('wire', 'Show the triangles', WIRE, 'aria-pressed="false"')}
${button('more', 'Settings', GEAR, 'aria-expanded="false"')}</div>
<dl>${figure('bytes', 'Received')}${figure('triangles', 'Triangles')}${figure('splits', 'Splits a second')}${figure('error', 'Error')}</dl>
<div class="load" role="progressbar" aria-label="Received"><i></i></div>
<form class="settings" hidden>
${select('budget', 'Line, at most', [[0, 'as fast as it goes'], [5e4, '50 kB/s'], [1e5, '100 kB/s'], [25e4, '250 kB/s'], [1e6, '1 MB/s'], [4e6, '4 MB/s']])}
${select('frame', 'Time of a picture', [[0, 'does not matter'], [16, 'at most 16 ms'], [33, 'at most 33 ms'], [50, 'at most 50 ms'], [100, 'at most 100 ms']])}
${select('error', 'Error on screen', [[0, 'none: the original'], [0.5, 'half a pixel'], [1, '1 pixel'], [2, '2 pixels'], [5, '5 pixels']])}
${select('colours', 'Colours', [['material', 'as given'], ['plain', 'clay'], ['uv', 'UV map']])}
${select('shading', 'Shading', [['smooth', 'as given'], ['flat', 'flat']])}
${select('up', 'Up', [['z', 'Z'], ['y', 'Y']])}
</form></div>`;

export const bytesText = (bytes) =>
  bytes < 1000 ? `${bytes} B` : bytes < 1e6 ? `${(bytes / 1e3).toPrecision(3)} kB` : `${(bytes / 1e6).toPrecision(3)} MB`;
export const countText = (count) => Math.round(count).toLocaleString('en').replaceAll(',', '\u202f');
const pixelText = (pixels) => (pixels < 0 ? '–' : pixels === 0 ? '0 px' : `${pixels < 0.01 ? '<\u2009' : ''}${Math.max(pixels, 0.01).toPrecision(2)} px`);

export class Panel {
  /** `act`: { play, level, wire, set, again }, what to do when someone asks for it. */
  constructor(root, act) {
    root.innerHTML = BODY;
    this.root = root;
    const find = (selector) => root.querySelector(selector);
    this.find = find;
    this.canvas = find('canvas');
    find('.play').onclick = () => act.play();
    find('.base').onclick = () => act.level(0);
    find('.whole').onclick = () => act.level(1);
    find('.level').oninput = (event) => act.level(event.target.value / 1000);
    find('.wire').onclick = () => act.wire();
    find('.again').onclick = () => act.again();
    find('.more').onclick = () => this.open(find('.settings').hidden);
    find('.settings').onchange = (event) => act.set(event.target.name, event.target.value);
  }

  /** Pixels that the bar takes at the bottom, without its settings. */
  height() {
    const settings = this.find('.settings');
    return this.find('.bar').offsetHeight + 14 - (settings.hidden ? 0 : settings.offsetHeight + 12);
  }

  open(on) {
    this.find('.settings').hidden = !on;
    this.find('.more').setAttribute('aria-expanded', on);
  }

  /** Show a setting's value, which the list may not have. */
  setting(name, value) {
    const field = this.find(`[name=${name}]`);
    if (!field) return;
    if (![...field.options].some((option) => option.value === String(value))) {
      const text = { budget: `${bytesText(value)}/s`, frame: `at most ${value} ms`, error: `${value} pixels` }[name];
      if (!text) return;
      field.add(new Option(text, value));
    }
    field.value = value;
  }

  paused(on) {
    const play = this.find('.play');
    play.innerHTML = on ? PLAY : PAUSE;
    play.title = on ? 'Go on loading' : 'Pause loading';
    play.setAttribute('aria-label', play.title);
  }

  wire(on) {
    this.find('.wire').setAttribute('aria-pressed', on);
  }

  title(name) {
    this.find('b').textContent = name;
    this.canvas.setAttribute('aria-label', `${name}: drag to turn, pinch or wheel to come closer, arrow keys turn`);
  }

  state(text, same = false) {
    const state = this.find('.state');
    if (state.textContent !== text) state.textContent = text;
    state.classList.toggle('same', same);
    this.find('.bar').classList.toggle('same', same);
  }

  message(text, again = true) {
    this.find('.message').hidden = !text;
    this.find('.message span').textContent = text;
    this.find('.again').hidden = !again;
  }

  /** Bytes, triangles, splits a second, error; and how far the slider's track is filled. */
  figures({ received, bytes, shown, faces, rate, pixels, base, level }) {
    const { find } = this;
    const put = (name, value, rest = '') => {
      const html = `${value}${rest ? ` <small>${rest}</small>` : ''}`;
      if (find(name).innerHTML !== html) find(name).innerHTML = html;
    };
    put('.bytes', bytesText(received), bytes ? `of ${bytesText(bytes)}` : '');
    put('.triangles', countText(shown), `of ${countText(faces)}`);
    put('.splits', rate ? countText(Number(rate.toPrecision(2))) : '–');
    put('.error', pixelText(pixels));
    const part = (count) => (faces > base ? (100 * Math.log(Math.max(count, base) / base)) / Math.log(faces / base) : 100);
    const slide = find('.slide');
    slide.style.setProperty('--shown', `${part(shown).toFixed(1)}%`);
    slide.style.setProperty('--there', `${part(level).toFixed(1)}%`);
    const got = bytes ? Math.min(100, (100 * received) / bytes) : 0;
    find('.load').style.setProperty('--got', `${got.toFixed(1)}%`);
    find('.load').setAttribute('aria-valuenow', Math.round(got));
  }
}
