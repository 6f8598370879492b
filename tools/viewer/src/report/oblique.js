// A plane of any direction through the image, in 3D: the image upon it, and where the surfaces meet it.
import {
  BufferAttribute, BufferGeometry, DataTexture, DoubleSide, Group, LinearFilter, LineBasicMaterial, LineLoop, LineSegments, Mesh,
  MeshBasicMaterial, SRGBColorSpace, Vector3,
} from 'three';
import {linesAt} from '../outline.js';
import {rgbColor} from '../stage3d.js';

const PIXELS = 384;  // along each side
const COLOR = '#c98b1d';

/** Two directions that span the plane of a normal, the second one as upright as it may be. */
function basisOf(normal) {
  const up = new Vector3(0, 0, 1), right = up.clone().cross(normal);
  if (right.lengthSq() < 1e-6) right.set(1, 0, 0);
  right.normalize();
  return [right, normal.clone().cross(right)];
}

/** The volume's value at an index between voxels, 0 to 255; -1 outside. */
function sample({data, size: [nx, ny, nz]}, i, j, k) {
  if (i < -0.5 || j < -0.5 || k < -0.5 || i > nx - 0.5 || j > ny - 0.5 || k > nz - 0.5) return -1;
  const hold = (x, n) => Math.min(n - 1, Math.max(0, x)), [x, y, z] = [hold(i, nx), hold(j, ny), hold(k, nz)], [a, b, c] = [Math.floor(x), Math.floor(y), Math.floor(z)];
  const dx = a < nx - 1 ? 1 : 0, dy = b < ny - 1 ? nx : 0, dz = c < nz - 1 ? nx * ny : 0, n = (c * ny + b) * nx + a, fx = x - a, fy = y - b;
  const layer = (at) => (data[at] * (1 - fx) + data[at + dx] * fx) * (1 - fy) + (data[at + dy] * (1 - fx) + data[at + dy + dx] * fx) * fy;
  return layer(n) * (1 - (z - c)) + layer(n + dz) * (z - c);
}

export class ObliquePlane {
  /** `half` is half of the plane's side, in world units. */
  constructor(volume, half) {
    Object.assign(this, {volume, half, group: new Group(), pixels: new Uint8Array(4 * PIXELS * PIXELS)});
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

  /** `grey` gives pixels for codes of 16 bits; `surfaces` are [mesh, colour]. */
  put({normal, center}, grey, surfaces) {
    const towards = new Vector3(...normal), middle = new Vector3(...center), [right, up] = basisOf(towards), {half} = this;
    const place = (x, y) => middle.clone().addScaledVector(right, x).addScaledVector(up, y), position = this.mesh.geometry.getAttribute('position');
    [[-1, -1], [1, -1], [1, 1], [-1, 1]].forEach(([x, y], n) => position.setXYZ(n, ...place(x * half, y * half)));
    position.needsUpdate = true;
    this.paint(place, grey);
    this.outline(towards, middle, right, up, surfaces);
  }

  paint(place, grey) {
    const {volume, half, pixels} = this, step = 2 * half / PIXELS, indexAt = (x, y) => volume.toIndex(place(x, y).toArray());
    const first = indexAt(-half + step / 2, -half + step / 2), alongX = indexAt(half + step / 2, -half + step / 2).map((v, a) => (v - first[a]) / PIXELS), alongY = indexAt(-half + step / 2, half + step / 2).map((v, a) => (v - first[a]) / PIXELS);
    for (let y = 0, n = 0; y < PIXELS; ++y)
      for (let x = 0; x < PIXELS; ++x, n += 4) {
        const value = sample(volume, first[0] + x * alongX[0] + y * alongY[0], first[1] + x * alongX[1] + y * alongY[1], first[2] + x * alongX[2] + y * alongY[2]);
        pixels[n] = pixels[n + 1] = pixels[n + 2] = value < 0 ? 0 : grey[Math.round(257 * value)] & 255;
        pixels[n + 3] = value < 0 ? 0 : 255;
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
