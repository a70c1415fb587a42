// SPDX-License-Identifier: Apache-2.0
// The dialogs that add a view to a case, or give another camera to one.
import {button, el, form, labelled} from '../../report/page/dom.js';

import * as Ask from './server.js';
import * as Shell from './shell.js';
import {armFields} from './xray_arm.js';
import * as XrayCameraFile from './xray_camera_file.js';

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
    return file && XrayCameraFile.cameraOf(file);
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
