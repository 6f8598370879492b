// The page of covol report: the image in three planes, surfaces and marks, and the figures of the run. It needs no
// server.
import {barButton, historyButtons, suggestButtons, toolChoice, windowMenu} from '../bar.js';
import {colorings} from '../colors.js';
import {el, unitText} from '../dom.js';
import {greyTable} from '../grey.js';
import {icon} from '../icons.js';
import {remember, VIEW_NAMES, viewState} from '../kept_view.js';
import {helpSheet, showFocus} from '../keyboard.js';
import {MarkPointer} from '../mark_pointer.js';
import {hintsOf, MARK_TOOLS, MarkTools} from '../mark_tools.js';
import {keptOblique, OBLIQUE, obliqueButton} from '../oblique_scene.js';
import {indexCoordinates} from '../outline.js';
import {PlanePanel} from '../plane_panel.js';
import {sceneTools} from '../scene_tools.js';
import {planeName} from '../space.js';
import {axisTriad, scaleBar, stageIn} from '../stage3d.js';
import {State} from '../state.js';
import {statusRow} from '../status.js';
import {Store} from '../store.js';
import {Suggestions} from '../suggest.js';
import {themeButton} from '../theme.js';
import {Toasts} from '../toast.js';
import {lookBox, marksButton, suggestedPlaces, suggestionList} from './controls.js';
import {readData} from './data.js';
import {exportMenu} from './export_menu.js';
import {factsOf, warningsOf} from './facts.js';
import {frameBar} from './frames.js';
import {keyboard, SHEET} from './keyboard.js';
import {LocalStudy} from './local_study.js';
import {drawOverlay} from './overlay.js';
import {ReportScene} from './scene.js';
import {saveTable, structureTable} from './table.js';
import {spaceAround, Volume, VolumeSlices} from './volume.js';

const MAX_MARKS = 10000;  // if there are more, marks are hidden at first, because they would hide the surface
const KEPT = [...VIEW_NAMES, 'tool', 'active', 'coloring', 'opacity', 'oblique'];

const middleOf = ({mesh: {min, max}}) => min.map((x, a) => (x + max[a]) / 2);

function firstState(image, space, data, kept) {
  const view = viewState(image, space, kept, {slices: space.voxelAt(space.toIndex(middleOf(data.structures[0]))), marks: !data.structures.some((s) => s.markCount > MAX_MARKS), cuts: data.image ? [0, 1, 2, OBLIQUE] : [0, 1, 2]});
  return new State({...view, grey: greyTable(image, view.window, view.colors), tool: MARK_TOOLS.some(([name]) => name === kept.tool) ? kept.tool : 'crosshair',
    active: data.structures[kept.active - 1] ? kept.active : 1, coloring: colorings(data.structures).some(([name]) => name === kept.coloring) ? kept.coloring : 'structure',
    oblique: keptOblique(kept.oblique), opacity: typeof kept.opacity === 'number' && kept.opacity >= 0 && kept.opacity <= 1 ? kept.opacity : 1, selected: null, hover: null, drag: null, ring: null, suggested: 0, isAsking: false, ruler: null,
    keyPanel: 2, study: 0, meshes: 0, loaded: 0, theme: 'light'});
}

/** Removes the selection when its mark is removed. */
function follow(state, study) {
  const known = (target) => target && study.structure(target.structure)?.marks.some((m) => m.id === target.mark) ? target : null;
  study.on('change', () => state.set({study: state.get('study') + 1, selected: known(state.get('selected')), hover: known(state.get('hover')), drag: known(state.get('drag'))}));
}

/** Objects that the parts of the page share. */
function appOf(data, digest) {
  const base = data.origin ?? [0, 0, 0], volume = data.image ? new Volume(data.image, base) : null, space = volume ?? spaceAround(data.structures, base);
  const {black, white} = data.image ?? {black: 0, white: 1}, image = {black, white, low: black, high: white, anatomical: data.anatomical};
  for (const structure of data.structures) Object.assign(structure, {index: indexCoordinates(structure.positions, space), isShown: true});
  // All pages of a time-lapse store their view under the same name, that of the first page, so that they have the same
  // view.
  const view = new Store(`covol-report/${data.frames ? `${location.pathname.replace(/[^/]*$/, '')}${data.frames.pages[0]}` : digest}`, () => sessionStorage), kept = Object.fromEntries(KEPT.map((name) => [name, view.get(name)]));
  const state = firstState(image, space, data, kept), study = new LocalStudy(data.structures, new Store(`covol-report/${digest}`)), toasts = new Toasts();
  const app = {data, image, volume, space, unitText: data.unitText, state, study, toasts, kept: view, panels: [], slices: volume && new VolumeSlices(volume),
    meshes: {get: (id) => data.structures[id - 1] ?? null}, toast: (text, kind) => toasts.show(text, kind), keep: (name, value) => view.set(name, value)};
  app.tools = new MarkTools(app);
  app.goTo = (world) => {
    const index = space.toIndex(world);
    state.set({slices: space.voxelAt(index)});
    for (const panel of app.panels) panel.reveal(index);
  };
  app.choose = (id) => {
    state.set({active: id, selected: null});
    app.goTo(middleOf(data.structures[id - 1]));
  };
  const places = suggestedPlaces(data);
  app.suggestions = new Suggestions({...app, connection: {ask: (_, id) => setTimeout(() => study.emit('suggestions', {structure: id, places: places.filter((place) => place.id === id)}))}});
  state.on(['window', 'colors'], () => state.set({grey: greyTable(image, state.get('window'), state.get('colors'))}));
  follow(state, study);
  return app;
}

