// Keys of the report page, in addition to those of both pages.
import {listenToKeys, VIEW_ROWS, viewKeys} from '../keyboard.js';
import {isMarkTool, MARK_TOOLS} from '../mark_tools.js';

export const SHEET = [
  ['Marks', [['Click', 'mark with the tool'], ['Shift+click', 'inside; in 3D on the surface'], ['Alt+click', 'outside'], ['drag', 'move a mark'], ['Delete', 'remove the mark under the cursor'],
    ['a', 'mark at the crosshair'], ['z', 'undo'], ['Shift+z', 'redo']]],
  ['Tools', [...MARK_TOOLS.map(([, label, key]) => [key, label]), ['Escape', 'cancel']]],
  ['Structures', [['1\u20269', 'choose'], ['h', 'hide or show']]],
  ['Suggestions', [['n', 'where a mark would help; the next one'], ['Enter', 'the border is at the ring']]],
  ['Views', [...VIEW_ROWS, ['d', 'oblique plane in 3D, facing you'], ['[ ]', 'in 3D: moves the oblique plane'], [', .', 'frame of a time-lapse']]],
];

/** `app` has state, study, tools, panels, image and space. */
export function keyboard(app, {suggestions, help, theme, view, oblique, frames}) {
  const {state, study, tools, space} = app, {keys: shared, moveCrosshair} = viewKeys(app, {help, theme, view});
  const own = () => tools.active() ?? study.structures[0], target = () => state.get('hover') ?? state.get('selected');
  const cancel = () => {
    if (state.get('ruler')) return state.set({ruler: null});
    if (state.get('ring')) return suggestions.clear();
    if (state.get('selected')) return state.set({selected: null});
    return state.set({large: -1});
  };
  // In 3D the keys of slices move the oblique plane.
  const stepOf = (key, by) => () => document.activeElement === view()?.canvas && state.get('oblique') ? view().stepOblique(by) : shared[key]();
  const keys = {
    ...shared, '[': stepOf('[', -1), ']': stepOf(']', 1), '{': stepOf('{', -10), '}': stepOf('}', 10), ',': () => frames?.step(-1), '.': () => frames?.step(1), d: () => app.volume && oblique.click(), z: () => study.act({do: 'undo'}), Z: () => study.act({do: 'redo'}), n: () => suggestions.next(), Escape: cancel,
    a: () => tools.addMark(isMarkTool(state.get('tool')) ? state.get('tool') : 'surface', space.toWorld(state.get('slices'))),
    h: () => study.act({do: 'show', structure: own().id, visible: !own().visible}), Delete: () => tools.remove(target()), Backspace: () => tools.remove(target()),
  };
  for (const [tool, , key] of MARK_TOOLS) keys[key] = () => state.set({tool});
  const digit = (n) => { if (study.structures[n]) state.set({active: study.structures[n].id, selected: null}); };
  // The page is longer than the window: arrow keys scroll it, except on a plane.
  listenToKeys(keys, {help, view, moveCrosshair, digit, enter: () => suggestions.accept(), taking: 'canvas'});
}
