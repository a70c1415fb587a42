// SPDX-License-Identifier: Apache-2.0
// The panel "CT": choosing it, how it is read, and its three slices. The panel "Landmarks in the CT": named points of a
// bone, placed in the slices. Another panel adds their places in the X-rays to the same landmarks.
import * as Dom from '../../report/page/dom.js';
import {button, el, select} from '../../report/page/dom.js';

import * as CasePage from './case.js';
import {CtState} from './draft.js';
import * as PointList from './point_list.js';
import * as Shell from './shell.js';
import * as SliceGeometry from './slice_geometry.js';
import * as SliceInput from './slice_input.js';
import {SliceView} from './slice_view.js';

const COLOUR = '#f0e442';

const landmarks = (draft) => draft.document.landmarks || [];
const find = (document, name) => document.landmarks.find((one) => one.name === name);

function place(draft, state, name, point_mm, what) {
  if (!SliceGeometry.isInside(state.ct, SliceGeometry.index(state.ct, point_mm)))
    return void Shell.notice('This is outside the CT.', 'fault');
  state.goTo(point_mm);
  draft.change(
      what + ' the landmark ' + name, (document) => (find(document, name).model_mm = PointList.rounded(point_mm)));
}

const actions = (draft, state, name) => ({
  moveTo: (point_mm) => place(draft, state, name, point_mm, 'move'),
  // Removes only the place in the CT. The landmark and its pixels stay.
  remove: () =>
      draft.change('remove the landmark ' + name + ' from the CT', (document) => delete find(document, name).model_mm)
});

const marks = (draft, state) => landmarks(draft).filter(({model_mm}) => model_mm).map(({name, model_mm}) => ({
                                                                                        key: 'landmark ' + name,
                                                                                        point_mm: model_mm,
                                                                                        colour: COLOUR,
                                                                                        label: name,
                                                                                        ...actions(draft, state, name)
                                                                                      }));

async function rename(draft, state, name) {
  const taken = landmarks(draft).map((one) => one.name).filter((one) => one !== name);
  const other = await PointList.rename('Rename the landmark ' + name, name, taken);
  if (!other || other === name) return;
  state.setTool(null);
  draft.change('rename ' + name + ' to ' + other, (document) => (find(document, name).name = other));
}

function rowOf(draft, state, landmark) {
  const {name, model_mm, fragment, pixels} = landmark, key = 'landmark ' + name;
  const fragments = Object.keys(draft.document.fragments || {}), views = Object.keys(pixels || {});
  const tool = {
    key,
    hint: 'Click where ' + name + ' is in the CT. Esc ends.',
    says: () => 'put ' + name + ' here',
    place(point_mm) {
      place(draft, state, name, point_mm, model_mm ? 'move' : 'place');
      state.setTool(null);
    }
  };
  const belongs = fragments.length > 1 &&
      select('of', [['', 'choose …'], ...fragments.map((one) => [one, one])], fragment || '',
             (value) => draft.change(name + ' belongs to ' + (value || 'none'), (document) => {
               const changed = find(document, name);
               if (value)
                 changed.fragment = value;
               else
                 delete changed.fragment;
             }));
  return el(
      'li', {class: 'fragment', 'data-landmark': name},
      el('div', {class: 'toolbar'}, el('strong', {}, name), belongs,
         state.ct && PointList.toggle(state, key, model_mm ? 'Click again' : 'Click in a slice', tool),
         state.ct && !model_mm && button('At the crosshair', () => tool.place([...state.cursor_mm])),
         button('Rename', () => rename(draft, state, name), {'aria-label': 'Rename ' + name}),
         button(
             'Remove',
             () => draft.change(
                 'remove the landmark ' + name,
                 (document) => {
                   document.landmarks = document.landmarks.filter((one) => one.name !== name);
                 }),
             {'aria-label': 'Remove the landmark ' + name}),
         views.length ? el('span', {class: 'note'}, 'seen in ' + views.join(', ')) : null),
      model_mm ? el('ul', {class: 'points'},
                    PointList.row(state, name + ' in the CT', model_mm, actions(draft, state, name))) :
                 el('p', {class: 'note'}, 'Not in the CT yet.'));
}

