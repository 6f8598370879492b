// The structures as a table that can be sorted and saved.
import {dot, el, number} from '../dom.js';
import {icon} from '../icons.js';
import {structureFacts, warningsAbout} from './facts.js';
import {csv, save} from './files.js';

const plain = (value) => typeof value === 'number' && Number.isFinite(value) ? value : null;

/** A row of figures for each structure. */
function rowsOf({data, study}) {
  return structureFacts(data).map(({structure, facts}, n) => {
    const {min, max} = structure.mesh, expected = facts.expected_dice ?? facts.expected ?? {};
    return {id: study.structures[n].id, name: structure.name, color: structure.color, volume: plain(facts.surface?.volume), area: plain(facts.surface?.area),
      extent_x: max[0] - min[0], extent_y: max[1] - min[1], extent_z: max[2] - min[2], dice: plain(expected.value), low: plain(expected.low), high: plain(expected.high),
      marks: structure.markCount, warnings: warningsAbout(data, structure)};
  });
}

export function saveTable(app) {
  const unit = app.data.unit || 'units', names = ['structure', `volume_${unit}3`, `area_${unit}2`, ...'xyz'].map((name) => name.length === 1 ? `extent_${name}_${unit}` : name);
  const rows = rowsOf(app).map((r) => [r.name, r.volume, r.area, r.extent_x, r.extent_y, r.extent_z, r.dice, r.low, r.high, r.marks, r.warnings.join('; ')]);
  save('structures.csv', csv([[...names, 'expected_dice', 'expected_dice_low', 'expected_dice_high', 'marks', 'warnings'], ...rows]));
}

export function structureTable(app) {
  const {data, state, study, tools, choose} = app, rows = rowsOf(app), unit = data.unitText, power = (n) => unit ? `${unit}${n}` : '';
  const figure = (value, digits = 4) => value === null ? '\u2013' : number(value, digits);
  const columns = [
    ['name', 'structure', '', (r) => r.name.toLowerCase()], ['volume', 'volume', power('\u00b3'), (r) => r.volume], ['area', 'area', power('\u00b2'), (r) => r.area],
    ['extent_x', data.anatomical ? 'R\u2013L' : 'x', unit, (r) => r.extent_x], ['extent_y', data.anatomical ? 'A\u2013P' : 'y', unit, (r) => r.extent_y], ['extent_z', data.anatomical ? 'I\u2013S' : 'z', unit, (r) => r.extent_z],
    ['dice', 'expected Dice', '', (r) => r.dice], ['marks', 'marks', '', (r) => r.marks], ['warnings', 'warnings', '', (r) => r.warnings.length],
  ];
  const body = el('tbody', {}), sorted = {by: null, isUp: true};
  const lines = rows.map((r) => {
    const shown = el('input', {type: 'checkbox', checked: true, 'aria-label': `show ${r.name}`, onchange: () => study.act({do: 'show', structure: r.id, visible: shown.checked})});
    const name = el('button', {type: 'button', class: 'name', title: 'shows its middle; marks are set for it', onclick: () => choose(r.id)}, r.name);
    const dice = r.dice === null ? '\u2013' : [figure(r.dice, 3), r.low === null ? null : el('small', {}, ` ${figure(r.low, 2)}\u2013${figure(r.high, 2)}`)];
    const said = r.warnings.length === 0 ? '\u2013' : el('details', {}, el('summary', {}, icon('warning'), String(r.warnings.length)), el('ul', {}, r.warnings.map((line) => el('li', {}, line))));
    const count = el('td', {class: 'value'});
    const line = el('tr', {'data-structure': r.id}, el('th', {scope: 'row'}, el('span', {class: 'who'}, shown, dot(r.color), name)),
      [figure(r.volume), figure(r.area), figure(r.extent_x, 3), figure(r.extent_y, 3), figure(r.extent_z, 3), dice].map((cell) => el('td', {class: 'value'}, cell)), count, el('td', {}, said));
    return {r, line, shown, count};
  });
  const heads = columns.map(([key, label, small]) => el('th', {scope: 'col', 'aria-sort': 'none'}, el('button', {type: 'button', onclick: () => sort(key)}, label, small ? el('small', {}, ` ${small}`) : null)));
  const sort = (key) => {
    sorted.isUp = sorted.by === key ? !sorted.isUp : key === 'name';
    sorted.by = key;
    const [, , , value] = columns.find(([name]) => name === key), sign = sorted.isUp ? 1 : -1;
    // Unknown values come last in ascending and in descending order.
    const order = [...lines].sort(({r: a}, {r: b}) => value(a) === value(b) ? a.id - b.id : value(a) === null ? 1 : value(b) === null ? -1 : sign * (value(a) < value(b) ? -1 : 1));
    body.replaceChildren(...order.map(({line}) => line));
    heads.forEach((head, n) => head.setAttribute('aria-sort', columns[n][0] === key ? sorted.isUp ? 'ascending' : 'descending' : 'none'));
  };
  body.replaceChildren(...lines.map(({line}) => line));
  const update = () => {
    const active = tools.active() ?? study.structures[0];
    for (const {r, line, shown, count} of lines) {
      const own = study.structure(r.id), by = own.marks.length - study.given.get(r.id);
      shown.checked = own.visible;
      line.setAttribute('aria-current', String(own === active));
      count.textContent = number(r.marks + by);
    }
  };
  state.on(['study', 'active'], update);
  update();
  return el('section', {class: 'card table', 'aria-label': 'structures'},
    el('div', {class: 'card-head'}, el('h2', {}, rows.length > 1 ? `${rows.length} structures` : 'Structure'), el('button', {type: 'button', class: 'copy', 'data-do': 'table', onclick: () => saveTable(app)}, 'save as CSV')),
    el('div', {class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'table of structures'}, el('table', {class: 'structures-table'}, el('thead', {}, el('tr', {}, heads)), body)));
}
