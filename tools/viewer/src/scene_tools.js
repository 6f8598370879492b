// Controls on the 3D view.
import {el} from './dom.js';
import {icon} from './icons.js';

/** The controls of the 3D view. `names` are those of the planes, `more` further controls, `cuts` further choices, [value, text]. */
export function sceneTools(app, view, names, {more = [], cuts = []} = {}) {
  const {state} = app;
  const planes = [2, 1, 0].map((axis) => el('button', {type: 'button', class: 'small', 'data-plane': axis, 'aria-label': `slice ${names[axis]} in 3D`, onclick: () => {
    const list = [...state.get('planes')];
    list[axis] = !list[axis];
    state.set({planes: list});
  }}, names[axis]));
  const cut = el('select', {class: 'small', 'aria-label': 'cut the surfaces at a slice', onchange: () => state.set({cut: Number(cut.value)})},
    [[-1, 'no cut'], ...[2, 1, 0].map((axis) => [axis, `cut ${names[axis]}`]), ...cuts].map(([value, text]) => el('option', {value}, text)));
  const flip = el('button', {type: 'button', class: 'small', title: 'the other half', 'aria-label': 'the other half', onclick: () => state.set({flip: !state.get('flip')})}, icon('flip'));
  const home = el('button', {type: 'button', class: 'small', title: 'reset the camera (r)', 'aria-label': 'reset the camera', onclick: () => view()?.reset()}, icon('home'));
  const large = el('button', {type: 'button', class: 'icon', title: '3D alone, and back (f)', 'aria-label': '3D alone, and back', onclick: () => state.set({large: state.get('large') === 3 ? -1 : 3})});
  const update = () => {
    planes.forEach((one) => one.setAttribute('aria-pressed', String(state.get('planes')[one.dataset.plane])));
    cut.value = state.get('cut');
    flip.hidden = state.get('cut') < 0;
    flip.setAttribute('aria-pressed', String(state.get('flip')));
    large.replaceChildren(icon(state.get('large') === 3 ? 'small' : 'large'));
  };
  state.on(['planes', 'cut', 'flip', 'large'], update);
  update();
  return el('div', {class: 'panel-head', ondblclick: (event) => { if (!event.target.closest('button, select')) large.click(); }},
    el('span', {class: 'chip plain'}, '3D'), el('span', {class: 'scene-tools'}, app.panels.length > 0 ? planes : [], cut, flip, more, home), large);
}
