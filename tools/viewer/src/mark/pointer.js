// Mouse, pen and fingers on a plane.
import {marksOn} from './overlay.js';

const CLICK = 4, TAP = 10;  // CSS pixels that a press may move and still be a click
const HIT = 8, HIT_LINE = 6;
const FREEHAND = 3;  // between two corners
const NEAR_BEGINNING = 10;
const NOTCH = 30;  // of a wheel that turns smoothly

/** Whether the space bar is down: then a drag moves the picture. */
const keys = {space: false};
addEventListener('keydown', (event) => { if (event.key === ' ') keys.space = true; });
addEventListener('keyup', (event) => { if (event.key === ' ') keys.space = false; });
addEventListener('blur', () => { keys.space = false; });

function distanceToLine([x, y], [ax, ay], [bx, by]) {
  const dx = bx - ax, dy = by - ay, share = Math.min(1, Math.max(0, ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1)));
  return Math.hypot(x - ax - share * dx, y - ay - share * dy);
}

export class PointerInput {
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
    canvas.addEventListener('dblclick', (event) => this.doubleClick(event));
    canvas.addEventListener('wheel', (event) => this.turn(event), {passive: false});
    // One finger scrolls the page, unless it has something to do here.
    canvas.addEventListener('touchstart', (event) => {
      const tool = panel.state.get('tool'), box = canvas.getBoundingClientRect(), touch = event.touches[0];
      const hit = this.markAt([touch.clientX - box.left, touch.clientY - box.top], TAP + 4);
      if (event.touches.length > 1 || hit || ['outline', 'ruler', 'crosshair'].includes(tool)) event.preventDefault();
    }, {passive: false});
  }

  get isDrawing() { return this.gesture?.what === 'freehand'; }

  spotOf(event) {
    const box = this.panel.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  /** The nearest mark of this slice that may be changed. */
  markAt([x, y], within = HIT) {
    let best = null, least = within;
    const active = this.panel.tools.active();
    for (const {structure, mark, spot} of marksOn(this.panel, 0)) {
      const distance = Math.hypot(spot[0] - x, spot[1] - y) - (structure === active ? 0.5 : 0);
      if (structure.locked || distance > least) continue;
      least = distance;
      best = {structure: structure.id, mark: mark.id};
    }
    return best;
  }

  outlineAt(spot) {
    const {study, axis, shownAt} = this.panel;
    for (const structure of study.structures) {
      if (!structure.visible || structure.locked) continue;
      for (const outline of structure.outlines) {
        if (outline.axis !== axis || outline.at !== shownAt) continue;
        const spots = outline.world.map((world) => this.panel.spotOf(world));
        const isNear = spots.some((a, n) => (n > 0 || outline.closed) && distanceToLine(spot, spots.at(n - 1), a) <= HIT_LINE);
        if (isNear) return {structure: structure.id, outline: outline.id};
      }
    }
    return null;
  }

  targetAt(spot, isTouch = false) { return this.markAt(spot, isTouch ? TAP + 4 : HIT) ?? this.outlineAt(spot); }

  down(event) {
    const {panel} = this, {state, canvas} = panel, spot = this.spotOf(event), isTouch = event.pointerType === 'touch', tool = state.get('tool');
    canvas.focus({preventScroll: true});
    canvas.setPointerCapture(event.pointerId);
    this.fingers.set(event.pointerId, spot);
    this.spot = spot;
    if (this.fingers.size === 2) return state.set({drag: null}), this.begin('pinch', spot);
    if (this.fingers.size > 2 || this.gesture) return undefined;
    if (event.button === 1 || (event.button === 0 && keys.space)) return event.preventDefault(), this.begin('pan', spot);
    if (event.button === 2) return this.begin('window', spot, {window: state.get('window')});
    if (event.button !== 0) return undefined;
    if (event.ctrlKey || event.metaKey || tool === 'crosshair') return this.begin('crosshair', spot), this.moveCrosshair(spot);
    if (tool === 'ruler') return this.begin('ruler', spot, {begins: panel.indexAt(...spot)});
    const hit = tool === 'outline' ? null : this.targetAt(spot, isTouch);
    if (hit?.mark) {
      const mark = panel.study.structure(hit.structure).marks.find((m) => m.id === hit.mark), [x, y] = panel.spotOf(mark.world);
      return this.begin('mark', spot, {hit, grip: [x - spot[0], y - spot[1]], limit: isTouch ? TAP : CLICK});
    }
    return this.begin(tool === 'outline' ? 'outline' : 'click', spot, {hit, limit: isTouch ? TAP : CLICK});
  }

  begin(what, from, more = {}) { this.gesture = {what, from, last: from, moved: false, ...more}; }

  move(event) {
    const {panel, gesture} = this, spot = this.spotOf(event);
    this.spot = spot;
    panel.tellCursor?.(panel, spot);
    if (!gesture) return this.hover(spot);
    const before = this.fingers.get(event.pointerId);
    if (gesture.what === 'pinch') return this.pinch(event.pointerId, before, spot);
    if (!before) return undefined;
    this.fingers.set(event.pointerId, spot);
    if (Math.hypot(spot[0] - gesture.from[0], spot[1] - gesture.from[1]) > (gesture.limit ?? 0)) gesture.moved = true;
    const act = {pan: () => this.pan(gesture.last, spot), window: () => this.changeWindow(gesture, spot), crosshair: () => this.moveCrosshair(spot),
      ruler: () => this.measure(gesture, spot), mark: () => this.dragMark(gesture, spot), outline: () => this.beginFreehand(gesture, spot), freehand: () => this.freehand(gesture, event)};
    act[gesture.what]?.();
    gesture.last = spot;
    return undefined;
  }

  up(event) {
    const {panel, gesture} = this, spot = this.spotOf(event);
    this.fingers.delete(event.pointerId);
    if (event.pointerType === 'touch') this.spot = null;
    if (gesture?.what === 'pinch') {  // the second finger that is lifted sets no mark
      if (this.fingers.size === 0) this.gesture = null;
      return;
    }
    this.gesture = null;
    if (!gesture) return;
    if (gesture.what === 'click' && !gesture.moved) this.click(event, spot, gesture.hit);
    else if (gesture.what === 'mark') this.drop(gesture);
    else if (gesture.what === 'outline' && !gesture.moved) this.corner(spot);
    else if (gesture.what === 'freehand') this.endFreehand(spot);
    panel.later();
    this.hover(spot);
  }

  cancel(event) {
    this.fingers.delete(event.pointerId);
    if (this.fingers.size === 0) this.gesture = null;
    this.panel.state.set({drag: null});
  }

  leave() {
    if (this.gesture) return;
    this.spot = null;
    this.panel.state.set({hover: null});
    this.panel.tellCursor?.(this.panel, null);
    if (this.panel.state.get('draft')) this.panel.later();
  }

  hover(spot) {
    const {state, canvas} = this.panel, tool = state.get('tool'), hit = ['ruler', 'crosshair'].includes(tool) || state.get('draft') ? null : this.targetAt(spot), old = state.get('hover');
    if (hit?.mark !== old?.mark || hit?.outline !== old?.outline || hit?.structure !== old?.structure) state.set({hover: hit});
    if (state.get('draft')) this.panel.later();
    canvas.style.cursor = keys.space ? 'grab' : hit?.mark ? 'move' : hit && tool === 'erase' ? 'pointer' : tool === 'erase' ? 'default' : '';
  }

  click(event, spot, hit) {
    const {panel} = this, {state, tools} = panel, tool = state.get('tool');
    if (tool === 'erase') return void (hit ? tools.remove(hit) : state.set({selected: null}));
    const index = panel.indexAt(...spot);
    state.set({selected: null});
    if (!panel.isSeen(index)) return undefined;
    return tools.addMark(tools.kindOf(event), panel.space.toWorld(index));
  }

  dragMark(gesture, spot) {
    if (!gesture.moved) return;
    const {panel} = this, index = panel.indexAt(spot[0] + gesture.grip[0], spot[1] + gesture.grip[1]);
    for (const a of [panel.right, panel.down]) index[a] = Math.min(panel.space.size[a] - 0.5, Math.max(-0.5, index[a]));
    panel.state.set({drag: {...gesture.hit, world: panel.space.toWorld(index)}});
  }

  drop({hit, moved}) {
    const {state, tools} = this.panel, drag = state.get('drag');
    if (!moved && state.get('tool') === 'erase') return tools.remove(hit);
    if (drag) tools.moveMark(hit, drag.world);
    state.set({drag: null, selected: hit});
    return undefined;
  }

  corner(spot) {
    const {panel} = this, draft = panel.state.get('draft'), index = panel.indexAt(...spot);
    if (!panel.isSeen(index)) return;
    if (draft && draft.axis === panel.axis && draft.at === panel.shownAt) {
      const distance = (place) => Math.hypot(...panel.plane.place(...place).map((v, n) => v - spot[n]));
      if (distance(draft.places.at(-1)) < CLICK) return;  // the second click of a double click
      if (draft.places.length > 2 && distance(draft.places[0]) < NEAR_BEGINNING) return void panel.tools.closeDraft(true, 1 / panel.plane.scaleX);
    }
    panel.tools.addCorners(panel, [[index[panel.right], index[panel.down]]]);
  }

  doubleClick() {
    if (this.panel.state.get('tool') === 'outline' && this.panel.state.get('draft')) this.panel.tools.closeDraft(true);
  }

  beginFreehand(gesture, spot) {
    if (!gesture.moved) return;
    this.corner(gesture.from);
    if (!this.panel.state.get('draft')) return void (this.gesture = null);
    gesture.what = 'freehand';
    gesture.corner = gesture.from;
    gesture.last = spot;
  }

  freehand(gesture, event) {
    const {panel} = this, places = [];
    for (const one of event.getCoalescedEvents?.() ?? [event]) {
      const spot = this.spotOf(one), index = panel.indexAt(...spot);
      if (Math.hypot(spot[0] - gesture.corner[0], spot[1] - gesture.corner[1]) < FREEHAND || !panel.isInside(index)) continue;
      gesture.corner = spot;
      places.push([index[panel.right], index[panel.down]]);
    }
    if (places.length > 0) panel.tools.addCorners(panel, places);
  }

  /** Back at the beginning: it is closed. */
  endFreehand(spot) {
    const {panel} = this, draft = panel.state.get('draft');
    if (!draft || draft.places.length < 6) return;
    const [x, y] = panel.plane.place(...draft.places[0]);
    if (Math.hypot(spot[0] - x, spot[1] - y) < NEAR_BEGINNING) panel.tools.closeDraft(true, 1 / panel.plane.scaleX);
  }

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
