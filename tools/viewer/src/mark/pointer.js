// Outlines and paint by mouse, pen and touch, in addition to gestures of planes and marks.
import {MarkPointer} from '../mark_pointer.js';
import {CLICK, TAP} from '../pointer.js';
import {isBrush} from './tools.js';

const HIT_LINE = 6;  // CSS pixels: maximum distance of the pointer from a line that it selects
const FREEHAND = 3;  // minimum number of CSS pixels between two corners of a freehand outline
const NEAR_BEGINNING = 10;

function distanceToLine([x, y], [ax, ay], [bx, by]) {
  const dx = bx - ax, dy = by - ay, share = Math.min(1, Math.max(0, ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1)));
  return Math.hypot(x - ax - share * dx, y - ay - share * dy);
}

export class PointerInput extends MarkPointer {
  constructor(panel) {
    super(panel);
    panel.canvas.addEventListener('dblclick', () => this.doubleClick());
  }

  get isDrawing() { return this.gesture?.what === 'freehand'; }

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

  targetAt(spot, isTouch = false) { return super.targetAt(spot, isTouch) ?? this.outlineAt(spot); }

  hoverTarget(spot) { return this.panel.state.get('draft') || isBrush(this.tool) ? null : super.hoverTarget(spot); }

  takesTouch(spot) { return super.takesTouch(spot) || this.tool === 'outline' || isBrush(this.tool); }

  interrupt() {
    super.interrupt();
    this.panel.state.set({stroke: null});
  }

  press(event, spot) {
    if (isBrush(this.tool)) return this.beginStroke(event, spot);
    if (this.tool !== 'outline') return super.press(event, spot);
    return this.begin('outline', spot, {hit: null, limit: event.pointerType === 'touch' ? TAP : CLICK});
  }

  drag(gesture, spot, event) {
    if (gesture.what === 'outline') this.beginFreehand(gesture, spot);
    else if (gesture.what === 'freehand') this.freehand(gesture, event);
    else if (gesture.what === 'stroke') this.continueStroke(gesture, event);
    else super.drag(gesture, spot, event);
  }

  release(gesture, spot, event) {
    if (gesture.what === 'outline' && !gesture.moved) this.corner(spot);
    else if (gesture.what === 'freehand') this.endFreehand(spot);
    else if (gesture.what === 'stroke') this.panel.tools.endStroke();
    else super.release(gesture, spot, event);
  }

  leave() {
    super.leave();
    if (!this.gesture && (this.panel.state.get('draft') || isBrush(this.tool))) this.panel.later();
  }

  hover(spot) {
    super.hover(spot);
    if (this.panel.state.get('draft') || isBrush(this.tool)) this.panel.later();
  }

  corner(spot) {
    const {panel} = this, draft = panel.state.get('draft'), index = panel.indexAt(...spot);
    if (!panel.isSeen(index)) return;
    if (draft && draft.axis === panel.axis && draft.at === panel.shownAt) {
      const distance = (place) => Math.hypot(...panel.plane.place(...place).map((v, n) => v - spot[n]));
      if (distance(draft.places.at(-1)) < CLICK) return;  // the second click of a double click adds no corner
      if (draft.places.length > 2 && distance(draft.places[0]) < NEAR_BEGINNING) return void panel.tools.closeDraft(true, 1 / panel.plane.scaleX);
    }
    panel.tools.addCorners(panel, [[index[panel.right], index[panel.down]]]);
  }

  doubleClick() {
    if (this.panel.state.get('tool') === 'outline' && this.panel.state.get('draft')) this.panel.tools.closeDraft(true);
  }

  beginStroke(event, spot) {
    const {panel} = this, index = panel.indexAt(...spot);
    if (!panel.isSeen(index)) return;
    const erases = this.tool === 'rubber' || event.shiftKey;
    if (panel.tools.stroke(panel, [index], erases)) this.begin('stroke', spot, {corner: spot, at: panel.shownAt});
  }

  /** Adds corners a third of the brush radius apart; between them the stroke is a straight line. */
  continueStroke(gesture, event) {
    const {panel} = this, places = [], apart = Math.max(2, panel.state.get('brush').radius * panel.plane.scale / 3);
    for (const one of event.getCoalescedEvents?.() ?? [event]) {
      const spot = this.spotOf(one), index = panel.indexAt(...spot);
      if (Math.hypot(spot[0] - gesture.corner[0], spot[1] - gesture.corner[1]) < apart || !panel.isInside(index)) continue;
      gesture.corner = spot;
      index[panel.axis] = gesture.at;
      places.push(index);
    }
    if (places.length > 0) panel.tools.stroke(panel, places);
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

  /** Closes the outline if it ends at its beginning. */
  endFreehand(spot) {
    const {panel} = this, draft = panel.state.get('draft');
    if (!draft || draft.places.length < 6) return;
    const [x, y] = panel.plane.place(...draft.places[0]);
    if (Math.hypot(spot[0] - x, spot[1] - y) < NEAR_BEGINNING) panel.tools.closeDraft(true, 1 / panel.plane.scaleX);
  }
}
