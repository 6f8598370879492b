// The row above the views: tools, undo, grey values, suggestions, files.
import {dot, el} from '../dom.js';
import {isSame, presets} from './grey.js';
import {icon} from './icons.js';
import {menu, menuItem} from './menu.js';
import {TOOLS} from './tools.js';

function button(name, label, onclick, more = {}) {
  return el('button', {type: 'button', class: 'tool', title: label, 'aria-label': label, 'data-do': name, onclick, ...more}, icon(name));
}

function toolChoice(state) {
  const buttons = TOOLS.map(([name, label, key]) => button(name, `${label} (${key})`, () => state.set({tool: name}), {'data-tool': name}));
  const update = () => buttons.forEach((one) => one.setAttribute('aria-pressed', String(one.dataset.tool === state.get('tool'))));
  state.on(['tool'], update);
  update();
  return el('div', {class: 'tools', role: 'group', 'aria-label': 'tool'}, buttons);
}

function history(app) {
  const {study, state} = app;
  const undo = button('undo', 'undo (z)', () => study.act({do: 'undo'})), redo = button('redo', 'redo (Shift+z)', () => study.act({do: 'redo'}));
  const update = () => {
    const waiting = study.queue.items.filter(({action}) => action.do !== 'undo').length > 0;
    undo.disabled = !study.canUndo && !waiting;
    redo.disabled = !study.canRedo && !study.queue.items.some(({action}) => action.do === 'undo');
  };
  state.on(['study'], update);
  update();
  return el('div', {class: 'tools', role: 'group', 'aria-label': 'history'}, undo, redo);
}

function windowMenu({state, image, panels}) {
  return menu('grey values (w)', [icon('window'), el('span', {class: 'caret'})], (close) => [
    ...presets(image, panels[state.get('keyPanel')].slice).map(([name, window]) => menuItem(name, () => { state.set({window}); close(); },
      {role: 'menuitemradio', 'aria-checked': String(isSame(window, state.get('window')))})),
    menuItem('inverted', () => { const {black, white} = state.get('window'); state.set({window: {black: white, white: black}}); close(); }),
    el('p', {class: 'hint'}, 'Right-drag in a plane: across for contrast, up and down for brightness.'),
  ]);
}

const FILES_OF_ALL = [['mask.nii.gz', 'labels, NIfTI'], ['mask.nrrd', 'labels, NRRD'], ['mask.tif', 'labels, TIFF'], ['table.csv', 'table']];
const FILES_OF_ONE = [['mask.nii.gz', 'NIfTI'], ['mask.nrrd', 'NRRD'], ['mask.tif', 'TIFF'], ['mesh.ply', 'PLY'], ['mesh.stl', 'STL'], ['surface.vdb', 'VDB']];

function exportMenu({study}) {
  const link = (id, format, text) => el('a', {role: 'menuitem', tabindex: -1, href: `/export?structure=${id}&format=${format}`, download: '', title: format}, text);
  return menu('export', [icon('export'), el('span', {class: 'caret'})], (close) => {
    const hasSurface = (s) => s.result && s.result.stage !== 'empty' && s.result.triangles > 0, saved = study.structures.filter((s) => typeof s.id === 'number');
    const parts = [];
    if (saved.some(hasSurface)) parts.push(el('h3', {}, 'All structures'), el('div', {class: 'files'}, FILES_OF_ALL.map(([format, text]) => link(0, format, text))));
    for (const s of saved) {
      const files = [...(hasSurface(s) ? FILES_OF_ONE : []), ...(s.marks.length + s.outlines.length > 0 ? [['marks.csv', 'marks']] : [])];
      if (files.length > 0) parts.push(el('h3', {}, dot(s.color), el('span', {}, s.name)), el('div', {class: 'files'}, files.map(([format, text]) => link(s.id, format, text))));
    }
    if (parts.length === 0) parts.push(el('p', {class: 'hint'}, 'There is nothing to save yet.'));
    for (const part of parts) part.addEventListener('click', (event) => { if (event.target.closest('a')) close(); });
    return parts;
  });
}

export function toolbar(app, {theme, help, suggestions}) {
  const {state, image} = app;
  const suggest = el('button', {type: 'button', class: 'tool wide', title: 'where a mark would help most (n)', 'data-do': 'suggest', onclick: () => suggestions.next()}, icon('suggest'), el('span', {}, 'Suggest'));
  const accept = el('button', {type: 'button', class: 'tool wide accept', title: 'the border is at the ring (Enter)', 'data-do': 'accept', hidden: true, onclick: () => suggestions.accept()}, 'Border is here');
  state.on(['ring', 'suggested', 'isAsking', 'link'], () => {
    if (state.get('link') !== 'open') state.set({isAsking: false});
    accept.hidden = !state.get('ring');
    suggest.lastChild.textContent = state.get('isAsking') ? 'Asking\u2026' : state.get('suggested') > 0 ? `Next (${state.get('suggested')})` : 'Suggest';
  });
  theme.className = 'tool';
  return el('header', {class: 'bar'},
    el('div', {class: 'title'}, el('span', {class: 'brand'}, 'covol'), el('h1', {title: image.name}, image.name)),
    toolChoice(state), history(app), el('div', {class: 'tools'}, windowMenu(app), suggest, accept),
    el('div', {class: 'tools end'}, exportMenu(app), theme, button('help', 'keys (?)', () => help.showModal())));
}

/** What belongs to the 3D view, upon it. */
export function sceneTools(app, view, names) {
  const {state} = app;
  const planes = [2, 1, 0].map((axis) => el('button', {type: 'button', class: 'small', 'data-plane': axis, 'aria-label': `slice ${names[axis]} in 3D`, onclick: () => {
    const list = [...state.get('planes')];
    list[axis] = !list[axis];
    state.set({planes: list});
  }}, names[axis]));
  const cut = el('select', {class: 'small', 'aria-label': 'cut the surfaces at a slice', onchange: () => state.set({cut: Number(cut.value)})},
    [[-1, 'no cut'], ...[2, 1, 0].map((axis) => [axis, `cut ${names[axis]}`])].map(([value, text]) => el('option', {value}, text)));
  const flip = el('button', {type: 'button', class: 'small', title: 'the other half', 'aria-label': 'the other half', onclick: () => state.set({flip: !state.get('flip')})}, icon('flip'));
  const home = el('button', {type: 'button', class: 'small', title: 'reset the camera (r)', 'aria-label': 'reset the camera', onclick: () => view()?.reset()}, icon('home'));
  const large = el('button', {type: 'button', class: 'icon', title: '3D alone, and back (f)', 'aria-label': '3D alone, and back', onclick: () => state.set({large: state.get('large') === 3 ? -1 : 3})});
  const update = () => {
    planes.forEach((one) => one.setAttribute('aria-pressed', String(state.get('planes')[one.dataset.plane])));
    cut.value = state.get('cut');
    flip.hidden = state.get('cut') < 0;
    flip.setAttribute('aria-pressed', String(state.get('flip')));
    large.replaceChildren(icon(state.get('large') === 3 ? 'small' : 'large'));
  };
  state.on(['planes', 'cut', 'flip', 'large'], update);
  update();
  return el('div', {class: 'panel-head', ondblclick: (event) => { if (!event.target.closest('button, select')) large.click(); }},
    el('span', {class: 'chip plain'}, '3D'), el('span', {class: 'scene-tools'}, planes, cut, flip, home), large);
}
