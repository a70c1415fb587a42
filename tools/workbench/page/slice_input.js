// SPDX-License-Identifier: Apache-2.0
// Mouse, touch and keys in a slice.
import * as SliceGeometry from './slice_geometry.js';
import {pinched} from './viewport.js';

const placeOf = (view, event) => {
  const box = view.canvas.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
};

// The action of a drag with a mouse button. `moved` gets the way since its last call.
function begin(view, event) {
  const {state} = view, place = placeOf(view, event), mark = event.button === 0 && view.markAt(place);
  if (event.button === 2) {
    return {moved: (dx, dy) => state.setWindow(state.window.level + 2 * dy, state.window.width * Math.exp(0.006 * dx))};
  }
  if (event.button === 1 || event.shiftKey) return {moved: (dx, dy) => view.pan(dx, dy)};
  if (mark) return moveMark(view, mark);
  if (state.tool) return {moved() {}, clicked: (at) => state.tool.place(pointAt(view, at))};
  const follow = (at) => state.moveCursor(view.at(at).index);
  follow(place);
  return {moved: (dx, dy, at) => follow(at)};
}

const pointAt = (view, place) => SliceGeometry.point(view.state.ct, view.at(place).index);

// A mark follows the pointer. The case changes once, on release.
function moveMark(view, mark) {
  let to = null;
  const moving = () => (to ? [{...mark, point_mm: to}] : []);
  return {
    cancelled() {
      view.state.marks.delete('moving');
      view.state.tell('view');
    },
    moved(dx, dy, at) {
      to = pointAt(view, at);
      view.state.marks.set('moving', moving);
      view.state.tell('view');
    },
    ended() {
      view.state.marks.delete('moving');
      view.state.selected = mark.key;
      if (to && SliceGeometry.isInside(view.state.ct, SliceGeometry.index(view.state.ct, to))) mark.moveTo(to);
      view.state.goTo(to || mark.point_mm);
    }
  };
}

// Two fingers zoom and move the picture.
function pinch(view, moved, place) {
  const {factor, around, by} = pinched(view.pointers, moved, place);
  view.zoom(factor, around);
  view.pan(...by);
}

function listenPointer(view) {
  const {canvas} = view;
  view.pointers = new Map();
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  canvas.addEventListener('pointerdown', (event) => {
    if (!view.state.ct) return;
    view.pointers.set(event.pointerId, placeOf(view, event));
    if (view.pointers.size > 1) {  // what the first finger began ends here
      if (view.drag && view.drag.cancelled) view.drag.cancelled();
      view.drag = null;
    }
    if (view.drag || view.pointers.size > 1) return;
    if (event.button === 1) event.preventDefault();  // no scrolling by the wheel's button
    canvas.focus({preventScroll: true});
    canvas.setPointerCapture(event.pointerId);
    const place = placeOf(view, event);
    view.drag = {...begin(view, event), pointer: event.pointerId, last: place, start: place, isFar: false};
  });
  canvas.addEventListener('pointermove', (event) => {
    const place = placeOf(view, event), {drag} = view;
    if (view.pointers.size === 2 && view.pointers.has(event.pointerId)) return pinch(view, event.pointerId, place);
    if (drag && drag.pointer === event.pointerId) {
      if (Math.hypot(place[0] - drag.start[0], place[1] - drag.start[1]) > 3) drag.isFar = true;
      if (drag.isFar) {
        drag.moved(place[0] - drag.last[0], place[1] - drag.last[1], place);
        drag.last = place;
      }
    }
    view.under = event.pointerType === 'mouse' ? place : null;
    if (!view.state.ct || !view.view) return;
    const there = view.at(place);
    view.state.pointed({view, ...there});
    if (view.under) view.tell(place, there.value_hu);
  });
  const end = (event) => {
    const {drag} = view;
    view.pointers.delete(event.pointerId);
    if (!drag || drag.pointer !== event.pointerId) return;
    view.drag = null;
    if (drag.ended) drag.ended();
    if (event.type === 'pointerup' && !drag.isFar && drag.clicked) drag.clicked(placeOf(view, event));
  };
  canvas.addEventListener('pointerup', end);
  canvas.addEventListener('pointercancel', end);
  canvas.addEventListener('pointerleave', () => {
    view.state.pointed(null);
    view.under = null;
    view.hint.hidden = true;
  });
}

