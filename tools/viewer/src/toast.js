// Short messages that disappear after a while, or on a click.
import {el} from './dom.js';

const STAY = 6000;  // ms for which a message is displayed

export class Toasts {
  constructor() { this.element = el('div', {class: 'toasts', role: 'status', 'aria-live': 'polite'}); }

  show(text, kind = 'plain') {
    for (const old of this.element.children) if (old.dataset.text === text) old.remove();
    while (this.element.children.length > 2) this.element.firstChild.remove();
    const toast = el('div', {class: `toast ${kind}`, 'data-text': text, onclick: () => toast.remove()}, text);
    this.element.append(toast);
    setTimeout(() => toast.remove(), STAY);
  }
}
