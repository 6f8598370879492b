// Keys for everything, and the sheet that lists them.
import {el} from '../dom.js';
import {isSame, presets} from './grey.js';
import {TOOLS} from './tools.js';

const SHEET = [
  ['Marks', [['Click', 'mark with the tool'], ['Shift+click', 'inside'], ['Alt+click', 'outside'], ['drag', 'move a mark'], ['Delete', 'remove the mark or the outline under the cursor'],
    ['a', 'mark or corner at the crosshair'], ['z', 'undo'], ['Shift+z', 'redo']]],
  ['Tools', [...TOOLS.map(([, label, key]) => [key, label]), ['Enter', 'close the outline'], ['Shift+Enter', 'end it open'], ['Escape', 'cancel']]],
  ['Structures', [['1\u20269', 'choose'], ['Shift+n', 'new structure'], ['F2', 'rename'], ['h', 'hide or show'], ['l', 'lock']]],
  ['Suggestions', [['n', 'where a mark would help; the next one'], ['Enter', 'the border is at the ring'], ['click', 'the border is there']]],
  ['Views', [['wheel, [ ]', 'slice; with Shift 10'], ['Ctrl+wheel, + \u2212', 'zoom'], ['middle, Space+drag', 'move the picture'], ['Ctrl+click, x', 'crosshair to the cursor'], ['arrows', 'move the crosshair, turn 3D'],
    ['right-drag', 'grey values'], ['w', 'next grey values'], ['f', 'this view alone'], ['r', 'reset views'], ['v', 'slices in 3D'], ['t', 'dark or light'], ['?', 'this sheet']]],
];

export function helpSheet() {
  const dialog = el('dialog', {class: 'help', 'aria-label': 'keys', onclick: (event) => { if (event.target === dialog) dialog.close(); }},
    el('div', {class: 'help-head'}, el('h2', {}, 'Keys'), el('button', {type: 'button', class: 'icon', 'aria-label': 'close', onclick: () => dialog.close()}, '\u2715')),
    el('div', {class: 'sheet'}, SHEET.map(([title, rows]) => el('section', {}, el('h3', {}, title),
      el('dl', {}, rows.map(([key, what]) => [el('dt', {}, el('kbd', {}, key)), el('dd', {}, what)]))))));
  return dialog;
}

/** `app` has state, study, tools, panels, image and the rest of the page. */
export function keyboard(app, {suggestions, sidebar, help, theme, view}) {
  const {state, study, tools, panels, image, space} = app;
  const panel = () => panels[state.get('keyPanel')];
  const own = () => tools.active() ?? study.structures[0];
  const step = (by) => panel().go(panel().at + by);

  function atCrosshair() {
    const index = state.get('slices');
    if (state.get('tool') === 'outline') return tools.addCorners(panel(), [[index[panel().right], index[panel().down]]]);
    return tools.addMark(['inside', 'outside'].includes(state.get('tool')) ? state.get('tool') : 'surface', space.toWorld(index));
  }

  function moveCrosshair(key, by) {
    const {plane} = panel(), [axis, flip, sign] = {ArrowLeft: [plane.right, plane.flipX, -1], ArrowRight: [plane.right, plane.flipX, 1], ArrowUp: [plane.down, plane.flipY, -1], ArrowDown: [plane.down, plane.flipY, 1]}[key];
    const slices = [...state.get('slices')];
    slices[axis] = Math.min(space.size[axis] - 1, Math.max(0, slices[axis] + (flip ? -sign : sign) * by));
    state.set({slices});
    panel().reveal(slices);
  }

  function nextWindow() {
    const list = presets(image, panel().slice), at = list.findIndex(([, window]) => isSame(window, state.get('window'))), [name, window] = list[(at + 1) % list.length];
    state.set({window});
    app.toast(`grey values: ${name}`);
  }

  function cancel() {
    if (state.get('draft')) return state.set({draft: null});
    if (state.get('ruler')) return state.set({ruler: null});
    if (state.get('ring')) return suggestions.clear();
    if (state.get('selected')) return state.set({selected: null});
    return state.set({large: -1});
  }

  function enter(event) {
    if (state.get('draft')) tools.closeDraft(!event.shiftKey);
    else if (!suggestions.accept()) return false;
    return true;
  }

  const keys = {
    z: () => study.act({do: 'undo'}), Z: () => study.act({do: 'redo'}), '[': () => step(-1), ']': () => step(1), '{': () => step(-10), '}': () => step(10),
    PageUp: () => step(10), PageDown: () => step(-10), '+': () => panel().zoomAt(1.3), '=': () => panel().zoomAt(1.3), '-': () => panel().zoomAt(1 / 1.3),
    n: () => suggestions.next(), N: () => tools.addStructure(), F2: () => sidebar.rename(), a: atCrosshair, Escape: cancel, w: nextWindow, t: () => theme.click(), '?': () => help.showModal(),
    x: () => { const {input} = panel(); if (input.spot) input.moveCrosshair(input.spot); },
    f: () => state.set({large: state.get('large') >= 0 ? -1 : document.activeElement === view()?.canvas ? 3 : state.get('keyPanel')}),
    r: () => { state.set({views: [null, null, null]}); view()?.reset(); },
    v: () => state.set({planes: state.get('planes').every(Boolean) ? [false, false, false] : [true, true, true]}),
    h: () => own() && tools.change('show', own().id, !own().visible), l: () => own() && tools.change('lock', own().id, !own().locked),
    Delete: () => tools.remove(state.get('hover') ?? state.get('selected')),
    Backspace: () => tools.dropCorner() || tools.remove(state.get('hover') ?? state.get('selected')),
  };
  for (const [tool, , key] of TOOLS) keys[key] = () => state.set({tool});

  document.addEventListener('keydown', (event) => {
    const {key, target} = event, isText = target.matches?.('input:not([type=range]):not([type=color]), select, textarea'), isOnControl = target.matches?.('button, a, input, select, summary');
    if (help.open || isText) return;
    const isTyped = event.getModifierState('AltGraph');  // [ and ] on many keyboards
    if (!isTyped && (event.ctrlKey || event.metaKey)) {
      const act = {z: event.shiftKey ? keys.Z : keys.z, Z: keys.Z, y: keys.Z}[key];
      if (!act) return;
      event.preventDefault();
      return void act();
    }
    if (event.altKey && !isTyped) return;
    if (key === 'Enter') return void (isOnControl ? null : enter(event) && event.preventDefault());
    if (key === ' ') return void (isOnControl ? null : event.preventDefault());
    if (key.startsWith('Arrow')) {
      if (event.defaultPrevented || isOnControl || target === view()?.canvas) return;
      event.preventDefault();
      return void moveCrosshair(key, event.shiftKey ? 10 : 1);
    }
    if (/^[1-9]$/.test(key)) {
      const structure = study.structures[Number(key) - 1];
      return void (structure && state.set({active: structure.id, selected: null}));
    }
    const act = keys[key];
    if (!act) return;
    event.preventDefault();
    act();
  });
}
