// Actions that the server has not acknowledged yet. Until then each is stored in localStorage: a tab that is opened
// later sends them, and sending an action from two tabs does no harm, because the server applies each key once.

const REFERENCES = ['structure', 'mark', 'to'];

/** A reference that stands for an ID that the server has not assigned yet: "of" and the key of the action that makes the object. */
export const referenceOf = (key) => `of ${key}`;
export const isReference = (id) => typeof id === 'string';

export class Queue {
  constructor() {
    this.client = crypto.getRandomValues(new Uint32Array(3)).reduce((text, n) => text + n.toString(36), '');
    this.count = 0;
    this.items = [];
    this.store = null;
  }

  /** Called when the page has received the name of the study. Stored actions from earlier sessions are put before the new ones. */
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

  /** Replaces a reference by the ID of the object that the action made. */
  settle(reference, id) {
    for (const item of this.items)
      for (const name of REFERENCES)
        if (item.action[name] === reference) {
          item.action = {...item.action, [name]: id};
          this.keep(item);
        }
  }

  /** Actions that refer to an object that will never exist, because the action that makes it is not in the queue any more. */
  orphans() {
    const made = new Set(this.items.map(({action}) => referenceOf(action.key)));
    return this.items.filter(({action}) => REFERENCES.some((name) => isReference(action[name]) && !made.has(action[name])));
  }

  isReady({action}) { return !REFERENCES.some((name) => isReference(action[name])); }

  /** The number of actions that the server has not acknowledged, and may therefore not have stored. */
  get waiting() { return this.items.filter(({seq}) => seq === null).length; }
}
