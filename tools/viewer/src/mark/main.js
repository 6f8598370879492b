// The page of covol mark: an image in three planes, its marks, and the surfaces that are computed from them.
import {el, unitText} from '../dom.js';
import {greyTable} from '../grey.js';
import {icon} from '../icons.js';
import {helpSheet, showFocus} from '../keyboard.js';
import {remember, VIEW_NAMES, viewState} from '../kept_view.js';
import {hintsOf} from '../mark_tools.js';
import {keptOblique, OBLIQUE, obliqueButton, ObliqueScene} from '../oblique_scene.js';
import {PlanePanel} from '../plane_panel.js';
import {sceneTools} from '../scene_tools.js';
import {ImageSpace, planeName} from '../space.js';
import {axisTriad, scaleBar, stageIn} from '../stage3d.js';
import {State} from '../state.js';
import {statusRow} from '../status.js';
import {Store} from '../store.js';
import {Suggestions} from '../suggest.js';
import {themeButton} from '../theme.js';
import {Toasts} from '../toast.js';
import {Channels, keptMix} from './channels.js';
import {Connection} from './connection.js';
import {Files} from './files.js';
import {codesOf} from './image_plane.js';
import {keyboard, SHEET} from './keyboard.js';
import {linkBar} from './link_bar.js';
import {Meshes} from './meshes.js';
import {optionsSheet} from './options.js';
import {drawOverlay} from './overlay.js';
import {PaintPictures} from './paint.js';
import {PointerInput} from './pointer.js';
import {isReference, Queue} from './queue.js';
import {sidebar as makeSidebar} from './sidebar.js';
import {SliceStore} from './slice_store.js';
import {Study} from './study.js';
import {tableSheet} from './table.js';
import {Timing} from './timing.js';
import {toolbar} from './toolbar.js';
import {Tools, TOOLS} from './tools.js';

const KEPT = [...VIEW_NAMES, 'active', 'tool', 'brush', 'mix', 'oblique'];

function firstState(image, space, kept) {
  const view = viewState(image, space, kept, {cuts: [0, 1, 2, OBLIQUE]});
  const brush = kept.brush?.radius > 0 ? {radius: kept.brush.radius, isBall: kept.brush.isBall === true} : {radius: 5 * Math.min(...space.spacing), isBall: false};
  return new State({...view, grey: greyTable(image, view.window, view.colors), brush, mix: keptMix(kept.mix, image), oblique: keptOblique(kept.oblique), stroke: null, tool: TOOLS.some(([name]) => name === kept.tool) ? kept.tool : 'surface',
    active: Number.isInteger(kept.active) ? kept.active : null, selected: null, hover: null, drag: null, ring: null, suggested: 0, isAsking: false, ruler: null, draft: null,
    keyPanel: 2, link: 'connecting', waiting: 0, study: 0, meshes: 0, loaded: 0, theme: 'light'});
}

/** Updates the selection when structures change: references are replaced by IDs, and removed objects are deselected. */
function follow(state, study) {
  const known = (target) => {
    const own = target && study.structure(target.structure);
    if (!own) return null;
    const part = target.mark === undefined ? {outline: study.resolve(target.outline)} : {mark: study.resolve(target.mark)};
    const isThere = part.mark === undefined ? own.outlines.some((o) => o.id === part.outline) : own.marks.some((m) => m.id === part.mark);
    if (!isThere) return null;
    return own.id === target.structure && part.mark === target.mark && part.outline === target.outline ? target : {...target, structure: own.id, ...part};
  };
  study.on('change', () => {
    const active = study.resolve(state.get('active')), first = study.structures[0]?.id ?? null;
    // Before the page has received the first state (seq < 0), the active structure is kept, because it may exist.
    const isKept = study.seq < 0 || study.structure(active);
    state.set({study: state.get('study') + 1, active: isKept ? active : first, selected: known(state.get('selected')), hover: known(state.get('hover')), drag: known(state.get('drag'))});
  });
}

