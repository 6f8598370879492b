// One plane on the page: its slice, the overlay, zoom and position.
import {el, number} from './dom.js';
import {Plane, write} from './plane.js';
import {AXIS_COLORS, dominant, planeName} from './space.js';
import {icon} from './icons.js';
import {PictureLayer} from './picture_layer.js';

const MAX_STEP = 1024, LARGEST_VOXEL = 90;  // LARGEST_VOXEL: maximum size of a voxel when zoomed in, CSS pixels
const REDRAWN_ON = ['slices', 'views', 'grey', 'study', 'meshes', 'hover', 'selected', 'ring', 'ruler', 'drag', 'active', 'loaded', 'theme', 'large', 'tool', 'planes', 'countFrom', 'marks'];

/** The step of a slice, in voxels per value and a power of two, if a pixel of the screen shows this many voxels along an axis. */
const stepFor = (voxels) => Math.min(MAX_STEP, 2 ** Math.max(0, Math.floor(Math.log2(voxels) + 1e-6)));

export class PlanePanel {
  /**
   * `app` has image, space, unitText, state, slices, toast, and the members that pointer and overlay need.
   * `drawOverlay(panel, context)` draws on the slice, `Input` is a PlanePointer, `redrawnOn` lists further names of the state.
   */
  constructor(axis, app, {drawOverlay, Input, redrawnOn = []}) {
    Object.assign(this, {axis, ...app, drawOverlay, shownAt: -1, travel: 0, picture: null, pictureStep: 1, layer: new PictureLayer()});
    const {state, space, image} = this, name = planeName(space, axis, image.anatomical);
    this.name = name;
    this.plane = new Plane(space, axis, image.anatomical);
    ({right: this.right, down: this.down} = this.plane);
    this.canvas = el('canvas', {tabindex: 0, role: 'application', 'aria-roledescription': 'image plane'});
    this.slider = el('input', {type: 'range', min: 0, max: space.size[axis] - 1, step: 1, 'data-axis': axis, 'aria-label': `slice, ${name}`,
      oninput: () => this.go(Number(this.slider.value))});
    this.chip = el('span', {class: 'chip'}, name);
    this.chip.style.setProperty('--chip', AXIS_COLORS[axis]);
    this.where = el('button', {type: 'button', class: 'where', title: 'slices are counted from 0, as covol does, or from 1, as Fiji does (k)', onclick: () => state.set({countFrom: 1 - state.get('countFrom')})});
    this.fit = el('button', {type: 'button', class: 'icon fit', title: 'whole slice (r)', 'aria-label': `whole slice, ${name}`, onclick: () => this.setView(null)});
    this.large = el('button', {type: 'button', class: 'icon', title: 'this plane alone, and back (f)', 'aria-label': `${name} alone, and back`, onclick: () => this.toggleLarge()});
    const head = el('div', {class: 'panel-head', ondblclick: (event) => { if (!event.target.closest('button, input')) this.toggleLarge(); }},
      this.chip, this.slider, this.where, this.fit, this.large);
    this.element = el('section', {class: `panel slice axis-${axis}`, 'aria-label': name}, head, el('div', {class: 'picture'}, this.canvas, this.layer.canvas));
    new ResizeObserver(() => this.draw()).observe(this.canvas.parentElement);
    state.on([...REDRAWN_ON, ...redrawnOn], () => this.later());
    this.input = new Input(this);
  }

  get at() { return this.state.get('slices')[this.axis]; }

  get view() { return this.state.get('views')[this.axis]; }

  go(at) {
    const slices = [...this.state.get('slices')], next = Math.min(this.space.size[this.axis] - 1, Math.max(0, Math.round(at)));
    this.travel = Math.sign(next - this.at) || this.travel;
    slices[this.axis] = next;
    this.state.set({slices});
  }

  toggleLarge() { this.state.set({large: this.state.get('large') === this.axis ? -1 : this.axis}); }

