// SPDX-License-Identifier: Apache-2.0
// Exports seeds, landmarks, starts and cameras to files of marrow and of other programs (docs/formats.md).
import * as Dom from '../../report/page/dom.js';
import {el, form, labelled, select} from '../../report/page/dom.js';

import * as Ask from './server.js';
import * as Shell from './shell.js';

const IMPORTED = Object.freeze({seeds: 'Seeds', landmarks: 'Landmarks', pose: 'Start'});

const fragmentOf = (document, name) => {
  document.fragments = document.fragments || {};
  return document.fragments[name] = document.fragments[name] || {seeds: [], register: true};
};

// Enters the content of a file into the document. Landmarks of the same name get the places in the file. Everything
// else stays.
const PUT = {
  seeds(document, {seeds}) {
    for (const [name, one] of Object.entries(seeds)) Object.assign(fragmentOf(document, name), one);
  },
  landmarks(document, {landmarks}) {
    document.landmarks = document.landmarks || [];
    for (const one of landmarks) {
      const old = document.landmarks.find((other) => other.name === one.name);
      if (old)
        Object.assign(old, one, {pixels: {...(old.pixels || {}), ...(one.pixels || {})}});
      else
        document.landmarks.push(one);
    }
  },
  pose(document, {world_from_ct}, fragment) {
    fragmentOf(document, fragment).start = world_from_ct;
  }
};

async function importFrom(shared, what) {
  const path = await Shell.choose(`Import: ${IMPORTED[what].toLowerCase()}`);
  if (path === undefined) return;
  await Shell.guarded(async () => {
    const got = await Ask.json('api/xray/import', {what, path});
    await shared.draft.change(`import ${path}`, (document) => PUT[what](document, got, shared.fragment()));
    for (const warning of got.warnings) Shell.notice(warning);
    Shell.notice(`${IMPORTED[what]} read from ${path}`);
  });
}

const NAMES = Object.freeze({...IMPORTED, cameras: 'Cameras', result: 'Result’s pose'});

export function make(shared) {
  const command = el('div', {role: 'status', 'data-exported': ''});
  const told = ({path, command: text}) => command.replaceChildren(...(
      text ? [el('p', {class: 'note'}, `The same as ${path} in a shell, into the folder runs:`), Dom.command(text)] :
             []));
  const button = (text, what, does) => Dom.button(
      text, does, {[`data-${text.toLowerCase()}`]: what, 'aria-label': `${text} ${NAMES[what].toLowerCase()}`});
  const row = (what) =>
      el('span', {class: 'field'}, el('span', {}, NAMES[what]),
         el('span', {class: 'pair'}, IMPORTED[what] && button('Import', what, () => importFrom(shared, what)),
            button('Export', what, () => (what === 'result' ? beginResult(shared, told) : begin(shared, what, told)))));
  return {element: el('div', {class: 'exchange'}, el('div', {class: 'toolbar'}, Object.keys(NAMES).map(row)), command)};
}

const POINTS = [
  ['.yaml', 'marrow (.yaml)'], ['.mrk.json', '3D Slicer (.mrk.json), one fragment'],
  ['.fcsv', 'xReg, 3D Slicer until 5 (.fcsv), one fragment']
];
const POSE = [['.yaml', 'marrow (.yaml)'], ['.tfm', 'ITK, 3D Slicer (.tfm)']];
const CAMERAS = [['.h5', 'xReg (.h5)'], ['.xml', 'RTK (.xml)'], ['.txt', 'plastimatch (.txt), one view']];
const FORMATS = Object.freeze({seeds: POINTS, landmarks: POINTS, pose: POSE, cameras: CAMERAS, result: POSE.slice(1)});
const TITLES = Object.freeze(
    {seeds: 'seeds', landmarks: 'landmarks', pose: 'start', cameras: 'cameras', result: 'a result’s pose'});

// The content to write, or a sentence that says why there is none.
const GET = {
  seeds(document) {
    const found = Object.entries(document.fragments || {}).filter(([, one]) => (one.seeds || []).length);
    if (!found.length) return 'There are no seeds yet.';
    const fragments = found.map(([name, one]) => [name, {seeds: one.seeds, register: one.register !== false}]);
    return {fragments: Object.fromEntries(fragments)};
  },
  landmarks(document, fragment) {
    const fragments = {};
    for (const one of document.landmarks || []) {
      if (!one.model_mm) continue;
      const name = one.fragment || fragment, to = fragments[name] = fragments[name] || {points: {}, seen: {}};
      to.points[one.name] = one.model_mm;
      for (const [view, at] of Object.entries(one.pixels || {})) (to.seen[view] = to.seen[view] || {})[one.name] = at;
    }
    return Object.keys(fragments).length ? {fragments} : 'No landmark has a place in the CT, which the file needs.';
  },
  pose(document, fragment) {
    const matrix = ((document.fragments || {})[fragment] || {}).start;
    return matrix ? {matrix} : `The fragment “${fragment}” has no start yet.`;
  },
  cameras(document, fragment, shared) {
    const views = shared.views().filter((view) => shared.cameraOf(view.name));
    return views.length ? {views: views.map(({name, image, camera}) => ({name, image, camera}))} :
                          'There is no view with an image and a camera yet.';
  }
};