async function start() {
  const answer = await fetch('/image');
  if (!answer.ok) throw new Error(await answer.text());
  const image = await answer.json(), space = new ImageSpace(image), units = unitText(image.unit ?? '');
  document.title = `${image.name} \u2013 covol mark`;
  const store = new Store(`covol-mark/view/${image.name}`), kept = Object.fromEntries(KEPT.map((name) => [name, store.get(name)]));
  const state = firstState(image, space, kept), queue = new Queue(), study = new Study(queue), connection = new Connection(study, queue, state), toasts = new Toasts();
  const toast = (text, kind) => toasts.show(text, kind), timing = new Timing();
  const slices = new SliceStore(space, image, () => state.set({loaded: state.get('loaded') + 1}));
  const meshes = new Meshes(space, () => state.set({meshes: state.get('meshes') + 1}));
  const tools = new Tools({state, study, space, toast}), painting = new PaintPictures(space), files = new Files({study, tools, toast, queue});
  const app = {image, space, unitText: units, state, study, meshes, slices, tools, painting, files, toast, keep: (name, value) => store.set(name, value)};
  app.goTo = (world) => {
    const index = space.toIndex(world);
    state.set({slices: space.voxelAt(index)});
    for (const panel of app.panels) panel.reveal(index);
  };
  app.channels = new Channels(app);
  study.on('failed', (why) => toast(why, 'failed'));
  study.on('result', (result, isNew) => meshes.take(result, isNew));
  study.on('change', () => meshes.keepOnly(study.confirmed.map((s) => s.id)));
  state.on(['link'], () => { if (state.get('link') === 'open') slices.retry(); });
  follow(state, study);

  const panels = app.panels = [0, 1, 2].map((axis) => new PlanePanel(axis, app, {drawOverlay, Input: PointerInput, redrawnOn: ['draft', 'stroke', 'brush']}));
  const status = statusRow(app, hintsOf(TOOLS)), names = [0, 1, 2].map((axis) => planeName(space, axis, image.anatomical));
  const suggestions = new Suggestions({...app, connection}), help = helpSheet(SHEET), table = tableSheet(app), options = optionsSheet(app);
  const theme = themeButton(state, icon('theme'), {get: () => new Store('covol-mark').get('theme'), set: (value) => new Store('covol-mark').set('theme', value)});
  let view = null;
  const oblique = obliqueButton(state, () => view, 'y');
  const holder = el('div', {class: 'picture'}), three = el('section', {class: 'panel three', 'aria-label': '3D'}, sceneTools(app, () => view, names, {more: [oblique], cuts: [[OBLIQUE, 'cut oblique']]}), holder);
  const sidebar = makeSidebar(app), stage = el('main', {class: 'stage'}, panels[2].element, three, panels[1].element, panels[0].element);
  document.getElementById('page').replaceChildren(toolbar(app, {theme, help, suggestions, table, options}), linkBar(state), stage, sidebar.element, status.element, toasts.element, files.input, help, table.dialog, options.dialog);
  const enlarge = () => { stage.dataset.large = state.get('large'); };
  state.on(['large'], enlarge);
  enlarge();
  view = stageIn(holder, {label: 'the surfaces in 3D: drag or arrow keys turn them, a click brings the planes there, Shift+click sets a mark', triad: axisTriad(image.anatomical), scale: scaleBar(units),
    otherwise: 'The planes beside it work.'}, (canvas) => new ObliqueScene(canvas, app));
  view?.addOblique(codesOf());
  view?.takeCamera(store.get('camera'));
  for (const panel of panels) {
    panel.showCursor = status.tell;
    panel.onPicture = (axis) => view?.movePlane(axis);
    panel.onShown = (mesh) => timing.drawn(mesh);
    panel.draw();
  }
  showFocus();
  keyboard(app, {suggestions, sidebar, help, theme, oblique, view: () => view});
  remember(state, store, KEPT, (name, value) => name !== 'active' || !isReference(value));
  // The browser warns before it closes a page whose unsent actions would be lost, because they could not be stored.
  addEventListener('beforeunload', (event) => { if (queue.isLost && queue.waiting > 0) event.preventDefault(); });
  connection.open();
  window.covolMark = {state, study, connection, queue, panels, view, meshes, slices, image, space, suggestions, timing, tools, files, channels: app.channels,
    get resultsSeen() { return study.resultsSeen; }, get lastShown() { return timing.lastShown; }, get lastAction() { return study.lastAction; }};
}

start().catch((error) => {
  document.getElementById('page').replaceChildren(el('p', {class: 'notice'}, `The page cannot be shown: ${error.message}`));
  throw error;
});
