// Common parts of the 3D views: a camera that is turned by hand, lights that turn with it, a cutting plane.
import {
  AmbientLight, Box3, Color, DirectionalLight, PerspectiveCamera, Plane, Scene, Sphere, SRGBColorSpace, Vector3, WebGLRenderer,
} from 'three';
import {OrbitControls} from 'three/examples/jsm/controls/OrbitControls.js';
import {el, number, svg} from './dom.js';
import {roundLength} from './plane.js';
import {AXIS_COLORS} from './space.js';

export const EYE = new Vector3(0.45, -0.8, 0.4);

export function rgbColor(rgb) { return new Color().setRGB(rgb[0] / 255, rgb[1] / 255, rgb[2] / 255, SRGBColorSpace); }

/** A drawing of the world's axes as seen by the camera. */
export function axisTriad(anatomical) {
  const names = anatomical ? ['L', 'P', 'S'] : ['x', 'y', 'z'], drawing = svg('svg', {viewBox: '-32 -32 64 64', class: 'triad', 'aria-hidden': 'true'});
  const lines = AXIS_COLORS.map((color) => svg('line', {x1: 0, y1: 0, stroke: color, 'stroke-width': 2.5, 'stroke-linecap': 'round'}));
  const labels = names.map((name, a) => svg('text', {'text-anchor': 'middle', 'dominant-baseline': 'central', fill: AXIS_COLORS[a]}, document.createTextNode(name)));
  drawing.append(...lines, ...labels);
  const turn = (camera) => {
    const e = camera.matrixWorldInverse.elements;
    for (let a = 0; a < 3; ++a) {
      const x = e[4 * a], y = -e[4 * a + 1];
      lines[a].setAttribute('x2', 18 * x);
      lines[a].setAttribute('y2', 18 * y);
      labels[a].setAttribute('x', 26 * x);
      labels[a].setAttribute('y', 26 * y);
    }
  };
  return {drawing, turn};
}

/** A scale bar, which is correct at the distance of the centre of rotation from the camera. */
export function scaleBar(unit) {
  const text = el('span', {}), bar = el('i', {}), drawing = el('div', {class: 'scale', 'aria-hidden': 'true'}, text, bar);
  const update = ({camera, controls, canvas}) => {
    const distance = camera.position.distanceTo(controls.target), pixel = 2 * distance * Math.tan(camera.fov * Math.PI / 360) / (canvas.clientHeight || 1);
    const length = roundLength(Math.min(120, canvas.clientWidth / 4) * pixel), label = `${number(length)}${unit ? `\u2009${unit}` : ''}`;
    drawing.hidden = !Number.isFinite(length);
    bar.style.width = `${(length / pixel).toFixed(1)}px`;
    if (text.textContent !== label) text.textContent = label;
  };
  return {drawing, update};
}

/** `make(canvas)` creates the view in a holder; if it fails, a message gives the reason. */
export function stageIn(holder, {label, triad, scale, otherwise}, make) {
  const canvas = el('canvas', {tabindex: 0, role: 'img', 'aria-label': label});
  holder.append(canvas, triad.drawing, scale.drawing);
  try {
    const view = make(canvas);
    view.onTurn = (camera) => { triad.turn(camera); scale.update(view); };
    view.renderNow();
    canvas.addEventListener('keydown', (event) => {
      const [x, y] = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[event.key] ?? [0, 0];
      if (!x && !y) return;
      event.preventDefault();
      view.rotate(x * 0.12, y * 0.12);
    });
    canvas.addEventListener('webglcontextlost', () => holder.append(el('p', {class: 'notice over'}, 'The graphics device was lost; reload the page.')));
    return view;
  } catch (error) {
    holder.replaceChildren(el('p', {class: 'notice over'}, el('strong', {}, 'No 3D view: '),
      `this browser has no WebGL, or it is switched off (${error.message}). ${otherwise}`));
    return null;
  }
}

export class Stage3D {
  /** `space` is the image's, or null. @throws if WebGL is not available */
  constructor(canvas, state, space) {
    Object.assign(this, {canvas, state, space});
    this.renderer = new WebGLRenderer({canvas, antialias: true, alpha: true, preserveDrawingBuffer: false});
    this.renderer.localClippingEnabled = true;
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(28, 1, 0.01, 1000);
    this.camera.up.set(0, 0, 1);
    this.scene.add(this.camera);
    this.addLights();
    this.clip = new Plane();
    this.box = new Box3();
    this.sphere = new Sphere(new Vector3(), 1);
  }

