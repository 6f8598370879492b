// Structures and marks of a page without a server: actions can be undone, and are kept over a reload.
import {applyAction} from '../changes.js';

const KINDS = ['surface', 'inside', 'outside'];

export class LocalStudy {
  /** `data` are decoded structures; `store` saves the actions. */
  constructor(data, store) {
    let id = 0;
    const marksOf = ({marks}) => Array.from({length: marks.length / 3}, (_, n) => ({id: ++id, kind: 'surface', world: [...marks.subarray(3 * n, 3 * n + 3)]}));
    const structures = data.map((own, n) => ({id: n + 1, name: own.name, color: own.color, locked: false, marks: marksOf(own), outlines: [], result: null}));
    Object.assign(this, {store, given: new Map(structures.map((s) => [s.id, s.marks.length])), nextId: id + 1, hidden: new Set(), listeners: [], done: [], undone: [], states: [structures]});
    for (const action of store.get('actions', [])) if (this.makesSense(action)) this.push(action);
    this.refresh();
  }

  makesSense({do: what, structure, mark, kind, world} = {}) {
    const own = this.states.at(-1).find((s) => s.id === structure), isPlace = Array.isArray(world) && world.length === 3 && world.every(Number.isFinite);
    if (what === 'add_mark') return Boolean(own) && KINDS.includes(kind) && isPlace;
    return ['move_mark', 'remove_mark'].includes(what) && Boolean(own?.marks.some((m) => m.id === mark)) && (what === 'remove_mark' || isPlace);
  }

  push(action) {
    this.done.push(action);
    this.states.push(applyAction(this.states.at(-1), action, this.nextId++));
  }

  get canUndo() { return this.done.length > 0; }

  get canRedo() { return this.undone.length > 0; }

  structure(id) { return this.structures.find((s) => s.id === id) ?? null; }

  resolve(id) { return id; }

  on(what, listener) { this.listeners.push([what, listener]); }

  emit(what, told) { for (const [name, listener] of this.listeners) if (name === what) listener(told); }

  act(action) {
    if (action.do === 'undo') {
      if (!this.canUndo) return;
      this.undone.push([this.done.pop(), this.states.pop()]);
    } else if (action.do === 'redo') {
      if (!this.canRedo) return;
      const [again, state] = this.undone.pop();
      this.done.push(again);
      this.states.push(state);
    } else if (action.do === 'show') {  // changes the display only, not the marks
      this.hidden[action.visible ? 'delete' : 'add'](action.structure);
    } else {
      this.undone = [];
      this.push(action);
    }
    if (action.do !== 'show') this.store.set('actions', this.done);
    this.refresh();
    this.emit('action', {action});
    this.emit('change');
  }

  refresh() { this.structures = this.states.at(-1).map((s) => ({...s, visible: !this.hidden.has(s.id)})); }
}
