// What a reload must not lose. The browser's storage may be full or forbidden: then it is lost, and nothing else happens.

export class Store {
  /** `place()` gives the storage: localStorage, or sessionStorage for what belongs to one tab. */
  constructor(prefix, place = () => localStorage) { Object.assign(this, {prefix: `${prefix}/`, place}); }

  get(name, otherwise = null) {
    try {
      const text = this.place().getItem(this.prefix + name);
      return text === null ? otherwise : JSON.parse(text);
    } catch {
      return otherwise;
    }
  }

  /** Whether it is kept. */
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
    } catch { /* nothing was kept */ }
  }

  names() {
    try {
      return Object.keys(this.place()).filter((name) => name.startsWith(this.prefix)).map((name) => name.slice(this.prefix.length));
    } catch {
      return [];
    }
  }
}
