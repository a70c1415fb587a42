// SPDX-License-Identifier: Apache-2.0
// The panel "Segmentation": the fragments grow from their seeds, or get the smooth surface of their labels, and are
// shown in the slices and in 3D.
import {button, command, el, labelled, number, select, shellPath, shellWord} from '../../report/page/dom.js';

import * as CasePage from './case.js';
import {CtState} from './draft.js';
import {SurfaceView} from './pipeline_node.js';
import * as PointList from './point_list.js';
import * as Ask from './server.js';
import * as Shell from './shell.js';

const METHODS = [['bone', 'by a threshold, as bone.yaml does'], ['femur', 'by a level set, as femur.yaml does']];
const STAGES =
    Object.freeze({coarse: 'on a coarse grid; the full grid is being computed', full: 'on the grid of the CT'});

// The outlines of one result, requested slice by slice.
function outlines(segmentation, colourOf) {
  const known = new Map(), asked = new Set();
  async function ask(key, axis, index, later) {
    asked.add(key);
    try {
      const {bytes, about} = await Ask.bytes('api/segmentation/outlines', {segmentation, axis, index});
      const numbers = new Float32Array(bytes), [low, high] = [0, 1, 2].filter((one) => one !== axis);
      let from = 0;
      known.set(key, about.map(({name, numbers: count}) => {
        const part = numbers.subarray(from, from += count), ends = new Float32Array(count / 2 * 3);
        for (let i = 0; 2 * i < count; ++i) {
          ends[3 * i + axis] = index;
          ends[3 * i + low] = part[2 * i];
          ends[3 * i + high] = part[2 * i + 1];
        }
        return {name, colour: colourOf(name), ends};
      }));
      if (known.size > 300) known.delete(known.keys().next().value);
      later();
    } catch (error) {
      if (error.status !== 409) Shell.notice(error.message, 'fault');
    }
    asked.delete(key);
  }
  return {
    lines(axis, index, later) {
      const key = axis + ' ' + index;
      if (!known.has(key) && asked.size < 3 && !asked.has(key)) ask(key, axis, index, later);
      return known.get(key);
    }
  };
}

async function surfaces(segmentation, names, colourOf) {
  const meshes = [];
  for (const fragment of names) {
    const {bytes, about} = await Ask.bytes('api/segmentation/surface', {segmentation, fragment});
    meshes.push({
      vertices: new Float32Array(bytes, 0, 3 * about.vertices),
      triangles: new Uint32Array(bytes, 12 * about.vertices, 3 * about.triangles),
      colour: colourOf(fragment)
    });
  }
  return meshes;
}

class Panel {
  constructor(draft, left) {
    Object.assign(
        this, {draft, state: CtState.of(draft), chosen: null, segmented: '', shownFor: '', isRunning: false, turn: 0});
    this.solid = new SurfaceView('Surfaces of the fragments; arrow keys turn them');
    this.solid.element.hidden = true;
    this.none = el('div', {class: 'empty-stage'}, el('p', {}, 'The segmented bones are shown here in 3D.'));
    this.picture =
        el('figure', {class: 'slice', 'data-solid': ''}, this.none, this.solid.element,
           el('figcaption', {}, el('strong', {}, 'Surfaces'), el('span', {class: 'note'}, 'drag to turn')));
    this.threshold = el('input', {type: 'number', class: 'short', value: 250, step: 10});
    const field = labelled('threshold, HU', this.threshold);
    this.how = select('how', METHODS, this.method, (value) => {
      this.chosen = value;
      this.update();
    });
    this.field = field;
    this.button = button('Segment', () => this.run(), {'data-do': 'segment'});
    this.outcome = el('p', {class: 'note', role: 'status', 'data-segmented': ''});
    this.old = el('p', {class: 'note'});
    this.command = el('details', {hidden: true}, el('summary', {}, 'The same in a shell, once the case is saved'));
    this.element = el(
        'div', {}, el('div', {class: 'toolbar'}, this.how, field, this.button), this.outcome, this.old, this.command);
    const renewed = () => {
      if (!this.state.ct || this.state.ct.name !== this.segmented) this.state.contours.delete('segmentation');
      this.update();
    };
    this.state.addEventListener('ct', renewed, {signal: left});
  }

  fragments() {
    return this.draft.document.fragments || {};
  }

