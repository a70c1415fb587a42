// SPDX-License-Identifier: Apache-2.0
// The panel "Fragments": their names, and what gives them: seeds inside their bone, a label, or a surface.
import {button, checkbox, el, labelled, select} from '../../report/page/dom.js';

import * as CasePage from './case.js';
import {CtState, LabelsState} from './draft.js';
import * as PointList from './point_list.js';
import * as Shell from './shell.js';
import * as SliceGeometry from './slice_geometry.js';

const MOST_KEPT = 500, BONE_HU = 150;

// The values of a CT at points, such as seeds. They come slice by slice, and each is asked for once. changed() is
// called when one has arrived.
class CtValues {
  constructor(state, changed) {
    Object.assign(this, {state, changed, known: new Map(), asked: new Set()});
  }

  // The largest value at a point and at its neighbours in the axial slice, in HU: segmentation looks around a seed,
  // too. Undefined until it has arrived.
  at(point_mm) {
    const {ct} = this.state;
    if (!ct) return undefined;
    const key = ct.name + ' ' + point_mm.join(' ');
    if (!this.known.has(key)) this.ask(key, point_mm);
    return this.known.get(key);
  }

  async ask(key, point_mm) {
    if (this.asked.has(key)) return;
    this.asked.add(key);
    const {ct} = this.state, [i, j, k] = this.state.indexOf(point_mm), [columns, rows, slices] = ct.size;
    try {
      if (k < 0 || k >= slices) return;
      const values = await this.state.slice(2, k), near = [];
      for (let v = Math.max(0, j - 1); values && v <= Math.min(rows - 1, j + 1); ++v)
        for (let u = Math.max(0, i - 1); u <= Math.min(columns - 1, i + 1); ++u) near.push(values[v * columns + u]);
      if (!near.length) return;
      this.known.set(key, Math.max(...near));
      if (this.known.size > MOST_KEPT) this.known.delete(this.known.keys().next().value);
      this.changed();
    } catch (error) { /* the slices say what is wrong */
    } finally {
      this.asked.delete(key);
    }
  }
}

// Why there is no bone where this value is; '' if there may be.
function noBone(value_hu) {
  if (value_hu === null || value_hu === undefined || value_hu >= BONE_HU) return '';
  return `${value_hu} HU is ${value_hu < -300 ? 'air' : 'not bone'}`;
}
const ofBone = `bone has more than ${BONE_HU} HU`;

const entries = (draft) => Object.entries(draft.document.fragments || {});
const names = (draft) => entries(draft).map(([name]) => name);

function addSeed(draft, state, name, point_mm) {
  if (!SliceGeometry.isInside(state.ct, SliceGeometry.index(state.ct, point_mm)))
    return void Shell.notice('This is outside the CT.', 'fault');
  state.goTo(point_mm);
  draft.change('seed of ' + name, (document) => {
    document.fragments[name].seeds = [...(document.fragments[name].seeds || []), PointList.rounded(point_mm)];
  });
}

const seedActions = (draft, name, i) => ({
  moveTo: (point_mm) => draft.change(
      'move a seed of ' + name, (document) => (document.fragments[name].seeds[i] = PointList.rounded(point_mm))),
  remove: () => draft.change('remove a seed of ' + name, (document) => document.fragments[name].seeds.splice(i, 1))
});

const marks = (draft) => entries(draft).flatMap(([name, {seeds = []}], f) => seeds.map((point_mm, i) => ({
                                                                                         key: 'seed ' + name + ' ' + i,
                                                                                         point_mm,
                                                                                         colour: PointList.colour(f),
                                                                                         label: name,
                                                                                         ...seedActions(draft, name, i)
                                                                                       })));

async function rename(draft, state, name) {
  const other = await PointList.rename('Rename the fragment ' + name, name, names(draft).filter((one) => one !== name));
  if (!other || other === name) return;
  state.setTool(null);
  draft.change('rename ' + name + ' to ' + other, (document) => {
    document.fragments = Object.fromEntries(
        Object.entries(document.fragments).map(([key, value]) => [key === name ? other : key, value]));
    for (const landmark of document.landmarks || [])
      if (landmark.fragment === name) landmark.fragment = other;
  });
}

