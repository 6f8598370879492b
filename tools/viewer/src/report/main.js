// The page: views, switches, facts.
import {contrast, greyTable, structureList, suggestions, toolbar} from './controls.js';
import {readData} from './data.js';
import {el, unitText} from '../dom.js';
import {factsOf, warningsOf} from './facts.js';
import {indexCoordinates} from '../outline.js';
import {View3D} from './scene.js';
import {SlicePanel} from './slices.js';
import {axisTriad, stageIn} from '../stage3d.js';
import {State} from '../state.js';
import {themeButton} from '../theme.js';
import {Volume} from './volume.js';

const MOST_MARKS = 10000;  // more hide what they lie on, at first

function middleOf(structures, volume) {
  const low = [Infinity, Infinity, Infinity], high = low.map((x) => -x);
  for (const {mesh} of structures)
    for (let a = 0; a < 3; ++a) {
      low[a] = Math.min(low[a], mesh.min[a]);
      high[a] = Math.max(high[a], mesh.max[a]);
    }
  const index = volume.toIndex(low.map((x, a) => (x + high[a]) / 2));
  return index.map((at, a) => Math.min(volume.size[a] - 1, Math.max(0, Math.round(at))));
}

function keyboard(state, panels, view, theme) {
  document.addEventListener('keydown', (event) => {
    if (event.target.matches?.('input, select, textarea') || event.ctrlKey || event.metaKey || event.altKey) return;
    const click = (selector) => document.querySelector(selector)?.click();
    const actions = {
      m: () => click('[data-key=marks]'), t: () => theme.click(), r: () => view()?.reset(),
      '[': () => panels[2]?.go(panels[2].at - 1), ']': () => panels[2]?.go(panels[2].at + 1),
      1: () => click('[data-plane="2"]'), 2: () => click('[data-plane="1"]'), 3: () => click('[data-plane="0"]'),
      Escape: () => state.set({large: -1, focus: null}),
    };
    actions[event.key]?.();
  });
}

async function start() {
  const page = document.getElementById('page');
  const data = await readData();
  data.unitText = unitText(data.unit);
  const volume = data.image ? new Volume(data.image) : null;
  for (const structure of data.structures) {
    if (!volume) continue;
    structure.index = indexCoordinates(structure.positions, volume);
    structure.markIndex = indexCoordinates(structure.marks, volume);
  }
  const slices = volume ? middleOf(data.structures, volume) : [0, 0, 0];
  const state = new State({slices, visible: data.structures.map(() => true), marks: !data.structures.some((s) => s.markCount > MOST_MARKS), planes: [false, false, Boolean(volume)], cut: -1, flip: false,
    cutShare: 0.5, opacity: 1, coloring: 'structure', grey: greyTable({black: 0, white: 255}), focus: null, large: -1, decoded: 0, theme: 'light'});
  const theme = themeButton(state, '\u25d0');
  if (volume) await volume.decodeSlice(slices[2]);

  let view = null;
  const holder = el('div', {class: 'picture'});
  const three = el('section', {class: 'panel three'}, holder, structureList(data, state));
  const panels = volume ? [0, 1, 2].map((axis) => new SlicePanel(axis, data, state, volume)) : [];
  const left = el('div', {class: 'left'}, three, toolbar(data, state, volume, () => view));
  const right = volume ? el('div', {class: 'right'}, panels[2].element, el('div', {class: 'pair'}, panels[1].element, panels[0].element), contrast(state)) : null;
  const stage = el('div', {class: `stage${volume ? '' : ' alone'}`}, left, right);
  const warnings = warningsOf(data);
  let figures;
  try {
    figures = factsOf(data);
  } catch (error) {  // a report that another version wrote
    figures = el('p', {class: 'notice'}, `The figures of this run cannot be shown: ${error.message}.`);
  }
  page.replaceChildren(
    el('header', {}, el('span', {class: 'mark'}, 'covol'), el('h1', {}, data.title), warnings && el('a', {class: 'badge', href: '#warnings'}, warnings.label), theme),
    el('main', {}, stage, suggestions(data, state, volume), warnings?.element, figures,
      el('footer', {}, 'Keys: m marks, 1 2 3 slice planes, [ ] slice, r reset view, t dark or light; arrows on a focused view.')));
  state.on(['large'], () => {
    stage.dataset.large = state.get('large');
    for (const panel of panels) panel.later();
  });
  view = stageIn(holder, {label: 'the surfaces in 3D; drag or arrow keys turn them', triad: axisTriad(data.anatomical),
    otherwise: volume ? 'The slices beside it work.' : 'The figures below work.'}, (canvas) => new View3D(canvas, data, state, volume));
  for (const panel of panels) panel.draw();
  keyboard(state, panels, () => view, theme);
  window.covolReport = {data, state, volume, view, panels, ready: performance.now(), done: !volume};
  if (!volume) return;
  let count = 0;
  await volume.decodeAll(slices[2], () => state.set({decoded: ++count}));
  window.covolReport.done = true;
  window.covolReport.decoded = performance.now();
}

start().catch((error) => {
  const why = typeof DecompressionStream === 'undefined' ? 'this browser is too old for it (DecompressionStream is missing)' : error.message;
  document.getElementById('page').replaceChildren(el('p', {class: 'notice'}, `The page cannot be shown: ${why}.`));
  throw error;
});
