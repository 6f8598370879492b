// The 3D view of the report page: colours by what is known of the surface, and opacity.
import {BufferAttribute, Color, Vector3} from 'three';
import {BodyScene} from '../body_scene.js';
import {rangeOf, vertexColors} from '../colors.js';
import {EYE, rgbColor} from '../stage3d.js';
import {ObliquePlane} from './oblique.js';

export const OBLIQUE = 3;  // beside the axes 0, 1, 2 of the image: what surfaces are cut at

export class ReportScene extends BodyScene {
  constructor(canvas, app) {
    super(canvas, app);
    if (app.panels.length === 0) this.frame.visible = false;  // there is no image to be framed
    if (app.volume) this.addOblique();
    this.look(EYE, true);
  }

  addOblique() {
    this.oblique = new ObliquePlane(this.app.volume, 0.5 * this.imageBox.max.distanceTo(this.imageBox.min));
    this.scene.add(this.oblique.group);
    const {state} = this;
    state.on(['oblique', 'grey', 'loaded', 'study'], () => this.updateOblique());
    state.on(['slices'], () => {
      const oblique = state.get('oblique');
      if (oblique) state.set({oblique: {...oblique, center: this.space.toWorld(state.get('slices'))}});
    });
    state.on(['cut'], () => { if (state.get('cut') === OBLIQUE && !state.get('oblique')) this.faceOblique(); });
    this.updateOblique();
  }

  /** The plane through the crosshair that the eye looks at straight. */
  faceOblique() {
    const normal = this.camera.position.clone().sub(this.controls.target).normalize().toArray();
    this.state.set({oblique: {normal, center: this.space.toWorld(this.state.get('slices'))}});
  }

  /** Moves it towards its normal, by so many of the smallest voxels' sides. */
  stepOblique(by) {
    const {normal, center} = this.state.get('oblique'), step = by * Math.min(...this.space.spacing);
    this.state.set({oblique: {normal, center: center.map((x, a) => x + step * normal[a])}});
  }

  updateOblique() {
    const plane = this.state.get('oblique'), {study, meshes} = this.app;
    this.oblique.group.visible = Boolean(plane);
    if (plane) this.oblique.put(plane, this.state.get('grey'), study.structures.filter((s) => s.visible).map((s) => [meshes.get(s.id), s.color]));
    this.updateClip();
  }

  cutAt(axis) {
    if (axis !== OBLIQUE) return super.cutAt(axis);
    const {normal, center} = this.state.get('oblique') ?? {normal: EYE.clone().normalize().toArray(), center: this.space.toWorld(this.state.get('slices'))};
    return {normal: new Vector3(...normal), place: new Vector3(...center)};
  }

  listen() {
    super.listen();
    this.state.on(['coloring', 'opacity'], () => this.update());
  }

  updateSurface(structure, data) {
    super.updateSurface(structure, data);
    const own = this.surfaces.get(structure.id), name = this.state.get('coloring'), opacity = this.state.get('opacity'), {material, geometry} = own.mesh;
    own.mesh.visible = structure.visible && opacity > 0;
    const isTransparent = opacity < 1, isPlain = name === 'structure';
    if (material.transparent !== isTransparent || material.vertexColors === isPlain) material.needsUpdate = true;
    Object.assign(material, {transparent: isTransparent, depthWrite: !isTransparent, opacity, vertexColors: !isPlain});
    material.color = isPlain ? rgbColor(structure.color) : new Color(1, 1, 1);
    if (isPlain || own.coloring === name) return;
    own.coloring = name;
    const range = name === 'support' ? null : rangeOf(this.app.data.structures, name);
    geometry.setAttribute('color', new BufferAttribute(vertexColors(data, name, range), 3));
  }
}