  /** Called when the scene has been filled. */
  begin() {
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener('change', () => this.draw());
    this.look(EYE, true);
    new ResizeObserver(() => this.resize()).observe(this.canvas.parentElement);
    this.resize();
  }

  addLights() {
    const key = new DirectionalLight(0xffffff, 2.7), fill = new DirectionalLight(0xdfe8ff, 0.9), rim = new DirectionalLight(0xffffff, 0.7);
    key.position.set(-0.7, 0.9, 1.1);
    fill.position.set(1.2, -0.1, 0.7);
    rim.position.set(0.2, 0.8, -1.2);
    for (const light of [key, fill, rim]) {
      this.camera.add(light, light.target);  // as children of the camera, the lights turn with it
      light.target.position.set(0, 0, 0);
    }
    this.scene.add(new AmbientLight(0xffffff, 0.4));
  }

  /** Sets the box of all displayed objects. */
  setBox(box) {
    this.box.copy(box);
    this.box.getBoundingSphere(this.sphere);
    if (!(this.sphere.radius > 0)) this.sphere.radius = 1;
  }

  /** Chooses the side of the cut that is removed: the half of the body that is nearer to the camera. */
  turnCut() {
    const axis = this.state.get('cut');
    if (axis < 0) return;
    const {normal, place} = this.cutAt(axis);
    this.cutSign = Math.sign(normal.dot(this.camera.position.clone().sub(place))) || 1;
  }

  /** Clips these materials on one side of the slice of an axis. */
  clipMaterials(materials) {
    const axis = this.state.get('cut');
    let planes = null;
    if (axis >= 0) {
      const sign = (this.state.get('flip') ? -1 : 1) * (this.cutSign ?? 1);
      const {normal, place} = this.cutAt(axis);
      this.clip.setFromNormalAndCoplanarPoint(normal.multiplyScalar(-sign), place);
      planes = [this.clip];
    }
    for (const material of materials) {
      if (Boolean(material.clippingPlanes) !== Boolean(planes)) material.needsUpdate = true;
      material.clippingPlanes = planes;
    }
  }

  cutAt(axis) {
    const index = [0, 0, 0];
    index[axis] = this.state.get('slices')[axis];
    return {normal: new Vector3(...this.space.duals[axis]).normalize(), place: new Vector3(...this.space.toWorld(index))};
  }

  /** The corners of a slice, in cyclic order. */
  cornersOf(axis, at) {
    const [right, down] = this.space.planeAxes(axis);
    return [[0, 0], [1, 0], [1, 1], [0, 1]].map(([x, y]) => {
      const index = [0, 0, 0];
      index[axis] = at;
      index[right] = x ? this.space.size[right] - 0.5 : -0.5;
      index[down] = y ? this.space.size[down] - 0.5 : -0.5;
      return this.space.toWorld(index);
    });
  }

  /** Turns the camera to a direction, at once or in a motion of a third of a second. */
  look(direction, atOnce = false) {
    // At distance radius / sin(half), the bounding sphere just fits into the narrower side of the view. The camera is
    // 7 % nearer.
    const half = Math.atan(Math.tan(this.camera.fov * Math.PI / 360) * Math.min(1, this.camera.aspect));
    const distance = 0.93 * this.sphere.radius / Math.sin(half), from = this.camera.position.clone().sub(this.sphere.center);
    const begin = from.clone().normalize(), end = direction.clone().normalize(), size = from.length() || distance;
    const place = (share) => {
      const now = begin.clone().lerp(end, share);
      if (now.lengthSq() < 1e-4) now.copy(end);
      this.camera.position.copy(this.sphere.center).addScaledVector(now.normalize(), size + share * (distance - size));
      this.controls.target.copy(this.sphere.center);
      this.setDepth(distance);
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

  setDepth(distance) {
    this.camera.near = distance / 100;
    this.camera.far = distance * 20;
    this.camera.updateProjectionMatrix();
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
