// Stores the view over a reload: slices, zoom, grey values, planes in 3D.
import {COLOR_MAPS} from './color_maps.js';

export const VIEW_NAMES = ['slices', 'views', 'window', 'planes', 'cut', 'flip', 'large', 'countFrom', 'marks', 'colors'];

/** The initial state: as before a reload, as far as the stored values are valid. */
export function viewState(image, space, kept, first = {}) {
  const isTriple = (list, test) => Array.isArray(list) && list.length === 3 && list.every(test), isOneOf = (values, value, otherwise) => values.includes(value) ? value : otherwise;
  const otherwise = {slices: space.size.map((n) => Math.floor((n - 1) / 2)), window: {black: image.black, white: image.white}, planes: [false, false, false], ...first};
  return {
    slices: isTriple(kept.slices, Number.isInteger) ? space.voxelAt(kept.slices) : otherwise.slices,
    views: isTriple(kept.views, (v) => v === null || [v.zoom, v.x, v.y].every(Number.isFinite)) ? kept.views : [null, null, null],
    window: Number.isFinite(kept.window?.black) && Number.isFinite(kept.window?.white) ? kept.window : otherwise.window,
    planes: isTriple(kept.planes, (on) => typeof on === 'boolean') ? kept.planes : otherwise.planes,
    cut: isOneOf(otherwise.cuts ?? [0, 1, 2], kept.cut, -1), flip: kept.flip === true, large: isOneOf([0, 1, 2, 3], kept.large, -1), countFrom: isOneOf([0, 1], kept.countFrom, 0),
    colors: isOneOf(COLOR_MAPS, kept.colors, 'grey'), marks: isOneOf([true, false], kept.marks, otherwise.marks ?? true),
  };
}

/** Stores these parts of the state after each change. `isLasting(name, value)` returns whether a value may be stored. */
export function remember(state, store, names, isLasting = () => true) {
  let timer = null;
  const save = () => {
    clearTimeout(timer);
    timer = null;
    for (const name of names) if (isLasting(name, state.get(name))) store.set(name, state.get(name));
  };
  state.on(names, () => { timer ??= setTimeout(save, 300); });
  addEventListener('pagehide', () => { if (timer) save(); });
}
