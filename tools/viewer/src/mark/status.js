// The row below the views: what is under the cursor, what a click does. And the bar that says that there is no server.
import {el, number} from '../dom.js';
import {HINTS} from './tools.js';

export function statusRow({state, space, image, slices, unitText}) {
  const voxel = el('span', {}), world = el('span', {}), value = el('span', {}), hint = el('span', {class: 'hint'});
  const element = el('footer', {class: 'status', 'aria-label': 'under the cursor'}, el('span', {class: 'cursor'}, voxel, world, value), hint);
  const update = () => { hint.textContent = HINTS[state.get('tool')]; };
  state.on(['tool'], update);
  update();
  // A tenth of a voxel can be told.
  const digits = Math.min(6, Math.max(0, Math.ceil(1 - Math.log10(Math.min(...space.spacing)))));
  const signed = (v) => v.toFixed(digits).replace('-', '\u2212');
  /** Tells of a place in a panel; null: the pointer has left. */
  const tell = (panel, spot) => {
    const index = spot && panel.indexAt(...spot);
    if (!index || !panel.isInside(index)) return [voxel, world, value].forEach((part) => { part.textContent = ''; });
    const at = space.voxelAt(index), known = slices.valueAt(at, image);
    voxel.textContent = `voxel ${at.join(', ')}`;
    world.textContent = `${space.toWorld(index).map(signed).join(', ')}${unitText ? `\u2009${unitText}` : ''}`;
    value.textContent = known ? `value ${known.isExact ? '' : '\u2248\u2009'}${number(known.value)}` : '';
    return undefined;
  };
  return {element, tell};
}

const LINKS = {
  lost: (n) => `Not connected. ${n === 0 ? 'It is tried again.' : `${n} action${n === 1 ? ' is' : 's are'} kept and will be sent.`}`,
  connecting: () => 'Not connected yet. It is tried again.',
  refused: (n) => `The server was started anew: open the address that it printed.${n === 0 ? '' : ` ${n} action${n === 1 ? ' is' : 's are'} kept and will be sent from there.`}`,
  other: () => 'Another study is open on this address now.',
};

export function linkBar(state) {
  const text = el('span', {}), again = el('button', {type: 'button', onclick: () => location.reload()}, 'Open it');
  const element = el('div', {class: 'link', role: 'alert', hidden: true}, text, again);
  let timer = null;
  const update = () => {
    const link = state.get('link'), tell = LINKS[link];
    if (tell) text.textContent = tell(state.get('waiting'));
    again.hidden = link !== 'other';
    clearTimeout(timer);
    // The first moment of a page is no loss.
    if (link === 'connecting' && element.hidden) timer = setTimeout(() => { element.hidden = !LINKS[state.get('link')]; }, 1200);
    else element.hidden = !tell;
  };
  state.on(['link', 'waiting'], update);
  update();
  return element;
}
