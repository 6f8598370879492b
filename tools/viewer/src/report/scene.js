// The 3D view: surfaces, marks, three textured slice planes.
import {
  Box3, BufferAttribute, BufferGeometry, Color, DataTexture, DoubleSide, Group, IcosahedronGeometry, InstancedMesh, LineBasicMaterial,
  LineLoop, LineSegments, LinearFilter, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, MeshStandardMaterial, Points,
  PointsMaterial, SRGBColorSpace, Vector3,
} from 'three';
import {rangeOf, vertexColors} from '../colors.js';
import {outlineAt} from '../outline.js';
import {AXIS_COLORS} from '../space.js';
import {rgbColor, Stage3D} from '../stage3d.js';

const MOST_BALLS = 4000;  // marks as balls; more are points

export class View3D extends Stage3D {
  /** @throws where there is no WebGL */
  constructor(canvas, data, state, volume) {
    super(canvas, state, volume);
    Object.assign(this, {data, volume});
    this.addSurfaces();
    this.addMarks();
    if (volume) this.addPlanes();
    this.addFocus();
    this.begin();
    this.listen();
  }

  addSurfaces() {
    const box = new Box3();
    this.surfaces = this.data.structures.map((structure) => {
      const geometry = new BufferGeometry();
      geometry.setAttribute('position', new BufferAttribute(structure.positions, 3));
      geometry.setIndex(new BufferAttribute(structure.corners, 1));
      geometry.computeVertexNormals();
      geometry.computeBoundingBox();
      box.union(geometry.boundingBox);
      const material = new MeshStandardMaterial({color: rgbColor(structure.color), roughness: 0.58, metalness: 0, side: DoubleSide});
      const mesh = new Mesh(geometry, material);
      this.scene.add(mesh);
      return mesh;
    });
    this.setBox(box);
  }

