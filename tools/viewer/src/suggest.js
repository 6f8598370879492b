// Positions at which a mark would improve the result most: requested, then shown one after the other.

export class Suggestions {
  /** `goTo(world)` moves all planes to a position. */
  constructor({state, study, meshes, connection, tools, toast, goTo}) {
    Object.assign(this, {state, study, meshes, connection, tools, toast, goTo, left: [], structure: null});
    study.on('suggestions', (answer) => this.take(answer));
    study.on('failed', () => this.stopAsking());
    study.on('change', () => { if (this.structure !== null && !this.study.structure(this.structure)) this.clear(); });
    study.on('action', (item) => {  // any mark that the user adds ends the display of the suggestion
      if (item?.action.do === 'add_mark' && this.state.get('ring')) this.state.set({ring: null});
    });
    state.on(['active'], () => this.clear());
  }

  clear() {
    this.left = [];
    this.structure = null;
    this.state.set({ring: null, suggested: 0});
  }

  /** Goes to the next suggestion; requests more if none is left. */
  next() {
    if (this.left.length > 0) return this.show();
    const own = this.tools.active() ?? this.study.structures[0];
    if (!own) return this.toast('There is no structure yet: the first click makes one.');
    if (this.connection.ask('suggest', own.id)) {
      this.asked = own.id;
      this.state.set({isAsking: true});
    } else {
      this.toast('Suggestions need the server, which is not connected.');
    }
    return undefined;
  }

  take({structure, places}) {
    if (structure !== this.asked) return;
    this.stopAsking();
    this.structure = structure;
    this.left = [...places];
    if (places.length > 0) this.show();
    else this.toast(this.meshes.get(structure) ? 'Nothing to suggest: the surface rests on marks or edges everywhere.' : 'Nothing to suggest yet: first a surface is needed.');
  }

  stopAsking() {
    this.asked = null;
    this.state.set({isAsking: false});
  }

  show() {
    const place = this.left.shift();
    this.state.set({ring: {world: place.world, structure: this.structure}, suggested: this.left.length});
    this.goTo(place.world);
  }

  /** Accepts the suggestion: sets a mark at the ring. */
  accept() {
    const ring = this.state.get('ring');
    if (!ring) return false;
    this.state.set({ring: null});
    this.tools.addMark('surface', ring.world);
    return true;
  }
}
