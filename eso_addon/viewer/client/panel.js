// SPDX-License-Identifier: GPL-3.0-or-later
// Buttons, slider, figures and messages around the picture.
import { STYLE } from './style.js';

const icon = (path) => `<svg viewBox="0 0 24 24"><path d="${path}"/></svg>`;
const PAUSE = icon('M9 5v14M15 5v14');
const PLAY = icon('M8 5l11 7-11 7z');

const button = (name, label, content) => `<button class="${name}" title="${label}">${content}</button>`;
const select = (name, label, options) =>
  `<label>${label}<select name="${name}">${options.map(([value, text]) => `<option value="${value}">${text}`).join('')}</select></label>`;
const figure = (name, label) => `<div><dt>${label}</dt><dd class="${name}">–</dd></div>`;

const bytesText = (bytes) =>
  bytes < 1000 ? `${bytes} B` : bytes < 1e6 ? `${(bytes / 1e3).toPrecision(3)} kB` : `${(bytes / 1e6).toPrecision(3)} MB`;
const UNITS = { budget: (value) => `${bytesText(value)}/s`, frame: (value) => `${value} ms`, error: (value) => `${value} px` };
const numbers = (name, label, none, values) => select(name, label, [[0, none], ...values.map((value) => [value, UNITS[name](value)])]);

const BODY = `<style>${STYLE}</style>
<canvas tabindex="0" role="img"></canvas>
<header><b></b> <span class="state" role="status"></span></header>
<div class="message card" role="alert" hidden><span></span>${button('again', 'Load once more', 'Try again')}</div>
<div class="bar card">
<div class="row">${button('play', '', '')}${button('base', 'Back to the base', icon('M12 4l8 14H4z'))}
<input class="level" type="range" max="1000" aria-label="Level of detail">
${button('whole', 'All that there is', icon('M12 4l8 14H4zv14M8 11h8l-4 7z'))}
${button('wire', 'Show the triangles', icon('M12 3l8 4.5v9L12 21l-8-4.5v-9zM4 7.5l8 4.5 8-4.5M12 12v9'))}
${button('more', 'Settings', icon('M4 8h9m5 0h2M4 16h2m5 0h9M13 5v6h5V5zM6 13v6h5v-6z'))}</div>
<dl>${figure('bytes', 'Received')}${figure('triangles', 'Triangles')}${figure('splits', 'Splits a second')}${figure('error', 'Error')}</dl>
<progress max="1"></progress>
<form hidden>
${numbers('budget', 'Line, at most', 'as fast as it goes', [5e4, 1e5, 25e4, 1e6, 4e6])}
${numbers('frame', 'Time of a picture', 'does not matter', [16, 33, 50, 100])}
${numbers('error', 'Error on screen', 'none: the original', [0.5, 1, 2, 5])}
${select('colours', 'Colours', [['material', 'as given'], ['plain', 'clay'], ['uv', 'UV map']])}
${select('shading', 'Shading', [['smooth', 'as given'], ['flat', 'flat']])}
${select('up', 'Up', [['z', 'Z'], ['y', 'Y']])}
</form></div>`;

export const countText = (count) => Math.round(count).toLocaleString('en').replaceAll(',', '\u202f');
const pixelText = (pixels) => (pixels < 0 ? '–' : pixels && pixels < 0.01 ? '<\u2009.01 px' : `${Number(pixels.toPrecision(2))} px`);

/** Fill the element's shadow; `act`: { play, level, wire, set, again }, what to do when someone asks for it. */
export function makePanel(root, act) {
  root.innerHTML = BODY;
  const find = (selector) => root.querySelector(selector);
  const form = find('form');
  const canvas = find('canvas');
  find('.play').onclick = act.play;
  find('.base').onclick = () => act.level(0);
  find('.whole').onclick = () => act.level(1);
  find('.level').oninput = ({ target }) => act.level(target.value / 1000);
  find('.wire').onclick = act.wire;
  find('.again').onclick = act.again;
  find('.more').onclick = () => press('.more', !(form.hidden = !form.hidden));
  form.onchange = ({ target }) => act.set(target.name, target.value);

  const press = (selector, on) => find(selector).setAttribute('aria-pressed', on);

  return {
    canvas,

    /** Pixels that the bar takes at the bottom, without its settings. */
    height: () => find('.bar').offsetHeight - form.offsetHeight + 14,

    /** Show a setting's value, which the list may not have. */
    setting(name, value) {
      const field = form.elements[name];
      if (name === 'level') find('.level').value = 1000 * value;
      if (name === 'wire') press('.wire', value);
      if (name === 'paused') {
        find('.play').innerHTML = value ? PLAY : PAUSE;
        find('.play').title = value ? 'Go on loading' : 'Pause loading';
      }
      if (!field) return;
      field.value = value;
      if (field.selectedIndex >= 0 || !UNITS[name]) return;
      field.add(new Option(UNITS[name](value), value, true, true));
    },

    title(name) {
      find('b').textContent = name;
      canvas.ariaLabel = `${name}: drag to turn, pinch or wheel to come closer, arrow keys turn`;
    },

    message(text, again) {
      find('.message').hidden = !text;
      find('.message span').textContent = text;
      find('.again').hidden = !again;
    },

    /** Bytes, triangles, splits a second, error; and how all is going. */
    figures({ received, bytes, shown, faces, rate, pixels, seconds }, text, same) {
      const put = (selector, html) => {
        if (find(selector).innerHTML !== html) find(selector).innerHTML = html;
      };
      put('.state', text);
      put('.bytes', `${bytesText(Math.min(received, bytes || received))} ${bytes ? `<small>of ${bytesText(bytes)}</small>` : ''}`);
      put('.triangles', `${countText(shown)} ${faces ? `<small>of ${countText(faces)}</small>` : ''}`);
      put('.splits', rate ? countText(Number(rate.toPrecision(2))) : '–');
      put('.error', pixelText(pixels).replace('<', '&lt;'));
      find('progress').value = bytes && received / bytes;
      find('.play').disabled = Boolean(seconds);
      find('.state').classList.toggle('same', same);
    },
  };
}
