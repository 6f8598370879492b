// The 3D view of the page: surfaces that are added and removed, marks, and optionally slices.
import {
  BackSide, Box3, BufferAttribute, BufferGeometry, CanvasTexture, DoubleSide, Group, InstancedMesh, IcosahedronGeometry, LineBasicMaterial,
  LineLoop, LineSegments, LinearFilter, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, MeshStandardMaterial, Raycaster,
  SRGBColorSpace, Vector2, Vector3,
} from 'three';
import {linesAt} from './outline.js';
import {AXIS_COLORS} from './space.js';
import {EYE, rgbColor, Stage3D} from './stage3d.js';

const CLICK = 4;  // CSS pixels that the pointer may move during a click
// Delays in ms before a change is shown in 3D. After a change of marks, the view waits for the surface that follows
// from it; after a new surface, it waits until the planes have drawn its outlines.
const WITH_SURFACE = 600, AFTER_OUTLINES = 60;
const KINDS = ['surface', 'inside', 'outside'];
const HALO = 1.3;  // radius of the rim around a mark, in radii of the mark; makes it visible on dark and light backgrounds
const shared = new IcosahedronGeometry(1, 2), coarse = new IcosahedronGeometry(1, 1), coarsest = new IcosahedronGeometry(1, 0);
const ballOf = (count) => count > 4000 ? coarsest : count > 800 ? coarse : shared;

/** The colour of a mark of a structure: differs from the colour of the surface, and from those of marks of other kinds. */
function markColor(color, kind) {
  const own = rgbColor(color);
  return kind === 'surface' ? own.multiplyScalar(0.3) : kind === 'inside' ? own.lerp(rgbColor([255, 255, 255]), 0.6) : rgbColor([20, 20, 22]);
}

export class BodyScene extends Stage3D {
  /** `app` has space, state, study, meshes, tools, panels and goTo(world). @throws if WebGL is not available */
  constructor(canvas, app) {
    super(canvas, app.state, app.space);
    Object.assign(this, {app, surfaces: new Map(), balls: new Map(), isTouched: false, due: Infinity, patience: WITH_SURFACE});
    const {size} = this.space, corners = [[-0.5, -0.5, -0.5], size.map((n) => n - 0.5)], box = new Box3();
    for (let n = 0; n < 8; ++n) box.expandByPoint(new Vector3(...this.space.toWorld([0, 1, 2].map((a) => corners[n >> a & 1][a]))));
    this.imageBox = box;
    this.setBox(box);
    // The box's corners lie on its bounding sphere, and look() places the camera 7 % too near for the whole sphere.
    this.sphere.radius *= 1.15;
    this.addImageBox(corners);
    this.addPlanes();
    this.addRing();
    this.begin();
    this.controls.addEventListener('start', () => { this.isTouched = true; });
    this.controls.addEventListener('end', () => this.keepCamera());
    this.listen();
    this.update();
  }

