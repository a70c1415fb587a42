// SPDX-License-Identifier: Apache-2.0
// The controls of the page "Place": its bar, the ways to show the bones, and the side with costs, verdict and steps.
import {button, checkbox, choice, el, select, slider} from '../../report/page/dom.js';

import * as Geometry from './geometry.js';
import {inverse, length, minus, moved, plus, times, turned, unit} from './geometry.js';
import * as Shell from './shell.js';
import * as Viewport from './viewport.js';
import * as XrayLook from './xray_picture.js';

// How a bone moves when it is dragged in a view. Each function returns a motion of the world: a 4 x 4 matrix to
// multiply the bone's pose by, from the left. Depth is along z of the camera, away from the X-ray source.

const depth_mm = (camera, point_mm) => moved(camera.camera_from_world, point_mm)[2];
const source_mm = (camera) => inverse(camera.camera_from_world).slice(0, 3).map((row) => row[3]);
// A direction of the camera in the world: [1, 0, 0] is to the right in the image, [0, 1, 0] down, [0, 0, 1] away.
export const direction = (camera, vector) => turned(inverse(camera.camera_from_world), vector);

// The point of a pixel's ray at a depth.
function pointAt(camera, pixel, at_mm) {
  const {origin, direction: along} = Geometry.ray(camera, pixel);
  return plus(origin, times(along, at_mm / turned(camera.camera_from_world, along)[2]));
}

// The point under the pixel `from`, at the depth of `middle_mm`, moves under `to`. Nothing moves in depth.
export function shiftInView(camera, middle_mm, from, to) {
  const at_mm = depth_mm(camera, middle_mm);
  return Geometry.shift(minus(pointAt(camera, to, at_mm), pointAt(camera, from, at_mm)));
}

// Clockwise in the view, about the ray through the middle.
export const turnInView = (camera, middle_mm, angle_rad) =>
    Geometry.rotation(minus(middle_mm, source_mm(camera)), angle_rad, middle_mm);

// The angle between two pixels of a pointer's way, seen from the middle.
export function angleAbout(camera, middle_mm, from, to) {
  const centre = Geometry.pixel(camera, middle_mm);
  if (!centre) return 0;
  const angle = ([u, v]) => Math.atan2(v - centre[1], u - centre[0]);
  const turn = angle(to) - angle(from);
  return Math.atan2(Math.sin(turn), Math.cos(turn));
}

// Along the ray through the middle, so that the bone grows or shrinks in this view and stays where it is.
export const shiftInDepth = (camera, middle_mm, by_mm) =>
    Geometry.shift(times(unit(minus(middle_mm, source_mm(camera))), by_mm));

// About the bone's own axis.
export const roll = (axis, middle_mm, angle_rad) => Geometry.rotation(axis, angle_rad, middle_mm);

// Tips the bone towards the source: about the direction in the image that is perpendicular to its long axis.
export function tip(camera, axis, middle_mm, angle_rad) {
  const away = unit(minus(middle_mm, source_mm(camera))), across = Geometry.cross(axis, away);
  return Geometry.rotation(length(across) > 0.05 ? across : direction(camera, [1, 0, 0]), angle_rad, middle_mm);
}

// The angle of a roll: a degree for each millimetre that the pointer moved across the bone's axis.
export function rollAngle(camera, axis, middle_mm, from, to) {
  const at_mm = depth_mm(camera, middle_mm), away = unit(minus(middle_mm, source_mm(camera)));
  const across = Geometry.cross(axis, away);
  if (length(across) < 0.05) return 0;
  const went = minus(pointAt(camera, to, at_mm), pointAt(camera, from, at_mm));
  return Geometry.dot(went, unit(across)) * Math.PI / 180;
}

export class PlaceControls {
  updateBar() {
    if (!this.bar) return;
    const {changes, from, state} = this.bar, {draft} = this;
    changes.update(draft.state_undo, draft.state_redo);
    from.disabled = Boolean(this.isRegistering) || !(this.pipeline || this.sequence.isOn);
    from.textContent = this.sequence.isOn ? 'Track from here' : 'Register from here';
    state.textContent = draft.is_saved ? 'saved' : 'kept as a draft';
  }

  restyle(change) {
    Object.assign(this, change);
    for (const view of this.views) view.draw();
  }