  setView(view) {
    const views = [...this.state.get('views')];
    views[this.axis] = view && {zoom: view.zoom, x: Math.min(this.space.size[this.right] - 0.5, Math.max(-0.5, view.x)), y: Math.min(this.space.size[this.down] - 0.5, Math.max(-0.5, view.y))};
    this.state.set({views});
  }

  /** The view with this zoom in which voxel (x, y) is displayed at position (px, py) of the canvas. */
  viewWith(zoom, [x, y], [px, py]) {
    const {plane} = this, grow = zoom / (this.view?.zoom ?? 1), [sx, sy] = plane.shown(x, y), rows = (py - plane.viewHeight / 2) / (plane.scaleY * grow);
    const [cx, cy] = plane.shown(sx - (px - plane.viewWidth / 2) / (plane.scaleX * grow) + rows * plane.lean / plane.scaleX, sy - rows);
    return {zoom, x: cx, y: cy};
  }

  zoomAt(factor, px = this.plane.viewWidth / 2, py = this.plane.viewHeight / 2) {
    const {plane} = this, before = this.view?.zoom ?? 1, fit = Math.min(plane.scaleX, plane.scaleY) / before;
    const zoom = Math.min(LARGEST_VOXEL / fit, before * factor);
    this.setView(zoom <= 1.001 ? null : this.viewWith(zoom, plane.unplace(px, py), [px, py]));
    this.draw();  // immediately: draw() updates this.plane, with which the next event computes positions
  }

  /** Scrolls to a position if it is outside of the zoomed view. */
  reveal(index) {
    if (!this.view || !this.plane.viewWidth) return;
    const [px, py] = this.plane.place(index[this.right], index[this.down]), {viewWidth, viewHeight} = this.plane, rim = 24;
    if (px < rim || py < rim || px > viewWidth - rim || py > viewHeight - rim) this.setView({...this.view, x: index[this.right], y: index[this.down]});
  }

  /** A position on the canvas in voxels of the image, on the displayed slice. */
  indexAt(px, py) {
    const index = [0, 0, 0], [x, y] = this.plane.unplace(px, py);
    [index[this.axis], index[this.right], index[this.down]] = [this.shownAt, x, y];
    return index;
  }

  /** Whether a position can be marked: it is inside the image, and the slice is displayed. */
  isSeen(index) {
    if (!this.isInside(index)) return false;
    if (!this.hasPicture) this.toast('This slice could not be loaded: it is not marked blindly.');
    return this.hasPicture;
  }

  isInside(index) { return [this.right, this.down].every((a) => index[a] >= -0.5 && index[a] <= this.space.size[a] - 0.5); }

  /** A position of the world in CSS pixels of the canvas, and of the window. */
  spotOf(world) {
    const index = this.space.toIndex(world);
    return this.plane.place(index[this.right], index[this.down]);
  }

  pixelOf(world) {
    const box = this.canvas.getBoundingClientRect(), [x, y] = this.spotOf(world);
    return [box.left + x, box.top + y];
  }

  later() { this.pending ??= requestAnimationFrame(() => this.draw()); }

  draw() {
    if (this.pending) cancelAnimationFrame(this.pending);
    this.pending = null;
    const {canvas, plane} = this, box = canvas.parentElement, ratio = Math.min(3, devicePixelRatio), width = box.clientWidth, height = box.clientHeight;
    this.tell();
    if (width === 0 || height === 0) return this.drawHidden(ratio);
    const size = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
    plane.lay(width, height, this.view);
    this.takeSlice(ratio);
    const context = canvas.getContext('2d');
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    this.layer.draw(plane, width, height, ratio, this.hasPicture);
    if (!this.hasPicture) this.drawNoPicture(context, width, height);
    this.drawOverlay(this, context);
    if (this.input.spot && !this.input.gesture) this.showCursor?.(this, this.input.spot);
    plane.drawScale(context, this.unitText);
    plane.drawLetters(context);
    return undefined;
  }