function makeLandmarks(draft, left) {
  const state = CtState.of(draft), list = el('ul', {class: 'fragments'});
  const add = PointList.nameField(
      'new landmark', 'Add', () => landmarks(draft).map(({name}) => name),
      (name) => draft.change('add the landmark ' + name, (document) => {
        document.landmarks = [...(document.landmarks || []), {name}];
      }));
  const update = PointList.renewed(
      list,
      () =>
          [landmarks(draft), Object.keys(draft.document.fragments || {}), state.tool && state.tool.key,
           Boolean(state.ct)],
      () => landmarks(draft).map((landmark) => rowOf(draft, state, landmark)));
  state.marks.set('landmarks', () => marks(draft, state));
  for (const name of ['ct', 'view']) state.addEventListener(name, update, {signal: left});
  return {
    element:
        el('div', {},
           el('p', {class: 'note'},
              'Points that can be found in the CT and in the X-rays. They give a start to the ' +
                  'registration.'),
           add, list),
    update
  };
}

CasePage.panel('Landmarks in the CT', 'check', 40, makeLandmarks);

const VOLUME = /\.(mha|nrrd|nii|nii\.gz|tif|tiff)$/i;
const PRESETS = [['bone', 'Bone', 400, 1800], ['soft', 'Soft tissue', 40, 400]];

const numberOf = (box) => (box.value.trim() === '' ? null : Number(box.value));

// The options of reading, for files that do not say everything. changed(options) gets the keys of a case's `ct`.
function optionsForm(changed) {
  const number = (label) => Dom.labelled(label, el('input', {type: 'number', step: 'any', class: 'short'}));
  const box = (field) => field.querySelector('input');
  const sizes = ['x', 'y', 'z'].map((axis) => number('voxel ' + axis + ', mm'));
  const offset = number('offset, HU');
  const flips = ['x', 'y', 'z'].map((axis) => Dom.checkbox('flip ' + axis, false, () => {}));
  const series = Dom.labelled('series UID', el('input', {type: 'text'}));
  const fault = el('p', {class: 'fault', role: 'alert', 'data-fault-of': 'ct-options'});
  function read() {
    const size = sizes.map((field) => numberOf(box(field))), options = {};
    const is_given = size.some((value) => value !== null), is_whole = size.every((value) => value > 0);
    fault.textContent =
        is_given && !is_whole ? 'Give the voxel\'s size along x, y and z, each above 0 mm, or none of them.' : '';
    if (fault.textContent) return;
    if (is_given) {
      options.voxel_size_mm = size;
    }
    const flip = ['x', 'y', 'z'].filter((axis, k) => box(flips[k]).checked);
    if (flip.length) options.flip = flip;
    if (numberOf(box(offset))) options.value_offset_hu = numberOf(box(offset));
    if (box(series).value.trim()) options.series_uid = box(series).value.trim();
    changed(options);
  }
  function fill(ct) {
    const {voxel_size_mm = [], flip = [], value_offset_hu = '', series_uid = ''} = ct || {};
    sizes.forEach((field, k) => (box(field).value = voxel_size_mm[k] === undefined ? '' : voxel_size_mm[k]));
    flips.forEach((field, k) => (box(field).checked = flip.includes('xyz'[k])));
    box(offset).value = value_offset_hu;
    box(series).value = series_uid;
    fault.textContent = '';
  }
  const form = Dom.form(
      {class: 'toolbar'}, read, sizes, flips, offset, series, fault,
      el('button', {type: 'submit', 'data-do': 'read-ct'}, 'Read again'));
  const element =
      el('details', {class: 'ct-options'}, el('summary', {}, 'How it is read'),
         el('p', {class: 'note'}, 'Needed only if its files do not say it, or are wrong.'), form);
  return {element, fill};
}

