// Actions that the server has not acknowledged yet. Each is kept in localStorage until then: a tab that is opened later
// takes them up, and two tabs that send the same one do no harm, because the server applies a key once.

const REFERENCES = ['structure', 'mark', 'to'];

/** An ID that the server has not given yet: "of" and the key of the action that asks for it. */
export const referenceOf = (key) => `of ${key}`;
export const isReference = (id) => typeof id === 'string';

export class Queue {
  constructor() {
    this.client = crypto.getRandomValues(new Uint32Array(3)).reduce((text, n) => text + n.toString(36), '');
    this.count = 0;
    this.items = [];
    this.store = null;
  }

  /** The study is known: what was left over of it comes first. */
  open(store) {
    this.store = store;
    const old = store.names().map((key) => ({key, ...store.get(key)})).filter(({key, action}) => action?.key === key);
    old.sort((a, b) => a.time - b.time || Number(a.key.split('-').pop()) - Number(b.key.split('-').pop()));
    const known = new Set(this.items.map(({action}) => action.key));
    this.items = [...old.filter(({key}) => !known.has(key)).map(({action, time}) => ({action, time, sentOn: 0, seq: null})), ...this.items];
    for (const item of this.items) this.keep(item);
  }

  keep({action, time}) { this.isLost = this.store ? !this.store.set(action.key, {action, time}) : false; }

  nextKey() { return `${this.client}-${++this.count}`; }

  add(action) {
    const item = {action: {key: this.nextKey(), ...action}, time: Date.now(), sentOn: 0, seq: null};
    this.items.push(item);
    this.keep(item);
    return item;
  }

  find(key) { return this.items.find(({action}) => action.key === key); }

  remove(item) {
    this.items = this.items.filter((other) => other !== item);
    this.store?.remove(item.action.key);
  }

  /** An action made something, and this is its ID. */
  settle(reference, id) {
    for (const item of this.items)
      for (const name of REFERENCES)
        if (item.action[name] === reference) {
          item.action = {...item.action, [name]: id};
          this.keep(item);
        }
  }

  /** What waits for something that will never be. */
  orphans() {
    const made = new Set(this.items.map(({action}) => referenceOf(action.key)));
    return this.items.filter(({action}) => REFERENCES.some((name) => isReference(action[name]) && !made.has(action[name])));
  }

  isReady({action}) { return !REFERENCES.some((name) => isReference(action[name])); }

  /** Those that are not known to be on disk. */
  get waiting() { return this.items.filter(({seq}) => seq === null).length; }
}