  /** Updates the picture of a plane that is not visible on the page, because another one is enlarged; the 3D view may still show it. */
  drawHidden(ratio) {
    if (!this.state.get('planes')[this.axis]) return;
    if (!this.plane.scaleX) this.plane.lay(512, 512);
    this.takeSlice(ratio);
  }

  /** The step that matches the pixels of the screen, and the displayed part of the slice. */
  requestFor(ratio) {
    const {plane, axis, slices} = this, step = stepFor(1 / (Math.max(plane.scaleX, plane.scaleY) * ratio));
    const {viewWidth: width, viewHeight: height} = plane, corners = [[0, 0], [width, 0], [0, height], [width, height]].map(([x, y]) => plane.unplace(x, y));
    const [low, high] = [Math.min, Math.max].map((of) => [0, 1].map((a) => of(...corners.map((corner) => corner[a]))));
    return {step, part: slices.partFor(axis, step, low, high)};
  }

  takeSlice(ratio) {
    const {axis, at, slices} = this, {step, part} = this.requestFor(ratio), wanted = `${at} ${step} ${JSON.stringify(part)}`, failed = slices.hasFailed(axis, at, step, part);
    if (this.wanted !== wanted || (this.hadFailed && !failed) || this.generation !== slices.generation) slices.want(axis, at, step, this.travel, part);
    this.wanted = wanted;
    this.generation = slices.generation;
    this.hadFailed = failed;
    // Until the slice has been received, a previous one is displayed, with its overlay.
    const late = slices.best(axis, at, step) || part || this.shownAt < 0 ? null : slices.late(axis, at, step, this.shownAt), place = late ?? at;
    const slice = slices.best(axis, place, step), detail = part && slices.partial(axis, place, step, part);
    const isNew = slice && this.layer.take(slice, detail, this.state.get('grey'));
    if (slice) [this.slice, this.picture, this.pictureStep] = [slice, this.layer.whole.canvas, slice.step];
    if (slice || failed) [this.shownAt, this.hasPicture] = [place, Boolean(slice)];
    if (isNew) this.onPicture?.(axis);
  }

  /** To be called when the content of the slice has changed although its position has not: it is then drawn again. */
  forgetPicture() { this.layer.whole.slice = null; }

  drawNoPicture(context, width, height) {
    if (this.shownAt < 0) return;
    const {left, top, width: w, height: h} = this.plane;
    context.fillStyle = '#16171a';
    context.fillRect(left, top, w, h);
    context.font = '12px system-ui, sans-serif';
    context.textAlign = 'center';
    write(context, 'this slice could not be loaded', width / 2, height / 2);
  }

  tell() {
    const {space, axis, at, state} = this, index = [0, 0, 0];
    index[axis] = at;
    const {w} = dominant(space.axes[axis]), world = space.fileWorld(index)[w], first = state.get('countFrom');
    const shown = space.fileNumber(axis, at) + first, range = `${first}\u2013${space.fileCount(axis) - 1 + first}`, text = `${shown} of ${range}`, isZoomed = Boolean(this.view);
    const place = `${'xyz'[w]} ${number(world).replace('-', '\u2212')}${this.unitText ? `\u2009${this.unitText}` : ''}`;
    if (this.where.dataset.text !== text + place) {
      this.where.dataset.text = text + place;
      this.where.replaceChildren(el('b', {}, String(shown)), ` of ${range}`, el('span', {class: 'world'}, ` \u00b7 ${place}`));
      this.slider.value = at;
      this.slider.setAttribute('aria-valuetext', `${text}, ${place}`);
      this.canvas.setAttribute('aria-label', `${this.name}, slice ${text}. Arrows move the crosshair, a sets a mark there, [ and ] change the slice`);
    }
    const zoom = isZoomed ? `${number(this.view.zoom, 2)}\u00d7` : '';
    if (this.fit.textContent !== zoom) this.fit.textContent = zoom;
    this.fit.hidden = !isZoomed;
    const isLarge = this.state.get('large') === axis;
    if (this.isLarge !== isLarge) this.large.replaceChildren(icon(isLarge ? 'small' : 'large'));
    this.isLarge = isLarge;
  }
}
