// Settings and quality of the run: tables, bars, the command.
import {dot, el, number, svg} from '../dom.js';

/** A section for each structure; if there are several, the first one is open. */
function perStructure(parts) {
  if (parts.length === 1) return parts[0][1];
  return parts.map(([structure, content], n) => el('details', {class: 'one', open: n === 0}, el('summary', {}, dot(structure.color), el('span', {}, structure.name)), content));
}

function section(title, note, ...content) {
  return el('section', {class: 'card'}, el('h2', {}, title), note ? el('p', {class: 'note'}, note) : null, ...content);
}

/** The part of the run's report that belongs to each structure of the page: {structure, facts}. */
export function structureFacts(data) {
  const list = Array.isArray(data.facts.structures) ? data.facts.structures : [];
  return data.structures.map((structure, n) => ({structure, facts: list.find((f) => f.name === structure.name) ?? list[n] ?? data.facts}));
}

/** Warnings about one structure: lines that begin with its name, or all if there is no other one. */
export function warningsAbout(data, structure) {
  const warnings = (Array.isArray(data.facts.warnings) ? data.facts.warnings : []).map(String);
  return data.structures.length === 1 ? warnings : warnings.filter((line) => line.startsWith(`${structure.name}: `));
}

export function warningsOf(data) {
  const warnings = Array.isArray(data.facts.warnings) ? data.facts.warnings : [];
  if (warnings.length === 0) return null;
  const label = warnings.length > 1 ? `${warnings.length} warnings` : '1 warning';
  const element = el('aside', {class: 'notice', id: 'warnings', role: 'note'}, el('strong', {}, label),
    el('ul', {}, warnings.map((line) => el('li', {}, String(line)))));
  return {label, element};
}

function figure(label, value, note) {
  return el('div', {class: 'figure'}, el('dt', {}, label), el('dd', {}, value, note ? el('small', {}, note) : null));
}

function quality({structure, facts}, data) {
  const surface = facts.surface ?? {}, fit = facts.fit?.points_to_surface, h = facts.grid?.voxel_size;
  const unit = data.unitText, power = (n) => unit ? `\u2009${unit}${n}` : '';
  const figures = [];
  const add = (label, value, note) => figures.push(figure(label, value, note));
  if (typeof surface.volume === 'number') add('volume', number(surface.volume) + power('\u00b3'));
  if (typeof surface.area === 'number') add('area', number(surface.area) + power('\u00b2'));
  if ('closed' in surface) add('surface', surface.closed ? 'closed' : 'open', surface.closed ? `genus ${surface.genus}, ${surface.components} piece${surface.components === 1 ? '' : 's'}` : null);
  if (fit) {
    const inVoxels = (x) => h ? `${number(x / h, 2)} voxels` : null;
    add('marks to surface, mean', number(fit.mean, 3) + power(''), inVoxels(fit.mean));
    add('95 % of them within', number(fit.p95, 3) + power(''), inVoxels(fit.p95));
    add('farthest mark', number(fit.max, 3) + power(''), inVoxels(fit.max));
  }
  if (facts.fit?.marks_off?.count > 0) add('marks off the surface', number(facts.fit.marks_off.count), `beyond ${number(facts.fit.marks_off.beyond)}${power('')}`);
  const e = structure.evidence;
  if (e && e.area > 0) add('rests on neither marks nor edges', `${number(100 * e.unsupported_area / e.area, 2)} %`, 'of the surface');
  if (structure.markCount > 0 && !fit) add('marks', number(structure.markCount));
  add('triangles shown', number(structure.mesh.triangles), structure.mesh.triangles < structure.mesh.of_triangles ? `of ${number(structure.mesh.of_triangles)}` : null);
  return el('dl', {class: 'figures'}, figures);
}

function text(value) {
  if (value === null || value === undefined || value === -1) return '\u2013';
  if (Array.isArray(value)) return value.map(text).join(', ');
  if (typeof value === 'object') return JSON.stringify(value);
  return typeof value === 'number' ? number(value, 5) : String(value);
}

