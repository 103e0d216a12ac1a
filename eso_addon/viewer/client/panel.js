// SPDX-License-Identifier: GPL-3.0-or-later
// Buttons, slider, figures and messages around the picture; panel.html says how they look.
const BODY = await (await fetch(new URL('./panel.html', import.meta.url))).text();

const bytesText = (bytes) =>
  bytes < 1000 ? `${bytes} B` : bytes < 1e6 ? `${(bytes / 1e3).toPrecision(3)} kB` : `${(bytes / 1e6).toPrecision(3)} MB`;
const pixelText = (pixels) => (pixels < 0 ? '–' : pixels && pixels < 0.01 ? '&lt;\u2009.01 px' : `${Number(pixels.toPrecision(2))} px`);
const ofText = (part, whole, text) => `${text(part)} ${whole ? `<small>of ${text(whole)}</small>` : ''}`;
export const countText = (count) => Math.round(count).toLocaleString('en').replaceAll(',', '\u202f');

/** Fill the element's shadow; `set` is told the name and value that someone wants, `again` is called to try once more. */
export function makePanel(root, set, again) {
  root.innerHTML = BODY;
  const find = (selector) => root.querySelector(selector);
  const [canvas, form, settings] = ['canvas', 'form', '.settings'].map(find);
  form.oninput = ({ target }) => set(target.name, target.type === 'checkbox' ? target.checked : target.value);
  find('.base').onclick = () => set('level', 0);
  find('.whole').onclick = () => set('level', 1);
  find('.again').onclick = again;
  find('.more').onclick = ({ currentTarget }) => { currentTarget.ariaPressed = !(settings.hidden = !settings.hidden); };

  return {
    canvas,

    /** Pixels that the bar takes at the bottom, without its settings. */
    height: () => form.offsetHeight - settings.offsetHeight + 14,

    /** Show a setting's value, which the list may not have. */
    setting(name, value) {
      const field = form.elements[name];
      if (!field) return;
      if (field.type === 'checkbox') field.checked = value;
      field.value = value;
      if (field.selectedIndex >= 0 || !field.dataset.unit) return;
      field.add(new Option((name === 'budget' ? bytesText(value) : value) + field.dataset.unit, value, true, true));
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
      put('.bytes', ofText(Math.min(received, bytes || received), bytes, bytesText));
      put('.triangles', ofText(shown, faces, countText));
      put('.splits', rate ? countText(Number(rate.toPrecision(2))) : '–');
      put('.error', pixelText(pixels));
      find('progress').value = bytes && received / bytes;
      form.elements.paused.disabled = Boolean(seconds);
      find('.state').classList.toggle('same', same);
    },
  };
}