function header(app, {theme, help, warnings, frames}) {
  const {state, study, volume, data} = app;
  theme.className = 'tool';
  return el('header', {class: 'bar'},
    el('div', {class: 'title'}, el('span', {class: 'brand'}, 'covol'), el('h1', {title: data.title}, data.title), warnings && el('a', {class: 'badge', href: '#warnings'}, warnings.label)),
    volume ? toolChoice(state, MARK_TOOLS) : null, historyButtons(app, () => [study.canUndo, study.canRedo]),
    el('div', {class: 'tools'}, volume ? windowMenu(app) : null, suggestedPlaces(data).length > 0 ? suggestButtons(state, app.suggestions) : null),
    frames?.element ?? null,
    el('div', {class: 'tools end'}, exportMenu(app, () => saveTable(app)), theme, barButton('help', 'keys (?)', () => help.showModal())));
}

/** The 3D view and the planes. */
function stageOf(app, view, oblique) {
  const {state, volume, space, image, panels} = app, holder = el('div', {class: 'picture'}), names = [0, 1, 2].map((axis) => volume ? planeName(space, axis, image.anatomical) : 'xyz'[axis]);
  const three = el('section', {class: 'panel three', 'aria-label': '3D'}, sceneTools(app, view, names, {more: [volume ? oblique : null, marksButton(state)], cuts: volume ? [[OBLIQUE, 'cut oblique']] : []}), holder, lookBox(app));
  const element = el('section', {class: `stage${volume ? '' : ' alone'}`, 'aria-label': 'views'}, three, panels.length > 0 ? [panels[2].element, panels[1].element, panels[0].element] : null);
  const enlarge = () => { element.dataset.large = state.get('large'); };
  state.on(['large'], enlarge);
  enlarge();
  return {element, holder};
}

async function start() {
  const {data, digest} = await readData();
  data.unitText = unitText(data.unit);
  const app = appOf(data, digest), {state, volume, panels, slices} = app;
  if (volume) await volume.decodeSlice(state.get('slices')[2]);
  if (volume) for (const axis of [0, 1, 2]) panels.push(new PlanePanel(axis, app, {drawOverlay, Input: MarkPointer}));
  let view = null, figures;
  const frames = frameBar(data.frames);
  const own = new Store('covol-report'), theme = themeButton(state, icon('theme'), {get: () => own.get('theme'), set: (value) => own.set('theme', value)});
  const help = helpSheet(SHEET), status = statusRow({...app, slices: slices ?? {valueAt: () => null}}, volume ? hintsOf(MARK_TOOLS) : Object.fromEntries(MARK_TOOLS.map(([tool]) => [tool, 'Shift and a click on the surface: a mark']))), warnings = warningsOf(data), oblique = obliqueButton(state, () => view, 'd'), stage = stageOf(app, () => view, oblique);
  try {
    figures = factsOf(data);
  } catch (error) {  // for example, a report of another version
    figures = el('p', {class: 'notice'}, `The figures of this run cannot be shown: ${error.message}.`);
  }
  document.getElementById('page').replaceChildren(header(app, {theme, help, warnings, frames}), el('main', {}, stage.element, status.element,
    el('div', {class: 'below'}, suggestionList(app), warnings?.element, structureTable(app), figures)), app.toasts.element, help);
  view = stageIn(stage.holder, {label: 'the surfaces in 3D: drag or arrow keys turn them, a click brings the planes there, Shift+click sets a mark', triad: axisTriad(data.anatomical), scale: scaleBar(data.unitText),
    otherwise: volume ? 'The slices beside it work.' : 'The figures below work.'}, (canvas) => new ReportScene(canvas, app));
  view?.takeCamera(app.kept.get('camera'));
  for (const panel of panels) {
    panel.showCursor = status.tell;
    panel.onPicture = (axis) => view?.movePlane(axis);
    panel.draw();
  }
  showFocus();
  keyboard(app, {suggestions: app.suggestions, help, theme, view: () => view, oblique, frames});
  remember(state, app.kept, KEPT);
  window.covolReport = {...app, view, ready: performance.now(), done: !volume};
  if (!volume) return;
  await volume.decodeAll(() => state.get('slices')[2], () => {
    slices.forget();
    for (const panel of panels) panel.forgetPicture();
    state.set({loaded: state.get('loaded') + 1});
  });
  Object.assign(window.covolReport, {done: true, decoded: performance.now()});
}

start().catch((error) => {
  const why = typeof DecompressionStream === 'undefined' ? 'this browser is too old for it (DecompressionStream is missing)' : error.message;
  document.getElementById('page').replaceChildren(el('p', {class: 'notice'}, `The page cannot be shown: ${why}.`));
  throw error;
});
