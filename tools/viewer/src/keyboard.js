// Keys of both pages, and the sheet that lists keys.
import {el} from './dom.js';
import {isSame, presets} from './grey.js';

export const VIEW_ROWS = [['wheel, [ ]', 'slice; with Shift 10'], ['Ctrl+wheel, + \u2212', 'zoom'], ['middle, Space+drag', 'move the picture'], ['Ctrl+click, x', 'crosshair to the cursor'],
  ['arrows', 'move the crosshair, turn 3D'], ['right-drag', 'grey values'], ['w', 'next grey values'], ['f', 'this view alone'], ['r', 'reset views'], ['v', 'slices in 3D'],
  ['q', 'marks: show or hide'], ['k', 'count slices from 1, as Fiji does'], ['t', 'dark or light'], ['?', 'this sheet']];

/** The dialog that lists all keys; `parts` is a list of [title, rows of [key, description]]. */
export function helpSheet(parts) {
  const dialog = el('dialog', {class: 'help', 'aria-label': 'keys', onclick: (event) => { if (event.target === dialog) dialog.close(); }},
    el('div', {class: 'help-head'}, el('h2', {}, 'Keys'), el('button', {type: 'button', class: 'icon', 'aria-label': 'close', onclick: () => dialog.close()}, '\u2715')),
    el('div', {class: 'sheet'}, parts.map(([title, rows]) => el('section', {}, el('h3', {}, title),
      el('dl', {}, rows.map(([key, what]) => [el('dt', {}, el('kbd', {}, key)), el('dd', {}, what)]))))));
  return dialog;
}

/** Actions of the keys of VIEW_ROWS; `app` has state, panels, image and space, and `view()` returns the 3D view. */
export function viewKeys(app, {help, theme, view}) {
  const {state, panels, image, space} = app, panel = () => panels[state.get('keyPanel')], step = (by) => panel()?.go(panel().at + by);

  function moveCrosshair(key, by) {
    if (!panel()) return;
    const {plane} = panel(), [axis, flip, sign] = {ArrowLeft: [plane.right, plane.flipX, -1], ArrowRight: [plane.right, plane.flipX, 1], ArrowUp: [plane.down, plane.flipY, -1], ArrowDown: [plane.down, plane.flipY, 1]}[key];
    const slices = [...state.get('slices')];
    slices[axis] = Math.min(space.size[axis] - 1, Math.max(0, slices[axis] + (flip ? -sign : sign) * by));
    state.set({slices});
    panel().reveal(slices);
  }

  function nextWindow() {
    if (!panel()) return;
    const list = presets(image, panel().slice), at = list.findIndex(([, window]) => isSame(window, state.get('window'))), [name, window] = list[(at + 1) % list.length];
    state.set({window});
    app.toast(`grey values: ${name}`);
  }

  const keys = {
    '[': () => step(-1), ']': () => step(1), '{': () => step(-10), '}': () => step(10), PageUp: () => step(10), PageDown: () => step(-10),
    '+': () => panel()?.zoomAt(1.3), '=': () => panel()?.zoomAt(1.3), '-': () => panel()?.zoomAt(1 / 1.3), w: nextWindow, t: () => theme.click(), '?': () => help.showModal(),
    x: () => { const input = panel()?.input; if (input?.spot) input.moveCrosshair(input.spot); },
    f: () => state.set({large: state.get('large') >= 0 ? -1 : document.activeElement === view()?.canvas || !panel() ? 3 : state.get('keyPanel')}),
    r: () => { state.set({views: [null, null, null]}); view()?.reset(); },
    v: () => state.set({planes: state.get('planes').every(Boolean) ? [false, false, false] : [true, true, true]}),
    q: () => state.set({marks: !state.get('marks')}),
    k: () => state.set({countFrom: 1 - state.get('countFrom')}),
  };
  return {keys, panel, moveCrosshair};
}

/**
 * Dispatches keys: `keys` are actions by key, `enter(event)` returns whether it handled the key, `digit(n)` counts from 0.
 * Outside of elements that match `taking`, arrow and page keys keep their default action.
 */
export function listenToKeys(keys, {help, view, moveCrosshair, enter, digit, taking = 'body, canvas'}) {
  document.addEventListener('keydown', (event) => {
    const {key, target} = event, isText = target.matches?.('input:not([type=range]):not([type=color]):not([type=checkbox]), select, textarea'), isOnControl = target.matches?.('button, a, input, select, summary');
    if (help.open || document.querySelector('dialog[open]') || isText) return;
    const isTyped = event.getModifierState('AltGraph');  // on many keyboard layouts, [ and ] are typed with AltGr
    if (!isTyped && (event.ctrlKey || event.metaKey)) {
      const act = {z: event.shiftKey ? keys.Z : keys.z, Z: keys.Z, y: keys.Z}[key];
      if (!act) return;
      event.preventDefault();
      return void act();
    }
    if (event.altKey && !isTyped) return;
    if (key === 'Enter') return void (isOnControl ? null : enter(event) && event.preventDefault());
    if (key.startsWith('Arrow')) {
      if (event.defaultPrevented || isOnControl || target === view()?.canvas || !target.matches?.(taking)) return;
      event.preventDefault();
      return void moveCrosshair(key, event.shiftKey ? 10 : 1);
    }
    if (key === ' ') return void (target.matches?.('canvas') && event.preventDefault());
    if (/^[1-9]$/.test(key)) return void digit(Number(key) - 1);
    if (key.startsWith('Page') && !target.matches?.(taking)) return;
    const act = keys[key];
    if (!act) return;
    event.preventDefault();
    act();
  });
}

/** Shows a frame around the focused element after a key was pressed, until the pointer is used again. */
export function showFocus() {
  addEventListener('keydown', ({key}) => { if (/^(Tab|Arrow.*|Page.*|[[\]{}a])$/.test(key)) document.documentElement.dataset.keys = 'on'; });
  addEventListener('pointerdown', () => { delete document.documentElement.dataset.keys; }, true);
}