  addMarks() {
    this.marks = this.data.structures.map((structure, n) => {
      const group = new Group(), count = structure.marks.length / 3;
      const color = this.data.structures.length > 1 ? rgbColor(structure.color).multiplyScalar(0.35) : new Color('#0e6fb8');
      if (count > MOST_BALLS) {
        const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(structure.marks, 3));
        group.add(new Points(geometry, new PointsMaterial({color, size: 2, sizeAttenuation: false})));
      } else if (count > 0) {
        const radius = this.sphere.radius * Math.min(0.014, Math.max(0.005, 0.2 / Math.sqrt(count)));
        const balls = new InstancedMesh(new IcosahedronGeometry(radius, 2), new MeshLambertMaterial({color}), count);
        for (let m = 0; m < count; ++m)
          balls.setMatrixAt(m, new Matrix4().makeTranslation(structure.marks[3 * m], structure.marks[3 * m + 1], structure.marks[3 * m + 2]));
        balls.frustumCulled = false;
        group.add(balls);
      }
      this.scene.add(group);
      return group;
    });
  }

  addPlanes() {
    this.planes = [0, 1, 2].map((axis) => {
      const geometry = new BufferGeometry();
      geometry.setAttribute('position', new BufferAttribute(new Float32Array(12), 3));
      geometry.setAttribute('uv', new BufferAttribute(new Float32Array([0, 0, 1, 0, 1, 1, 0, 1]), 2));
      geometry.setIndex([0, 1, 2, 0, 2, 3]);
      const mesh = new Mesh(geometry, new MeshBasicMaterial({side: DoubleSide}));
      const border = new LineLoop(new BufferGeometry().setAttribute('position', geometry.getAttribute('position')),
        new LineBasicMaterial({color: AXIS_COLORS[axis]}));
      mesh.frustumCulled = border.frustumCulled = false;
      const outlines = this.data.structures.map((structure) => {
        const lines = new LineSegments(new BufferGeometry(), new LineBasicMaterial({color: rgbColor(structure.color)}));
        lines.frustumCulled = false;
        return lines;
      });
      const group = new Group().add(mesh, border, ...outlines);
      this.scene.add(group);
      return {group, mesh, outlines};
    });
    for (const axis of [0, 1, 2]) this.movePlane(axis);
  }

  addFocus() {
    const material = new MeshBasicMaterial({color: '#ff5a36', depthTest: false, transparent: true, opacity: 0.9});
    this.focus = new Mesh(new IcosahedronGeometry(this.sphere.radius * 0.022, 3), material);
    this.focus.renderOrder = 1;
    this.focus.visible = false;
    this.scene.add(this.focus);
  }

  movePlane(axis) {
    const {group, mesh} = this.planes[axis], volume = this.volume, at = this.state.get('slices')[axis];
    group.visible = this.state.get('planes')[axis];
    const [right, down] = volume.planeAxes(axis), position = mesh.geometry.getAttribute('position');
    this.cornersOf(axis, at).forEach((place, n) => position.setXYZ(n, ...place));
    position.needsUpdate = true;
    if (!group.visible) return;
    this.paintPlane(axis);
    this.drawOutlines(axis, at, right, down);
  }

  /** The surfaces' outlines on a plane, seen from both of its sides. */
  drawOutlines(axis, at, right, down) {
    const {volume} = this, lift = 0.002 * this.sphere.radius / volume.spacing[axis];
    this.planes[axis].outlines.forEach((lines, n) => {
      const structure = this.data.structures[n], segments = outlineAt(structure, axis, at, [right, down]);
      const places = new Float32Array(3 * segments.length), index = [0, 0, 0];
      for (const [side, offset] of [[0, -lift], [1, lift]])
        for (let s = 0; s < segments.length; s += 2) {
          index[axis] = at + offset;
          index[right] = segments[s];
          index[down] = segments[s + 1];
          places.set(volume.toWorld(index), 3 * (s / 2 + side * segments.length / 2));
        }
      lines.geometry.dispose();
      lines.geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(places, 3));
      lines.visible = this.state.get('visible')[n];
    });
  }

  paintPlane(axis) {
    const {mesh} = this.planes[axis], {width, height, values} = this.volume.slice(axis, this.state.get('slices')[axis]);
    const grey = this.state.get('grey'), rgba = new Uint8Array(4 * values.length);
    for (let n = 0; n < values.length; ++n) rgba.fill(grey[values[n]], 4 * n, 4 * n + 3), rgba[4 * n + 3] = 255;
    mesh.material.map?.dispose();
    const texture = new DataTexture(rgba, width, height);
    texture.colorSpace = SRGBColorSpace;
    texture.minFilter = texture.magFilter = LinearFilter;
    texture.needsUpdate = true;
    const first = !mesh.material.map;
    mesh.material.map = texture;
    if (first) mesh.material.needsUpdate = true;
  }

  listen() {
    const {state} = this;
    state.on(['slices', 'planes', 'grey', 'decoded'], () => {
      if (this.volume) for (const axis of [0, 1, 2]) this.movePlane(axis);
      this.updateClip();
      this.draw();
    });
    state.on(['cut'], () => { this.turnCut(); this.updateClip(); this.draw(); });
    state.on(['flip'], () => { this.updateClip(); this.draw(); });
    state.on(['visible', 'marks', 'opacity'], () => { this.updateVisible(); this.draw(); });
    state.on(['coloring'], () => { this.updateColors(); this.draw(); });
    state.on(['focus'], () => this.showFocus());
    this.updateVisible();
    this.updateClip();
  }

  updateVisible() {
    const opacity = this.state.get('opacity');
    this.data.structures.forEach((structure, n) => {
      const visible = this.state.get('visible')[n], material = this.surfaces[n].material;
      this.surfaces[n].visible = visible && opacity > 0;
      this.marks[n].visible = visible && this.state.get('marks');
      for (const plane of this.planes ?? []) plane.outlines[n].visible = visible;
      const transparent = opacity < 1;
      if (material.transparent !== transparent) material.needsUpdate = true;
      material.transparent = transparent;
      material.depthWrite = !transparent;
      material.opacity = opacity;
    });
  }

  updateClip() { this.clipMaterials([...this.surfaces, ...this.marks.flatMap((group) => group.children)].map((object) => object.material)); }

  cutAt(axis) {
    if (this.volume) return super.cutAt(axis);
    const normal = new Vector3().setComponent(axis, 1), place = this.box.min.clone();
    place.lerp(this.box.max, this.state.get('cutShare'));
    return {normal, place};
  }

  updateColors() {
    const name = this.state.get('coloring'), range = name === 'structure' || name === 'support' ? null : rangeOf(this.data.structures, name);
    this.data.structures.forEach((structure, n) => {
      const mesh = this.surfaces[n], plain = name === 'structure';
      if (!plain) mesh.geometry.setAttribute('color', new BufferAttribute(vertexColors(structure, name, range), 3));
      mesh.material.vertexColors = !plain;
      mesh.material.color = plain ? rgbColor(structure.color) : new Color(1, 1, 1);
      mesh.material.needsUpdate = true;
    });
  }

  showFocus() {
    const world = this.state.get('focus');
    this.focus.visible = Boolean(world);
    if (!world) return this.draw();
    this.focus.position.set(...world);
    const towards = this.focus.position.clone().sub(this.sphere.center).normalize();
    // From straight above or below a turn about the vertical has no meaning.
    const flat = new Vector3(towards.x, towards.y, Math.min(0.75, Math.max(-0.75, towards.z)));
    if (flat.lengthSq() > 0.01) this.look(flat.x === 0 && flat.y === 0 ? flat.setY(-0.6) : flat);
    else this.draw();
  }
}
