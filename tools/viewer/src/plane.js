// One plane of an image on a canvas: positions of voxels, with orientation letters and a scale bar.
import {number} from './dom.js';
import {dominant} from './space.js';

const LETTERS = [['R', 'L'], ['A', 'P'], ['I', 'S']];  // at the - and + ends of the world's axes, LPS

/** Writes text with a dark outline, which makes it legible on any grey value. */
export function write(context, text, x, y, color = '#fff') {
  context.lineJoin = 'round';
  context.strokeStyle = 'rgba(0, 0, 0, 0.7)';
  context.lineWidth = 3;
  context.strokeText(text, x, y);
  context.fillStyle = color;
  context.fillText(text, x, y);
}

/** The largest number of the form 1, 2 or 5 times a power of 10 that is not larger than `most`. */
export function roundLength(most) {
  const tens = 10 ** Math.floor(Math.log10(most));
  return [5, 2, 1].map((n) => n * tens).find((n) => n <= most) ?? tens;
}

export class Plane {
  constructor(space, axis, anatomical) {
    Object.assign(this, {space, axis, anatomical});
    [this.right, this.down] = space.planeAxes(axis);
    this.flipX = this.flipY = false;
    if (anatomical) {  // radiological convention: the patient's left at the right, anterior and superior up
      const x = dominant(space.axes[this.right]), y = dominant(space.axes[this.down]);
      this.flipX = x.sign < 0;
      this.flipY = y.w === 2 ? y.sign > 0 : y.sign < 0;
    } else {
      this.flipY = this.down === 2;  // z up, as in the 3D view
    }
  }

  /** Fits the plane into that many CSS pixels; `view` has a zoom, and the voxel x, y at the centre. */
  lay(width, height, view = null) {
    const {size, spacing} = this.space, cosine = this.space.cosine(this.right, this.down) * (this.flipX === this.flipY ? 1 : -1);
    const steep = Math.sqrt(1 - cosine * cosine), sizeX = size[this.right] * spacing[this.right] + Math.abs(cosine) * size[this.down] * spacing[this.down], sizeY = steep * size[this.down] * spacing[this.down];
    const scale = Math.min(width / sizeX, height / sizeY) * (view?.zoom ?? 1);  // CSS pixels per world unit
    const scaleX = scale * spacing[this.right], scaleY = scale * steep * spacing[this.down];
    /** In a sheared image, each row is shifted by this many pixels to the right of the one above it. */
    const lean = scale * cosine * spacing[this.down];
    const [x, y] = view ? this.shown(view.x, view.y) : [(size[this.right] - 1) / 2, (size[this.down] - 1) / 2];
    Object.assign(this, {scale, scaleX, scaleY, lean, viewWidth: width, viewHeight: height, width: scaleX * size[this.right], height: scale * sizeY,
      left: width / 2 - (x + 0.5) * scaleX - (y + 0.5) * lean, top: height / 2 - (y + 0.5) * scaleY});
  }

  /** Converts voxel coordinates to those counted from the left and the top of the displayed plane; the function is its own inverse. */
  shown(x, y) {
    const {size} = this.space;
    return [this.flipX ? size[this.right] - 1 - x : x, this.flipY ? size[this.down] - 1 - y : y];
  }

  /** From voxels to CSS pixels; voxel centres are at integers. */
  place(x, y) {
    const [sx, sy] = this.shown(x, y);
    return [this.left + (sx + 0.5) * this.scaleX + (sy + 0.5) * this.lean, this.top + (sy + 0.5) * this.scaleY];
  }

  /** From CSS pixels to voxels. */
  unplace(px, py) {
    const rows = (py - this.top) / this.scaleY;
    return this.shown((px - this.left - rows * this.lean) / this.scaleX - 0.5, rows - 0.5);
  }

  /** Draws a picture whose pixels are `step` x `step` voxels; the last ones may extend beyond the image. A part begins at pixel x, y. */
  drawPicture(context, picture, step = 1, {x = 0, y = 0} = {}) {
    const {left, top, width, height} = this, slope = this.lean / this.scaleY, x0 = left + (this.flipY ? slope * height : 0), right = this.flipX ? -1 : 1, down = this.flipY ? -1 : 1;
    context.save();
    context.transform(right, 0, down * slope, down, x0 + (this.flipX ? width : 0), top + (this.flipY ? height : 0));
    context.beginPath();
    context.rect(0, 0, width, height);
    context.clip();
    context.imageSmoothingQuality = 'high';
    context.drawImage(picture, x * step * this.scaleX, y * step * this.scaleY, picture.width * step * this.scaleX, picture.height * step * this.scaleY);
    context.restore();
  }

  /** A bar of a round length, at most a quarter of the view. */
  drawScale(context, unitText) {
    const {viewWidth: width, viewHeight: height} = this;
    const most = Math.min(120, width / 4) / this.scale;
    const length = roundLength(most), pixels = length * this.scale;
    // The bar is placed on the image itself, at least 12 pixels from the edges of the view.
    const x = width - Math.max(12, this.left + 10) - pixels, y = height - Math.max(12, this.top + 10);
    context.font = '11px system-ui, sans-serif';
    context.textAlign = 'center';
    for (const [color, line] of [['rgba(0, 0, 0, 0.7)', 4], ['#fff', 2]]) {
      context.strokeStyle = color;
      context.lineWidth = line;
      context.lineCap = 'butt';
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(x + pixels, y);
      context.stroke();
    }
    write(context, `${number(length)}${unitText ? ` ${unitText}` : ''}`, x + pixels / 2, y - 6);
  }

  drawLetters(context) {
    if (!this.anatomical) return;
    const {viewWidth: width, viewHeight: height} = this;
    const ends = (axis, flip) => {
      const {w, sign} = dominant(this.space.axes[axis]), forward = (sign > 0) !== flip;
      return forward ? LETTERS[w] : [...LETTERS[w]].reverse();
    };
    const [left, right] = ends(this.right, this.flipX), [top, bottom] = ends(this.down, this.flipY);
    context.font = '600 12px system-ui, sans-serif';
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    write(context, left, 10, height / 2);
    write(context, right, width - 10, height / 2);
    write(context, top, width / 2, 11);
    write(context, bottom, width / 2, height - 11);
    context.textBaseline = 'alphabetic';
  }
}
