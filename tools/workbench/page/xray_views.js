// SPDX-License-Identifier: Apache-2.0
// The panel "X-ray views" of the page "Case": the list of views, their geometry, and its faults.
import * as Dom from '../../report/page/dom.js';
import {el} from '../../report/page/dom.js';

import * as CasePage from './case.js';
import * as Geometry from './geometry.js';
import * as Ask from './server.js';
import * as Sight from './sight.js';
import * as XrayAdd from './xray_add.js';
import * as XrayCameraFile from './xray_camera_file.js';
import * as XrayFrame from './xray_frame.js';
import * as XrayImages from './xray_images.js';
import * as XrayTable from './xray_table.js';

const CHECK_PAUSE_ms = 500;

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

const degrees = (value) => value.toFixed(1) + '°';
const millimetres = (value) => Dom.number(value) + ' mm';

// Numbers that reveal a mistake: [[what, figure]].
function figuresOf(views) {
  const rows = [];
  for (const {view, camera} of views) {
    const focal = camera.intrinsics[0][0], arm = view.camera && view.camera.c_arm;
    const opening = 2 * Math.atan(camera.width_px / 2 / focal) * 180 / Math.PI;
    rows.push([
      `${view.name}: source to detector`,
      (arm ? millimetres(arm.source_to_detector_mm) : `${Dom.number(focal)} times the size of a pixel`) +
          `; the image opens ${degrees(opening)}`
    ]);
  }
  for (let i = 0; i < views.length; ++i)
    for (let k = i + 1; k < views.length; ++k)
      rows.push([
        `Between ${views[i].view.name} and ${views[k].view.name}`,
        degrees(Sight.angle_deg(views[i].camera, views[k].camera))
      ]);
  const met = views.length > 1 && Sight.meeting(views.map((one) => one.camera));
  if (met)
    rows.push([
      'Central rays meet at',
      `(${met.world_mm.map(XrayFrame.tenths).join(', ')}) mm in the world; they pass each other at ` +
          millimetres(met.distance_mm)
    ]);
  if (met)
    for (const {view, camera} of views)
      rows.push([
        `${view.name}: source to that point`,
        millimetres(Geometry.length(Geometry.minus(Sight.centralRay(camera).origin, met.world_mm)))
      ]);
  return rows;
}

// Asks marrow to check the cameras when views and landmarks no longer change. Calls told({warnings, command}) or
// told({fault}).
function checking(draft, told) {
  let asked = '', timer = null, aborter = null;
  return (views) => {
    const landmarks = (draft.document.landmarks || []).map(({name, pixels}) => {
      const known = Object.entries(pixels || {}).filter(([view]) => views.some((one) => one.view.name === view));
      return {name, pixels: Object.fromEntries(known)};
    });
    const body = {views: views.map(({view: {name, image, camera}}) => ({name, image, camera})), landmarks};
    const text = JSON.stringify(body);
    if (text === asked) return;
    asked = text;
    clearTimeout(timer);
    if (aborter) aborter.abort();
    if (!views.length) return told(null);
    timer = setTimeout(async () => {
      aborter = new AbortController();
      try {
        told(await Ask.post('api/xray/check', body, aborter.signal));
      } catch (error) {
        if (error.name !== 'AbortError') told({fault: error.message, warnings: []});
      }
    }, CHECK_PAUSE_ms);
  };
}

function checkText(answer) {
  if (!answer) return [];
  const lines = answer.fault ? [el('p', {class: 'fault'}, answer.fault)] :
                               answer.warnings.map((text) => el('p', {class: 'fault', 'data-warning': ''}, text));
  const error = answer.metrics && answer.metrics.error;
  if (!lines.length)
    lines.push(
        el('p', {class: 'note', 'data-good': ''},
           error === undefined ?
               'No fault was found in these cameras.' :
               `No fault was found in these cameras; the marked landmarks are ${XrayTable.figure(error)} px off.`));
  if (answer.command)
    lines.push(el('details', {}, el('summary', {}, 'The same in a shell'), Dom.command(answer.command)));
  return lines;
}

function make(draft) {
  const list = el('ul', {class: 'view-list'});
  const figures = el('table', {class: 'values', 'data-figures': ''});
  const sides = el('p', {class: 'note', 'data-sides': ''});
  const check = el('div', {role: 'status', 'data-check': ''});
  const ask = checking(draft, (answer) => check.replaceChildren(...checkText(answer)));
  const update = () => {
    const views = draft.document.views || [], entries = views.map((view) => XrayImages.of(view, update));
    const signature = JSON.stringify([views, entries.map((one) => one.is_ready)]);
    sides.textContent = sidesText(views);
    if (signature !== list.dataset.shown) {
      list.dataset.shown = signature;
      list.replaceChildren(...views.map((view, i) => item(draft, view, i, views.length, entries[i])));
    }
    const known = views.map((view, i) => ({view, camera: entries[i].camera})).filter((one) => one.camera);
    figures.replaceChildren(el(
        'tbody', {},
        figuresOf(known).map(([what, figure]) => el('tr', {}, el('th', {scope: 'row'}, what), el('td', {}, figure)))));
    if (entries.every((one) => one.is_ready)) ask(known);
  };
  const again = Dom.button('Read again', () => {
    XrayImages.forget();
    list.dataset.shown = '';
    draft.dispatchEvent(new Event('change'));
  }, {'data-do': 'read-again', title: 'Reads images and cameras from their files again'});
  return {
    element:
        el('div', {class: 'xray-views'},
           el('div', {class: 'toolbar'}, Dom.button('Add X-ray', () => XrayAdd.add(draft), {'data-do': 'add-view'}),
              again),
           list, sides, figures, check),
    update
  };
}

CasePage.panel('X-ray views', 20, make);
