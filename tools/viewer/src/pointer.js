// Mouse, pen and touch on a plane: position, zoom, grey values, crosshair, ruler. Subclasses add further actions of a
// press.

export const CLICK = 4, TAP = 10;  // CSS pixels that the pointer may move during a click of the mouse, and during a tap
const NOTCH = 30;  // scroll distance per slice, in CSS pixels, for wheels without notches

/** Whether the space bar is pressed: then a drag moves the image. */
const keys = {space: false};
addEventListener('keydown', (event) => { if (event.key === ' ') keys.space = true; });
addEventListener('keyup', (event) => { if (event.key === ' ') keys.space = false; });
addEventListener('blur', () => { keys.space = false; });

export class PlanePointer {
  constructor(panel) {
    Object.assign(this, {panel, fingers: new Map(), gesture: null, spot: null, wheel: 0});
    const {canvas} = panel;
    canvas.addEventListener('pointerdown', (event) => this.down(event));
    canvas.addEventListener('pointermove', (event) => this.move(event));
    canvas.addEventListener('pointerup', (event) => this.up(event));
    canvas.addEventListener('pointercancel', (event) => this.cancel(event));
    canvas.addEventListener('pointerenter', () => panel.state.set({keyPanel: panel.axis}));
    canvas.addEventListener('focus', () => panel.state.set({keyPanel: panel.axis}));
    canvas.addEventListener('pointerleave', () => this.leave());
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('wheel', (event) => this.turn(event), {passive: false});
    // The space bar must not scroll the page while the pointer is on a plane.
    addEventListener('keydown', (event) => { if (event.key === ' ' && this.spot && !event.target.matches?.('button, a, input, select, summary, textarea')) event.preventDefault(); });
    // A touch with one finger scrolls the page, unless it has a function on the plane (takesTouch).
    canvas.addEventListener('touchstart', (event) => {
      const box = canvas.getBoundingClientRect(), touch = event.touches[0];
      if (event.touches.length > 1 || this.takesTouch([touch.clientX - box.left, touch.clientY - box.top])) event.preventDefault();
    }, {passive: false});
  }

  get tool() { return this.panel.state.get('tool'); }

  get isGrabbing() { return keys.space; }

