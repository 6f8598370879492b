// The current state of the display; views are notified of changes.

export class State {
  constructor(values) {
    this.values = values;
    this.listeners = [];
  }

  get(name) { return this.values[name]; }

  set(changes) {
    const changed = Object.keys(changes).filter((name) => this.values[name] !== changes[name]);
    if (changed.length === 0) return;
    Object.assign(this.values, changes);
    for (const listener of this.listeners) listener(changed);
  }

  /** `listener` is called when one of these values changes. */
  on(names, listener) {
    this.listeners.push((changed) => { if (changed.some((name) => names.includes(name))) listener(); });
  }
}
