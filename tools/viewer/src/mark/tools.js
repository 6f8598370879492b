// Effects of clicks, drags and keys on the active structure: outlines and whole structures, in addition to marks.
import {MARK_TOOLS, MarkTools} from '../mark_tools.js';

const OUTLINE = ['outline', 'outline', 'c', 'Click: corner, drag: freehand \u00b7 Enter closes, Shift+Enter leaves it open, Escape cancels'];
const BRUSH_KEYS = ', and . change the size \u00b7 d: disc or ball';
const BRUSHES = [['brush', 'brush', 'b', `Drag paints what is inside \u00b7 Shift rubs out \u00b7 ${BRUSH_KEYS}`], ['rubber', 'rub out paint', 'g', `Drag rubs paint out \u00b7 ${BRUSH_KEYS}`]];
export const isBrush = (tool) => ['brush', 'rubber'].includes(tool);
export const TOOLS = [...MARK_TOOLS.slice(0, 3), OUTLINE, ...BRUSHES, ...MARK_TOOLS.slice(3)];
const COLORS = [[68, 119, 170], [238, 102, 119], [34, 136, 51], [204, 187, 68], [102, 204, 238], [170, 51, 119], [238, 119, 51],
  [0, 153, 136], [136, 34, 85], [153, 153, 51], [51, 34, 136], [187, 187, 187]];

/** Simplifies a line (Douglas and Peucker): removes corners that are at most `most` away from the simplified line. */
function thinned(places, most) {
  if (places.length < 3) return places;
  const [a, b] = [places[0], places[places.length - 1]], dx = b[0] - a[0], dy = b[1] - a[1], length = Math.hypot(dx, dy);
  let far = 0, at = 0;
  for (let n = 1; n < places.length - 1; ++n) {
    const [x, y] = [places[n][0] - a[0], places[n][1] - a[1]], distance = length > 0 ? Math.abs(x * dy - y * dx) / length : Math.hypot(x, y);
    if (distance > far) [far, at] = [distance, n];
  }
  if (far <= most) return [a, b];
  return [...thinned(places.slice(0, at + 1), most).slice(0, -1), ...thinned(places.slice(at), most)];
}

export class Tools extends MarkTools {
  isReady() {
    if (this.study.name === null) this.toast('Not connected yet.');
    return this.study.name !== null;
  }

  addStructure() {
    if (this.study.name === null) return void this.toast('Not connected yet.');
    const names = new Set(this.study.structures.map((s) => s.name)), used = new Set(this.study.structures.map((s) => String(s.color)));
    let n = this.study.structures.length + 1;
    while (names.has(`structure ${n}`)) ++n;
    const color = COLORS.find((c) => !used.has(String(c))) ?? COLORS[this.study.structures.length % COLORS.length];
    const reference = this.study.act({do: 'add_structure', name: `structure ${n}`, color});
    this.state.set({active: reference, selected: null});
    return reference;
  }

  /** Continues the stroke that is being painted; returns false if painting is not possible. */
  stroke(panel, places, erases) {
    const {axis, shownAt: at} = panel, {radius, isBall} = this.state.get('brush'), old = this.state.get('stroke');
    if (!old && (!this.isReady() || !this.open())) return false;
    const world = places.map((index) => this.space.toWorld(index));
    this.state.set({stroke: old ? {...old, world: [...old.world, ...world]} : {erases, radius, ...(isBall ? {} : {axis, at}), world}});
    return true;
  }

  endStroke() {
    const stroke = this.state.get('stroke'), own = stroke && this.open();
    if (own && !(stroke.erases && (own.strokes ?? []).length === 0)) this.study.act({do: 'add_stroke', structure: own.id, ...stroke});
    this.state.set({stroke: null});
  }

  resizeBrush(factor) {
    const {radius, isBall} = this.state.get('brush'), least = 0.5 * Math.min(...this.space.spacing), most = Math.max(...this.space.size.map((n, a) => n * this.space.spacing[a])) / 4;
    this.state.set({brush: {radius: Math.min(most, Math.max(least, radius * factor)), isBall}});
  }

  toggleBall() {
    const {radius, isBall} = this.state.get('brush');
    this.state.set({brush: {radius, isBall: !isBall}});
    this.toast(isBall ? 'The brush paints on one slice.' : 'The brush is a ball: it paints on the slices beside it as well.');
  }

  /** Adds corners to the outline that is being drawn; `places` are voxels in the plane. */
  addCorners(panel, places) {
    const {axis, at} = panel, draft = this.state.get('draft');
    if (draft && (draft.axis !== axis || draft.at !== at))
      return this.toast(`An outline on slice ${draft.at} is not finished: Enter closes it, Escape cancels it.`);
    if (!draft && !this.open()) return undefined;
    this.state.set({draft: {axis, at, places: [...(draft?.places ?? []), ...places]}});
    return undefined;
  }

  dropCorner() {
    const draft = this.state.get('draft');
    if (!draft) return false;
    const places = draft.places.slice(0, -1);
    this.state.set({draft: places.length > 0 ? {...draft, places} : null});
    return true;
  }

  /** Finishes the outline that is being drawn. `fine` is the size of a pixel in voxels: details smaller than half of it are removed. */
  closeDraft(closed, fine = 0) {
    const draft = this.state.get('draft');
    if (!draft) return false;
    const places = thinned(draft.places, 0.5 * fine), least = closed ? 3 : 2;
    if (places.length < least) return this.toast(closed ? 'An outline needs 3 corners.' : 'A line needs 2 corners.'), true;
    const own = this.open();
    if (!own) return true;
    this.state.set({draft: null});
    const [right, down] = this.space.planeAxes(draft.axis), world = places.map(([x, y]) => {
      const index = [0, 0, 0];
      [index[draft.axis], index[right], index[down]] = [draft.at, x, y];
      return this.space.toWorld(index);
    });
    this.study.act({do: 'add_outline', structure: own.id, axis: draft.axis, at: draft.at, closed, world});
    return true;
  }

  /** Changes a property of a structure as a whole. */
  change(what, id, value) {
    const own = this.study.structure(id);
    if (!own) return;
    const act = (action) => this.study.act({...action, structure: own.id});
    if (what === 'lock') return void act({do: 'lock', locked: value});
    if (what === 'show') return void act({do: 'show', visible: value});
    if (own.locked) return void this.toast(`\u201c${own.name}\u201d is locked: l unlocks it.`);
    const changes = {
      rename: () => value && value !== own.name && act({do: 'rename', name: value}),
      recolor: () => act({do: 'recolor', color: value}),
      clear_paint: () => act({do: 'clear_paint'}),
      remove_guess: () => act({do: 'remove_guess'}),
      duplicate: () => act({do: 'duplicate'}),
      give: () => act({do: 'give_mark', mark: value.mark, to: value.to}),
      remove: () => {
        act({do: 'remove_structure'});
        this.toast(`\u201c${own.name}\u201d is removed: z brings it back.`);
      },
    };
    changes[what]();
  }
}
