// SPDX-License-Identifier: Apache-2.0
// The panel "X-rays" of the page "Case": the views side by side, the tools that work on them, and the landmarks.
import * as Dom from '../../report/page/dom.js';
import {el} from '../../report/page/dom.js';

import * as CasePage from './case.js';
import * as Ask from './server.js';
import * as Viewport from './viewport.js';
import * as XrayAdd from './xray_add.js';
import * as XrayExchange from './xray_export.js';
import * as XrayFrame from './xray_frame.js';
import * as XrayLandmarks from './xray_landmarks.js';
import * as XrayMasks from './xray_masks.js';
import * as XrayImages from './xray_picture.js';

const FIT_PAUSE_ms = 400;

// What the parts of the panel share.
function bench(draft) {
  const shared = {draft, frames: new Map(), chosen: null, live: null, fit: null, fit_fault: '', tool: 'look'};
  let fragment = null;
  shared.views = () => draft.document.views || [];
  shared.entryOf = (name) => {
    const view = shared.views().find((one) => one.name === name);
    return view && XrayImages.of(view);
  };
  shared.cameraOf = (name) => {
    const entry = shared.entryOf(name);
    return entry && entry.camera;
  };
  shared.choose = (name) => {
    shared.chosen = name;
    shared.refresh();
  };
  shared.fragment = () => {
    const names = Object.keys(draft.document.fragments || {});
    return names.includes(fragment) ? fragment : names[0] || 'bone';
  };
  shared.chooseFragment = (name) => {
    fragment = name;
    shared.refit();
  };
  return shared;
}

// A tool has press(frame, pixel, event), arrow(frame, step), key(frame, name) and says(frame, pixel), each optional.
const LOOK = {};
const windowing = () => ({
  says: () => 'drag: contrast and brightness',
  press(frame) {
    const [low, high] = frame.window, width = high - low, middle = (low + high) / 2;
    let begin = null;
    return {
      move(pixel, place) {
        begin = begin || place;
        const next = width * Math.exp((place[0] - begin[0]) / 200);
        const level = middle + width * (place[1] - begin[1]) / 300;
        frame.setWindow(level - next / 2, level + next / 2);
      }
    };
  }
});

function toolbar(shared, tools) {
  const options = [
    ['look', 'Move'], ['window', 'Window'], ['landmark', 'Landmark'], ['brush', 'Mask'], ['rectangle', 'Mask box'],
    ['eraser', 'Erase']
  ];
  const choice = Dom.choice('Tool', options, shared.tool, (name) => {
    shared.tool = name;
    shared.refresh();
  });
  const size = el('input', {
    type: 'range',
    min: 1,
    max: 200,
    value: shared.brush_px,
    'data-do': 'brush-size',
    oninput: () => {
      shared.brush_px = Number(size.value);
      number.textContent = size.value + ' px';
      shared.refresh();
    }
  });
  const number = el('span', {class: 'note'}, size.value + ' px');
  const brush = Dom.labelled('Brush', el('span', {class: 'with-number'}, size, number));
  const look = XrayImages.control(() => shared.frames.forEach((frame) => frame.relook()));
  const all = Dom.button('Whole', () => shared.frames.forEach((frame) => frame.fit()), {'data-do': 'fit'});
  const update = () => {
    brush.hidden = !['brush', 'eraser'].includes(shared.tool);
    choice.querySelector('[role="group"]').choose(shared.tool);
  };
  return {element: el('div', {class: 'toolbar'}, choice, brush, all, look), update};
}

// A view in the row of X-rays, with its name, its fault, and the value under the pointer.
function figure(shared, view, tool) {
  const frame = XrayFrame.make(view.name, tool);
  const fault = el('p', {class: 'fault', role: 'alert', hidden: true});
  const wait = el('p', {class: 'note'}, 'The image is being read …');
  frame.element =
      el('figure', {class: 'xray', 'data-xray': view.name},
         el('figcaption', {}, el('span', {}, view.name), frame.value), fault, wait, frame.box);
  frame.update = (next) => {
    const entry = XrayImages.of(next, shared.refresh);
    wait.hidden = entry.is_ready || Boolean(frame.entry);
    fault.hidden = !entry.fault;
    fault.textContent = entry.fault || '';
    frame.box.hidden = entry.is_ready && !entry.numbers;
    frame.show(entry);
  };
  return frame;
}

