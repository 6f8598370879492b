// The structures after all pending actions have been applied.
import {applyAction, isSameMark, isSameOutline} from '../changes.js';
import {referenceOf} from './queue.js';

/** The actions without those that a later pending undo cancels. An undo without a pending action before it is left to the server. */
function withoutUndone(actions) {
  const done = [], undone = [];
  for (const action of actions) {
    if (action.do === 'undo') {
      if (done.length > 0) undone.push(done.pop());
    } else if (action.do === 'redo') {
      if (undone.length > 0) done.push(undone.pop());
    } else {
      done.push(action);
      undone.length = 0;
    }
  }
  return done;
}

/** The ID of the object that an action has made, for servers that do not send it: the highest ID that fits; `taken` are IDs of other objects. */
export function madeBy(action, structures, taken) {
  const own = structures.find((s) => s.id === action.structure);
  const made = action.do === 'add_structure' ? structures.filter((s) => s.name === action.name)
    : action.do === 'add_mark' ? own?.marks.filter((m) => isSameMark(m, action)) : action.do === 'add_outline' ? own?.outlines.filter((o) => isSameOutline(o, action)) : [];
  return (made ?? []).map(({id}) => id).filter((id) => !taken.has(id)).sort((a, b) => b - a)[0];
}

/** Applies pending actions to the structures. `resolve` replaces a reference by the ID, if that is known. */
export function fold(structures, actions, resolve) {
  return withoutUndone(actions).reduce((list, a) => {
    const action = {...a, structure: resolve(a.structure), mark: resolve(a.mark), to: resolve(a.to)};
    return applyAction(list, action, resolve(referenceOf(a.key)));
  }, structures);
}