// The wheel scrolls the page until a slice has been clicked.
function listenWheel(view) {
  let turned = 0;
  view.canvas.addEventListener('wheel', (event) => {
    if (document.activeElement !== view.canvas || !view.state.ct) return;
    event.preventDefault();
    if (event.ctrlKey) return view.zoom(Math.exp(-0.002 * event.deltaY), placeOf(view, event));
    turned += event.deltaMode ? 60 * event.deltaY : event.deltaY;
    const slices = Math.trunc(turned / 60);  // a notch of a mouse wheel is 100 to 120; a touch pad gives smaller values
    turned -= 60 * slices;
    if (slices) view.goToSlice(view.wanted + Math.sign(slices) * Math.ceil(Math.abs(slices) / 2));
  }, {passive: false});
}

function listenKeys(view) {
  view.canvas.addEventListener('keydown', (event) => {
    if (!view.state.ct || event.ctrlKey || event.metaKey || event.altKey) return;
    const action = actionOf(view, event);
    if (!action) return;
    event.preventDefault();
    event.stopPropagation();
    action();
  });
}

function actionOf(view, {key, shiftKey}) {
  const {state} = view, {level, width} = state.window, middle = view.placeOf(state.cursor_mm);
  const step = (direction, count) => () => {
    const index = state.cursorIndex();
    index[direction.axis] += count * direction.sign;
    state.moveCursor(index);
  };
  const through = {axis: view.plane.across, sign: 1}, arrow = {
    ArrowLeft: [view.plane.right, -1],
    ArrowRight: [view.plane.right, 1],
    ArrowUp: [view.plane.down, -1],
    ArrowDown: [view.plane.down, 1],
    PageUp: [through, shiftKey ? 10 : 1],
    PageDown: [through, shiftKey ? -10 : -1]
  }[key];
  const pans = {ArrowLeft: [20, 0], ArrowRight: [-20, 0], ArrowUp: [0, 20], ArrowDown: [0, -20]}[key];
  if (pans && shiftKey) return () => view.pan(...pans);
  if (arrow) return step(...arrow);
  return {
    '+': () => view.zoom(1.25, middle),
    '=': () => view.zoom(1.25, middle),
    '-': () => view.zoom(0.8, middle),
    '0': () => view.fit(),
    'b': () => state.setWindow(level - 0.05 * width, width),
    'd': () => state.setWindow(level + 0.05 * width, width),
    'w': () => state.setWindow(level, 1.1 * width),
    'n': () => state.setWindow(level, width / 1.1),
    'Enter': () => state.tool && state.tool.place([...state.cursor_mm]),
    'Delete': () => removeNearest(view)
  }[key];
}

// The mark at the crosshair.
function removeNearest(view) {
  const mark = view.markAt(view.placeOf(view.state.cursor_mm));
  if (mark) mark.remove();
}

export function listen(view) {
  listenPointer(view);
  listenWheel(view);
  listenKeys(view);
}

export const KEYS = [
  ['Arrow keys', 'in a slice: move the crosshair by a voxel; with Shift: move the picture'],
  ['Page Up, Page Down', 'in a slice: to the next one; with Shift: ten further'],
  ['+ - 0', 'in a slice: closer, further, whole'], ['b d', 'in a slice: brighter, darker'],
  ['w n', 'in a slice: wider window, narrower window'],
  ['Enter', 'in a slice: put the chosen kind of point at the crosshair'],
  ['Delete', 'in a slice: remove the point at the crosshair']
];
