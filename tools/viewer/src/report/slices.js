// The slice viewer: three planes of the image with the surfaces' outlines and the marks.
import {colorOf, el, number} from '../dom.js';
import {outlineAt} from '../outline.js';
import {Plane} from '../plane.js';
import {AXIS_COLORS, dominant, planeName} from '../space.js';

const MANY_MARKS = 100;

export class SlicePanel {
  constructor(axis, data, state, volume) {
    Object.assign(this, {axis, data, state, volume});
    this.plane = new Plane(volume, axis, data.anatomical);
    ({right: this.right, down: this.down} = this.plane);
    this.canvas = el('canvas', {tabindex: 0, role: 'img', 'aria-label': `slice ${planeName(volume, axis, data.anatomical)}; arrow keys change it`});
    this.label = el('span', {class: 'where'});
    this.slider = el('input', {type: 'range', min: 0, max: volume.size[axis] - 1, step: 1, 'data-axis': axis,
      'aria-label': `slice ${planeName(volume, axis, data.anatomical)}`, oninput: () => this.go(Number(this.slider.value))});
    this.chip = el('span', {class: 'chip'}, planeName(volume, axis, data.anatomical));
    this.chip.style.setProperty('--chip', AXIS_COLORS[axis]);
    this.expand = el('button', {type: 'button', class: 'icon', title: 'larger, and back', 'aria-label': 'larger, and back',
      onclick: () => state.set({large: state.get('large') === axis ? -1 : axis})}, '\u2922');
    this.element = el('section', {class: `panel slice axis-${axis}`},
      el('div', {class: 'panel-head'}, this.chip, this.label, this.expand), el('div', {class: 'picture'}, this.canvas), this.slider);
    this.listen();
  }

