// What a reload must not lose. localStorage may be full or forbidden: then it is lost, and nothing else happens.

export class Store {
  constructor(prefix) { this.prefix = `${prefix}/`; }

  get(name, otherwise = null) {
    try {
      const text = localStorage.getItem(this.prefix + name);
      return text === null ? otherwise : JSON.parse(text);
    } catch {
      return otherwise;
    }
  }

  /** Whether it is kept. */
  set(name, value) {
    try {
      localStorage.setItem(this.prefix + name, JSON.stringify(value));
      return true;
    } catch {
      return false;
    }
  }

  remove(name) {
    try {
      localStorage.removeItem(this.prefix + name);
    } catch { /* nothing was kept */ }
  }

  names() {
    try {
      return Object.keys(localStorage).filter((name) => name.startsWith(this.prefix)).map((name) => name.slice(this.prefix.length));
    } catch {
      return [];
    }
  }
}
