// Parts of the row above the views: tools, undo, grey values.
import {COLOR_MAPS} from './color_maps.js';
import {el} from './dom.js';
import {isSame, presets} from './grey.js';
import {icon} from './icons.js';
import {menu, menuItem} from './menu.js';

export function barButton(name, label, onclick, more = {}) {
  return el('button', {type: 'button', class: 'tool', title: label, 'aria-label': label, 'data-do': name, onclick, ...more}, icon(name));
}

/** Buttons that choose the tool; `tools` is a list of [name, label, key]. */
export function toolChoice(state, tools) {
  const buttons = tools.map(([name, label, key]) => barButton(name, `${label} (${key})`, () => state.set({tool: name}), {'data-tool': name}));
  const update = () => buttons.forEach((one) => one.setAttribute('aria-pressed', String(one.dataset.tool === state.get('tool'))));
  state.on(['tool'], update);
  update();
  return el('div', {class: 'tools', role: 'group', 'aria-label': 'tool'}, buttons);
}

/** The buttons undo and redo; `can()` returns two booleans: whether there are actions to undo, and actions to redo. */
export function historyButtons({study, state}, can) {
  const undo = barButton('undo', 'undo (z)', () => study.act({do: 'undo'})), redo = barButton('redo', 'redo (Shift+z)', () => study.act({do: 'redo'}));
  const update = () => { [undo.disabled, redo.disabled] = can().map((is) => !is); };
  state.on(['study'], update);
  update();
  return el('div', {class: 'tools', role: 'group', 'aria-label': 'history'}, undo, redo);
}

/** The menu of grey values; `more()` returns further entries for it. */
export function windowMenu({state, image, panels}, more = () => []) {
  return menu('grey values (w)', [icon('window'), el('span', {class: 'caret'})], (close) => [
    ...presets(image, panels[state.get('keyPanel')].slice).map(([name, window]) => menuItem(name, () => { state.set({window}); close(); },
      {role: 'menuitemradio', 'aria-checked': String(isSame(window, state.get('window')))})),
    el('h3', {}, 'Colours'),
    ...COLOR_MAPS.map((colors) => menuItem(colors, () => { state.set({colors}); close(); }, {role: 'menuitemradio', 'aria-checked': String(state.get('colors') === colors)})),
    ...more(),
    el('p', {class: 'hint'}, 'Right-drag in a plane: across for contrast, up and down for brightness.'),
  ]);
}

export function suggestButtons(state, suggestions) {
  const suggest = el('button', {type: 'button', class: 'tool wide', title: 'where a mark would help most (n)', 'aria-label': 'suggest where a mark would help', 'data-do': 'suggest', onclick: () => suggestions.next()}, icon('suggest'), el('span', {}, 'Suggest'));
  const accept = el('button', {type: 'button', class: 'tool wide accept', title: 'the border is at the ring (Enter)', 'data-do': 'accept', hidden: true, onclick: () => suggestions.accept()}, 'Border is here');
  state.on(['ring', 'suggested', 'isAsking'], () => {
    accept.hidden = !state.get('ring');
    suggest.lastChild.textContent = state.get('isAsking') ? 'Asking\u2026' : state.get('suggested') > 0 ? `Next (${state.get('suggested')})` : 'Suggest';
  });
  return [suggest, accept];
}