/** Each option's value, and whether covol or the user chose it. */
function optionRows(facts, data) {
  const automatic = facts.automatic ?? {}, resolved = facts.resolved ?? {}, given = new Set(data.facts.given ?? []);
  const rows = [];
  const isGiven = (name) => given.has(name) || given.has(name.replace(/_/g, '-'));
  for (const name of new Set([...Object.keys(automatic), ...Object.keys(resolved)])) {
    const reason = automatic[name], value = name in resolved ? text(resolved[name]) : '';
    if (value === '\u2013' && !reason) continue;  // the run did not need this option, so that no value was chosen
    rows.push({name: name.replace(/_/g, ' '), value, how: isGiven(name) && name in resolved ? 'given' : reason ? 'automatic' : 'default', reason: reason ?? ''});
  }
  const rank = {automatic: 0, given: 1, default: 2};
  return rows.sort((a, b) => rank[a.how] - rank[b.how]);
}

function optionsTable(facts, data) {
  const rows = optionRows(facts, data);
  if (rows.length === 0) return null;
  return el('div', {class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'options'}, el('table', {class: 'options'},
    el('thead', {}, el('tr', {}, ['option', 'used', 'chosen', 'why'].map((head) => el('th', {scope: 'col'}, head)))),
    el('tbody', {}, rows.map((row) => el('tr', {class: row.how},
      el('th', {scope: 'row'}, row.name), el('td', {class: 'value'}, row.value), el('td', {}, el('span', {class: `tag ${row.how}`}, row.how)),
      el('td', {class: 'why'}, row.reason))))));
}

function timeBars(seconds) {
  const stages = Object.entries(seconds).filter(([name, time]) => name !== 'total' && time > 0.0005);
  if (stages.length === 0) return null;
  const most = Math.max(...stages.map(([, time]) => time));
  return el('div', {class: 'bars', role: 'table', 'aria-label': 'seconds of each stage'}, stages.map(([name, time]) => {
    const bar = el('span', {class: 'time'});
    bar.style.width = `${Math.max(0.5, 100 * time / most)}%`;
    return el('div', {class: 'bar-row', role: 'row'}, el('span', {role: 'rowheader'}, name), el('span', {class: 'track'}, bar),
      el('span', {class: 'value', role: 'cell'}, `${number(time, 3)}\u2009s`));
  }));
}

/** The mean motion of the surface at each step, on a logarithmic axis. */
function convergence(changes, tolerance) {
  const width = 560, height = 190, left = 46, bottom = 30, top = 10, right = 12;
  const values = changes.map((v) => Math.max(v, 1e-6)), low = Math.floor(Math.log10(Math.min(...values, tolerance || Infinity)));
  const high = Math.max(low + 1, Math.ceil(Math.log10(Math.max(...values))));
  const x = (n) => left + (width - left - right) * (values.length > 1 ? n / (values.length - 1) : 0.5);
  const y = (v) => top + (height - top - bottom) * (1 - (Math.log10(v) - low) / (high - low));
  const label = (content, attributes) => svg('text', attributes, document.createTextNode(content));
  const parts = [];
  for (let power = low; power <= high; ++power)
    parts.push(svg('line', {x1: left, x2: width - right, y1: y(10 ** power), y2: y(10 ** power), class: 'grid'}),
      label(`${power >= -3 ? number(10 ** power) : `1e${power}`}`, {x: left - 6, y: y(10 ** power) + 4, 'text-anchor': 'end'}));
  if (tolerance > 0) parts.push(svg('line', {x1: left, x2: width - right, y1: y(tolerance), y2: y(tolerance), class: 'limit'}));
  parts.push(svg('polyline', {points: values.map((v, n) => `${x(n).toFixed(1)},${y(v).toFixed(1)}`).join(' '), class: 'line'}));
  parts.push(label('1', {x: x(0), y: height - 10, 'text-anchor': 'middle'}), label(String(values.length), {x: x(values.length - 1), y: height - 10, 'text-anchor': 'end'}),
    label('step', {x: (left + width) / 2, y: height - 10, 'text-anchor': 'middle'}));
  return svg('svg', {viewBox: `0 0 ${width} ${height}`, class: 'chart', role: 'img', 'aria-label': 'motion of the surface at each step, voxels'}, ...parts);
}

