// SPDX-License-Identifier: Apache-2.0
// The panel "Labels": the segmentation of another program over the slices, and its segments as fragments.
import * as Dom from '../../report/page/dom.js';
import {el, number} from '../../report/page/dom.js';

import * as CasePage from './case.js';
import {CtState, LabelsState} from './draft.js';
import * as PointList from './point_list.js';
import * as Shell from './shell.js';
import * as SliceGeometry from './slice_geometry.js';

const LABELS = /\.(mha|nrrd|nii|nii\.gz|dcm)$/i;

async function choose(draft) {
  const at = Shell.folderOf(draft.document.labels || '');
  const file = await Shell.choose(
      'Choose a label map: NIfTI, NRRD, .seg.nrrd, MHA, or a file or folder of DICOM SEG',
      {folders: true, accepts: (name) => LABELS.test(name) || !name.includes('.'), at});
  if (file !== undefined) draft.change('choose the labels ' + file, (document) => (document.labels = file));
}

// The fragments that have a label, by the segment's index.
function chosen(draft, labels) {
  const fragments = new Map();
  Object.entries(draft.document.fragments || {}).forEach(([name, {label}], f) => {
    const segment = label !== undefined && labels.segmentOf(label);
    if (segment) fragments.set(labels.labels.segments.indexOf(segment), {name, colour: PointList.colour(f)});
  });
  return fragments;
}

// Makes a fragment of a segment, under its name.
function add(draft, segment) {
  const taken = Object.keys(draft.document.fragments || {}), title = segment.name || LabelsState.title(segment);
  const name = Shell.freeName(title, taken, ' ');
  draft.change('add the fragment ' + name, (document) => {
    document.fragments = {...(document.fragments || {}), [name]: {label: segment.label, register: true}};
  });
}

// Why a segment cannot be a fragment; '' if it can.
const faultOf = ({label, volume_ml}) =>
    (label === null ? 'Another segment has the same name and number; rename it in its program.' :
         !volume_ml ? 'It has no voxel of its own.' :
                      '');

// A colour for each segment that is no fragment yet: muted, and the same each time.
const muted = (i) => 'hsl(' + (i * 137) % 360 + ' 45% 60%)';

// The bytes of a colour as a canvas has them, so that pictures can be mixed.
function bytesOf(colour) {
  const pen = new OffscreenCanvas(1, 1).getContext('2d');
  pen.fillStyle = colour;
  pen.fillRect(0, 0, 1, 1);
  return pen.getImageData(0, 0, 1, 1).data;
}

// What the slices mix with their values: the colour and opacity of each voxel's segment.
function overlay(draft, labels, isShown) {
  let known = '', colours = [];
  const renew = () => {
    const fragments = chosen(draft, labels), {name, segments} = labels.labels;
    const now = JSON.stringify([name, [...fragments]]);
    if (now === known) return;
    known = now;
    colours = segments.map((one, i) => {
      const fragment = fragments.get(i);
      return {bytes: bytesOf(fragment ? fragment.colour : muted(i)), opacity: fragment ? 0.55 : 0.25};
    });
  };
  return {
    slice(ct, axis, index) {
      if (!isShown() || !labels.labels) return null;
      renew();
      const places = labels.slice(ct, axis, index);
      return places ? {key: known, places, colours} : null;
    }
  };
}

// The rows of the list; `wanted` is a part of a name or number.
function rows(draft, state, labels, wanted) {
  const fragments = chosen(draft, labels);
  return labels.labels.segments.map((segment, i) => ({segment, i}))
      .filter(({segment}) => LabelsState.title(segment).toLowerCase().includes(wanted.toLowerCase()))
      .map(({segment, i}) => {
        const fragment = fragments.get(i), title = LabelsState.title(segment), fault = faultOf(segment);
        return el(
            'li', {class: 'point', 'data-segment': segment.number},
            el('span', {class: 'swatch', style: 'background:' + (fragment ? fragment.colour : muted(i))}),
            Dom.button(title, () => state.goTo(segment.middle_mm), {class: 'link', 'aria-label': 'Go to ' + title}),
            el('span', {class: 'note'}, number(segment.volume_ml) + ' ml'),
            fragment ? el('span', {class: 'note'}, 'is the fragment ' + fragment.name) :
                       Dom.button('Add as a fragment', () => add(draft, segment), {
                         'aria-label': 'Add as a fragment: ' + title,
                         'data-add': segment.number,
                         disabled: Boolean(fault),
                         title: fault
                       }));
      });
}

