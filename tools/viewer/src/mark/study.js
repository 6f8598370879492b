// The study: the state from the server, and on top of it the pending actions of this page.
import {fold, madeBy} from './fold.js';
import {referenceOf} from './queue.js';

const OF_A_SURFACE = ['triangles', 'volume', 'area', 'extent', 'mean', 'sd', 'expected', 'warnings'];

/** The new result of a structure. While its surface is recomputed, or if that failed, the figures of the existing surface are kept. */
function merged(before, result) {
  if (!before || !result || !['working', 'failed'].includes(result.stage) || before.stage === 'empty') return result;
  return {...result, ...Object.fromEntries(OF_A_SURFACE.filter((name) => before[name] !== undefined).map((name) => [name, before[name]]))};
}

export class Study {
  constructor(queue) {
    Object.assign(this, {queue, name: null, seq: -1, canUndo: false, canRedo: false, options: {}, confirmed: [], structures: [], resultsSeen: 0, lastAction: 0});
    this.ids = new Map();
    this.guesses = new Map();
    this.listeners = {change: [], result: [], failed: [], suggestions: [], action: [], gap: [], state: []};
  }

  on(what, listener) { this.listeners[what].push(listener); }

  emit(what, ...values) { for (const listener of this.listeners[what]) listener(...values); }

  resolve(id) { return this.ids.get(id) ?? this.guesses.get(id) ?? id; }

  structure(id) {
    const known = this.resolve(id);
    return this.structures.find((s) => s.id === known) ?? null;
  }

  /** An action of the user: displayed at once, sent as soon as possible. Returns the reference to the object that it makes, if any. */
  act(action) {
    const item = this.queue.add(action);
    this.lastAction = performance.now();
    this.refold();
    this.emit('action', item);
    return referenceOf(item.action.key);
  }

  receive(message) {
    if (message.state) this.takeState(message.state);
    else if (message.patch) this.takePatch(message.patch);
    else if (message.done) this.takeDone(message);
    else if (message.failed) this.takeFailed(message);
    else if (message.result) this.takeResult(message.result);
    else if (message.suggestions) this.emit('suggestions', message.suggestions);
  }

  takeState(state) {
    Object.assign(this, {name: state.study, seq: state.seq, canUndo: state.can_undo, canRedo: state.can_redo, options: state.options ?? {}});
    const before = new Map(this.confirmed.map((s) => [s.id, s.result]));
    this.confirmed = state.structures.map((s) => ({...s, result: merged(before.get(s.id), s.result)}));
    this.emit('state', state);
    this.sweep();
    this.refold();
    for (const {result} of this.confirmed) if (result) this.emit('result', result, true);
  }

  takePatch(patch) {
    if (patch.seq <= this.seq) return;
    if (patch.seq !== this.seq + 1) return this.emit('gap');  // a message was lost: the page reconnects to get a complete state
    Object.assign(this, {seq: patch.seq, canUndo: patch.can_undo, canRedo: patch.can_redo, options: patch.options ?? this.options});
    const known = new Map(this.confirmed.map((s) => [s.id, s]));
    for (const s of patch.structures) known.set(s.id, {...s, result: merged(known.get(s.id)?.result, s.result)});
    for (const id of patch.removed ?? []) known.delete(id);
    this.confirmed = (patch.order ?? [...known.keys()]).filter((id) => known.has(id)).map((id) => known.get(id));
    this.sweep();
    this.refold();
    for (const s of patch.structures) if (s.result) this.emit('result', s.result, false);
  }

  takeDone({done: key, seq, id}) {
    const item = this.queue.find(key);
    if (!item) return;
    item.seq = seq;
    if (id !== undefined) this.settle(key, id);
    this.queue.store?.remove(key);
    this.sweep();
    this.refold();
    this.emit('action', null);
  }

  settle(key, id) {
    this.ids.set(referenceOf(key), id);
    this.queue.settle(referenceOf(key), id);
  }

  takeFailed({failed: key, why}) {
    const item = this.queue.find(key);
    if (item) this.queue.remove(item);
    this.dropOrphans();
    this.refold();
    this.emit('failed', why, item?.action ?? null);
    this.emit('action', null);
  }

  takeResult(result) {
    const own = this.confirmed.find((s) => s.id === result.structure);
    if (!own) return;
    ++this.resultsSeen;
    own.result = merged(own.result, result);
    this.refold();
    this.emit('result', result, false);
  }

  /** Removes acknowledged actions once the structures contain their effects, so that a mark never disappears in between. */
  sweep() {
    for (const {action} of this.queue.items.filter((item) => item.seq !== null && item.seq <= this.seq)) {
      if (!this.ids.has(referenceOf(action.key))) {
        const id = madeBy(action, this.confirmed, new Set(this.ids.values()));
        if (id !== undefined) this.settle(action.key, id);
      }
      this.queue.remove(this.queue.find(action.key));
    }
    this.dropOrphans();
  }

  /** Removes actions on objects that do not exist, because the server refused to make them, or because they were removed. */
  dropOrphans() {
    for (let orphans = this.queue.orphans(); orphans.length > 0; orphans = this.queue.orphans()) {
      for (const orphan of orphans) this.queue.remove(orphan);
      this.emit('failed', 'What this belonged to is not there any more.', null);
    }
  }

  refold() {
    const taken = new Set(this.ids.values());
    this.guesses.clear();
    // A structure that this page has added may already be in the state although its ID has not been reported. Its ID is
    // then estimated by madeBy(), so that pending marks appear in this structure.
    for (const {action, sentOn} of this.queue.items)
      if (action.do === 'add_structure' && sentOn > 0) this.guesses.set(referenceOf(action.key), madeBy(action, this.confirmed, taken));
    this.structures = fold(this.confirmed, this.queue.items.map(({action}) => action), (id) => this.resolve(id));
    this.emit('change');
  }
}