  listen() {
    const {canvas} = this;
    new ResizeObserver(() => this.draw()).observe(canvas.parentElement);
    this.state.on(['slices', 'visible', 'marks', 'grey', 'decoded', 'focus', 'theme'], () => this.later());
    canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      this.go(this.at + Math.sign(event.deltaY));
    }, {passive: false});
    const drag = (event) => { if (event.buttons === 1) this.pick(event); };
    canvas.addEventListener('pointerdown', (event) => { canvas.setPointerCapture(event.pointerId); drag(event); });
    canvas.addEventListener('pointermove', drag);
    canvas.addEventListener('dblclick', () => this.expand.click());
    canvas.addEventListener('keydown', (event) => {
      const step = {ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1, PageUp: 10, PageDown: -10}[event.key];
      if (!step) return;
      event.preventDefault();
      this.go(this.at + step);
    });
  }

  get at() { return this.state.get('slices')[this.axis]; }

  go(at) {
    const slices = [...this.state.get('slices')];
    slices[this.axis] = Math.min(this.volume.size[this.axis] - 1, Math.max(0, Math.round(at)));
    this.state.set({slices});
  }

  /** The slices of the two other planes through a place in this one. */
  pick(event) {
    const box = this.canvas.getBoundingClientRect(), slices = [...this.state.get('slices')];
    const [x, y] = this.plane.unplace(event.clientX - box.left, event.clientY - box.top);
    const clampTo = (axis, at) => Math.min(this.volume.size[axis] - 1, Math.max(0, Math.round(at)));
    slices[this.right] = clampTo(this.right, x);
    slices[this.down] = clampTo(this.down, y);
    this.state.set({slices});
  }

  later() { this.pending ??= requestAnimationFrame(() => this.draw()); }

  draw() {
    this.pending = null;
    const {plane, canvas} = this, box = canvas.parentElement, ratio = Math.min(2, devicePixelRatio);
    const width = box.clientWidth, height = box.clientHeight;
    this.slider.value = this.at;
    this.tell();
    if (width === 0 || height === 0) return;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    plane.lay(width, height);
    const context = canvas.getContext('2d');
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    this.drawImage(context);
    this.drawCrosshair(context);
    this.drawOutlines(context);
    if (this.state.get('marks')) this.drawMarks(context);
    this.drawFocus(context);
    plane.drawScale(context, this.data.unitText);
    plane.drawLetters(context);
  }

  tell() {
    const {volume, axis} = this, file = volume.toFileIndex(axis, this.at);
    const index = [0, 0, 0];
    index[axis] = this.at;
    const d = dominant(volume.axes[axis]), world = volume.toWorld(index)[d.w];
    this.label.textContent = `${number(Math.round(file))} of 0\u2013${volume.ofSize[axis] - 1}  \u00b7  ${'xyz'[d.w]} ${number(world)}${this.data.unitText ? ` ${this.data.unitText}` : ''}`;
  }

  place(x, y) { return this.plane.place(x, y); }

  drawImage(context) {
    const {values, width: nx, height: ny} = this.volume.slice(this.axis, this.at), grey = this.state.get('grey');
    const key = `${this.at} ${this.state.get('decoded')} ${grey.key}`;
    if (this.key !== key) {
      this.picture ??= Object.assign(document.createElement('canvas'), {width: nx, height: ny});
      const own = this.picture.getContext('2d'), image = own.createImageData(nx, ny), pixels = new Uint32Array(image.data.buffer);
      for (let n = 0; n < values.length; ++n) pixels[n] = 0xff000000 | grey[values[n]] * 0x010101;
      own.putImageData(image, 0, 0);
      this.key = key;
    }
    this.plane.drawPicture(context, this.picture);
  }

  drawCrosshair(context) {
    const slices = this.state.get('slices'), [x, y] = this.place(slices[this.right], slices[this.down]), {left, top, width, height} = this.plane;
    context.lineWidth = 1;
    context.globalAlpha = 0.55;
    for (const [axis, from, to] of [[this.right, [x, top], [x, top + height]], [this.down, [left, y], [left + width, y]]]) {
      context.strokeStyle = AXIS_COLORS[axis];
      context.beginPath();
      context.moveTo(...from);
      context.lineTo(...to);
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  outline(structure) {
    return outlineAt(structure, this.axis, this.at, [this.right, this.down]);
  }

  drawOutlines(context) {
    context.lineCap = 'round';
    this.data.structures.forEach((structure, n) => {
      if (!this.state.get('visible')[n]) return;
      const segments = this.outline(structure);
      context.beginPath();
      for (let s = 0; s < segments.length; s += 4) {
        context.moveTo(...this.place(segments[s], segments[s + 1]));
        context.lineTo(...this.place(segments[s + 2], segments[s + 3]));
      }
      context.strokeStyle = colorOf(structure.color);
      context.lineWidth = 1.75;
      context.stroke();
    });
  }

  drawMarks(context) {
    const {volume, axis} = this, half = 0.5 * Math.max(...volume.spacing) / volume.spacing[axis];
    this.data.structures.forEach((structure, n) => {
      if (!this.state.get('visible')[n]) return;
      const along = structure.markIndex[axis], xs = structure.markIndex[this.right], ys = structure.markIndex[this.down];
      context.fillStyle = this.data.structures.length > 1 ? colorOf(structure.color) : '#2fb6ff';
      context.strokeStyle = 'rgba(0, 0, 0, 0.75)';
      context.lineWidth = 1;
      const here = [];
      for (let m = 0; m < along.length; ++m) if (Math.abs(along[m] - this.at) <= half + 1e-3) here.push(m);
      const many = here.length > MANY_MARKS;  // these would hide the outline
      for (const m of here) {
        context.beginPath();
        context.arc(...this.place(xs[m], ys[m]), many ? 1.25 : 3, 0, 2 * Math.PI);
        context.fill();
        if (!many) context.stroke();
      }
    });
  }

  drawFocus(context) {
    const world = this.state.get('focus');
    if (!world) return;
    const index = this.volume.toIndex(world);
    if (Math.abs(index[this.axis] - this.at) > 1.01) return;
    const [x, y] = this.place(index[this.right], index[this.down]);
    for (const [color, width] of [['rgba(0, 0, 0, 0.6)', 4], ['#ff5a36', 2]]) {
      context.strokeStyle = color;
      context.lineWidth = width;
      context.beginPath();
      context.arc(x, y, 11, 0, 2 * Math.PI);
      context.stroke();
    }
  }
}
