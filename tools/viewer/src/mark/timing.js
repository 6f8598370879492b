// When what was done was seen: for people who measure the page.

const KEPT = 200;

export class Timing {
  constructor() {
    Object.assign(this, {pointer: 0, lastShown: 0, outlines: []});
    addEventListener('pointerup', (event) => { this.pointer = event.timeStamp; }, true);
  }

  /** The outline of a surface was drawn for the first time: it is on the screen when the next picture begins. */
  drawn({id, version, seq, stage}) {
    const {pointer} = this;
    this.lastShown = performance.now();
    requestAnimationFrame((now) => {
      this.outlines.push({structure: id, version, seq, stage, pointer, shown: now});
      if (this.outlines.length > KEPT) this.outlines.shift();
    });
  }
}