function remove(draft, state, name) {
  state.setTool(null);
  draft.change('remove the fragment ' + name, (document) => {
    delete document.fragments[name];
    for (const landmark of document.landmarks || [])
      if (landmark.fragment === name) delete landmark.fragment;
  });
}

const wayOf = ({label, surface}) => (surface ? 'surface' : label !== undefined ? 'label' : 'seeds');
const SURFACE = /\.(stl|ply|obj|vtp)$/i;

// Gives a fragment in another way: `given` is {seeds}, {label} or {surface}.
const giveBy = (draft, name, given) => draft.change('give ' + name + ' by ' + Object.keys(given)[0], (document) => {
  const {seeds, label, surface, ...others} = document.fragments[name];
  document.fragments[name] = {...given, ...others};
});

async function chooseSurface(draft, name, given) {
  const at = Shell.folderOf(given ? given.file : '');
  const file = await Shell.choose(
      'Choose the closed surface of ' + name + ': STL, PLY, OBJ or VTP', {accepts: (one) => SURFACE.test(one), at});
  if (file !== undefined) await giveBy(draft, name, {surface: {...given, file}});
  return file !== undefined;
}

// What gives the fragment: seeds, a label by its number and name, or a surface.
function wayField(draft, labels, name, fragment) {
  const segments = labels.labels ? labels.labels.segments : [], way = wayOf(fragment);
  const mine = way === 'label' ? segments.indexOf(labels.segmentOf(fragment.label)) : -1;
  const listed = segments.map((segment, i) => ['label ' + i, LabelsState.title(segment), segment])
                     .filter(([, , segment]) => segment.label !== null && segment.volume_ml);
  const now = way === 'label' ? 'label ' + mine : way;
  const options = [
    ['seeds', 'seeds'], ...(mine < 0 && way === 'label' ? [[now, 'the label ' + fragment.label]] : []),
    ...(listed.length ? [['Labels', listed.map(([value, title]) => [value, title])]] : []), ['surface', 'a surface …']
  ];
  const field = select('given by', options, now, async (value) => {
    if (value === 'seeds') return giveBy(draft, name, {seeds: []});
    if (value !== 'surface') return giveBy(draft, name, {label: segments[Number(value.split(' ')[1])].label});
    if (!await Shell.guarded(() => chooseSurface(draft, name, fragment.surface))) field.box.value = now;
  });
  field.box.dataset.way = name;
  field.box.setAttribute('aria-label', 'What gives ' + name);
  return field;
}

function surfaceRow(draft, name, surface) {
  const scale = el('input', {
    type: 'number',
    class: 'short',
    min: 0.001,
    step: 'any',
    value: surface.scale || 1,
    'aria-label': 'mm of one unit of the surface of ' + name,
    onchange: () => {
      if (!(Number(scale.value) > 0)) return void Shell.notice('One unit must be longer than 0 mm.', 'fault');
      const given = Number(scale.value) === 1 ? {} : {scale: Number(scale.value)};
      giveBy(draft, name, {surface: {file: surface.file, ...given}});
    }
  });
  return el(
      'div', {class: 'toolbar'}, el('span', {}, surface.file),
      button('Choose another …', () => Shell.guarded(() => chooseSurface(draft, name, surface))),
      labelled('one unit, mm', scale));
}

function labelRow(state, labels, label) {
  const segment = labels.segmentOf(label);
  if (!segment)
    return el(
        'p', {class: labels.labels ? 'fault' : 'note'},
        labels.labels ? 'The label map has no label ' + label + '; choose one.' : 'No label map is read.');
  return el(
      'p', {class: 'note'}, button(LabelsState.title(segment), () => state.goTo(segment.middle_mm), {class: 'link'}));
}

function seedList(draft, state, values, name, seeds) {
  if (!seeds.length) return el('p', {class: 'note'}, 'No seed yet.');
  return el('ul', {class: 'points'}, seeds.map((point_mm, i) => {
    const fault = noBone(values.at(point_mm));
    return PointList.row(
        state, 'seed ' + (i + 1) + ' of ' + name, point_mm, seedActions(draft, name, i),
        fault && el('span', {class: 'fault', role: 'alert', 'data-outside': name}, fault + '; ' + ofBone));
  }));
}

