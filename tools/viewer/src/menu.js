// A button with a list below it.
import {el} from './dom.js';

/** A menu; `fill` is called when it opens and returns the elements of the list. */
export function menu(label, face, fill) {
  const list = el('div', {class: 'menu', role: 'menu', 'aria-label': label, hidden: true});
  const button = el('button', {type: 'button', class: 'tool', title: label, 'aria-label': label, 'aria-haspopup': 'menu', 'aria-expanded': 'false', onclick: () => open(list.hidden)}, face);
  const element = el('div', {class: 'has-menu'}, button, list);
  const open = (isOpen, isByKey = false) => {
    if (isOpen) list.replaceChildren(...fill(() => open(false)));
    list.hidden = !isOpen;
    button.setAttribute('aria-expanded', String(isOpen));
    if (!isOpen) return isByKey && button.focus();
    // If the list would extend beyond the right edge of the window, it is moved to the left.
    list.style.left = '0';
    const over = list.getBoundingClientRect().right - document.documentElement.clientWidth + 8;
    if (over > 0) list.style.left = `${-over}px`;
    return list.querySelector('[role^=menuitem]')?.focus();
  };
  element.addEventListener('keydown', (event) => {
    const items = [...list.querySelectorAll('[role^=menuitem]')], at = items.indexOf(document.activeElement);
    const step = {ArrowDown: 1, ArrowUp: -1}[event.key];
    if (event.key === 'Escape' && !list.hidden) open(false, true);
    else if (step && list.hidden) open(true);
    else if (step) items[(at + step + items.length) % items.length]?.focus();
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  document.addEventListener('pointerdown', (event) => { if (!list.hidden && !element.contains(event.target)) open(false); });
  element.addEventListener('focusout', (event) => { if (!list.hidden && event.relatedTarget && !element.contains(event.relatedTarget)) open(false); });
  return element;
}

export function menuItem(text, onclick, more = {}) { return el('button', {type: 'button', role: 'menuitem', tabindex: -1, onclick, ...more}, text); }