function row(shared, tool) {
  const place = el('div', {class: 'xray-row'});
  const empty = el(
      'div', {class: 'empty-stage'}, el('p', {}, 'The X-rays are shown here.'),
      Dom.button('Add an X-ray …', () => XrayAdd.add(shared.draft), {'data-do': 'add-first-view', class: 'primary'}));
  const aspect = () => {
    const entry = [...shared.frames.values()].map((frame) => frame.entry).find((one) => one && one.numbers);
    return entry ? entry.width_px / entry.height_px : 1;
  };
  const tiles = Viewport.arranged(place, aspect);
  const update = () => {
    const views = shared.views(), names = views.map((one) => one.name);
    if ([...shared.frames.keys()].join('\n') !== names.join('\n')) {
      for (const [name, frame] of shared.frames)
        if (!names.includes(name)) {
          frame.dispose();
          shared.frames.delete(name);
        }
      const kept =
          new Map(views.map((view) => [view.name, shared.frames.get(view.name) || figure(shared, view, tool)]));
      shared.frames.clear();
      kept.forEach((frame, name) => shared.frames.set(name, frame));
      place.replaceChildren(...[...shared.frames.values()].map((frame) => frame.element));
    }
    for (const view of views) shared.frames.get(view.name).update(view);
    empty.hidden = views.length > 0;
    place.hidden = !views.length;
    tiles.update();
  };
  return {elements: [empty, place], update, dispose: tiles.dispose};
}

// Requests the pose from the landmarks when they no longer change.
function fitting(shared, told) {
  const ask = Ask.whenStill('api/xray/fit', FIT_PAUSE_ms, (fit, fit_fault) => {
    Object.assign(shared, {fit, fit_fault});
    told();
  });
  return () => {
    const fragment = shared.fragment();
    const landmarks = (shared.draft.document.landmarks ||
                       []).filter((one) => one.model_mm && (!one.fragment || one.fragment === fragment));
    const views =
        shared.views()
            .filter((view) => shared.cameraOf(view.name))
            .map(({name, image, camera}) => ({name, image, camera, width_px: shared.cameraOf(name).width_px}));
    const are_seen = landmarks.some((one) => Object.keys(one.pixels || {}).length);
    ask({fragment, landmarks, views}, landmarks.length >= 3 && views.length > 0 && are_seen);
  };
}

function make(draft) {
  const shared = bench(draft);
  shared.brush_px = 20;
  const masks = XrayMasks.make(shared);
  const tools = {look: LOOK, window: windowing(), landmark: XrayLandmarks.tool(shared), ...masks.tools};
  const none = {press: () => null};
  const tool = () => ({
    ...none,
    ...tools[shared.tool],
    marks: (frame) => [...XrayLandmarks.marks(shared, frame), ...masks.marks(frame)]
  });
  const bar = toolbar(shared, tools), views = row(shared, tool), table = XrayLandmarks.make(shared);
  const exchange = XrayExchange.make(shared);
  shared.refresh = () => {
    bar.element.hidden = !shared.views().length;
    bar.update();
    views.update();
    masks.update();
    table.update();
    shared.refit();
  };
  shared.refit = fitting(shared, () => {
    shared.refresh();
    table.updateFit();
  });
  return {
    stage: {xrays: el('div', {class: 'xrays'}, bar.element, views.elements)},
    tools: [
      {step: 'check', title: 'Landmarks in the X-rays', element: table.element},
      {step: 'save', title: 'Files of other programs', element: exchange.element}
    ],
    update() {
      shared.refresh();
      table.updateFit();
    },
    dispose() {
      XrayLandmarks.commit(shared);
      views.dispose();
      shared.frames.forEach((frame) => frame.dispose());
    }
  };
}

CasePage.panel('X-rays', 'xrays', 50, make, [...XrayFrame.KEYS, ...XrayLandmarks.KEYS]);
