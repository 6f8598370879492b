// Files for download: marks in a format that covol reads, and the table.
import {el} from '../dom.js';

const quoted = (cell) => {
  const text = String(cell ?? ''), isFormula = typeof cell === 'string' && /^[=+\-@\t\r]/.test(text);  // quoted with ', so that a spreadsheet does not interpret it
  return /[",\n\r]/.test(text) || isFormula ? `"${(isFormula ? `'${text}` : text).replace(/"/g, '""')}"` : text;
};

export const csv = (rows) => rows.map((row) => row.map(quoted).join(',')).join('\n') + '\n';

/** A name that is valid in every file system. */
export const fileName = (name) => name.replace(/[^\p{L}\p{N}._-]+/gu, '_').replace(/^[.\-]+/, '').slice(0, 80) || 'structure';

export function save(name, text) {
  const url = URL.createObjectURL(new Blob([text], {type: 'text/csv'})), link = el('a', {href: url, download: name});
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}

/** Marks as a table of world positions, for --points, --inside or --outside of covol segment. */
export function marksFile(marks, base) {
  return csv([['x', 'y', 'z'], ...marks.map(({world}) => world.map((x, a) => Number((x + base[a]).toPrecision(10))))]);
}
