// The row below the views: the values at the cursor, and the effect of a click.
import {el, number} from './dom.js';

/** The row with the values at the cursor; `hints` has a text for each tool, the effect of a click. */
export function statusRow({state, space, image, slices, unitText}, hints) {
  const voxel = el('span', {}), world = el('span', {}), value = el('span', {}), hint = el('span', {class: 'hint'});
  const element = el('footer', {class: 'status', 'aria-label': 'under the cursor'}, el('span', {class: 'cursor'}, voxel, world, value), hint);
  const update = () => { hint.textContent = hints[state.get('tool')] ?? ''; };
  state.on(['tool'], update);
  update();
  // The number of decimals is chosen so that a tenth of the smallest voxel side can be read.
  const digits = Math.min(6, Math.max(0, Math.ceil(1 - Math.log10(Math.min(...space.spacing)))));
  const signed = (v) => v.toFixed(digits).replace('-', '\u2212');
  /** Shows a position in a panel; null: the pointer has left. */
  const tell = (panel, spot) => {
    const index = spot && panel.indexAt(...spot);
    if (!index || !panel.isInside(index)) return [voxel, world, value].forEach((part) => { part.textContent = ''; });
    const at = space.voxelAt(index), known = slices.valueAt(at, image);
    voxel.textContent = `voxel ${at.map((n, a) => space.fileNumber(a, n)).join(', ')}`;
    world.textContent = `${space.fileWorld(index).map(signed).join(', ')}${unitText ? `\u2009${unitText}` : ''}`;
    value.textContent = known ? `value ${known.isExact ? '' : '\u2248\u2009'}${number(known.value)}` : '';
    return undefined;
  };
  return {element, tell};
}
