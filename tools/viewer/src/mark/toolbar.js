// The row above the views: tools, undo, grey values, suggestions, files.
import {barButton, historyButtons, suggestButtons, toolChoice, windowMenu} from '../bar.js';
import {dot, el} from '../dom.js';
import {icon} from '../icons.js';
import {menu, menuItem} from '../menu.js';
import {TOOLS} from './tools.js';

function canUndo(study) {
  const waiting = study.queue.items.map(({action}) => action.do);
  return [study.canUndo || waiting.some((what) => what !== 'undo'), study.canRedo || waiting.includes('undo')];
}

const FILES_OF_ALL = [['mask.nii.gz', 'labels, NIfTI'], ['mask.nrrd', 'labels, NRRD'], ['mask.tif', 'labels, TIFF'], ['table.csv', 'table']];
const FILES_OF_ONE = [['mask.nii.gz', 'NIfTI'], ['mask.nrrd', 'NRRD'], ['mask.tif', 'TIFF'], ['mesh.ply', 'PLY'], ['mesh.stl', 'STL'], ['surface.vdb', 'VDB']];

function importMenu({files}) {
  const item = (as, text, close) => menuItem(text, () => { close(); files.choose(as); }, {'data-import': as});
  return menu('add files', [icon('import'), el('span', {class: 'caret'})], (close) => [item('points', 'Marks for the active structure\u2026', close), item('guess', 'A guess to correct\u2026', close), item('labels', 'Labels as structures\u2026', close),
    el('p', {class: 'hint'}, 'Or drop a file on the page: marks of napari, Fiji, 3D Slicer; a mask, a mesh or a level set of another tool.')]);
}

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

export function toolbar(app, {theme, help, suggestions, table, options}) {
  const {state, image} = app;
  state.on(['link'], () => { if (state.get('link') !== 'open') state.set({isAsking: false}); });
  theme.className = 'tool';
  return el('header', {class: 'bar'},
    el('div', {class: 'title'}, el('span', {class: 'brand'}, 'covol'), el('h1', {title: image.name}, image.name)),
    toolChoice(state, TOOLS), historyButtons(app, () => canUndo(app.study)), el('div', {class: 'tools'}, windowMenu(app, () => app.channels.items()), suggestButtons(state, suggestions)),
    el('div', {class: 'tools end'}, barButton('table', 'table of results', () => table.open()), barButton('options', 'options of the study', () => options.open()), importMenu(app), exportMenu(app), theme, barButton('help', 'keys (?)', () => help.showModal())));
}
