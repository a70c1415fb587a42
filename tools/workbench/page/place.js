// SPDX-License-Identifier: Apache-2.0
// The page "Place": bones are placed by hand over the X-rays, and registered from there. The case's draft keeps the
// poses as `start`.
import {el} from '../../report/page/dom.js';

import * as Geometry from './geometry.js';
import {PlacedCase} from './place_case.js';
import * as PlaceMotion from './place_controls.js';
import {PlaceControls} from './place_controls.js';
import * as Ask from './server.js';
import * as Shell from './shell.js';

const radians = (angle_deg) => angle_deg * Math.PI / 180;
let page = null;  // the PlacedCase that is shown

const inView = (what, motion) => () => page && page.active && page.byKeys(page.active, what, motion);
const shift = (u, v) =>
    inView('move', ({camera}) => Geometry.shift(Geometry.times(PlaceMotion.direction(camera, [u, v, 0]), page.step)));
const depth = (sign) =>
    inView('move in depth', ({camera, middle}) => PlaceMotion.shiftInDepth(camera, middle, sign * page.step));
const turn = (sign) =>
    inView('turn', ({camera, middle}) => PlaceMotion.turnInView(camera, middle, radians(sign * page.step)));
const roll = (sign) => inView(
    'turn about the long axis of', ({middle, axis}) => PlaceMotion.roll(axis, middle, radians(sign * page.step)));
const tip = (sign) =>
    inView('tip', ({camera, middle, axis}) => PlaceMotion.tip(camera, axis, middle, radians(sign * page.step)));

const inSequence = (action) => page && page.sequence.isOn && action(page.sequence);

function nextView() {
  if (!page || !page.views) return;
  const at = page.views.indexOf(page.active);
  page.views[(at + 1) % page.views.length].canvas.focus();
}
function nextStep(by) {
  if (!page || !page.stepChoice) return;
  const steps = ['0.1', '0.5', '1', '5'];
  const step = steps[Math.max(0, Math.min(3, steps.indexOf(String(page.step)) + by))];
  page.stepChoice.querySelector(`[data-value="${step}"]`).click();
}
function nextZoom() {
  if (!page || !page.zoomChoice) return;
  const now = page.zoomChoice.querySelector('[aria-pressed="true"]').dataset.value;
  page.zoomChoice.querySelector(`[data-value="${{1: 2, 2: 4, 4: 1}[now]}"]`).click();
}
function nextMode() {
  if (!page || !page.modes) return;
  const at = PlaceControls.MODES.findIndex(([mode]) => mode === page.mode);
  page.modes.querySelector(`[data-value="${PlaceControls.MODES[(at + 1) % PlaceControls.MODES.length][0]}"]`).click();
}

Shell.page('place', {
  title: 'Place',
  async show(place, parameters, first) {
    if (!first) return choose(place);
    page = new PlacedCase(first === '.' ? '' : first);
    await page.open(place);
  },
  leave() {
    if (page) page.leave();
    page = null;
  },
  keys: [
    ['ArrowLeft', 'move left in the view', shift(-1, 0)],
    ['ArrowRight', 'move right', shift(1, 0)],
    ['ArrowUp', 'move up', shift(0, -1)],
    ['ArrowDown', 'move down', shift(0, 1)],
    ['q or Q', 'turn left in the view', turn(-1)],
    ['e or E', 'turn right in the view', turn(1)],
    ['a or A', 'turn about the long axis', roll(1)],
    ['d or D', 'turn about it the other way', roll(-1)],
    ['w or W', 'move away from the X-ray source', depth(1)],
    ['s or S', 'move towards it', depth(-1)],
    ['r or R', 'tip the upper end away', tip(1)],
    ['f or F', 'tip it towards the source', tip(-1)],
    ['v', 'the next view', nextView],
    ['m', 'show the bone in the next way', nextMode],
    ['z', 'zoom in to the bone, and out', nextZoom],
    ['[ or ,', 'the previous frame', () => inSequence((sequence) => sequence.step(-1))],
    ['] or .', 'the next frame', () => inSequence((sequence) => sequence.step(1))],
    ['{ or <', 'the previous keyframe', () => inSequence((sequence) => sequence.stepKeyframe(-1))],
    ['} or >', 'the next keyframe', () => inSequence((sequence) => sequence.stepKeyframe(1))],
    ['k', 'make the present pose a keyframe', () => inSequence((sequence) => sequence.set())],
    ['K', 'remove the keyframe', () => inSequence((sequence) => sequence.remove())],
    ['+', 'larger steps', () => nextStep(1)],
    ['-', 'smaller steps', () => nextStep(-1)],
    [
      'Enter', 'register or track from here',
      (event) => page && page.bar && event.target.matches('canvas') && page.fromHere()
    ],
    ['Ctrl+z', 'undo', () => page && page.draft && page.change('undo')],
    ['Ctrl+y or Ctrl+Z', 'redo', () => page && page.draft && page.change('redo')],
    ['drag', 'move in the view; with Shift or the right button: turn; with Alt: turn about the long axis'],
    ['Ctrl+wheel', 'move in depth'],
    ['one finger', 'move'],
    ['two fingers', 'turn']
  ]
});

// Lists the cases in the folder.
async function choose(place) {
  const {cases} = await Ask.json('api/folder');
  place.append(
      el('h1', {}, 'Place'), el('p', {}, 'Choose a case. Its bones are placed over its X-rays by hand.'),
      Shell.links('place', cases.map((path) => path || '.'), 'There is no case yet.'));
}

// For measurements and tests: the case that is shown.
globalThis.marrow = {
  place: () => page
};
