// The 3D view: surfaces, marks, three textured slice planes.
import {
  AmbientLight, Box3, BufferAttribute, BufferGeometry, Color, DataTexture, DirectionalLight, DoubleSide, Group, IcosahedronGeometry,
  InstancedMesh, LineBasicMaterial, LineLoop, LineSegments, LinearFilter, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial,
  MeshStandardMaterial, PerspectiveCamera, Plane, Points, PointsMaterial, Scene, Sphere, SRGBColorSpace, Vector3, WebGLRenderer,
} from 'three';
import {OrbitControls} from 'three/examples/jsm/controls/OrbitControls.js';
import {rangeOf, vertexColors} from './colors.js';
import {outlineAt} from './outline.js';

const MOST_BALLS = 4000;  // marks as balls; more are points
const AXIS_COLORS = ['#d9574a', '#4f9e57', '#4a7fd1'];
const EYE = new Vector3(0.45, -0.8, 0.4);

function rgbColor(rgb) { return new Color().setRGB(rgb[0] / 255, rgb[1] / 255, rgb[2] / 255, SRGBColorSpace); }

export class View3D {
  /** @throws where there is no WebGL */
  constructor(canvas, data, state, volume) {
    Object.assign(this, {canvas, data, state, volume});
    this.renderer = new WebGLRenderer({canvas, antialias: true, alpha: true, preserveDrawingBuffer: false});
    this.renderer.localClippingEnabled = true;
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(28, 1, 0.01, 1000);
    this.camera.up.set(0, 0, 1);
    this.scene.add(this.camera);
    this.addLights();
    this.clip = new Plane();
    this.addSurfaces();
    this.addMarks();
    if (volume) this.addPlanes();
    this.addFocus();
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener('change', () => this.draw());
    this.look(EYE, true);
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
    this.listen();
  }

  addLights() {
    const key = new DirectionalLight(0xffffff, 2.7), fill = new DirectionalLight(0xdfe8ff, 0.9), rim = new DirectionalLight(0xffffff, 0.7);
    key.position.set(-0.7, 0.9, 1.1);
    fill.position.set(1.2, -0.1, 0.7);
    rim.position.set(0.2, 0.8, -1.2);
    for (const light of [key, fill, rim]) {
      this.camera.add(light, light.target);  // they turn with the eye
      light.target.position.set(0, 0, 0);
    }
    this.scene.add(new AmbientLight(0xffffff, 0.4));
  }

  addSurfaces() {
    this.box = new Box3();
    this.surfaces = this.data.structures.map((structure) => {
      const geometry = new BufferGeometry();
      geometry.setAttribute('position', new BufferAttribute(structure.positions, 3));
      geometry.setIndex(new BufferAttribute(structure.corners, 1));
      geometry.computeVertexNormals();
      geometry.computeBoundingBox();
      this.box.union(geometry.boundingBox);
      const material = new MeshStandardMaterial({color: rgbColor(structure.color), roughness: 0.58, metalness: 0, side: DoubleSide});
      const mesh = new Mesh(geometry, material);
      this.scene.add(mesh);
      return mesh;
    });
    this.sphere = this.box.getBoundingSphere(new Sphere());
    if (!(this.sphere.radius > 0)) this.sphere.radius = 1;
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
    [[0, 0], [1, 0], [1, 1], [0, 1]].forEach(([x, y], n) => {
      const index = [0, 0, 0];
      index[axis] = at;
      index[right] = x ? volume.size[right] - 0.5 : -0.5;
      index[down] = y ? volume.size[down] - 0.5 : -0.5;
      position.setXYZ(n, ...volume.toWorld(index));
    });
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

  /** The half that is cut away is the one in front. */
  turnCut() {
    const axis = this.state.get('cut');
    if (axis < 0) return;
    const {normal, place} = this.cutAt(axis);
    this.cutSign = Math.sign(normal.dot(this.camera.position.clone().sub(place))) || 1;
  }

  /** One half beside the slice of an axis is cut away. */
  updateClip() {
    const axis = this.state.get('cut');
    let planes = null;
    if (axis >= 0) {
      const sign = (this.state.get('flip') ? -1 : 1) * (this.cutSign ?? 1);
      const {normal, place} = this.cutAt(axis);
      this.clip.setFromNormalAndCoplanarPoint(normal.multiplyScalar(-sign), place);
      planes = [this.clip];
    }
    const materials = [...this.surfaces, ...this.marks.flatMap((group) => group.children)].map((object) => object.material);
    for (const material of materials) {
      if (Boolean(material.clippingPlanes) !== Boolean(planes)) material.needsUpdate = true;
      material.clippingPlanes = planes;
    }
  }

  cutAt(axis) {
    if (this.volume) {
      const index = [0, 0, 0];
      index[axis] = this.state.get('slices')[axis];
      return {normal: new Vector3(...this.volume.axes[axis]), place: new Vector3(...this.volume.toWorld(index))};
    }
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

  /** Turns to a direction; at once, or in a third of a second. */
  look(direction, atOnce = false) {
    // The narrower side of the view has to hold the ball around all surfaces.
    const half = Math.atan(Math.tan(this.camera.fov * Math.PI / 360) * Math.min(1, this.camera.aspect));
    const distance = 0.93 * this.sphere.radius / Math.sin(half), from = this.camera.position.clone().sub(this.sphere.center);
    const begin = from.clone().normalize(), end = direction.clone().normalize(), size = from.length() || distance;
    const place = (share) => {
      const now = begin.clone().lerp(end, share);
      if (now.lengthSq() < 1e-4) now.copy(end);
      this.camera.position.copy(this.sphere.center).addScaledVector(now.normalize(), size + share * (distance - size));
      this.controls.target.copy(this.sphere.center);
      this.camera.near = distance / 100;
      this.camera.far = distance * 20;
      this.camera.updateProjectionMatrix();
      this.controls.update();
      this.draw();
    };
    if (atOnce || matchMedia('(prefers-reduced-motion: reduce)').matches) return place(1);
    const start = performance.now(), turn = ++this.turn || (this.turn = 1);
    const step = (now) => {
      if (turn !== this.turn) return;
      const share = Math.min(1, Math.max(0, (now - start) / 350));
      place(share * share * (3 - 2 * share));
      if (share < 1) requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  reset() { this.look(EYE); }

  rotate(horizontal, vertical) {
    const from = this.camera.position.clone().sub(this.controls.target);
    from.applyAxisAngle(this.camera.up, horizontal);
    const side = from.clone().cross(this.camera.up).normalize();
    const tilted = from.clone().applyAxisAngle(side, vertical);
    if (tilted.angleTo(this.camera.up) > 0.05 && tilted.angleTo(this.camera.up) < Math.PI - 0.05) from.copy(tilted);
    this.camera.position.copy(this.controls.target).add(from);
    this.controls.update();
    this.draw();
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.canvas.parentElement;
    if (width === 0 || height === 0) return;
    const before = this.camera.aspect;
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (before !== this.camera.aspect && !this.sized) this.look(EYE, true);
    this.sized = true;
    this.renderNow();
  }

  draw() {
    this.pending ??= requestAnimationFrame(() => this.renderNow());
  }

  renderNow() {
    if (this.pending) cancelAnimationFrame(this.pending);
    this.pending = null;
    this.renderer.render(this.scene, this.camera);
    this.onTurn?.(this.camera);
  }
}

export {AXIS_COLORS};