  spotOf(event) {
    const box = this.panel.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  /** Whether a touch at that position has a function on the plane, and must not scroll the page. */
  takesTouch() { return ['ruler', 'crosshair'].includes(this.tool); }

  down(event) {
    const {panel} = this, {state, canvas} = panel, spot = this.spotOf(event);
    canvas.focus({preventScroll: true});
    canvas.setPointerCapture(event.pointerId);
    this.fingers.set(event.pointerId, spot);
    this.spot = spot;
    if (this.fingers.size === 2) return this.interrupt(), this.begin('pinch', spot);
    if (this.fingers.size > 2 || this.gesture) return undefined;
    if (event.button === 1 || (event.button === 0 && keys.space)) return event.preventDefault(), this.begin('pan', spot);
    if (event.button === 2) return this.begin('window', spot, {window: state.get('window')});
    if (event.button !== 0) return undefined;
    if (event.ctrlKey || event.metaKey || this.tool === 'crosshair') return this.begin('crosshair', spot), this.moveCrosshair(spot);
    if (this.tool === 'ruler') return this.begin('ruler', spot, {begins: panel.indexAt(...spot)});
    return this.press(event, spot);
  }

  /** For subclasses. Called when the main button is pressed and no gesture of this class begins. */
  press() {}

  /** Called when a second finger or the system interrupts a gesture. */
  interrupt() {}

  begin(what, from, more = {}) { this.gesture = {what, from, last: from, moved: false, ...more}; }

  move(event) {
    const {panel, gesture} = this, spot = this.spotOf(event);
    this.spot = spot;
    panel.showCursor?.(panel, spot);
    if (!gesture) return this.hover(spot);
    const before = this.fingers.get(event.pointerId);
    if (gesture.what === 'pinch') return this.pinch(event.pointerId, before, spot);
    if (!before) return undefined;
    this.fingers.set(event.pointerId, spot);
    if (Math.hypot(spot[0] - gesture.from[0], spot[1] - gesture.from[1]) > (gesture.limit ?? 0)) gesture.moved = true;
    this.drag(gesture, spot, event);
    gesture.last = spot;
    return undefined;
  }

  drag(gesture, spot) {
    if (gesture.what === 'pan') this.pan(gesture.last, spot);
    else if (gesture.what === 'window') this.changeWindow(gesture, spot);
    else if (gesture.what === 'crosshair') this.moveCrosshair(spot);
    else if (gesture.what === 'ruler') this.measure(gesture, spot);
  }

  up(event) {
    const {panel, gesture} = this, spot = this.spotOf(event);
    this.fingers.delete(event.pointerId);
    if (event.pointerType === 'touch') this.spot = null;
    if (gesture?.what === 'pinch') {  // lifting the second finger must not set a mark
      if (this.fingers.size === 0) this.gesture = null;
      return;
    }
    this.gesture = null;
    if (!gesture) return;
    this.release(gesture, spot, event);
    panel.later();
    this.hover(spot);
  }

  release() {}

  cancel(event) {
    this.fingers.delete(event.pointerId);
    if (this.fingers.size === 0) this.gesture = null;
    this.interrupt();
  }

  leave() {
    if (this.gesture) return;
    this.spot = null;
    this.panel.showCursor?.(this.panel, null);
  }

  hover() { this.panel.canvas.style.cursor = keys.space ? 'grab' : ''; }

  moveCrosshair(spot) {
    const {panel} = this, slices = panel.space.voxelAt(panel.indexAt(...spot));
    slices[panel.axis] = panel.at;
    panel.state.set({slices});
  }

  measure(gesture, spot) {
    const {panel} = this;
    panel.state.set({ruler: {axis: panel.axis, at: panel.shownAt, from: gesture.begins, to: panel.indexAt(...spot)}});
  }

  pan([x0, y0], [x, y]) {
    const {panel} = this, zoom = panel.view?.zoom ?? 1;
    panel.setView(panel.viewWith(zoom, panel.plane.unplace(x0, y0), [x, y]));
    panel.draw();
  }

  pinch(id, before, spot) {
    const other = [...this.fingers].find(([finger]) => finger !== id)?.[1];
    if (!before || !other) return;
    this.fingers.set(id, spot);
    const {panel} = this, middle = (a) => [(a[0] + other[0]) / 2, (a[1] + other[1]) / 2], size = (a) => Math.max(20, Math.hypot(a[0] - other[0], a[1] - other[1]));
    this.pan(middle(before), middle(spot));
    panel.zoomAt(size(spot) / size(before), ...middle(spot));
  }

  changeWindow({from, window: {black, white}}, spot) {
    const {panel} = this, range = Math.max(1e-9, white - black), middle = (black + white) / 2;
    const width = range * Math.exp((spot[0] - from[0]) / 150), level = middle + (spot[1] - from[1]) / 250 * range;
    panel.state.set({window: {black: level - width / 2, white: level + width / 2}});
  }

  turn(event) {
    event.preventDefault();
    const {panel} = this, delta = event.deltaY * (event.deltaMode === 1 ? 40 : event.deltaMode === 2 ? 400 : 1);
    if (event.ctrlKey || event.metaKey) return panel.zoomAt(Math.exp(-Math.min(120, Math.max(-120, delta)) / 350), ...this.spotOf(event));
    this.wheel = Math.sign(delta) === Math.sign(this.wheel) ? this.wheel + delta : delta;
    const steps = Math.abs(delta) >= 50 ? Math.sign(delta) : Math.trunc(this.wheel / NOTCH);
    if (steps === 0) return undefined;
    this.wheel = 0;
    return panel.go(panel.at + steps);
  }
}