async function choose(draft) {
  const file = await Shell.choose('Choose a CT: a file, or the folder of a DICOM series', {
    folders: true,
    accepts: (name) => VOLUME.test(name),
    at: Shell.folderOf(draft.document.ct ? draft.document.ct.file : '')
  });
  if (file !== undefined) draft.change('choose the CT ' + file, (document) => (document.ct = {file}));
}

// A button for each series of the folder, if the fault lists them.
const seriesIn = (draft, fault) => [...fault.matchAll(/^ +(\d+(?:\.\d+)+) \((.*)\)$/gm)].map(
    ([, uid, words]) =>
        el('p', {}, Dom.button('Read the series of ' + words, () => draft.change('choose a series', (document) => {
          document.ct.series_uid = uid;
        }), {'data-series': uid})));

function windowBar(state) {
  const presets = PRESETS.map(
      ([key, text, level, width]) => Dom.button(text, () => state.setWindow(level, width), {'data-window': key}));
  const all = Dom.button('All values', () => {
    const {lowest_hu: low, highest_hu: high} = state.ct;
    state.setWindow((low + high) / 2, high - low);
  }, {'data-window': 'all'});
  const level = el('input', {type: 'number', class: 'short', onchange: () => take()});
  const width = el('input', {type: 'number', class: 'short', min: 1, onchange: () => take()});
  const take = () => state.setWindow(Number(level.value), Number(width.value));
  return {
    element:
        el('div', {class: 'toolbar'},
           el('span', {class: 'field'}, el('span', {}, 'Window'), el('span', {class: 'choice'}, presets, all)),
           Dom.labelled('level', level), Dom.labelled('width', width)),
    update() {
      if (document.activeElement !== level) level.value = state.window.level;
      if (document.activeElement !== width) width.value = state.window.width;
      for (const [i, [, , at, wide]] of PRESETS.entries())
        presets[i].setAttribute('aria-pressed', String(state.window.level === at && state.window.width === wide));
    }
  };
}

// The place and the value at the crosshair and under the pointer.
function readout(state, views) {
  const here = el('span', {'data-read': 'crosshair'}), pointer = el('span', {'data-read': 'pointer'});
  const words = (point_mm, value_hu) =>
      point_mm.map((value) => value.toFixed(1)).join(', ') + ' mm' + (value_hu === null ? '' : ', ' + value_hu + ' HU');
  state.pointed = (what) => {
    pointer.textContent = what ? 'Pointer: ' + words(SliceGeometry.point(state.ct, what.index), what.value_hu) : '';
  };
  return {
    element: el('p', {class: 'note readout'}, here, ' ', pointer),
    update() {
      const view = views.find((one) => one.view);
      here.textContent = 'Crosshair (left, back, head): ' +
          words(state.cursor_mm, view ? view.at(view.placeOf(state.cursor_mm)).value_hu : null);
    }
  };
}

// The three slices with their tools; shown while there is a CT.
function slices(draft, state) {
  const views = ['axial', 'coronal', 'sagittal'].map((name) => new SliceView(name, state));
  const bar = windowBar(state), values = readout(state, views);
  const tool = el('p', {class: 'tool-hint', role: 'status'});
  const zoom =
      el('span', {class: 'choice', role: 'group', 'aria-label': 'Zoom'},
         Dom.button('+', () => all(1.4), {'data-do': 'closer', 'aria-label': 'Closer'}),
         Dom.button('−', () => all(1 / 1.4), {'data-do': 'further', 'aria-label': 'Further'}),
         Dom.button('Whole', () => views.forEach((view) => view.fit()), {'data-do': 'whole'}));
  const all = (factor) => views.forEach((view) => view.zoom(factor, view.placeOf(state.cursor_mm)));
  bar.element.append(zoom);
  const empty =
      el('div', {class: 'empty-stage'}, el('p', {}, 'The slices of the CT are shown here.'),
         Dom.button(
             'Choose the CT …', () => Shell.guarded(() => choose(draft)),
             {'data-do': 'choose-first-ct', class: 'primary'}));
  const foot = el('div', {class: 'slices-foot'}, tool, values.element);
  const tiles = el('div', {class: 'slices'}, views.map((view) => view.element));
  const element = el('div', {class: 'ct-slices'}, bar.element, empty, tiles, foot);
  return {
    element,
    views,
    values,
    reset: () => views.forEach((view) => view.reset()),
    update() {
      views.forEach((view) => view.show());
      bar.update();
      values.update();
      tool.textContent = state.tool ? state.tool.hint : '';
      element.classList.toggle('has-tool', Boolean(state.tool));
    },
    show(is_there) {
      for (const one of [bar.element, foot, ...views.map((view) => view.element)]) one.hidden = !is_there;
      empty.hidden = is_there;
      tiles.classList.toggle('without-slices', !is_there);
    },
    dispose: () => views.forEach((view) => view.dispose())
  };
}

