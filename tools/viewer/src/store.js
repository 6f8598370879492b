// Data that must survive a reload. If the browser's storage is full or blocked, they are lost without an error.

export class Store {
  /** `place()` returns the storage: localStorage, or sessionStorage for data of one tab. */
  constructor(prefix, place = () => localStorage) { Object.assign(this, {prefix: `${prefix}/`, place}); }

  get(name, otherwise = null) {
    try {
      const text = this.place().getItem(this.prefix + name);
      return text === null ? otherwise : JSON.parse(text);
    } catch {
      return otherwise;
    }
  }

  /** Returns whether the value was stored. */
  set(name, value) {
    try {
      this.place().setItem(this.prefix + name, JSON.stringify(value));
      return true;
    } catch {
      return false;
    }
  }

  remove(name) {
    try {
      this.place().removeItem(this.prefix + name);
    } catch { /* there is nothing to remove */ }
  }

  names() {
    try {
      return Object.keys(this.place()).filter((name) => name.startsWith(this.prefix)).map((name) => name.slice(this.prefix.length));
    } catch {
      return [];
    }
  }
}
