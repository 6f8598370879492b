// Records when results became visible, to measure the latency of the page.

const KEPT = 200;

export class Timing {
  constructor() {
    Object.assign(this, {pointer: 0, lastShown: 0, outlines: []});
    addEventListener('pointerup', (event) => { this.pointer = event.timeStamp; }, true);
  }

  /** Called when the outline of a surface was drawn for the first time. It becomes visible with the browser's next frame, whose time is recorded. */
  drawn({id, version, seq, stage}) {
    const {pointer} = this;
    this.lastShown = performance.now();
    requestAnimationFrame((now) => {
      this.outlines.push({structure: id, version, seq, stage, pointer, shown: now});
      if (this.outlines.length > KEPT) this.outlines.shift();
    });
  }
}
