// An oblique plane through the image, in 3D: the image on it, and its intersections with the surfaces.
import {
  BufferAttribute, BufferGeometry, DataTexture, DoubleSide, Group, LinearFilter, LineBasicMaterial, LineLoop, LineSegments, Mesh,
  MeshBasicMaterial, SRGBColorSpace, Vector3,
} from 'three';
import {linesAt} from './outline.js';
import {rgbColor} from './stage3d.js';

const PIXELS = 384;  // number of pixels of the plane's picture in each direction
const COLOR = '#c98b1d';

/** Two directions that span the plane with this normal; the second one is as upright as possible. */
function basisOf(normal) {
  const up = new Vector3(0, 0, 1), right = up.clone().cross(normal);
  if (right.lengthSq() < 1e-6) right.set(1, 0, 0);
  right.normalize();
  return [right, normal.clone().cross(right)];
}

export class ObliquePlane {
  /**
   * `half` is half of the plane's side, in world units. `codesOf(grid)` returns, at once or later, codes of 16 bits for the
   * pixels of a grid {first, alongX, alongY, count} in voxels of the image, row by row; `arrived` is called if they came later.
   */
  constructor(space, half, codesOf, arrived) {
    Object.assign(this, {space, half, codesOf, arrived, group: new Group(), pixels: new Uint8Array(4 * PIXELS * PIXELS)});
    const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(new Float32Array(12), 3));
    geometry.setAttribute('uv', new BufferAttribute(new Float32Array([0, 0, 1, 0, 1, 1, 0, 1]), 2));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    this.texture = Object.assign(new DataTexture(this.pixels, PIXELS, PIXELS), {colorSpace: SRGBColorSpace, minFilter: LinearFilter, magFilter: LinearFilter});
    this.mesh = new Mesh(geometry, new MeshBasicMaterial({map: this.texture, side: DoubleSide, alphaTest: 0.5}));
    const border = new LineLoop(new BufferGeometry().setAttribute('position', geometry.getAttribute('position')), new LineBasicMaterial({color: COLOR}));
    this.lines = new LineSegments(new BufferGeometry(), new LineBasicMaterial({vertexColors: true}));
    for (const part of [this.mesh, border, this.lines]) part.frustumCulled = false;
    this.group.add(this.mesh, border, this.lines);
  }

  /** Moves the plane. `grey` is a table with a pixel for each code of 16 bits, `surfaces` is a list of [mesh, colour] to intersect with the plane. */
  put({normal, center}, grey, surfaces) {
    const towards = new Vector3(...normal), middle = new Vector3(...center), [right, up] = basisOf(towards), {half} = this;
    const place = (x, y) => middle.clone().addScaledVector(right, x).addScaledVector(up, y), position = this.mesh.geometry.getAttribute('position');
    [[-1, -1], [1, -1], [1, 1], [-1, 1]].forEach(([x, y], n) => position.setXYZ(n, ...place(x * half, y * half)));
    position.needsUpdate = true;
    this.paint(place, grey);
    this.outline(towards, middle, right, up, surfaces);
  }

  paint(place, grey) {
    const {space, half} = this, step = 2 * half / PIXELS, indexAt = (x, y) => space.toIndex(place(x, y).toArray());
    const first = indexAt(-half + step / 2, -half + step / 2), alongX = indexAt(half + step / 2, -half + step / 2).map((v, a) => (v - first[a]) / PIXELS), alongY = indexAt(-half + step / 2, half + step / 2).map((v, a) => (v - first[a]) / PIXELS);
    const grid = {first, alongX, alongY, count: PIXELS}, key = JSON.stringify(grid), generation = this.codesOf.generation?.();
    if (this.key === key && this.generation === generation) return void (this.codes && this.color(grid, grey));
    Object.assign(this, {key, generation, codes: null});
    const codes = this.codesOf(grid);
    if (!(codes instanceof Promise)) return this.take(codes, grid, grey);
    return codes.then((own) => {
      if (this.key !== key || !own) return;  // the answer is for a plane that is not displayed any more
      this.take(own, grid, grey);
      this.arrived();
    });
  }

  take(codes, grid, grey) {
    this.codes = codes;
    this.color(grid, grey);
  }

  color({first, alongX, alongY}, grey) {
    const {pixels, codes} = this, last = this.space.size.map((n) => n - 0.5);
    for (let y = 0, n = 0; y < PIXELS; ++y)
      for (let x = 0; x < PIXELS; ++x, n += 4) {
        let isThere = true;
        for (let a = 0; a < 3; ++a) {
          const at = first[a] + x * alongX[a] + y * alongY[a];
          isThere &&= at >= -0.5 && at <= last[a];
        }
        const color = isThere ? grey[codes[n >> 2]] : 0;
        [pixels[n], pixels[n + 1], pixels[n + 2], pixels[n + 3]] = [color & 255, color >> 8 & 255, color >> 16 & 255, isThere ? 255 : 0];
      }
    this.texture.needsUpdate = true;
  }

  outline(towards, middle, right, up, surfaces) {
    const places = [], colors = [], lift = 0.005 * this.half;
    for (const [{positions, corners}, color] of surfaces) {
      const along = (axis) => {
        const from = middle.dot(axis), out = new Float32Array(positions.length / 3);
        for (let n = 0; n < out.length; ++n) out[n] = positions[3 * n] * axis.x + positions[3 * n + 1] * axis.y + positions[3 * n + 2] * axis.z - from;
        return out;
      };
      const lines = linesAt({index: [along(right), along(up), along(towards)], corners}, 2, 0, [0, 1]), rgb = rgbColor(color).toArray();
      for (const {places: line, closed} of lines)
        for (let n = 0; n < line.length - (closed ? 0 : 2); n += 2)
          for (const side of [-lift, lift])
            for (const at of [n, (n + 2) % line.length]) {
              places.push(...middle.clone().addScaledVector(right, line[at]).addScaledVector(up, line[at + 1]).addScaledVector(towards, side));
              colors.push(...rgb);
            }
    }
    this.lines.geometry.dispose();
    this.lines.geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(new Float32Array(places), 3)).setAttribute('color', new BufferAttribute(new Float32Array(colors), 3));
  }
}