  addImageBox(corners) {
    const places = [];
    for (let n = 0; n < 8; ++n)
      for (let a = 0; a < 3; ++a)
        if (!(n >> a & 1)) for (const end of [n, n | 1 << a]) places.push(...this.space.toWorld([0, 1, 2].map((b) => corners[end >> b & 1][b])));
    const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(new Float32Array(places), 3));
    this.frame = new LineSegments(geometry, new LineBasicMaterial({transparent: true, opacity: 0.35}));
    this.scene.add(this.frame);
  }

  addPlanes() {
    this.planes = [0, 1, 2].map((axis) => {
      const geometry = new BufferGeometry();
      geometry.setAttribute('position', new BufferAttribute(new Float32Array(12), 3));
      geometry.setAttribute('uv', new BufferAttribute(new Float32Array(8), 2));
      geometry.setIndex([0, 1, 2, 0, 2, 3]);
      const mesh = new Mesh(geometry, new MeshBasicMaterial({side: DoubleSide}));
      const border = new LineLoop(new BufferGeometry().setAttribute('position', geometry.getAttribute('position')), new LineBasicMaterial({color: AXIS_COLORS[axis]}));
      mesh.frustumCulled = border.frustumCulled = false;
      const outlines = new LineSegments(new BufferGeometry(), new LineBasicMaterial({vertexColors: true}));
      outlines.frustumCulled = false;
      const group = new Group().add(mesh, border, outlines);
      this.scene.add(group);
      return {group, mesh, outlines};
    });
  }

  addRing() {
    this.ring = new Mesh(shared, new MeshBasicMaterial({color: '#ffc414', depthTest: false, transparent: true, opacity: 0.9}));
    this.ring.renderOrder = 1;
    this.scene.add(this.ring);
  }

  listen() {
    const {state} = this;
    state.on(['study'], () => this.refreshIn(this.isLookChanged() ? 0 : this.patience));
    state.on(['meshes'], () => this.refreshIn(AFTER_OUTLINES));
    state.on(['drag', 'active', 'marks'], () => this.refreshIn(0));
    state.on(['planes'], () => this.movePlanes());
    // Slices that move are redrawn only if a plane or a cut shows their positions in 3D.
    state.on(['slices'], () => { if (state.get('planes').some(Boolean) || state.get('cut') >= 0) this.movePlanes(); });
    state.on(['cut'], () => { this.turnCut(); this.updateClip(); });
    state.on(['flip'], () => this.updateClip());
    state.on(['ring', 'theme'], () => this.updateSigns());
    let from = null;
    this.canvas.addEventListener('pointerdown', (event) => { from = event.button === 0 ? [event.clientX, event.clientY] : null; });
    this.canvas.addEventListener('pointerup', (event) => {
      if (from && event.button === 0 && Math.hypot(event.clientX - from[0], event.clientY - from[1]) <= CLICK) this.pick(event);
      from = null;
    });
    for (const axis of [0, 1, 2]) this.movePlane(axis);
    this.turnCut();
    this.updateSigns();
  }

  /** Shows changes after at most `wait` ms. They are delayed because 3D drawing is slow if there is no graphics card. */
  refreshIn(wait) {
    const due = performance.now() + wait;
    if (this.due <= due) return;
    const refresh = () => {
      this.due = Infinity;
      if (this.isChanged()) this.update();
    };
    clearTimeout(this.timer);
    this.due = due;
    if (wait > 0) this.timer = setTimeout(refresh, wait);
    else refresh();
  }

  /** Whether structures were added or removed, or their appearance has changed. */
  isLookChanged() {
    const look = this.app.study.structures.flatMap((s) => [s.id, s.visible, String(s.color)]), isSame = String(look) === this.lookSeen;
    this.lookSeen = String(look);
    return !isSame;
  }

  /** Whether surfaces or marks differ from the displayed ones. */
  isChanged() {
    const {study, meshes} = this.app, seen = [this.state.get('drag'), this.state.get('active'), this.state.get('marks')];
    for (const structure of study.structures) seen.push(structure.id, meshes.get(structure.id), structure.visible, structure.marks, String(structure.color));
    const isSame = this.seen?.length === seen.length && seen.every((part, n) => part === this.seen[n]);
    this.seen = seen;
    return !isSame;
  }

  /** Updates surfaces and marks. The camera is kept; until the user moves it, it shows the whole body. */
  update() {
    const {study, meshes} = this.app, seen = new Set();
    for (const structure of study.structures) {
      seen.add(structure.id);
      this.updateSurface(structure, meshes.get(structure.id));
    }
    for (const [id, surface] of this.surfaces) if (!seen.has(id)) this.dropSurface(id, surface);
    for (const [id, own] of this.balls) if (!seen.has(id)) this.scene.remove(own.group), this.balls.delete(id);
    const box = new Box3();
    for (const [id, {mesh}] of this.surfaces) if (study.structure(id)?.visible) box.union(mesh.geometry.boundingBox);
    this.setBox(box.isEmpty() ? this.imageBox : box);
    const count = study.structures.reduce((sum, {marks}) => sum + marks.length, 0);
    for (const structure of study.structures) this.updateMarks(structure, count);
    if (!box.isEmpty() && !this.isTouched && !this.isWellSeen()) this.look(this.camera.position.clone().sub(this.controls.target), true);
    for (const axis of [0, 1, 2]) if (this.planes[axis].group.visible && this.app.panels[axis]) this.drawOutlines(axis);
    this.updateClip();
  }

  /** Whether the body is near the middle of the view, and neither too small nor too large for it. */
  isWellSeen() {
    const half = Math.atan(Math.tan(this.camera.fov * Math.PI / 360) * Math.min(1, this.camera.aspect));
    const fit = this.sphere.radius / Math.sin(half), distance = this.camera.position.distanceTo(this.sphere.center);
    return distance > 0.85 * fit && distance < 1.5 * fit && this.controls.target.distanceTo(this.sphere.center) < 0.4 * this.sphere.radius;
  }

  dropSurface(id, {mesh}) {
    this.scene.remove(mesh);
    mesh.geometry.dispose();
    mesh.material.dispose();
    this.surfaces.delete(id);
  }

  updateSurface(structure, data) {
    let own = this.surfaces.get(structure.id);
    if (own && own.data !== data) this.dropSurface(structure.id, own), own = null;
    if (!data) return;
    if (!own) {
      const geometry = new BufferGeometry();
      geometry.setAttribute('position', new BufferAttribute(data.positions, 3));
      geometry.setIndex(new BufferAttribute(data.corners, 1));
      geometry.computeVertexNormals();
      geometry.computeBoundingBox();
      own = {data, mesh: new Mesh(geometry, new MeshStandardMaterial({roughness: 0.58, metalness: 0, side: DoubleSide}))};
      own.mesh.userData.structure = structure.id;
      this.scene.add(own.mesh);
      this.surfaces.set(structure.id, own);
    }
    own.mesh.material.color = rgbColor(structure.color);
    own.mesh.visible = structure.visible;
  }

  updateMarks(structure, count) {
    let own = this.balls.get(structure.id);
    const drag = this.state.get('drag'), moved = drag?.structure === structure.id ? drag : null, isShown = structure.visible && this.state.get('marks');
    // The radius is proportional to the body, so that marks have about the same size on the screen for small and large
    // bodies. It is smaller if there are many marks.
    const radius = this.sphere.radius * Math.min(0.013, Math.max(0.005, 0.2 / Math.sqrt(count))), ball = ballOf(count);
    const key = [structure.marks, structure.color, isShown, moved, radius, ball];
    if (own && key.every((part, n) => part === own.key[n])) return;
    if (own) {
      this.scene.remove(own.group);
      for (const one of own.group.children) one.dispose();
    }
    own = {key, group: new Group()};
    for (const kind of KINDS) {
      const marks = structure.marks.filter((m) => m.kind === kind);
      if (marks.length === 0) continue;
      const inner = new MeshLambertMaterial({color: markColor(structure.color, kind)}), rim = new MeshBasicMaterial({color: 0xffffff, side: BackSide});
      for (const [material, size] of [[inner, radius], [rim, HALO * radius]]) {
        const balls = new InstancedMesh(ball, material, marks.length);
        marks.forEach((m, n) => balls.setMatrixAt(n, new Matrix4().makeScale(size, size, size).setPosition(...(moved?.mark === m.id ? moved.world : m.world))));
        balls.frustumCulled = false;
        own.group.add(balls);
      }
    }
    own.group.visible = isShown;
    this.scene.add(own.group);
    this.balls.set(structure.id, own);
  }

  updateClip() {
    this.clipMaterials([...this.surfaces.values()].map(({mesh}) => mesh.material).concat([...this.balls.values()].flatMap(({group}) => group.children.map((ball) => ball.material))));
    this.draw();
  }

  updateSigns() {
    const ring = this.state.get('ring');
    this.ring.visible = Boolean(ring);
    if (ring) this.ring.position.set(...ring.world);
    this.ring.scale.setScalar(0.03 * this.sphere.radius);
    this.frame.material.color.set(this.state.get('theme') === 'dark' ? '#8b919c' : '#6d727b');
    this.draw();
  }

  movePlanes() {
    for (const axis of [0, 1, 2]) this.movePlane(axis);
    this.updateClip();
  }

  movePlane(axis) {
    const {group, mesh} = this.planes[axis], panel = this.app.panels[axis];
    group.visible = this.state.get('planes')[axis];
    if (!group.visible) return;
    if (!panel) return;
    const position = mesh.geometry.getAttribute('position'), uv = mesh.geometry.getAttribute('uv'), {picture, pictureStep, right, down} = panel;
    this.cornersOf(axis, this.state.get('slices')[axis]).forEach((place, n) => position.setXYZ(n, ...place));
    position.needsUpdate = true;
    if (!picture) return;
    // In a coarse picture, the last pixel of a row or column may extend beyond the image; this part is cut off.
    const x = this.space.size[right] / pictureStep / picture.width, y = this.space.size[down] / pictureStep / picture.height;
    [[0, 0], [x, 0], [x, y], [0, y]].forEach(([u, v], n) => uv.setXY(n, u, v));
    uv.needsUpdate = true;
    this.paintPlane(mesh.material, picture);
    this.drawOutlines(axis);
  }

  /** The surfaces' outlines on a slice, visible from both sides. */
  drawOutlines(axis) {
    const {outlines} = this.planes[axis], {right, down} = this.app.panels[axis], at = this.state.get('slices')[axis];
    const places = [], colors = [], lift = 0.002 * this.sphere.radius / this.space.spacing[axis], index = [0, 0, 0];
    const add = (line, n, offset) => {
      [index[axis], index[right], index[down]] = [at + offset, line[n], line[n + 1]];
      places.push(...this.space.toWorld(index));
    };
    for (const structure of this.app.study.structures) {
      const mesh = structure.visible && this.app.meshes.get(structure.id);
      if (!mesh) continue;
      const before = places.length, color = rgbColor(structure.color).toArray();
      for (const {places: line, closed} of linesAt(mesh, axis, at, [right, down]))
        for (let n = 0; n < line.length - (closed ? 0 : 2); n += 2)
          for (const offset of [-lift, lift]) add(line, n, offset), add(line, (n + 2) % line.length, offset);
      for (let n = before; n < places.length; n += 3) colors.push(...color);
    }
    outlines.geometry.dispose();
    outlines.geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(new Float32Array(places), 3)).setAttribute('color', new BufferAttribute(new Float32Array(colors), 3));
  }

  paintPlane(material, picture) {
    const {map} = material;
    if (map?.image === picture && map.userData.width === picture.width && map.userData.height === picture.height) {
      map.needsUpdate = true;
    } else {
      map?.dispose();
      material.map = Object.assign(new CanvasTexture(picture), {colorSpace: SRGBColorSpace, flipY: false, generateMipmaps: false, minFilter: LinearFilter, magFilter: LinearFilter});
      material.map.userData = {width: picture.width, height: picture.height};
      material.needsUpdate = true;
    }
    this.draw();
  }

  /** Moves the slices to the position under the pointer, or sets a mark there. */
  pick(event) {
    const box = this.canvas.getBoundingClientRect(), ray = new Raycaster();
    ray.setFromCamera(new Vector2(2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height), this.camera);
    const surfaces = [...this.surfaces.values()].map(({mesh}) => mesh).filter((mesh) => mesh.visible);
    const planes = this.planes.filter(({group}) => group.visible).map(({mesh}) => mesh);
    const isThere = ({object, point}) => !(object.material.clippingPlanes ?? []).some((plane) => plane.distanceToPoint(point) < 0);
    const hit = ray.intersectObjects([...surfaces, ...planes], false).find(isThere);
    if (!hit) return;
    const world = hit.point.toArray(), {structure} = hit.object.userData;
    this.app.goTo(world);
    if (!event.shiftKey || !structure) return;
    this.state.set({active: structure});
    this.app.tools.addMark('surface', world);
  }

  reset() {
    this.updateSigns();
    this.look(EYE);
    this.isTouched = false;
    this.app.keep('camera', null);
  }

  /** Sets the near and far planes of the camera so that they do not clip the body, even if it is small in a large image. */
  setDepth(distance) {
    const size = this.imageBox.max.distanceTo(this.imageBox.min);
    this.camera.near = Math.min(distance, size) / 100;
    this.camera.far = 20 * Math.max(distance, size);
    this.camera.updateProjectionMatrix();
  }

  rotate(horizontal, vertical) {
    super.rotate(horizontal, vertical);
    this.isTouched = true;
    this.keepCamera();
  }

  keepCamera() {
    this.app.keep('camera', {position: this.camera.position.toArray(), target: this.controls.target.toArray()});
  }

  /** Restores the camera after a reload, {position, target}; invalid values are ignored. */
  takeCamera(kept) {
    const {position, target} = kept ?? {};
    if (![position, target].every((place) => place?.length === 3 && place.every(Number.isFinite))) return;
    this.isTouched = true;
    this.sized = true;
    this.camera.position.set(...position);
    this.controls.target.set(...target);
    this.setDepth(this.camera.position.distanceTo(this.controls.target));
    this.controls.update();
    this.draw();
  }
}
