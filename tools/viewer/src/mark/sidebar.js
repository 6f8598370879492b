// The structures: names, quality, and messages about them.
import {colorOf, el, number} from '../dom.js';
import {icon} from '../icons.js';
import {isReference} from './queue.js';

const hex = (rgb) => `#${rgb.map((v) => v.toString(16).padStart(2, '0')).join('')}`;
const rgb = (text) => [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16));

/** Changes a text only if it differs, so that selections and screen readers are not disturbed. */
function put(element, text) { if (element.textContent !== text) element.textContent = text; }

function iconButton(name, label, onclick, more = {}) { return el('button', {type: 'button', class: 'icon', title: label, 'aria-label': label, onclick, ...more}, icon(name)); }

class Card {
  constructor(id, app) {
    Object.assign(this, {id, app});
    const {tools, state} = app;
    this.swatch = el('input', {type: 'color', class: 'swatch', title: 'colour', onchange: () => tools.change('recolor', this.id, rgb(this.swatch.value))});
    this.name = el('button', {type: 'button', class: 'name', onclick: () => state.set({active: this.id}), ondblclick: () => this.rename()});
    this.digit = el('kbd', {class: 'digit', 'aria-hidden': 'true'});
    this.count = el('span', {class: 'count'});
    this.eye = iconButton('eye', 'visible (h)', () => tools.change('show', this.id, !this.structure.visible));
    this.lock = iconButton('unlocked', 'lock (l)', () => tools.change('lock', this.id, !this.structure.locked));
    this.figures = el('div', {class: 'figures'});
    this.volume = el('span', {});
    this.dice = el('span', {});
    this.range = el('span', {class: 'range', 'aria-hidden': 'true'}, el('i', {}), el('b', {}));
    this.mean = el('span', {title: 'of the image inside, with its standard deviation'});
    this.meanLabel = el('span', {class: 'label'}, 'mean value');
    this.figures.append(el('span', {class: 'label'}, 'volume'), this.volume, this.meanLabel, this.mean, el('span', {class: 'label'}, 'expected Dice'), el('span', {class: 'dice'}, this.dice, this.range));
    this.message = el('p', {class: 'message'});
    this.paint = el('span', {});
    this.guess = el('span', {class: 'place'});
    this.paintRow = el('div', {class: 'row from'}, this.paint, iconButton('remove', 'remove all paint', () => tools.change('clear_paint', this.id)));
    this.guessRow = el('div', {class: 'row from'}, this.guess, iconButton('remove', 'remove the guess', () => tools.change('remove_guess', this.id)));
    this.warnings = el('ul', {class: 'warnings'});
    this.bar = el('div', {class: 'progress', role: 'progressbar', 'aria-label': 'surface', 'aria-valuemin': 0, 'aria-valuemax': 100}, el('i', {}));
    this.actions = el('div', {class: 'actions'}, iconButton('rename', 'rename (F2)', () => this.rename()),
      iconButton('duplicate', 'duplicate', () => tools.change('duplicate', this.id)), iconButton('remove', 'remove this structure', () => tools.change('remove', this.id)));
    this.element = el('li', {class: 'structure', 'data-structure': String(id)},
      el('div', {class: 'row'}, this.swatch, this.name, this.count, this.lock, this.eye, this.digit), this.figures, this.guessRow, this.paintRow, this.message, this.warnings, this.actions, this.bar);
    this.element.addEventListener('click', (event) => { if (!event.target.closest('button, input')) state.set({active: this.id}); });
  }