// The segment at the crosshair.
function atCrosshair(state, labels) {
  if (!state.ct || !labels.labels) return null;
  const index = state.cursorIndex().map(Math.round), axis = 2;
  if (!SliceGeometry.isInside(state.ct, index)) return null;
  const places = labels.slice(state.ct.name, axis, index[axis]);
  const place = places ? places[index[1] * state.ct.size[0] + index[0]] : 0;
  return place ? labels.labels.segments[place - 1] : null;
}

function readout(draft, state, labels) {
  const text = el('span', {'data-read': 'label'});
  const button = Dom.button('Add it as a fragment', () => {
    const segment = atCrosshair(state, labels);
    if (segment) add(draft, segment);
  }, {'data-do': 'add-label'});
  return {
    element: el('div', {class: 'toolbar'}, text, button),
    update() {
      const segment = atCrosshair(state, labels);
      text.textContent = 'At the crosshair: ' + (segment ? LabelsState.title(segment) : 'no label');
      button.disabled = !segment || Boolean(faultOf(segment)) ||
          [...chosen(draft, labels).keys()].includes(labels.labels.segments.indexOf(segment));
    }
  };
}

function make(draft, left) {
  const state = CtState.of(draft), labels = LabelsState.of(draft);
  let is_shown = true, wanted = '';
  const name = el('strong', {'data-labels': ''}), facts = el('span', {class: 'note'}), says = el('div', {});
  const shows = Dom.checkbox('show them in the slices', true, (is_on) => {
    is_shown = is_on;
    state.tell('view');
  });
  const filter = el('input', {
    type: 'search',
    oninput: () => {
      wanted = filter.value.trim();
      update();
    }
  });
  const list = el('ul', {class: 'points labels'}), here = readout(draft, state, labels);
  const tools = el('div', {class: 'toolbar'}, Dom.labelled('number or name', filter), shows);
  const without = Dom.button('Without labels', () => draft.change('choose no labels', (document) => {
    delete document.labels;
  }), {'data-do': 'no-labels'});
  const command = el('details', {}, el('summary', {}, 'The same in a shell'));
  const renew = PointList.renewed(
      list, () => [labels.labels, draft.document.fragments, wanted],
      () => (labels.labels ? rows(draft, state, labels, wanted) : []));

  function update() {
    const file = draft.document.labels, is_there = Boolean(labels.labels) && !labels.isReading;
    name.textContent = file || 'No label map is chosen.';
    name.classList.toggle('none', !file);
    facts.textContent = labels.isReading ? 'is being read' :
        is_there ? labels.labels.segments.length + ' labels, ' + labels.labels.grid.size.join(' × ') + ' voxels' :
                   '';
    says.replaceChildren(...(labels.fault ? [el('p', {class: 'fault', role: 'alert'}, labels.fault)] : []));
    for (const one of [tools, list, here.element]) one.hidden = !is_there;
    without.hidden = command.hidden = !file;
    command.replaceChildren(command.firstChild, Dom.command(labels.command));
    if (!is_there) return;
    renew();
    here.update();
  }
  const read = () => {
    update();
    state.standIn(labels.labels && labels.labels.ct);
  };
  state.overlay = overlay(draft, labels, () => is_shown);
  labels.addEventListener('labels', read, {signal: left});
  labels.addEventListener('slice', () => state.tell('view'), {signal: left});
  for (const name of ['ct', 'view']) state.addEventListener(name, () => labels.labels && here.update(), {signal: left});
  state.addEventListener('lost', () => labels.follow(true), {signal: left});
  update();
  return {
    element:
        el('div', {class: 'labels-panel'},
           el('p', {class: 'note'},
              'The segmentation of another program, such as TotalSegmentator or 3D Slicer. Its labels take the place ' +
                  'of seeds.'),
           el('div', {class: 'toolbar'},
              Dom.button('Choose labels …', () => Shell.guarded(() => choose(draft)), {'data-do': 'choose-labels'}),
              el('span', {}, name, ' ', facts), without),
           says, tools, here.element, list, command),
    update() {
      update();
      labels.follow();
    }
  };
}

CasePage.panel('Labels', 'ct', 15, make);
