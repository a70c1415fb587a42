// SPDX-License-Identifier: Apache-2.0
// How the views of a case stand to each other, and what is wrong with their cameras.
import * as Dom from '../../report/page/dom.js';
import {el} from '../../report/page/dom.js';

import * as Geometry from './geometry.js';
import * as Ask from './server.js';
import * as Sight from './sight.js';
import * as XrayFrame from './xray_frame.js';
import * as XrayPixelSize from './xray_pixel_size.js';
import * as XrayTable from './xray_table.js';

const CHECK_PAUSE_ms = 500, MOST_LISTED = 4;

const degrees = (value) => value.toFixed(1) + '°';
const millimetres = (value) => Dom.number(value) + ' mm';

// The angles of all pairs; of many views only the least and the largest.
function anglesOf(views) {
  const pairs = views.flatMap(
      ({view, camera}, i) => views.slice(i + 1).map(
          (other) => [`Between ${view.name} and ${other.view.name}`, Sight.angle_deg(camera, other.camera)]));
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
  const met = views.length > 1 && Sight.meeting(views.map((one) => one.camera));
  if (!met) return rows;
  rows.push([
    'Central rays meet at',
    `(${met.world_mm.map(XrayFrame.tenths).join(', ')}) mm in the world; they pass each other at ` +
        millimetres(met.distance_mm)
  ]);
  for (const {view, camera} of views)
    rows.push([
      `${view.name}: source to that point`,
      millimetres(Geometry.length(Geometry.minus(Sight.centralRay(camera).origin, met.world_mm)))
    ]);
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

export function make(draft) {
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
    size.textContent = XrayPixelSize.advice(known, draft.document.landmarks || []);
    if (entries.every((one) => one.is_ready)) ask(known);
  };
  return {element: el('div', {class: 'xray-check'}, figures, size, check), update};
}
