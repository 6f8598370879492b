// The menu of files: marks of each structure by kind, and the table.
import {dot, el} from '../dom.js';
import {icon} from '../icons.js';
import {menu, menuItem} from '../menu.js';
import {fileName, marksFile, save} from './files.js';

const KINDS = [['surface', 'marks', '--points'], ['inside', 'inside', '--inside'], ['outside', 'outside', '--outside']];

export function exportMenu({study, data, space}, saveTable) {
  return menu('save marks and the table', [icon('export'), el('span', {class: 'caret'})], (close) => {
    const several = study.structures.length > 1, parts = [];
    const file = (own, marks, what, flag) => {
      const name = `${fileName(own.name)}_${what}.csv`, label = `${name}: ${marks.length} mark${marks.length === 1 ? '' : 's'}`;
      return menuItem(label, () => { save(name, marksFile(marks, space.base)); close(); }, {'data-file': name, title: `covol segment \u2026 ${flag} ${several ? `${own.name}=` : ''}${name}`});
    };
    for (const own of study.structures) {
      const whole = data.structures[own.id - 1], isThinned = whole.markCount > study.given.get(own.id), items = [];
      for (const [kind, what, flag] of KINDS) {
        const marks = own.marks.filter((m) => m.kind === kind), set = marks.filter((m) => m.isNew);
        // If there are very many marks, the page contains only some of them (isThinned). No file of all marks is then
        // offered, because it would be incomplete.
        if (marks.length > 0 && !(isThinned && kind === 'surface')) items.push(file(own, marks, what, flag));
        if (set.length > 0 && (set.length < marks.length || isThinned)) items.push(file(own, set, `new_${what}`, flag));
      }
      if (items.length > 0) parts.push(el('h3', {}, dot(own.color), el('span', {}, own.name)), ...items);
    }
    if (parts.length > 0) parts.push(el('p', {class: 'hint'}, 'Places in the world, as covol segment reads them: marks by --points, the others by --inside and --outside.'));
    return [...parts, el('h3', {}, 'All structures'), menuItem('structures.csv: the table', () => { saveTable(); close(); }, {'data-file': 'structures.csv'})];
  });
}