// The choice of one of several names; nothing if there is only one.
const choiceOf = (label, names, chosen) =>
    select(label, names.map((one) => [one, one]), names.includes(chosen) ? chosen : names[0], () => {});

// The size of a pixel in the case; '' if the case does not have it.
function pixelOf(shared) {
  for (const {camera} of shared.views()) {
    if (camera && camera.c_arm) return camera.c_arm.pixel_mm;
    if (camera && camera.pixel_mm) return camera.pixel_mm[0];
  }
  return '';
}

// Resolves to {path, ending, one, pixel_mm}, or to undefined. `one`: the fragment or view that is chosen.
const ask = (shared, what, names, beside) => Shell.dialog(`Export: ${TITLES[what]}`, (close) => {
  const formats = FORMATS[what], is_camera = what === 'cameras';
  const box = el('input', {type: 'text', value: beside + formats[0][0], required: true, 'data-name': 'file'});
  const pixel = el('input', {
    type: 'number',
    step: 'any',
    min: 0.000001,
    max: 1000,
    required: is_camera,
    value: is_camera ? pixelOf(shared) : '',
    'data-export-field': 'pixel'
  });
  const one = choiceOf(is_camera ? 'View' : 'Fragment', names, shared.fragment());
  one.box.dataset.exportField = 'one';
  const format = select('Format', formats, formats[0][0], () => update());
  format.box.dataset.exportField = 'format';
  const update = () => {
    const known = formats.find(([ending]) => box.value.endsWith(ending));
    if (known) box.value = box.value.slice(0, -known[0].length) + format.box.value;
    one.hidden = names.length < 2 || (is_camera ? format.box.value !== '.txt' : format.box.value === '.yaml');
  };
  update();
  const submit = () =>
      close({path: box.value.trim(), one: one.hidden ? null : one.box.value, pixel_mm: Number(pixel.value)});
  setTimeout(() => box.focus());
  return form(
      {class: 'arm-fields'}, submit, format, labelled('File in the folder that is open', box), one,
      is_camera && labelled('Width of a pixel on the detector, mm', pixel),
      el('div', {class: 'toolbar'}, el('button', {type: 'submit', 'data-do': 'ok'}, 'Export')));
});

const confirmed = (path) => Shell.sure(
    'Replace the file?', el('p', {}, `${path} is there already.`), ['Replace it', {'data-do': 'replace'}],
    ['Keep it', {'data-do': 'keep'}]);

// Resolves to the server's answer, or to undefined if an older file is kept.
async function written(body) {
  try {
    return await Ask.post('api/xray/export', body);
  } catch (error) {
    if (error.status !== 409) throw error;
  }
  return await confirmed(body.path) ? Ask.post('api/xray/export', {...body, replace: true}) : undefined;
}

// The part of the content that goes into the file.
function chosen(shared, what, content, {one, pixel_mm}) {
  if (what === 'cameras') {
    const views = content.views.filter((view) => !one || view.name === one);
    const [[across], [, down]] = shared.cameraOf(views[0].name).intrinsics;
    return {views, pixel_width_mm: pixel_mm, pixel_height_mm: pixel_mm * across / down};
  }
  return one && content.fragments ? {fragments: {[one]: content.fragments[one]}} : content;
}

async function send(shared, what, content, answer, told) {
  await Shell.guarded(async () => {
    const of = what === 'result' ? 'pose' : what;
    const done = await written({what: of, path: answer.path, content: chosen(shared, what, content, answer)});
    if (!done) return;
    Shell.notice(`Written: ${done.path}`);
    told(done);
  });
}

// told({path, command}) is called when the file is written.
async function begin(shared, what, told) {
  const content = GET[what](shared.draft.document, shared.fragment(), shared);
  if (typeof content === 'string') return void Shell.notice(content, 'fault');
  const names = content.views ? content.views.map((view) => view.name) : Object.keys(content.fragments || {});
  const answer = await ask(shared, what, names, (shared.draft.path ? shared.draft.path + '.' : '') + what);
  if (answer) await send(shared, what, content, answer, told);
}

// A pose that a run found, in one of its files.
async function beginResult(shared, told) {
  const accepts = (name) => /\.ya?ml$/.test(name);
  const file = await Shell.choose('Pose of a run, such as runs/NAME/outputs/pose/…', {accepts});
  if (file === undefined) return;
  const answer = await ask(shared, 'result', [], file.replace(/\.ya?ml$/, ''));
  if (answer) await send(shared, 'result', {file}, answer, told);
}
