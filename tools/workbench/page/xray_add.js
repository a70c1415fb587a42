// SPDX-License-Identifier: Apache-2.0
// The dialogs that add a view to a case, or give another camera to one.
import {button, el, form, labelled, select} from '../../report/page/dom.js';

import * as Ask from './server.js';
import * as Shell from './shell.js';

const MIRRORS = [
  ['none', 'not at all: it is seen from the source, with rows from the top'],
  ['left_right', 'left to right: it is seen from the detector'],
  ['upside_down', 'upside down: its rows begin at the bottom']
];
const is_rtk = (file) => /\.xml$/i.test(file);
const holdsProjections = (file) => /\.(xml|h5|hdf5)$/i.test(file);

// Resolves to the draft's camera, {file, projection, mirror, pixel_mm}, or to undefined.
const askProjection = (file) => Shell.dialog('Camera file with projections', (close) => {
  const projection =
      el('input', {type: 'number', min: 0, step: 1, value: 0, required: true, 'data-camera-file': 'projection'});
  const pixel =
      el('input', {type: 'number', min: 0.000001, max: 1000, step: 'any', required: true, 'data-camera-file': 'pixel'});
  const mirror = select(
      'How the program’s image was turned over to become this one', MIRRORS, is_rtk(file) ? 'upside_down' : 'none',
      () => {});
  mirror.box.dataset.cameraFile = 'mirror';
  const submit = () => {
    const camera = {file, projection: Number(projection.value)};
    if (mirror.box.value !== 'none') camera.mirror = mirror.box.value;
    if (is_rtk(file)) camera.pixel_mm = [Number(pixel.value), Number(pixel.value)];
    close(camera);
  };
  return form(
      {class: 'arm-fields'}, submit, el('p', {class: 'note'}, file),
      labelled('Number of the projection, counted from 0', projection), mirror,
      is_rtk(file) && labelled('Size of a pixel on the detector, mm', pixel),
      el('div', {class: 'toolbar'}, el('button', {type: 'submit', 'data-camera-file': 'ok'}, 'Use this camera')));
});

// The draft's camera for a chosen file. Asks for what the file does not say.
const cameraOf = (file) => (holdsProjections(file) ? askProjection(file) : {file});

export const cameraInWords = ({file, projection, mirror}) => file +
    (projection === undefined ? '' : `, projection ${projection}`) +
    (mirror ? `, image turned over ${mirror === 'left_right' ? 'left to right' : 'upside down'}` : '');

// The angles and distances of a C-arm as fields. Nothing is filled in that nobody gave: a guessed number looks like a
// measured one.

// The keys of docs/case.md: [key, label, where it is found, what it may be at all, what it usually is, whether other
// views have the same].
const FIELDS = [
  [
    'alpha_deg', 'Cranio-caudal angle, degrees',
    'Positive if the detector is towards the head. The display of the C-arm says CRAN for +, CAUD for −.', [-90, 90],
    [-45, 45], false
  ],
  [
    'beta_deg', 'Right/left anterior angle, degrees',
    'Positive if the detector is on the patient’s left. The display says LAO for +, RAO for −.', [-180, 180],
    [-120, 120], false
  ],
  [
    'source_to_detector_mm', 'Source to detector, mm',
    'SID on the display, or in the manual. In a DICOM header (0018,1110).', [1, 10000], [800, 1500], true
  ],
  [
    'source_to_isocentre_mm', 'Source to isocentre, mm',
    'In the manual: from the source to the point about which the arm turns. In a DICOM header (0018,1111).', [1, 10000],
    [400, 1000], true
  ],
  [
    'pixel_mm', 'Size of a pixel on the detector, mm',
    'The width of the field on the detector, in mm, divided by the columns of the image. In a DICOM header ' +
        '(0018,1164).',
    [0.001, 100], [0.1, 0.6], true
  ]
];

function fieldOf([key, label, where, [min, max], usual, stays], known, before) {
  const given = known ? known[key] : stays && before ? before.c_arm[key] : undefined;
  const note = el('small', {class: 'arm-note'}), id = 'arm-' + key;
  const box = el('input', {
    type: 'number',
    step: 'any',
    required: true,
    min,
    max,
    value: given === undefined ? '' : given,
    placeholder: `usually ${usual[0]} to ${usual[1]}`,
    'data-arm': key,
    'aria-describedby': id,
    oninput: () => tell()
  });
  note.id = id;
  const tell = () => {
    const value = Number(box.value), is_odd = box.value !== '' && (value < usual[0] || value > usual[1]);
    const source = !known && given !== undefined && Number(box.value) === given ? `As in ${before.name}. ` : '';
    note.classList.toggle('odd', is_odd);
    note.textContent =
        is_odd ? `${box.value} is unusual; usual are ${usual[0]} to ${usual[1]}. ${where}` : source + where;
  };
  tell();
  return {key, box, element: el('div', {class: 'arm-field'}, labelled(label, box), note)};
}

