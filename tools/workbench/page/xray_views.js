// SPDX-License-Identifier: Apache-2.0
// The panel "X-ray views" of the page "Case": the list of views, and what is wrong with their images.
import * as Dom from '../../report/page/dom.js';
import {el} from '../../report/page/dom.js';

import * as CasePage from './case.js';
import {angle_deg, centralRay, length, meeting, minus, triangulated} from './geometry.js';
import * as Ask from './server.js';
import * as XrayAdd from './xray_add.js';
import * as XrayFrame from './xray_frame.js';
import * as XrayTable from './xray_landmarks.js';
import * as XrayImages from './xray_picture.js';

// The size of a pixel that would make views agree. A wrong size is the usual mistake of a camera that was typed in: it
// is often the one of the full detector, while the image was binned or zoomed.
const LEAST_POINTS = 3, WRONG_mm = 1, BETTER = 0.4, LEAST_CHANGE = 0.03;

// The camera if its pixels were `factor` times as large.
const scaled = (camera, factor) => ({
  ...camera,
  intrinsics: camera.intrinsics.map((row, i) => (i < 2 ? [row[0] / factor, row[1] / factor, row[2]] : row))
});

// The landmarks that two views or more show, with the rays' ends: [{model_mm, seen: [{view, pixel}]}].
const shared = (views, landmarks) =>
    landmarks
        .map(({model_mm, pixels}) => ({
               model_mm,
               seen: Object.entries(pixels || {}).filter(([name]) => views.some(({view}) => view.name === name))
             }))
        .filter(({seen}) => seen.length > 1);

// How badly the views agree, in mm: the distances of the rays, and how far the distances between landmarks differ from
// those in the CT.
function disagreement(views, points, factorOf) {
  const cameras = new Map(views.map(({view, camera}) => [view.name, scaled(camera, factorOf(view.name))]));
  const found = points.map(
      ({model_mm, seen}) =>
          ({model_mm, at: triangulated(seen.map(([name, pixel]) => ({camera: cameras.get(name), pixel})))}));
  if (found.some(({at}) => !at)) return Infinity;
  const errors = found.map(({at}) => at.distance_mm), inCt = found.filter(({model_mm}) => model_mm);
  for (let i = 0; i < inCt.length; ++i)
    for (let k = 0; k < i; ++k)
      errors.push(
          length(minus(inCt[i].at.world_mm, inCt[k].at.world_mm)) - length(minus(inCt[i].model_mm, inCt[k].model_mm)));
  return Math.sqrt(errors.reduce((sum, error) => sum + error * error, 0) / errors.length);
}

// The factor with the least disagreement, from a third to three times the present size.
function best(cost) {
  let low = Math.log(1 / 3), high = Math.log(3), at = 0, least = Infinity;
  for (let round = 0; round < 5; ++round) {
    const step = (high - low) / 24;
    for (let i = 0; i <= 24; ++i) {
      const value = cost(Math.exp(low + i * step));
      if (value < least) [at, least] = [low + i * step, value];
    }
    [low, high] = [at - step, at + step];
  }
  return {factor: Math.exp(at), cost: least};
}

// A sentence if another size of the pixels, in one view or in all, explains the landmarks clearly better. Only views
// that are given by the distances of a C-arm have a size that can be wrong.
export function advice(views, landmarks) {
  const points = shared(views, landmarks), arms = views.filter(({view}) => view.camera && view.camera.c_arm);
  if (points.length < LEAST_POINTS || !arms.length) return '';
  const now = disagreement(views, points, () => 1);
  if (!(now > WRONG_mm)) return '';
  const tried = [arms, ...(views.length > 1 ? arms.map((one) => [one]) : [])].map((changed) => {
    const names = new Set(changed.map(({view}) => view.name));
    return {changed, ...best((factor) => disagreement(views, points, (name) => (names.has(name) ? factor : 1)))};
  });
  const found = tried.reduce((a, b) => (b.cost < a.cost - 1e-9 ? b : a));
  if (found.cost > BETTER * now || Math.abs(Math.log(found.factor)) < LEAST_CHANGE) return '';
  const sizes = found.changed.map(({view}) => {
    const {pixel_mm} = view.camera.c_arm;
    return `${(pixel_mm * found.factor).toPrecision(3)} mm instead of ${pixel_mm} mm in ${view.name}`;
  });
  return `The landmarks disagree by ${now.toFixed(1)} mm. With pixels of ${sizes.join(' and ')} it would be ${
      found.cost.toFixed(1)} mm. Is the image binned, zoomed or scaled?`;
}

