// What a click, a drag or a key does with the active structure: marks, outlines, the ruler.

export const TOOLS = [
  ['surface', 'surface mark', 's'], ['inside', 'inside mark', 'i'], ['outside', 'outside mark', 'o'], ['outline', 'outline', 'c'],
  ['erase', 'move or erase', 'e'], ['crosshair', 'crosshair', 'p'], ['ruler', 'ruler', 'm'],
];
export const HINTS = {
  surface: 'Click: mark on the surface \u00b7 Shift: inside \u00b7 Alt: outside \u00b7 drag moves a mark',
  inside: 'Click: mark inside \u00b7 drag moves a mark', outside: 'Click: mark outside \u00b7 drag moves a mark',
  outline: 'Click: corner, drag: freehand \u00b7 Enter closes, Shift+Enter leaves it open, Escape cancels',
  erase: 'Click removes a mark or an outline \u00b7 drag moves a mark', crosshair: 'Click or drag: the other planes go there', ruler: 'Drag measures a distance \u00b7 Escape removes it',
};
const COLORS = [[68, 119, 170], [238, 102, 119], [34, 136, 51], [204, 187, 68], [102, 204, 238], [170, 51, 119], [238, 119, 51],
  [0, 153, 136], [136, 34, 85], [153, 153, 51], [51, 34, 136], [187, 187, 187]];

export const isMarkTool = (tool) => ['surface', 'inside', 'outside'].includes(tool);

/** Without the corners that lie within `most` of the line between their neighbours. */
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

export class Tools {
  constructor({state, study, space, toast}) { Object.assign(this, {state, study, space, toast}); }

  /** The kind of mark that a click makes. */
  kindOf(event) {
    const tool = this.state.get('tool');
    return event.shiftKey ? 'inside' : event.altKey ? 'outside' : isMarkTool(tool) ? tool : 'surface';
  }

  active() { return this.study.structure(this.state.get('active')); }

  /** The structure that is marked, made where there is none; null, and a word, where it is not to be changed. */
  open() {
    let own = this.active() ?? this.study.structures[0] ?? null;
    if (!own) own = this.study.structure(this.addStructure());
    else if (!this.active()) this.state.set({active: own.id});
    if (own.locked) this.toast(`\u201c${own.name}\u201d is locked: l unlocks it.`);
    else if (!own.visible) this.toast(`\u201c${own.name}\u201d is hidden: h shows it.`);
    else return own;
    return null;
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

  addMark(kind, world) {
    if (this.study.name === null) return this.toast('Not connected yet.');
    const own = this.open();
    if (own) this.study.act({do: 'add_mark', structure: own.id, kind, world});
    return undefined;
  }

  moveMark({structure, mark}, world) { this.study.act({do: 'move_mark', structure, mark, world}); }

  /** A mark or an outline: {structure, mark} or {structure, outline}. */
  remove(target) {
    const own = target && this.study.structure(target.structure);
    if (!own) return false;
    if (own.locked) this.toast(`\u201c${own.name}\u201d is locked: l unlocks it.`);
    else if (target.outline) this.study.act({do: 'remove_outline', structure: own.id, mark: target.outline});
    else this.study.act({do: 'remove_mark', structure: own.id, mark: target.mark});
    this.state.set({selected: null, hover: null});
    return true;
  }

  /** The outline that is being drawn gets a corner; `places` are voxels in the plane. */
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

  /** `fine` is the size of a pixel in voxels: what is smaller is not kept. */
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

  /** Something about a structure as a whole. */
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