  update(structure, n, isActive) {
    const shown = [structure, structure.result, n, isActive];
    if (this.shown?.every((part, at) => part === shown[at])) return;
    this.shown = shown;
    this.structure = structure;
    this.id = structure.id;
    const {element} = this, {result} = structure, unit = this.app.unitText ? `\u2009${this.app.unitText}\u00b3` : '';
    element.dataset.structure = structure.id;
    element.setAttribute('aria-current', String(isActive));
    element.style.setProperty('--own', colorOf(structure.color));
    element.classList.toggle('off', !structure.visible);
    if (document.activeElement !== this.swatch) this.swatch.value = hex(structure.color);
    this.swatch.setAttribute('aria-label', `colour of ${structure.name}`);
    put(this.name, structure.name);
    this.name.title = structure.name;
    put(this.digit, n < 9 ? String(n + 1) : '');
    const marks = structure.marks.length, outlines = structure.outlines.length, text = `${marks} mark${marks === 1 ? '' : 's'}${outlines ? `, ${outlines} outline${outlines === 1 ? '' : 's'}` : ''}`;
    put(this.count, outlines ? `${marks}+${outlines}` : String(marks));
    this.count.title = text;
    this.count.setAttribute('aria-label', text);
    this.updateSwitch(this.eye, structure.visible, ['eye', 'hidden'], `${structure.name}: visible (h)`);
    this.updateSwitch(this.lock, structure.locked, ['locked', 'unlocked'], `${structure.name}: locked (l)`);
    const hasSurface = result && result.stage !== 'empty' && result.triangles > 0;
    this.figures.hidden = !hasSurface;
    if (hasSurface) {
      put(this.volume, `${number(result.volume)}${unit}`);
      this.updateDice(result.expected);
      const isKnown = typeof result.mean === 'number';
      this.mean.hidden = this.meanLabel.hidden = !isKnown;
      if (isKnown) put(this.mean, `${number(result.mean)} \u00b1 ${number(result.sd, 3)}`);
    }
    const strokes = structure.strokes?.length ?? 0;
    this.paintRow.hidden = strokes === 0 || !isActive;
    put(this.paint, `painted: ${strokes} stroke${strokes === 1 ? '' : 's'}`);
    this.guessRow.hidden = !structure.guess || !isActive;
    if (structure.guess) put(this.guess, `corrects ${structure.guess.name}${structure.guess.label ? `, label ${structure.guess.label}` : ''}`);
    this.updateText(result, marks + outlines + strokes + (structure.guess ? 1 : 0), isActive);
    const isWorking = result?.stage === 'working', share = Math.round(100 * (result?.progress ?? 0));
    this.bar.hidden = !isWorking;
    this.bar.firstChild.style.width = `${Math.max(6, share)}%`;
    this.bar.setAttribute('aria-valuenow', share);
    this.actions.hidden = !isActive;
  }

  updateSwitch(button, isOn, [on, off], label) {
    button.setAttribute('aria-pressed', String(isOn));
    button.setAttribute('aria-label', label);
    if (button.dataset.icon === (isOn ? on : off)) return;
    button.dataset.icon = isOn ? on : off;
    button.replaceChildren(icon(button.dataset.icon));
  }

  updateDice(expected) {
    this.range.hidden = !expected;
    put(this.dice, expected ? `${expected.value.toFixed(2)} (${expected.low.toFixed(2)}\u2013${expected.high.toFixed(2)})` : '\u2013');
    this.dice.title = expected ? 'expected Dice coefficient, and the interval that holds it with 90 %' : 'not known yet';
    if (!expected) return;
    const [band, point] = this.range.children, at = (x) => `${100 * Math.min(1, Math.max(0, x))}%`;
    band.style.left = at(expected.low);
    band.style.width = at(expected.high - expected.low);
    point.style.left = at(expected.value);
  }

  updateText(result, count, isActive) {
    const isFailed = result?.stage === 'failed', text = isFailed || result?.stage === 'empty' ? result.message ?? '' : '';
    const hint = !text && count === 0 && isActive ? 'Click on the border of the structure, in any plane.' : text;
    put(this.message, hint);
    this.message.hidden = !hint;
    this.message.classList.toggle('failed', isFailed);
    const lines = result && result.stage !== 'empty' ? (result.warnings ?? []).map(String) : [];
    this.warnings.hidden = lines.length === 0;
    if (this.told === lines.join('\n')) return;
    this.told = lines.join('\n');
    this.warnings.replaceChildren(...lines.map((line) => el('li', {}, icon('warning'), el('span', {}, line))));
  }

