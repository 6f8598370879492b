// The 3D view of the report page: colours by properties of the surface, and opacity.
import {BufferAttribute, Color} from 'three';
import {rangeOf, vertexColors} from '../colors.js';
import {ObliqueScene} from '../oblique_scene.js';
import {EYE, rgbColor} from '../stage3d.js';
import {codesOf} from './volume_plane.js';

export class ReportScene extends ObliqueScene {
  constructor(canvas, app) {
    super(canvas, app);
    this.patience = 0;  // ms; changed marks are shown at once, because no new surface follows from them on this page
    if (app.panels.length === 0) this.frame.visible = false;  // there is no image whose frame could be drawn
    if (app.volume) this.addOblique(codesOf(app.volume));
    this.look(EYE, true);
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
