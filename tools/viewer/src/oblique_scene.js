// The 3D view with an oblique plane through the image.
import {Vector3} from 'three';
import {BodyScene} from './body_scene.js';
import {el} from './dom.js';
import {ObliquePlane} from './oblique.js';
import {EYE} from './stage3d.js';

export const OBLIQUE = 3;  // value of the state "cut" if the oblique plane cuts the surfaces; 0, 1, 2: the slice of an image axis

/** The stored plane from before a reload if it is valid, otherwise null. */
export function keptOblique(kept) {
  const isPlace = (place) => Array.isArray(place) && place.length === 3 && place.every(Number.isFinite);
  return isPlace(kept?.normal) && isPlace(kept?.center) ? {normal: kept.normal, center: kept.center} : null;
}

/** The button that switches the oblique plane on and off. When it is switched on, the plane faces the camera. */
export function obliqueButton(state, view, key) {
  const button = el('button', {type: 'button', class: 'small', title: `a plane through the crosshair that faces you (${key})`, 'data-key': 'oblique', onclick: () => {
    if (!state.get('oblique')) view()?.faceOblique();
    else state.set({oblique: null, cut: state.get('cut') === OBLIQUE ? -1 : state.get('cut')});
  }}, 'oblique');
  const update = () => button.setAttribute('aria-pressed', String(Boolean(state.get('oblique'))));
  state.on(['oblique'], update);
  update();
  return button;
}

export class ObliqueScene extends BodyScene {
  /** `codesOf` is passed to the ObliquePlane. */
  addOblique(codesOf) {
    this.oblique = new ObliquePlane(this.space, 0.5 * this.imageBox.max.distanceTo(this.imageBox.min), codesOf, () => this.draw());
    this.oblique.group.visible = false;
    this.scene.add(this.oblique.group);
    const {state} = this;
    state.on(['oblique', 'grey', 'loaded'], () => this.updateOblique());
    state.on(['slices'], () => {
      const oblique = state.get('oblique');
      if (oblique) state.set({oblique: {...oblique, center: this.space.toWorld(state.get('slices'))}});
    });
    state.on(['cut'], () => { if (state.get('cut') === OBLIQUE && !state.get('oblique')) this.faceOblique(); });
    this.updateOblique();
  }

  /** Sets the plane through the crosshair that is perpendicular to the viewing direction. */
  faceOblique() {
    const normal = this.camera.position.clone().sub(this.controls.target).normalize().toArray();
    this.state.set({oblique: {normal, center: this.space.toWorld(this.state.get('slices'))}});
  }

  /** Moves the plane along its normal by that many times the smallest voxel side. */
  stepOblique(by) {
    const {normal, center} = this.state.get('oblique'), step = by * Math.min(...this.space.spacing);
    this.state.set({oblique: {normal, center: center.map((x, a) => x + step * normal[a])}});
  }

  update() {
    super.update();
    if (this.oblique) this.updateOblique();
  }

  updateOblique() {
    const plane = this.state.get('oblique'), {study, meshes} = this.app;
    if (!plane && !this.oblique.group.visible) return;
    this.oblique.group.visible = Boolean(plane);
    if (plane) this.oblique.put(plane, this.state.get('grey'), study.structures.filter((s) => s.visible && meshes.get(s.id)).map((s) => [meshes.get(s.id), s.color]));
    this.updateClip();
  }

  cutAt(axis) {
    if (axis !== OBLIQUE) return super.cutAt(axis);
    const {normal, center} = this.state.get('oblique') ?? {normal: EYE.clone().normalize().toArray(), center: this.space.toWorld(this.state.get('slices'))};
    return {normal: new Vector3(...normal), place: new Vector3(...center)};
  }
}
