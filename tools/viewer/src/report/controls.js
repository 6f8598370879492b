// Controls on the 3D view, and the list of suggested slices.
import {colorings, rangeOf, SUPPORT, viridis} from '../colors.js';
import {colorOf, dot, el, number} from '../dom.js';

/** The structures: their colours, visibility, and the choice of the active one. */
function structureList({study, state, tools}) {
  const rows = study.structures.map((structure) => {
    const box = el('input', {type: 'checkbox', checked: true, 'aria-label': `show ${structure.name}`, onchange: () => study.act({do: 'show', structure: structure.id, visible: box.checked})});
    const name = el('button', {type: 'button', class: 'name', title: 'marks are set for this structure', onclick: () => state.set({active: structure.id, selected: null})}, structure.name);
    return {id: structure.id, box, element: el('li', {}, box, dot(structure.color), name)};
  });
  const update = () => {
    const active = tools.active() ?? study.structures[0];
    for (const {id, box, element} of rows) {
      box.checked = study.structure(id).visible;
      element.setAttribute('aria-current', String(id === active.id));
    }
  };
  state.on(['study', 'active'], update);
  update();
  return el('ul', {class: 'structures'}, rows.map(({element}) => element));
}

function legend(data, name) {
  if (name === 'structure') return [];
  if (name === 'support') return ['on marks', 'on edges', 'on neither'].map((word, n) => el('span', {class: 'key'}, dot(SUPPORT[n]), word));
  const [low, high] = rangeOf(data.structures, name), bar = el('span', {class: 'ramp'}), unit = name === 'distance_to_marks' && data.unitText ? `\u2009${data.unitText}` : '';
  bar.style.background = `linear-gradient(to right, ${Array.from({length: 9}, (_, n) => colorOf(viridis(n / 8).map(Math.round))).join(', ')})`;
  return [el('span', {}, number(low, 3)), bar, el('span', {}, `${number(high, 3)}${unit}`)];
}

/** A slider for the position of the cut, for a page without planes, on which it could not be moved otherwise. */
function cutPlace({state, space}) {
  const slider = el('input', {type: 'range', min: 0, step: 1, 'aria-label': 'place of the cut', oninput: () => state.set({slices: state.get('slices').map((at, axis) => axis === state.get('cut') ? Number(slider.value) : at)})});
  const row = el('label', {}, el('span', {}, 'cut at'), slider), update = () => {
    const axis = state.get('cut');
    row.hidden = axis < 0;
    if (axis < 0) return;
    slider.max = space.size[axis] - 1;
    slider.value = state.get('slices')[axis];
  };
  state.on(['cut', 'slices'], update);
  update();
  return row;
}

/** The box on the 3D view: structures, colours, opacity. */
export function lookBox(app) {
  const {data, state} = app, colors = colorings(data.structures), key = el('div', {class: 'legend'}), parts = [structureList(app)];
  if (colors.length > 1) {
    const select = el('select', {class: 'small', 'aria-label': 'colour by', onchange: () => state.set({coloring: select.value})}, colors.map(([value, name]) => el('option', {value}, name)));
    const update = () => {
      select.value = state.get('coloring');
      key.replaceChildren(...legend(data, state.get('coloring')));
      key.hidden = key.children.length === 0;
    };
    state.on(['coloring'], update);
    update();
    parts.push(el('label', {}, el('span', {}, 'colour'), select), key);
  }
  const slider = el('input', {type: 'range', min: 0, max: 1, step: 0.01, value: state.get('opacity'), 'aria-label': 'opacity of the surfaces', oninput: () => state.set({opacity: Number(slider.value)})});
  parts.push(el('label', {}, el('span', {}, 'opacity'), slider));
  if (!app.volume) parts.push(cutPlace(app));
  return el('details', {class: 'look', open: !matchMedia('(max-width: 760px)').matches}, el('summary', {}, data.structures.length > 1 ? `${data.structures.length} structures` : 'Surface'), el('div', {}, parts));
}

/** Shows and hides marks, for the row above the 3D view. */
export function marksButton(state) {
  const button = el('button', {type: 'button', class: 'small', title: 'marks (q)', 'data-key': 'marks', onclick: () => state.set({marks: !state.get('marks')})}, 'marks');
  const update = () => button.setAttribute('aria-pressed', String(state.get('marks')));
  state.on(['marks'], update);
  update();
  return button;
}

/** Positions at which new marks would improve the result most, each with its structure's ID. */
export function suggestedPlaces(data) {
  return data.structures.flatMap((structure, n) => (structure.evidence?.suggestions ?? []).map((place) => ({id: n + 1, structure, ...place})));
}

/** The list of suggested slices; a click on one goes to the suggested position. */
export function suggestionList({data, state, goTo}) {
  const items = suggestedPlaces(data), unit = data.unitText ? `\u2009${data.unitText}\u00b2` : '';
  if (items.length === 0) return null;
  const buttons = items.map((item) => el('button', {type: 'button', class: 'suggestion', 'data-slice': item.slice, onclick: () => {
    state.set({active: item.id, ring: {world: item.world, structure: item.id}});
    goTo(item.world);
  }}, data.structures.length > 1 ? dot(item.structure.color) : null, el('strong', {}, `slice ${item.slice}`), el('small', {}, `supports ${number(item.area, 3)}${unit}`)));
  state.on(['ring'], () => buttons.forEach((button, n) => button.setAttribute('aria-current', String(state.get('ring')?.world === items[n].world))));
  return el('section', {class: 'suggestions', 'aria-label': 'where new marks would help most'}, el('span', {class: 'lead'}, 'New marks would help most in'), el('div', {class: 'items'}, buttons));
}