const slicesHelp = () =>
    el('p', {class: 'note'},
       'Click into a slice: the crosshair goes there in all three. The wheel goes through the slices, with Ctrl it ' +
           'zooms. Drag with the right button for the window, with Shift to move the picture. Two fingers zoom. ',
       el('kbd', {}, '?'), ' lists the keys.');

function make(draft, left) {
  const state = CtState.of(draft), shown = slices(draft, state);
  const name = el('strong', {'data-ct': ''}), help = slicesHelp(), facts = el('span', {class: 'note'}),
        says = el('div', {});
  const options = optionsForm((more) => draft.change('read the CT in another way', (document) => {
    document.ct = {file: document.ct.file, ...more};
    state.read = '';
  }));
  const command = el('details', {}, el('summary', {}, 'The same in a shell'));
  const head =
      el('div', {class: 'toolbar'},
         Dom.button('Choose a CT …', () => Shell.guarded(() => choose(draft)), {'data-do': 'choose-ct'}),
         el('span', {}, name, ' ', facts));
  let reset_for = null;  // the name of the CT
  function tell() {
    const {ct} = state, {ct: chosen} = draft.document;
    name.textContent = chosen ? chosen.file :
        ct                    ? 'No CT is chosen. The slices have the grid of the labels.' :
                                'No CT is chosen.';
    facts.textContent = state.isReading ? 'is being read' :
        ct                              ? ct.size.join(' × ') + ' voxels of ' +
            ct.spacing_mm.map((size) => Number(size.toPrecision(4))).join(' × ') + ' mm' :
             '';
    says.replaceChildren(
        ...(state.fault ? [el('p', {class: 'fault', role: 'alert'}, state.fault), ...seriesIn(draft, state.fault)] :
                          []),
        ...(ct && chosen ? ct.doubts : []).map((doubt) => el('p', {class: 'fault doubt', role: 'status'}, doubt)));
    help.hidden = !ct;
    name.classList.toggle('none', !chosen);
    options.element.hidden = command.hidden = !chosen;
    if (state.fault) options.element.open = true;
    draft.ct_fault = state.fault;
    draft.dispatchEvent(new Event('steps'));
    command.replaceChildren(command.firstChild, Dom.command(state.command));
    shown.show(Boolean(ct));
    shown.element.inert = state.isReading;
    if ((ct ? ct.name : '') !== reset_for) shown.reset();
    reset_for = ct ? ct.name : '';
    if (ct) shown.update();
  }
  const viewed = () => state.ct && shown.update();
  state.addEventListener('ct', tell, {signal: left});
  state.addEventListener('view', viewed, {signal: left});
  state.addEventListener('slice', shown.values.update, {signal: left});
  options.fill(draft.document.ct);
  tell();
  let filled = JSON.stringify(draft.document.ct);
  return {
    element: el('div', {class: 'ct-panel'}, head, options.element, says, command, help),
    stage: {slices: shown.element},
    update() {
      const now = JSON.stringify(draft.document.ct);
      if (now !== filled) options.fill(draft.document.ct);
      filled = now;
      if (now === state.read) return viewed();
      state.follow();
    },
    dispose: shown.dispose
  };
}

CasePage.panel('CT', 'ct', 10, make, SliceInput.KEYS);
