// The image on a plane, on a separate canvas below the marks: it is redrawn only if the picture changes.
import {el} from './dom.js';

/** The context of a canvas in CPU memory. Pictures are computed on the CPU, and each would have to be uploaded to a canvas in GPU memory. */
const contextOf = (canvas) => canvas.getContext('2d', {willReadFrequently: true});

/** Adds the colours of another channel to the pixels of a picture. */
function addTo(pixels, values, table) {
  if (!values) return;
  for (let n = 0; n < pixels.length; ++n) {
    const a = pixels[n], b = table[values[n]];
    const red = (a & 255) + (b & 255), green = (a >> 8 & 255) + (b >> 8 & 255), blue = (a >> 16 & 255) + (b >> 16 & 255);
    pixels[n] = 0xff000000 | Math.min(255, blue) << 16 | Math.min(255, green) << 8 | Math.min(255, red);
  }
}

/** A slice, or a part of it, as a picture. */
class Picture {
  /** Draws the slice. Returns whether the picture has changed. */
  paint(slice, grey) {
    if (this.slice === slice && this.grey === grey.key) return false;
    this.canvas ??= document.createElement('canvas');
    const {canvas} = this, {width, height, values} = slice;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
    const context = contextOf(canvas);
    if (this.pixels?.width !== width || this.pixels?.height !== height) this.pixels = context.createImageData(width, height);
    const pixels = new Uint32Array(this.pixels.data.buffer);
    for (let n = 0; n < pixels.length; ++n) pixels[n] = grey[values[n]];
    for (const [channel, table] of grey.others ?? []) addTo(pixels, slice.others?.get(channel), table);
    context.putImageData(this.pixels, 0, 0);
    Object.assign(this, {slice, grey: grey.key});
    return true;
  }
}

export class PictureLayer {
  constructor() {
    Object.assign(this, {canvas: el('canvas', {class: 'image', 'aria-hidden': 'true'}), whole: new Picture(), fine: new Picture(), hasFine: false, count: 0});
  }

  /** Sets a whole slice, and a finer part of it or null. Returns whether the picture of the whole has changed. */
  take(slice, part, grey) {
    const isNew = this.whole.paint(slice, grey), isFiner = part ? this.fine.paint(part, grey) : false;
    if (isNew || isFiner || this.hasFine !== Boolean(part)) ++this.count;
    this.hasFine = Boolean(part);
    return isNew;
  }

  /** Draws on that many CSS pixels; `plane` gives the position. Does nothing without a picture. */
  draw(plane, width, height, ratio, isThere) {
    const {canvas} = this, key = [this.count, isThere, width, height, ratio, plane.left, plane.top, plane.scaleX, plane.scaleY].join(' ');
    if (key === this.key) return;
    this.key = key;
    const size = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
    const context = contextOf(canvas);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    if (!isThere) return;
    plane.drawPicture(context, this.whole.canvas, this.whole.slice.step);
    if (this.hasFine) plane.drawPicture(context, this.fine.canvas, this.fine.slice.step, this.fine.slice.part);
  }
}
