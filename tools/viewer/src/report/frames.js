// Frames of a time-lapse: each has a page of its own in the same folder, with the same view.
import {el} from '../dom.js';

/** A slider for the pages; null if there is only one. `step(by)` goes to another one. */
export function frameBar(frames) {
  if (!frames) return null;
  const {at, pages} = frames, last = pages.length - 1, text = el('output', {}, `${at} of 0\u2013${last}`);
  const go = (next) => { if (next !== at && next >= 0 && next <= last) location.href = encodeURIComponent(pages[next]); };
  const slider = el('input', {type: 'range', min: 0, max: last, step: 1, value: at, 'aria-label': 'frame', oninput: () => { text.textContent = `${slider.value} of 0\u2013${last}`; },
    onchange: () => go(Number(slider.value))});
  const button = (by, face, label) => el('button', {type: 'button', class: 'small', title: label, 'aria-label': label, disabled: at + by < 0 || at + by > last, onclick: () => go(at + by)}, face);
  const element = el('div', {class: 'tools frames', role: 'group', 'aria-label': 'frames'}, button(-1, '\u25c2', 'frame before (,)'), slider, button(1, '\u25b8', 'next frame (.)'), text);
  return {element, step: (by) => go(at + by)};
}