  rename() {
    const {tools} = this.app, input = el('input', {class: 'name', value: this.structure.name, 'aria-label': 'name of the structure', maxlength: 200});
    let isDone = false;
    const done = (isKept) => {
      if (isDone) return;
      isDone = true;
      input.replaceWith(this.name);
      if (isKept) tools.change('rename', this.id, input.value.trim());
      this.name.focus();
    };
    input.addEventListener('keydown', (event) => { if (event.key === 'Enter' || event.key === 'Escape') done(event.key === 'Enter'); });
    input.addEventListener('blur', () => done(true));
    this.name.replaceWith(input);
    input.select();
  }
}

/** The selected mark: its position and its structure. */
function markCard(app) {
  const {state, study, space, tools} = app, place = el('span', {class: 'place'}), kind = el('b', {});
  const give = el('select', {'aria-label': 'give the mark to another structure', onchange: () => {
    tools.change('give', state.get('selected').structure, {mark: state.get('selected').mark, to: study.structures[give.selectedIndex].id});
    state.set({selected: null});
  }});
  const element = el('section', {class: 'chosen', hidden: true, 'aria-label': 'chosen mark'}, el('div', {}, kind, place),
    el('div', {class: 'row'}, el('label', {}, 'of ', give), iconButton('remove', 'remove this mark (Delete)', () => tools.remove(state.get('selected')))));
  const update = () => {
    const chosen = state.get('selected'), own = chosen && study.structure(chosen.structure), mark = own?.marks.find((m) => m.id === study.resolve(chosen.mark));
    element.hidden = !mark;
    if (!mark) return;
    put(kind, mark.kind === 'surface' ? 'surface mark' : `mark ${mark.kind}`);
    put(place, `voxel ${space.toIndex(mark.world).map((v) => v.toFixed(1)).join(', ')}`);
    give.replaceChildren(...study.structures.map((s) => el('option', {selected: s === own, disabled: s.locked}, s.name)));
  };
  state.on(['selected', 'study'], update);
  return element;
}

export function sidebar(app) {
  const {state, study, tools} = app, cards = new Map(), list = el('ul', {class: 'list'});
  const nothing = el('p', {class: 'nothing'}, 'Click on the border of a structure in any plane: the first click begins one. With a few more marks around it, its surface appears.');
  const add = iconButton('plus', 'new structure (Shift+N)', () => tools.addStructure());
  const element = el('aside', {class: 'sidebar', 'aria-label': 'structures'},
    el('div', {class: 'side-head'}, el('h2', {}, 'Structures'), add), nothing, list, markCard(app));
  const update = () => {
    const active = tools.active(), seen = new Set(), references = [...cards.keys()].filter(isReference);
    nothing.hidden = study.structures.length > 0;
    study.structures.forEach((structure, n) => {
      // When the server has assigned the ID of a structure, the card that was made with a reference to it is kept.
      const waiting = cards.has(structure.id) ? structure.id : references.find((id) => study.resolve(id) === structure.id), card = cards.get(waiting) ?? new Card(structure.id, app);
      if (waiting !== structure.id) cards.delete(waiting);
      cards.set(structure.id, card);
      seen.add(structure.id);
      card.update(structure, n, structure === active);
      if (list.children[n] !== card.element) list.insertBefore(card.element, list.children[n] ?? null);
    });
    for (const [id, card] of cards) if (!seen.has(id)) card.element.remove(), cards.delete(id);
  };
  state.on(['study', 'active'], update);
  update();
  return {element, rename: () => cards.get(tools.active()?.id)?.rename()};
}
