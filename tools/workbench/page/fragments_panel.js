// SPDX-License-Identifier: Apache-2.0
// The panel "Fragments": their names, and the seeds inside their bone.
import {button, checkbox, el} from '../../report/page/dom.js';

import * as CasePage from './case.js';
import {CtState} from './ct_state.js';
import * as PointList from './point_list.js';
import * as Shell from './shell.js';
import * as SliceGeometry from './slice_geometry.js';

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

function fragmentOf(draft, state, [name, fragment], f) {
  const key = 'seed ' + name, seeds = fragment.seeds || [];
  const tool = {
    key,
    hint: 'Click inside the bone of ' + name + ' to put a seed there. Esc ends.',
    place: (point_mm) => addSeed(draft, state, name, point_mm)
  };
  const registers = checkbox(
      'register it', fragment.register !== false,
      (is_on) => draft.change(
          (is_on ? 'register ' : 'do not register ') + name,
          (document) => (document.fragments[name].register = is_on)));
  return el(
      'li', {class: 'fragment', 'data-fragment': name},
      el('div', {class: 'toolbar'}, el('span', {class: 'swatch', style: 'background:' + PointList.colour(f)}),
         el('strong', {}, name), registers, state.ct && PointList.toggle(state, key, 'Add seeds', tool),
         state.ct && button('Seed at the crosshair', () => tool.place([...state.cursor_mm])),
         button('Rename', () => rename(draft, state, name), {'aria-label': 'Rename ' + name}),
         button('Remove', () => remove(draft, state, name), {'aria-label': 'Remove the fragment ' + name})),
      seeds.length ? el('ul', {class: 'points'},
                        seeds.map(
                            (point_mm, i) => PointList.row(
                                state, 'seed ' + (i + 1) + ' of ' + name, point_mm, seedActions(draft, name, i)))) :
                     el('p', {class: 'note'}, 'No seed yet.'));
}

function make(draft) {
  const state = CtState.of(draft), list = el('ul', {class: 'fragments'});
  const add = PointList.nameField('new fragment', 'Add', () => names(draft), (name) => {
    draft.change('add the fragment ' + name, (document) => {
      document.fragments = {...(document.fragments || {}), [name]: {seeds: [], register: true}};
    });
  });
  const update = PointList.renewed(
      list, () => [draft.document.fragments, state.tool && state.tool.key, Boolean(state.ct)],
      () => entries(draft).map((entry, f) => fragmentOf(draft, state, entry, f)));
  state.marks.set('seeds', () => marks(draft));
  state.addEventListener('ct', update);
  state.addEventListener('view', update);
  const ends = (event) => event.key === 'Escape' && state.tool && state.setTool(null);
  document.addEventListener('keydown', ends);
  return {
    element: el(
        'div', {class: 'fragments-panel'},
        el('p', {class: 'note'},
           'A bone fragment grows from its seeds: points inside its bone. A fragment that is not registered is only ' +
               'separated from the others.'),
        add, list),
    update,
    dispose() {
      state.removeEventListener('ct', update);
      state.removeEventListener('view', update);
      document.removeEventListener('keydown', ends);
    }
  };
}

CasePage.panel('Fragments', 20, make, [['Esc', 'end putting points']]);
