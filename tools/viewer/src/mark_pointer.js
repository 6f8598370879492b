// Marks by mouse, pen and touch: a click sets one, a drag moves it.
import {marksOn} from './overlay.js';
import {CLICK, PlanePointer, TAP} from './pointer.js';

const HIT = 8;  // CSS pixels: maximum distance of the pointer from a mark that it selects

export class MarkPointer extends PlanePointer {
  /** The mark on this slice that is nearest to a position on the canvas, within so many CSS pixels, and that can be changed. */
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

  /** The mark that a press at that position selects or moves. */
  targetAt(spot, isTouch = false) { return this.markAt(spot, isTouch ? TAP + 4 : HIT); }

  takesTouch(spot) { return super.takesTouch(spot) || Boolean(this.markAt(spot, TAP + 4)); }

  press(event, spot) {
    const {panel} = this, isTouch = event.pointerType === 'touch', hit = this.targetAt(spot, isTouch), limit = isTouch ? TAP : CLICK;
    if (!hit?.mark) return this.begin('click', spot, {hit, limit});
    const mark = panel.study.structure(hit.structure).marks.find((m) => m.id === hit.mark), [x, y] = panel.spotOf(mark.world);
    return this.begin('mark', spot, {hit, grip: [x - spot[0], y - spot[1]], limit});
  }

  interrupt() { this.panel.state.set({drag: null}); }

  drag(gesture, spot, event) {
    if (gesture.what === 'mark') this.dragMark(gesture, spot);
    else super.drag(gesture, spot, event);
  }

  release(gesture, spot, event) {
    if (gesture.what === 'click' && !gesture.moved) this.click(event, spot, gesture.hit);
    else if (gesture.what === 'mark') this.drop(gesture);
  }

  leave() {
    super.leave();
    if (!this.gesture) this.panel.state.set({hover: null});
  }

  hoverTarget(spot) { return ['ruler', 'crosshair'].includes(this.tool) ? null : this.targetAt(spot); }

  hover(spot) {
    const {state, canvas} = this.panel, {tool} = this, hit = this.hoverTarget(spot), old = state.get('hover');
    if (hit?.mark !== old?.mark || hit?.outline !== old?.outline || hit?.structure !== old?.structure) state.set({hover: hit});
    canvas.style.cursor = this.isGrabbing ? 'grab' : hit?.mark ? 'move' : hit && tool === 'erase' ? 'pointer' : tool === 'erase' ? 'default' : '';
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
}
