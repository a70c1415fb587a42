// SPDX-License-Identifier: Apache-2.0
// The panel "X-ray views" of the page "Case": the list of views, and what is wrong with their images.
import * as Dom from '../../report/page/dom.js';
import {el} from '../../report/page/dom.js';

import * as CasePage from './case.js';
import * as XrayAdd from './xray_add.js';
import * as XrayCameraFile from './xray_camera_file.js';
import * as XrayCheck from './xray_check.js';
import * as XrayImages from './xray_images.js';
import * as XrayTable from './xray_table.js';

function cameraText(view) {
  const camera = view.camera || {};
  if (camera.file) return XrayCameraFile.inWords(camera);
  if (camera.c_arm)
    return `C-arm, ${camera.c_arm.alpha_deg}° cranio-caudal, ${camera.c_arm.beta_deg}° right/left anterior`;
  return camera.intrinsics ? 'matrices in the case' : 'no camera';
}

// The faults that an image shows by itself: [sentence].
function faultsOf(view, entry) {
  const faults = [];
  if (entry.fault) faults.push(entry.fault);
  if (entry.is_inverted)
    faults.push(
        'a bright limb on a dark ground: is bone bright here? In marrow’s images air is bright and bone is dark; ' +
        'invert the image file');
  return [...faults, ...(entry.warnings || [])];
}

async function rename(draft, name) {
  const taken = draft.document.views.map((view) => view.name);
  const next = await XrayTable.askName('Rename view', name, taken);
  if (next && next !== name)
    await draft.change(`rename the view ${name}`, (document) => XrayAdd.renameIn(document, name, next));
}
const remove = (draft, name) => draft.change(`remove the view ${name}`, (document) => {
  document.views = document.views.filter((view) => view.name !== name);
  for (const one of document.landmarks || [])
    if (one.pixels) delete one.pixels[name];
});
async function move(draft, name, by) {
  await draft.change(`move the view ${name}`, (document) => {
    const at = document.views.findIndex((view) => view.name === name), [view] = document.views.splice(at, 1);
    document.views.splice(at + by, 0, view);
  });
  const button = document.querySelector(`[data-view-row="${CSS.escape(name)}"] [data-do="${by < 0 ? 'up' : 'down'}"]`);
  if (button) button.focus();
}

function item(draft, view, index, count, entry) {
  const button = (text, does, what, disabled) =>
      Dom.button(text, does, {'data-do': what, 'aria-label': `${text}: ${view.name}`, disabled});
  const faults = entry.is_ready ? faultsOf(view, entry) : [];
  return el(
      'li', {'data-view-row': view.name},
      el('div', {class: 'view-head'}, el('strong', {}, view.name),
         el('span', {class: 'row-actions'}, button('Up', () => move(draft, view.name, -1), 'up', index === 0),
            button('Down', () => move(draft, view.name, 1), 'down', index === count - 1),
            button('Rename', () => rename(draft, view.name), 'rename'),
            button('Camera', () => XrayAdd.edit(draft, view), 'camera'),
            button('Remove', () => remove(draft, view.name), 'remove'))),
      el('p', {class: 'note'}, view.image, ' · ', cameraText(view), view.mask ? ' · mask' : '',
         view.mask &&
             Dom.button(
                 'Remove mask',
                 () => draft.change(
                     `remove the mask of ${view.name}`,
                     (document) => {
                       delete document.views.find((one) => one.name === view.name).mask;
                     }),
                 {'aria-label': `Remove mask: ${view.name}`})),
      faults.map((fault) => el('p', {class: 'fault', 'data-fault-of': view.name}, fault)));
}

// A sentence about files that do not state the patient's sides. Only the anatomy shows whether they are mirrored.
function sidesText(views) {
  const silent = views.filter((view) => !/\.(dcm|dicom)$/i.test(view.image)).map((view) => view.name);
  return silent.length ?
      `${
          silent.join(
              ', ')}: PNG and TIFF do not say which side is left. Compare with the anatomy: in a frontal view the ` +
          'patient’s left is on the left. Landmarks in two views also reveal a mirrored image.' :
      '';
}

// The rows of the list. A row is made again only if what it shows has changed.
function rows(draft, list) {
  const made = new Map();  // by the view's name: {signature, element}
  return (views, entries) => {
    const elements = views.map((view, i) => {
      const entry = entries[i], signature = JSON.stringify([view, i, views.length, entry.is_ready, entry.fault]);
      const old = made.get(view.name);
      if (old && old.signature === signature) return old.element;
      const element = item(draft, view, i, views.length, entry);
      made.set(view.name, {signature, element});
      return element;
    });
    if (elements.length !== list.children.length || elements.some((one, i) => one !== list.children[i]))
      list.replaceChildren(...elements);
  };
}

function make(draft) {
  const list = el('ul', {class: 'view-list'}), show = rows(draft, list);
  const sides = el('p', {class: 'note', 'data-sides': ''});
  const check = XrayCheck.make(draft);
  let is_waiting = false;
  const update = () => {
    const views = draft.document.views || [], entries = views.map((view) => XrayImages.of(view, soon));
    sides.textContent = sidesText(views);
    show(views, entries);
    check.update(views, entries);
  };
  const soon = () => {
    if (is_waiting) return;
    is_waiting = true;
    requestAnimationFrame(() => {
      is_waiting = false;
      update();
    });
  };
  const again = Dom.button('Read again', () => {
    XrayImages.forget();
    draft.dispatchEvent(new Event('change'));
  }, {'data-do': 'read-again', title: 'Reads images and cameras from their files again'});
  return {
    element:
        el('div', {class: 'xray-views'},
           el('div', {class: 'toolbar'}, Dom.button('Add X-ray', () => XrayAdd.add(draft), {'data-do': 'add-view'}),
              again),
           list, sides),
    tools: [{step: 'check', title: 'Cameras', element: check.element}],
    update
  };
}

CasePage.panel('X-ray views', 'xrays', 20, make);
