// The effects of actions on structures.

const isSamePlace = (a, b) => a.length === b.length && a.every((v, n) => v === b[n]);
export const isSameMark = (mark, action) => mark.kind === action.kind && isSamePlace(mark.world, action.world);
export const isSameOutline = (outline, a) => outline.axis === a.axis && outline.at === a.at && outline.world.length === a.world.length && outline.world.every((place, n) => isSamePlace(place, a.world[n]));

const CHANGES = {
  rename: (own, a) => ({...own, name: a.name}),
  recolor: (own, a) => ({...own, color: a.color}),
  lock: (own, a) => ({...own, locked: a.locked}),
  show: (own, a) => ({...own, visible: a.visible}),
  // The server may send a mark before it acknowledges the action that added it: the action must not add the mark a
  // second time.
  add_mark: (own, a, id) => own.marks.some((m) => !m.isNew && isSameMark(m, a)) ? own : ({...own, marks: [...own.marks, {id, kind: a.kind, world: a.world, isNew: true}]}),
  move_mark: (own, a) => ({...own, marks: own.marks.map((m) => m.id === a.mark ? {...m, world: a.world} : m)}),
  remove_mark: (own, a) => ({...own, marks: own.marks.filter((m) => m.id !== a.mark)}),
  add_outline: (own, a, id) => own.outlines.some((o) => !o.isNew && isSameOutline(o, a)) ? own : ({...own, outlines: [...own.outlines, {id, axis: a.axis, at: a.at, closed: a.closed, world: a.world, isNew: true}]}),
  add_marks: (own, a) => ({...own, marks: [...own.marks, ...a.world.map((world, n) => ({id: `${a.key} ${n}`, kind: a.kind, world, isNew: true}))]}),
  add_stroke: (own, a, id) => own.strokes.some((s) => s.id === id) ? own : ({...own, strokes: [...own.strokes, {id, erases: a.erases, radius: a.radius, axis: a.axis, at: a.at, world: a.world}]}),
  clear_paint: (own) => ({...own, strokes: []}),
  remove_guess: (own) => ({...own, guess: null}),
  remove_outline: (own, a) => ({...own, outlines: own.outlines.filter((o) => o.id !== a.mark)}),
};

/** The structures after an action; a new object gets `id`. Existing objects are not modified. */
export function applyAction(structures, action, id) {
  switch (action.do) {
    case 'add_structure':
      if (structures.some((s) => !s.isNew && s.name === action.name)) return structures;
      return [...structures, {id, name: action.name, color: action.color, locked: false, visible: true, marks: [], outlines: [], strokes: [], guess: null, result: null, isNew: true}];
    case 'remove_structure': return structures.filter((s) => s.id !== action.structure);
    case 'give_mark': {
      const mark = structures.find((s) => s.id === action.structure)?.marks.find((m) => m.id === action.mark);
      if (!mark) return structures;
      return structures.map((s) => s.id === action.structure ? CHANGES.remove_mark(s, action) : s.id === action.to ? {...s, marks: [...s.marks, mark]} : s);
    }
    case 'duplicate': return structures;  // the server chooses the name and colour of the copy
    default: {
      const change = CHANGES[action.do];
      return change ? structures.map((s) => s.id === action.structure ? change(s, action, id) : s) : structures;
    }
  }
}
