// Creates elements without markup in strings: a name from a file is always treated as text.

/** An element; attributes that begin with "on" are listeners, children may be strings. */
export function el(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else if (name === 'class') element.className = value;
    else element.setAttribute(name, value === true ? '' : value);
  }
  for (const child of children.flat(Infinity)) if (child !== null && child !== undefined) element.append(child);
  return element;
}

export function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS('http://www.w3.org/2000/svg', tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** A toggle button. */
export function toggle(label, isOn, change, attributes = {}) {
  const button = el('button', {
    type: 'button', class: 'toggle', 'aria-pressed': String(isOn), ...attributes,
    onclick: () => {
      const on = button.getAttribute('aria-pressed') !== 'true';
      button.setAttribute('aria-pressed', String(on));
      change(on);
    },
  }, label);
  return button;
}

/** A choice of one of several words. */
export function choice(words, chosen, change, label) {
  const buttons = words.map(([value, text, title]) => el('button', {
    type: 'button', class: 'toggle', 'aria-pressed': String(value === chosen), title, 'data-value': value,
    onclick: () => {
      for (const other of buttons) other.setAttribute('aria-pressed', String(other.dataset.value === String(value)));
      change(value);
    },
  }, text));
  return el('div', {class: 'choice', role: 'group', 'aria-label': label}, buttons);
}

/** A number for display: four digits, without an exponent if possible. */
export function number(value, digits = 4) {
  if (typeof value !== 'number' || !Number.isFinite(value)) return String(value);
  if (Number.isInteger(value)) return Math.abs(value) < 1e15 ? value.toLocaleString('en-US').replace(/,/g, '\u2009') : String(value);
  const size = Math.abs(value);
  if (size >= 1e9 || size < 1e-4) return value.toExponential(Math.max(0, digits - 1));
  const text = Number(value.toPrecision(digits));
  return Math.abs(text) >= 1e4 ? Math.round(text).toLocaleString('en-US').replace(/,/g, '\u2009') : String(text);
}

/** A unit for display: "um" with a Greek mu. */
export function unitText(unit) {
  const known = {um: '\u00b5m', micron: '\u00b5m', micrometer: '\u00b5m', micrometre: '\u00b5m', millimeter: 'mm', nanometer: 'nm'};
  return known[unit] ?? unit;
}

export function colorOf(rgb) { return `rgb(${rgb[0]}, ${rgb[1]}, ${rgb[2]})`; }

/** A round dot of a colour. */
export function dot(color) {
  const element = el('span', {class: 'dot'});
  element.style.background = colorOf(color);
  return element;
}
