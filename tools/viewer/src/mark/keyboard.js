// Keys of the mark page, in addition to those of both pages.
import {listenToKeys, VIEW_ROWS, viewKeys} from '../keyboard.js';
import {TOOLS} from './tools.js';

export const SHEET = [
  ['Marks', [['Click', 'mark with the tool'], ['Shift+click', 'inside'], ['Alt+click', 'outside'], ['drag', 'move a mark'], ['Delete', 'remove the mark or the outline under the cursor'],
    ['a', 'mark or corner at the crosshair'], ['z', 'undo'], ['Shift+z', 'redo']]],
  ['Tools', [...TOOLS.map(([, label, key]) => [key, label]), [', .', 'smaller, larger brush'], ['d', 'brush: disc or ball'], ['Enter', 'close the outline'], ['Shift+Enter', 'end it open'], ['Escape', 'cancel']]],
  ['Structures', [['1\u20269', 'choose'], ['Shift+n', 'new structure'], ['F2', 'rename'], ['h', 'hide or show'], ['l', 'lock']]],
  ['Suggestions', [['n', 'where a mark would help; the next one'], ['Enter', 'the border is at the ring'], ['click', 'the border is there']]],
  ['Views', [...VIEW_ROWS, ['y', 'oblique plane in 3D, facing you'], ['[ ]', 'in 3D: moves the oblique plane']]],
];

/** `app` has state, study, tools, panels, image and the other parts of the page. */
export function keyboard(app, {suggestions, sidebar, help, theme, oblique, view}) {
  const {state, study, tools, space} = app, {keys: shared, panel, moveCrosshair} = viewKeys(app, {help, theme, view});
  const own = () => tools.active() ?? study.structures[0];

  function atCrosshair() {
    const index = state.get('slices');
    if (state.get('tool') === 'outline') return tools.addCorners(panel(), [[index[panel().right], index[panel().down]]]);
    return tools.addMark(['inside', 'outside'].includes(state.get('tool')) ? state.get('tool') : 'surface', space.toWorld(index));
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

  // In 3D the keys of slices move the oblique plane.
  const stepOf = (key, by) => () => document.activeElement === view()?.canvas && state.get('oblique') ? view().stepOblique(by) : shared[key]();
  const keys = {
    ...shared, '[': stepOf('[', -1), ']': stepOf(']', 1), '{': stepOf('{', -10), '}': stepOf('}', 10), y: () => oblique.click(), z: () => study.act({do: 'undo'}), Z: () => study.act({do: 'redo'}),
    n: () => suggestions.next(), N: () => tools.addStructure(), F2: () => sidebar.rename(), a: atCrosshair, Escape: cancel,
    ',': () => tools.resizeBrush(1 / 1.25), '.': () => tools.resizeBrush(1.25), d: () => tools.toggleBall(),
    h: () => own() && tools.change('show', own().id, !own().visible), l: () => own() && tools.change('lock', own().id, !own().locked),
    Delete: () => tools.remove(state.get('hover') ?? state.get('selected')),
    Backspace: () => tools.dropCorner() || tools.remove(state.get('hover') ?? state.get('selected')),
  };
  for (const [tool, , key] of TOOLS) keys[key] = () => state.set({tool});
  const digit = (n) => { if (study.structures[n]) state.set({active: study.structures[n].id, selected: null}); };
  listenToKeys(keys, {help, view, moveCrosshair, enter, digit});
}