  fill(place) {
    this.commandPlace = el('div', {class: 'place-command'});
    this.bar = {
      changes: Shell.undoButtons((way) => this.change(way)),
      from: button('Register from here', () => this.fromHere(), {'data-do': 'register', class: 'primary'}),
      sequence: button(
          'Sequence', () => this.sequence.timeline.toggle(this.bar.sequence),
          {'data-do': 'open-sequence', 'aria-expanded': 'false'}),
      state: el('span', {class: 'note', role: 'status'})
    };
    const part = (title, ...content) => el('section', {'aria-label': title}, el('h2', {}, title), ...content);
    this.pipelineField = this.pipelineChoice();
    this.ofSequence = part('Keyframes', this.sequence.timeline.list);
    this.ofOneFrame = [part('Verdict', this.steps.verdict, this.judgeBox()), part('Costs', this.steps.costTable)];
    const views = el('div', {class: 'place-views'}, this.views.map((view) => view.element));
    const {camera} = this.views[0];
    this.tiles = Viewport.arranged(views, () => camera.width_px / camera.height_px);
    place.append(
        el('div', {class: 'page-head'}, el('h1', {}, Shell.nameOf(this.path)),
           el('div', {class: 'toolbar'}, this.bar.changes.boxes, this.bar.state),
           el('div', {class: 'toolbar'}, this.bar.sequence, this.pipelineField, this.bar.from)),
        this.sequence.timeline.setup, this.tools(), this.sequence.timeline.element,
        el('div', {class: 'place-work'}, views,
           el('aside', {class: 'place-side', 'aria-label': 'The present poses'}, this.ofOneFrame, this.ofSequence,
              part('Steps', this.steps.list), this.commandPlace)));
    this.ofSequence.hidden = true;
    this.steps.showVerdict(null);
    this.updateBar();
  }

  pipelineChoice() {
    const options = this.about.pipelines.map((one) => [one.file, one.name]);
    const help = () => (this.about.pipelines.find((one) => one.file === this.pipeline) || {help: ''}).help;
    const field = select('register by', options, this.pipeline, (file) => {
      this.pipeline = file;
      field.title = help();
    });
    field.title = help();
    return field;
  }

  judgeBox() {
    this.judges = true;
    return checkbox('judge each pose after a pause', true, (judges) => {
      this.judges = judges;
      this.pause();
    });
  }

  tools() {
    const strength = slider('strength', this.strength, (value) => this.restyle({strength: value}));
    const wipe = slider('line', this.wipe, (value) => this.restyle({wipe: value}));
    const shown = () => {
      strength.hidden = !['blend', 'edges'].includes(this.mode);
      wipe.hidden = this.mode !== 'wipe';
    };
    this.modes = choice('show', PlaceControls.MODES, this.mode, (mode) => {
      this.mode = mode;
      shown();
      this.redraw();
    });
    shown();
    this.stepChoice = choice(
        'step of keys (mm, °)', [['0.1', '0.1'], ['0.5', '0.5'], ['1', '1'], ['5', '5']], String(this.step),
        (step) => (this.step = Number(step)));
    this.zoomChoice = choice('zoom', [['1', '1'], ['2', '2'], ['4', '4']], '1', (factor) => this.zoom(Number(factor)));
    const bones = this.about.bones.length > 1 &&
        el('fieldset', {class: 'place-bones'}, el('legend', {}, 'moved'),
           this.about.bones.map((bone) => this.boneBox(bone)));
    return el(
        'div', {class: 'toolbar place-tools'}, this.modes, strength, wipe, this.zoomChoice, this.stepChoice, bones,
        XrayLook.control(() => this.views.forEach((view) => view.relook())));
  }

  zoom(factor) {
    const {middle} = this.hold(this.placed);
    for (const view of this.views) view.zoom(factor, Geometry.pixel(view.camera, middle) || [0, 0]);
  }

  boneBox(bone) {
    const box = checkbox(bone.name, true, (isMoved) => {
      this.moving[isMoved ? 'add' : 'delete'](bone.name);
      this.askCosts();
    });
    const [r, g, b] = this.colours[bone.name];
    box.prepend(el('span', {class: 'swatch', style: `background: rgb(${r} ${g} ${b})`, 'aria-hidden': 'true'}));
    return box;
  }

  get colours() {
    const COLOURS = [[255, 138, 31], [64, 196, 255], [150, 230, 90], [255, 110, 200]];
    return Object.fromEntries(this.about.bones.map((bone, i) => [bone.name, COLOURS[i % COLOURS.length]]));
  }
}
PlaceControls.MODES = [
  ['blend', 'Blend'], ['wipe', 'Wipe'], ['checkerboard', 'Checkerboard'], ['edges', 'Edges'], ['outline', 'Outline']
];