function convergenceOf(all) {
  const curves = all.filter(({facts}) => Array.isArray(facts.solve?.changes) && facts.solve.changes.length > 1);
  return curves.map(({structure, facts}) => [structure, convergence(facts.solve.changes, facts.resolved?.tolerance)]);
}

function pairs(rows) {
  return el('dl', {class: 'pairs'}, rows.filter(([, value]) => value).flatMap(([name, value]) => [el('dt', {}, name), el('dd', {}, value)]));
}

function provenance(data) {
  const {facts} = data, image = facts.input?.image, rows = [];
  const unit = data.unitText ? `\u2009${data.unitText}` : '';
  if (image) {
    rows.push(['image', image.path]);
    rows.push(['size, spacing', `${image.size.join(' \u00d7 ')} voxels of ${image.spacing.map((s) => number(s)).join(' \u00d7 ')}${unit}`]);
  }
  for (const {structure, facts: own} of structureFacts(data)) {
    const paths = [...(own.input?.points?.paths ?? []), ...(own.input?.contours?.paths ?? [])];
    const who = data.structures.length > 1 ? `marks of ${structure.name}` : 'marks';
    rows.push([who, [structure.markCount ? number(structure.markCount) : null, paths.length ? paths.join(', ') : null].filter(Boolean).join(' in ')]);
  }
  if (facts.grid ?? structureFacts(data)[0]?.facts.grid) {
    const grid = facts.grid ?? structureFacts(data)[0].facts.grid;
    if (grid.voxel_size) rows.push(['voxel size', `${number(grid.voxel_size)}${unit}${grid.active_voxels ? `, ${number(grid.active_voxels)} active voxels` : ''}`]);
  }
  if (data.image) {
    const thinned = data.image.step.some((s) => s > 1), cut = data.image.size.some((n, a) => n * data.image.step[a] < data.image.of_size[a] - data.image.step[a]);
    rows.push(['slices on this page', `${data.image.size.join(' \u00d7 ')} voxels${thinned ? `, one for each ${data.image.step.join(' \u00d7 ')} of the image` : ''}${cut ? ', the part around the surface' : ''}; black ${number(data.image.black)}, white ${number(data.image.white)}`]);
  }
  if (facts.peak_rss_bytes) rows.push(['memory at the peak', `${number(facts.peak_rss_bytes / 2 ** 20, 3)} MiB`]);
  rows.push(['program', `covol ${data.covol}`]);
  const command = facts.command_line;
  if (!command) return pairs(rows);
  const copy = el('button', {type: 'button', class: 'copy', onclick: async () => {
    try {
      await navigator.clipboard.writeText(command);
      copy.textContent = 'copied';
    } catch {
      getSelection().selectAllChildren(code);
      copy.textContent = 'selected';
    }
    setTimeout(() => { copy.textContent = 'copy'; }, 1500);
  }}, 'copy');
  const code = el('code', {}, command);
  return [pairs(rows), el('div', {class: 'command'}, code, copy)];
}

/** The elements below the views: tables, bars and curves, for all structures. */
export function factsOf(data) {
  const all = structureFacts(data), seconds = data.facts.seconds ?? {};
  const bars = timeBars(seconds), curves = convergenceOf(all);
  const tables = all.map(({structure, facts}) => [structure, optionsTable(facts, data)]).filter(([, table]) => table);
  return el('div', {class: 'facts'},
    section('Quality', null, perStructure(all.map((one) => [one.structure, quality(one, data)]))),
    bars ? section('Time', seconds.total ? `${number(seconds.total, 3)}\u2009s in all` : null, bars) : null,
    curves.length ? section('Convergence', 'Mean motion of the surface at each step, in voxels; dashed: the tolerance.', perStructure(curves)) : null,
    tables.length ? section('Options', 'What was used, and what covol chose by itself.', perStructure(tables)) : null,
    section('Provenance', null, provenance(data)));
}
