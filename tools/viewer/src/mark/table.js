// All structures in a table that can be sorted and saved.
import {dot, el, number} from '../dom.js';

const extentOf = ({extent}) => (extent ? Math.max(...extent) : undefined);
const COLUMNS = [
  ['structure', (s) => s.name], ['marks', (s) => s.marks.length], ['volume', (s, r) => r.volume, 3], ['area', (s, r) => r.area, 2], ['extent', (s, r) => extentOf(r), 1],
  ['mean', (s, r) => r.mean], ['sd', (s, r) => r.sd], ['expected Dice', (s, r) => r.expected?.value],
];

export function tableSheet(app) {
  const {study, state, unitText} = app, order = {by: 0, sign: 1, isNatural: true};
  const head = el('tr', {}), body = el('tbody', {});
  const save = el('a', {class: 'save', href: '/export?structure=0&format=table.csv', download: ''}, 'Save as CSV');
  const dialog = el('dialog', {class: 'help results', 'aria-label': 'results', onclick: (event) => { if (event.target === dialog) dialog.close(); }},
    el('div', {class: 'help-head'}, el('h2', {}, 'Structures'), save, el('button', {type: 'button', class: 'icon', 'aria-label': 'close', onclick: () => dialog.close()}, '\u2715')),
    el('div', {class: 'sheet'}, el('table', {}, el('thead', {}, head), body)));
  const unitOf = (power) => (power && unitText ? ` (${unitText}${['', '', '\u00b2', '\u00b3'][power]})` : '');
  const headers = COLUMNS.map(([name, , power], n) => el('th', {scope: 'col'}, el('button', {type: 'button', onclick: () => {
    Object.assign(order, {sign: !order.isNatural && order.by === n ? -order.sign : n === 0 ? 1 : -1, by: n, isNatural: false});
    fill();
  }}, name + unitOf(power))));
  head.append(...headers);
  const fill = () => {
    if (!dialog.open) return;
    const value = COLUMNS[order.by][1], of = (s) => value(s, s.result ?? {});
    const rows = [...study.structures];
    // Unknown values come last in ascending and in descending order.
    if (!order.isNatural) rows.sort((a, b) => {
      const [x, y] = [of(a), of(b)], isKnown = (v) => v !== undefined && v !== null;
      if (!isKnown(x) || !isKnown(y)) return isKnown(y) - isKnown(x);
      return order.sign * (typeof x === 'string' ? x.localeCompare(y) : x - y);
    });
    headers.forEach((header, n) => header.setAttribute('aria-sort', order.isNatural || n !== order.by ? 'none' : order.sign > 0 ? 'ascending' : 'descending'));
    body.replaceChildren(...rows.map((s) => el('tr', {onclick: () => state.set({active: s.id})}, COLUMNS.map(([, get], n) => {
      const shown = get(s, s.result ?? {});
      if (n === 0) return el('th', {scope: 'row'}, dot(s.color), el('span', {}, s.name));
      return el('td', {}, shown === undefined || shown === null ? '\u2013' : number(shown));
    }))));
    save.hidden = !study.structures.some((s) => s.result?.triangles > 0);
  };
  state.on(['study'], fill);
  return {dialog, open: () => { dialog.showModal(); fill(); }};
}