const CHECK_PAUSE_ms = 500, MOST_LISTED = 4;

const degrees = (value) => value.toFixed(1) + '°';
const millimetres = (value) => Dom.number(value) + ' mm';

// The angles of all pairs; of many views only the least and the largest.
function anglesOf(views) {
  const pairs = views.flatMap(
      ({view, camera}, i) => views.slice(i + 1).map(
          (other) => [`Between ${view.name} and ${other.view.name}`, angle_deg(camera, other.camera)]));
  pairs.sort((a, b) => (views.length > MOST_LISTED ? a[1] - b[1] : 0));
  return (views.length > MOST_LISTED ? [pairs[0], pairs.at(-1)] : pairs).map(([what, angle]) => [what, degrees(angle)]);
}

function distanceOf({view, camera}) {
  const focal = camera.intrinsics[0][0], arm = view.camera && view.camera.c_arm;
  const opening = 2 * Math.atan(camera.width_px / 2 / focal) * 180 / Math.PI;
  return [
    `${view.name}: source to detector`,
    (arm ? millimetres(arm.source_to_detector_mm) : `${Dom.number(focal)} times the size of a pixel`) +
        `; the image opens ${degrees(opening)}`
  ];
}

// Numbers that reveal a mistake: [[what, figure]].
function figuresOf(views) {
  const rows = [...views.map(distanceOf), ...anglesOf(views)];
  const met = views.length > 1 && meeting(views.map((one) => one.camera));
  if (!met) return rows;
  rows.push([
    'Central rays meet at',
    `(${met.world_mm.map(XrayFrame.tenths).join(', ')}) mm in the world; they pass each other at ` +
        millimetres(met.distance_mm)
  ]);
  for (const {view, camera} of views)
    rows.push(
        [`${view.name}: source to that point`, millimetres(length(minus(centralRay(camera).origin, met.world_mm)))]);
  return rows;
}

// Asks marrow to check the cameras when views and landmarks no longer change. Calls told({warnings, command}),
// told({warnings, fault}), or told(null) if there is no view.
function checking(draft, told) {
  const ask =
      Ask.whenStill('api/xray/check', CHECK_PAUSE_ms, (answer, fault) => told(fault ? {fault, warnings: []} : answer));
  return (views) => {
    const landmarks = (draft.document.landmarks || []).map(({name, pixels}) => {
      const known = Object.entries(pixels || {}).filter(([view]) => views.some((one) => one.view.name === view));
      return {name, pixels: Object.fromEntries(known)};
    });
    ask({views: views.map(({view: {name, image, camera}}) => ({name, image, camera})), landmarks}, views.length > 0);
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

function makeCheck(draft) {
  const figures = el('table', {class: 'values', 'data-figures': ''});
  const size = el('p', {class: 'fault', role: 'status', 'data-pixel-size': ''});
  const check = el('div', {role: 'status', 'data-check': ''});
  const ask = checking(draft, (answer) => {
    check.replaceChildren(...checkText(answer));
    const count = answer ? answer.warnings.length + (answer.fault ? 1 : 0) : 0;
    draft.check = answer && {lacks: count ? `${count} ${count === 1 ? 'doubt' : 'doubts'}` : ''};
    draft.dispatchEvent(new Event('steps'));
  });
  let shown = '';
  const update = (views, entries) => {
    const known = views.map((view, i) => ({view, camera: entries[i].camera})).filter((one) => one.camera);
    const now = JSON.stringify(known);
    if (now !== shown)
      figures.replaceChildren(el('tbody', {}, figuresOf(known).map(([what, figure]) => Dom.row(what, [figure]))));
    shown = now;
    size.textContent = advice(known, draft.document.landmarks || []);
    if (entries.every((one) => one.is_ready)) ask(known);
  };
  return {element: el('div', {class: 'xray-check'}, figures, size, check), update};
}

function cameraText(view) {
  const camera = view.camera || {};
  if (camera.file) return XrayAdd.cameraInWords(camera);
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
  const check = makeCheck(draft);
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