  // The chosen one. Without a choice: several fragments touch at a fracture, and a threshold would grow past it.
  get method() {
    return this.chosen || (Object.keys(this.fragments()).length > 1 ? 'femur' : 'bone');
  }

  // Whether labels or surfaces give the fragments, in place of seeds.
  areGiven() {
    return Object.values(this.fragments()).some(({label, surface}) => label !== undefined || surface);
  }

  // Shows a result: its outlines, volumes and surfaces.
  async take({segmentation, stage, volumes_ml}) {
    const names = Object.keys(volumes_ml), mine = ++this.turn;
    const colourOf = (name) => PointList.colour(Math.max(0, Object.keys(this.fragments()).indexOf(name)));
    this.state.contours.set('segmentation', outlines(segmentation, colourOf));
    this.state.tell('view');
    const volumes = names.map((name) => name + ' ' + number(volumes_ml[name]) + ' ml').join(', ');
    this.outcome.textContent =
        this.areGiven() ? 'As the pipelines take them: ' + volumes : 'Segmented ' + STAGES[stage] + ': ' + volumes;
    this.outcome.dataset.segmented = stage;
    const meshes = await Shell.guarded(() => surfaces(segmentation, names, colourOf));
    if (!meshes || mine !== this.turn) return;
    this.solid.element.hidden = false;
    this.none.hidden = true;
    this.solid.set(meshes);
  }

  // What a segmentation of the present draft is made from.
  content() {
    const {ct} = this.state, {labels} = this.draft.document, asked = {fragments: structuredClone(this.fragments())};
    if (ct) asked.ct = ct.name;
    if (labels) asked.labels = labels;
    return asked;
  }

  async run() {
    this.isRunning = true;
    const content = this.content(), asked = {...content, method: this.areGiven() ? 'given' : this.method};
    this.segmented = asked.ct || '';
    this.outcome.textContent = this.outcome.dataset.segmented = '';
    this.update();
    if (asked.method === 'bone') asked.threshold_hu = Number(this.threshold.value);
    try {
      const {job, pipeline} = await Ask.post('api/segment', asked);
      this.tellCommand(pipeline, asked);
      await Shell.follow('Segmenting', job, (event) => {
        if (event.event === 'grown') this.take(event);
      });
      this.shownFor = JSON.stringify(content);
    } catch (error) {
      this.failed(error);
    }
    this.isRunning = false;
    this.update();
  }

  // What the coarse grid gave stays, but nothing is computed any more.
  failed(error) {
    if (error.status !== 499) Shell.notice(error.message, 'fault');
    const is_coarse = this.outcome.dataset.segmented === 'coarse';
    const end = error.status === 499 ? 'It was stopped' : 'It failed';
    this.outcome.textContent = end + (is_coarse ? '; what is shown comes from a coarse grid.' : '.');
    this.outcome.dataset.segmented = 'failed';
    if (error.status === 409) this.state.follow(true);
  }

  tellCommand(pipeline, {threshold_hu}) {
    const words = ['marrow run', shellPath(pipeline), 'case=' + shellWord(this.draft.path || '.')];
    if (threshold_hu !== undefined) words.push('threshold_hu=' + threshold_hu);
    this.command.hidden = false;
    this.command.replaceChildren(this.command.firstChild, command(words.join(' ')));
  }

  update() {
    const are_given = this.areGiven(),
          has_seeds = Object.values(this.fragments()).some(({seeds}) => seeds && seeds.length);
    this.how.hidden = are_given;
    this.how.box.value = this.method;
    this.field.hidden = are_given || this.method !== 'bone';
    this.button.textContent = are_given ? 'Show the surfaces' : 'Segment';
    this.button.disabled = this.isRunning || !(are_given || (this.state.ct && has_seeds));
    this.button.title = are_given || has_seeds ? '' : 'Add a fragment and put seeds into its bone first';
    const now = JSON.stringify(this.content());
    this.old.textContent = this.shownFor && this.shownFor !== now ?
        'The fragments or the CT have changed since; ' + (are_given ? 'show them' : 'segment') + ' again.' :
        '';
  }
}

CasePage.panel('Segmentation', 'bones', 30, (draft, left) => {
  const panel = new Panel(draft, left);
  return {
    element: panel.element,
    stage: {surfaces: panel.picture},
    update: () => panel.update(),
    dispose: () => panel.solid.dispose()
  };
});
