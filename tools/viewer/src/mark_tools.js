// Effects of clicks, drags and keys on marks of the active structure; the ruler.

/** The tools for marks: [name, label, key, description]. */
export const MARK_TOOLS = [
  ['surface', 'surface mark', 's', 'Click: mark on the surface \u00b7 Shift: inside \u00b7 Alt: outside \u00b7 drag moves a mark'],
  ['inside', 'inside mark', 'i', 'Click: mark inside \u00b7 drag moves a mark'],
  ['outside', 'outside mark', 'o', 'Click: mark outside \u00b7 drag moves a mark'],
  ['erase', 'move or erase', 'e', 'Click removes a mark or an outline \u00b7 drag moves a mark'],
  ['crosshair', 'crosshair', 'p', 'Click or drag: the other planes go there'],
  ['ruler', 'ruler', 'm', 'Drag measures a distance \u00b7 Escape removes it'],
];
export const hintsOf = (tools) => Object.fromEntries(tools.map(([name, , , hint]) => [name, hint]));
export const isMarkTool = (tool) => ['surface', 'inside', 'outside'].includes(tool);

export class MarkTools {
  constructor({state, study, space, toast}) { Object.assign(this, {state, study, space, toast}); }

  /** The kind of mark that a click makes. */
  kindOf(event) {
    const tool = this.state.get('tool');
    return event.shiftKey ? 'inside' : event.altKey ? 'outside' : isMarkTool(tool) ? tool : 'surface';
  }

  active() { return this.study.structure(this.state.get('active')); }

  /** The structure to be marked, which is created if there is none; null, with a message, if it cannot be changed. */
  open() {
    let own = this.active() ?? this.study.structures[0] ?? null;
    if (!own) own = this.study.structure(this.addStructure());
    else if (!this.active()) this.state.set({active: own.id});
    if (own.locked) this.toast(`\u201c${own.name}\u201d is locked: l unlocks it.`);
    else if (!own.visible) this.toast(`\u201c${own.name}\u201d is hidden: h shows it.`);
    else return own;
    return null;
  }

  addStructure() { throw new Error('this page makes no structures'); }

  /** Whether the study may be changed now. */
  isReady() { return true; }

  addMark(kind, world) {
    if (!this.isReady()) return;
    const own = this.open();
    if (own) this.study.act({do: 'add_mark', structure: own.id, kind, world});
  }

  moveMark({structure, mark}, world) { this.study.act({do: 'move_mark', structure, mark, world}); }

  /** Removes a mark or an outline; `target` is {structure, mark} or {structure, outline}. */
  remove(target) {
    const own = target && this.study.structure(target.structure);
    if (!own) return false;
    if (own.locked) this.toast(`\u201c${own.name}\u201d is locked: l unlocks it.`);
    else if (target.outline) this.study.act({do: 'remove_outline', structure: own.id, mark: target.outline});
    else this.study.act({do: 'remove_mark', structure: own.id, mark: target.mark});
    this.state.set({selected: null, hover: null});
    return true;
  }
}