const seedTool = (draft, state, name) => ({
  key: 'seed ' + name,
  hint: 'Click inside the bone of ' + name + ' to put a seed there. Esc ends.',
  says: (value_hu) =>
      (value_hu === null || value_hu === undefined ? '' : noBone(value_hu) || `seed of ${name}: ${value_hu} HU`),
  place: (point_mm) => addSeed(draft, state, name, point_mm)
});

function fragmentOf(draft, state, labels, values, [name, fragment], f) {
  const key = 'seed ' + name, way = wayOf(fragment), tool = seedTool(draft, state, name);
  const registers = checkbox(
      'register it', fragment.register !== false,
      (is_on) => draft.change(
          (is_on ? 'register ' : 'do not register ') + name,
          (document) => (document.fragments[name].register = is_on)));
  const seeding = way === 'seeds' && state.ct ?
      [
        PointList.toggle(state, key, 'Add seeds', tool),
        button('Seed at the crosshair', () => tool.place([...state.cursor_mm]))
      ] :
      [];
  return el(
      'li', {class: 'fragment', 'data-fragment': name},
      el('div', {class: 'toolbar'}, el('span', {class: 'swatch', style: 'background:' + PointList.colour(f)}),
         el('strong', {}, name), wayField(draft, labels, name, fragment), registers, seeding,
         button('Rename', () => rename(draft, state, name), {'aria-label': 'Rename ' + name}),
         button('Remove', () => remove(draft, state, name), {'aria-label': 'Remove the fragment ' + name})),
      way === 'surface'   ? surfaceRow(draft, name, fragment.surface) :
          way === 'label' ? labelRow(state, labels, fragment.label) :
                            seedList(draft, state, values, name, fragment.seeds || []));
}

// A case gives all of its fragments in the same way.
function faultOf(draft) {
  const ways = [...new Set(entries(draft).map(([, fragment]) => wayOf(fragment)))];
  return ways.length < 2 ?
      '' :
      'Some fragments are given by ' + ways[0] + ', some by ' + ways[1] + '. A case gives all of them in the same way.';
}

function make(draft, left) {
  const state = CtState.of(draft), labels = LabelsState.of(draft), list = el('ul', {class: 'fragments'});
  const fault = el('p', {class: 'fault', role: 'status'});
  const values = new CtValues(state, () => update());
  const add = PointList.nameField('new fragment', 'Add', () => names(draft), async (name) => {
    const is_kept = await draft.change('add the fragment ' + name, (document) => {
      document.fragments = {...(document.fragments || {}), [name]: {seeds: [], register: true}};
    });
    if (is_kept && state.ct) state.setTool(seedTool(draft, state, name));
  });
  const outside = () => entries(draft).map(([, {seeds = []}]) => seeds.map((point_mm) => noBone(values.at(point_mm))));
  const renew = PointList.renewed(
      list,
      () =>
          [draft.document.fragments, state.tool && state.tool.key, state.ct && state.ct.name, labels.labels, outside()],
      () => entries(draft).map((entry, f) => fragmentOf(draft, state, labels, values, entry, f)));
  const update = () => {
    fault.textContent = faultOf(draft);
    fault.hidden = !fault.textContent;
    renew();
  };
  state.marks.set('seeds', () => marks(draft));
  const ends = (event) => event.key === 'Escape' && state.tool && state.setTool(null);
  for (const name of ['ct', 'view']) state.addEventListener(name, update, {signal: left});
  labels.addEventListener('labels', update, {signal: left});
  document.addEventListener('keydown', ends, {signal: left});
  return {
    element: el(
        'div', {class: 'fragments-panel'},
        el('p', {class: 'note'},
           'A bone fragment grows from its seeds: points inside its bone. Or a label or a surface of another program ' +
               'gives it. A fragment that is not registered is only separated from the others.'),
        add, fault, list),
    update
  };
}

CasePage.panel('Fragments', 'bones', 20, make, [['Esc', 'end putting points']]);