// known: the view's own values. before: {name, c_arm} of another view, whose distances this one has, too. values()
// gives the numbers; first() is the first field without a number.
function armFields(known, before) {
  const fields = FIELDS.map((field) => fieldOf(field, known, before));
  return {
    element: el('div', {class: 'arm-fields'}, fields.map((one) => one.element)),
    values: () => Object.fromEntries(fields.map(({key, box}) => [key, Number(box.value)])),
    first: () => (fields.find(({box}) => box.value === '') || fields[0]).box
  };
}

const is_image = (name) => /\.(png|tiff?|dcm|dicom)$/i.test(name);
// "frontal.0001" of "a/frontal.0001.png".
const stem = (path) => path.split('/').pop().replace(/\.[^.]*$/, '');

// Resolves to {name, kind: 'file' | 'header' | 'c_arm', c_arm}, or to undefined.
function ask(title, image, name, taken, camera, before) {
  return Shell.dialog(title, (close) => {
    const box = el('input', {type: 'text', value: name, maxlength: 100, 'data-name': 'view'});
    const fault = el('p', {class: 'fault', role: 'alert'});
    const arm = armFields(camera && camera.c_arm, before), has_header = /\.(dcm|dicom)$/i.test(image);
    const finish = (kind) => {
      const chosen = box.value.trim();
      if (!chosen) return void (fault.textContent = 'Give the view a name.');
      if (chosen !== name && taken.includes(chosen))
        return void (fault.textContent = `The name “${chosen}” is taken; give another one.`);
      const c_arm = arm.values();
      if (kind === 'c_arm' && !(c_arm.source_to_isocentre_mm < c_arm.source_to_detector_mm))
        return void (
            fault.textContent =
                'The isocentre is between source and detector, so its distance must be the smaller one.');
      close({name: chosen, kind, c_arm});
    };
    const fields = form(
        {}, () => finish('c_arm'), arm.element,
        el('button', {type: 'submit', 'data-camera': 'c_arm'}, 'Use these angles and distances'));
    if (!has_header) setTimeout(() => arm.first().focus());
    return el(
        'div', {class: 'add-view'}, el('p', {class: 'note'}, image), labelled('Name of the view', box), fault,
        el('h3', {}, 'How was it taken?'),
        el('p', {}, button('Choose a camera file', () => finish('file'), {'data-camera': 'file'}), ' ',
           el('span', {class: 'note'}, 'marrow’s YAML, or a file of XMALab, plastimatch, RTK or xReg')),
        has_header &&
            el('p', {}, button('Read the DICOM header', () => finish('header'), {'data-camera': 'header'}), ' ',
               el('span', {class: 'note'}, 'exact to about a degree at best')),
        el('details', {open: !has_header || Boolean(camera && camera.c_arm)},
           el('summary', {}, 'Angles and distances of a C-arm'), fields));
  });
}

// The camera of an image for the document, or undefined if the user leaves.
async function cameraFor(answer, image) {
  if (answer.kind === 'file') {
    const file =
        await Shell.choose(`Camera of ${answer.name}`, {at: Shell.folderOf(image), accepts: (name) => !is_image(name)});
    return file && cameraOf(file);
  }
  if (answer.kind === 'header') {
    const {camera, warnings} = await Ask.json('api/xray/header-camera', {image});
    for (const warning of warnings) Shell.notice(warning);
    return camera;
  }
  const {about} = await Ask.bytes('api/xray/image', {path: image});
  return {width_px: about.width_px, height_px: about.height_px, c_arm: answer.c_arm};
}

export async function add(draft) {
  const last = (draft.document.views || []).at(-1);
  const image = await Shell.choose('X-ray image', {accepts: is_image, at: last ? Shell.folderOf(last.image) : ''});
  if (!image) return;
  const taken = (draft.document.views || []).map((view) => view.name), name = Shell.freeName(stem(image), taken, ' ');
  const before = (draft.document.views || []).findLast(({camera}) => camera && camera.c_arm);
  const answer =
      await ask('Add an X-ray', image, name, taken, null, before && {name: before.name, c_arm: before.camera.c_arm});
  if (!answer) return;
  await Shell.guarded(async () => {
    const camera = await cameraFor(answer, image);
    if (!camera) return;
    await draft.change(`add the view ${answer.name}`, (document) => {
      document.views = [...(document.views || []), {name: answer.name, image, camera}];
    });
  });
}

// Renames a view everywhere in the document.
export function renameIn(document, name, next) {
  document.views.find((view) => view.name === name).name = next;
  for (const one of document.landmarks || [])
    if (one.pixels && one.pixels[name]) {
      one.pixels[next] = one.pixels[name];
      delete one.pixels[name];
    }
}

export async function edit(draft, view) {
  const taken = draft.document.views.map((one) => one.name);
  const answer = await ask(`Camera of ${view.name}`, view.image, view.name, taken, view.camera);
  if (!answer) return;
  await Shell.guarded(async () => {
    const camera = await cameraFor(answer, view.image);
    if (!camera) return;
    await draft.change(`camera of ${answer.name}`, (document) => {
      document.views.find((one) => one.name === view.name).camera = camera;
      if (answer.name !== view.name) renameIn(document, view.name, answer.name);
    });
  });
}
