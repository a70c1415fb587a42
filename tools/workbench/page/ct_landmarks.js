// SPDX-License-Identifier: Apache-2.0
// The panel "Landmarks in the CT": named points of a bone, placed in the slices. Another panel adds their places in the
// X-rays to the same landmarks.
import {button, el, select} from '../../report/page/dom.js';

import * as CasePage from './case.js';
import {CtState} from './ct_state.js';
import * as PointList from './point_list.js';
import * as Shell from './shell.js';
import * as SliceGeometry from './slice_geometry.js';

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

function make(draft, left) {
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

CasePage.panel('Landmarks in the CT', 'check', 40, make);
