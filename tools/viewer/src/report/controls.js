// What is switched around the 3D view, and the list of suggested slices.
import {colorings, rangeOf, SUPPORT, viridis} from '../colors.js';
import {choice, colorOf, dot, el, number, toggle} from '../dom.js';
import {planeName} from '../space.js';

/** The structures: names, colours, on and off. */
export function structureList(data, state) {
  return el('ul', {class: 'structures'}, data.structures.map((structure, n) => {
    const box = el('input', {type: 'checkbox', checked: true, onchange: () => {
      const visible = [...state.get('visible')];
      visible[n] = box.checked;
      state.set({visible});
    }});
    return el('li', {}, el('label', {}, box, dot(structure.color), el('span', {}, structure.name)));
  }));
}

function legend(data, name) {
  if (name === 'structure') return null;
  if (name === 'support')
    return ['on marks', 'on edges', 'on neither'].map((word, n) => el('span', {class: 'key'}, dot(SUPPORT[n]), word));
  const [low, high] = rangeOf(data.structures, name), bar = el('span', {class: 'ramp'});
  bar.style.background = `linear-gradient(to right, ${Array.from({length: 9}, (_, n) => colorOf(viridis(n / 8).map(Math.round))).join(', ')})`;
  const unit = name === 'distance_to_marks' && data.unitText ? `\u2009${data.unitText}` : '';
  return [el('span', {}, number(low, 3)), bar, el('span', {}, `${number(high, 3)}${unit}`)];
}

function slider(label, min, max, value, change) {
  const input = el('input', {type: 'range', min, max, step: (max - min) / 100, value, 'aria-label': label, oninput: () => change(Number(input.value))});
  return el('label', {class: 'small-slider'}, label, input);
}

/** The row below the 3D view. */
export function toolbar(data, state, volume, view) {
  const names = [0, 1, 2].map((axis) => volume ? planeName(volume, axis, data.anatomical) : 'xyz'[axis]);
  const parts = [];
  if (data.structures.some((s) => s.marks.length > 0)) parts.push(toggle('marks', state.get('marks'), (marks) => state.set({marks}), {'data-key': 'marks'}));
  if (volume)
    parts.push(el('div', {class: 'choice', role: 'group', 'aria-label': 'slice planes'}, el('span', {}, 'slices'), [2, 1, 0].map((axis) =>
      toggle(names[axis], state.get('planes')[axis], (on) => {
        const planes = [...state.get('planes')];
        planes[axis] = on;
        state.set({planes});
      }, {'data-plane': axis}))));
  const cut = choice([[-1, 'none'], [2, names[2]], [1, names[1]], [0, names[0]]], -1, (axis) => state.set({cut: axis}), 'cut the surface at a slice');
  parts.push(el('div', {class: 'group'}, el('span', {}, 'cut'), cut, toggle('\u21c4', false, (flip) => state.set({flip}), {title: 'the other half', 'aria-label': 'the other half'})));
  if (!volume) parts.push(slider('place', 0, 1, 0.5, (cutShare) => state.set({cutShare, slices: [...state.get('slices')]})));
  parts.push(slider('opacity', 0, 1, 1, (opacity) => state.set({opacity})));
  const colors = colorings(data.structures), key = el('div', {class: 'legend'});
  if (colors.length > 1) {
    const select = el('select', {'aria-label': 'colour by', onchange: () => state.set({coloring: select.value})}, colors.map(([value, name]) => el('option', {value}, name)));
    parts.push(el('label', {class: 'group'}, 'colour', select), key);
    state.on(['coloring'], () => { key.replaceChildren(...[legend(data, state.get('coloring'))].flat().filter(Boolean)); });
  }
  parts.push(el('button', {type: 'button', class: 'toggle', onclick: () => view()?.reset()}, 'reset view'));
  return el('div', {class: 'toolbar'}, parts);
}

/** Black and white of the slices. */
export function contrast(state) {
  const window = {black: 0, white: 255};
  const set = (name) => (share) => { window[name] = Math.round(255 * share); state.set({grey: greyTable(window)}); };
  return el('div', {class: 'contrast'}, el('span', {}, 'contrast'), slider('black', 0, 1, 0, set('black')), slider('white', 0, 1, 1, set('white')));
}

export function greyTable({black, white}) {
  const table = new Uint8Array(256), range = Math.max(1, white - black);
  for (let n = 0; n < 256; ++n) table[n] = Math.min(255, Math.max(0, Math.round(255 * (n - black) / range)));
  table.key = `${black} ${white}`;
  return table;
}

/** Places where new marks would help most; a click goes there. */
export function suggestions(data, state, volume) {
  const items = data.structures.flatMap((structure) => (structure.evidence?.suggestions ?? []).map((s) => ({structure, ...s})));
  if (items.length === 0) return null;
  const unit = data.unitText ? `\u2009${data.unitText}\u00b2` : '';
  const buttons = items.map((item) => el('button', {type: 'button', class: 'suggestion', 'data-slice': item.slice, onclick: () => {
    for (const other of buttons) other.removeAttribute('aria-current');
    buttons[items.indexOf(item)].setAttribute('aria-current', 'true');
    const index = volume?.fromFileIndex(item.index), most = volume?.size;
    state.set({...(volume ? {slices: index.map((at, a) => Math.min(most[a] - 1, Math.max(0, Math.round(at))))} : {}), focus: item.world});
  }}, data.structures.length > 1 ? dot(item.structure.color) : null, el('strong', {}, `slice ${item.slice}`),
  el('small', {}, `supports ${number(item.area, 3)}${unit}`)));
  return el('section', {class: 'suggestions', 'aria-label': 'where new marks would help most'},
    el('span', {class: 'lead'}, 'New marks would help most in'), el('div', {class: 'items'}, buttons));
}
