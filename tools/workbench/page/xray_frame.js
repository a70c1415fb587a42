// SPDX-License-Identifier: Apache-2.0
// One X-ray on the screen: zooming, moving and windowing. The tool does everything else.
import {el, svg} from '../../report/page/dom.js';

import * as Viewport from './viewport.js';
import {pinched} from './viewport.js';
import * as XrayPicture from './xray_picture.js';

// tool() returns the present tool: {press(frame, pixel, event), arrow(frame, step), key(frame, name), marks(frame),
// says(frame, pixel)}. says() gives the hint at the pointer.
// press() returns {move(pixel), end(pixel), cancel()}, or nothing: then the pointer moves the image.
export function make(name, tool) {
  const canvas = el('canvas', {role: 'img', 'aria-label': 'X-ray ' + name});
  const overlay = svg('svg', {class: 'xray-marks', 'aria-hidden': 'true'});
  const hint = el('span', {class: 'cursor-hint', 'aria-hidden': 'true', hidden: true});
  const box =
      el('div', {
        class: 'xray-box',
        tabindex: 0,
        role: 'application',
        'data-view': name,
        'aria-label': 'X-ray ' + name + '. Plus and minus zoom, W and L change window and level, arrows move.'
      },
         canvas, overlay, hint);
  const value = el('span', {class: 'xray-value', 'data-value-of': name}, '');
  const frame = {
    name,
    box,
    hint,
    overlay,
    value,
    entry: null,
    port: null,
    window: null,
    pointer: null,
    mask: null,
    element: null
  };

  // A new image gets its own window; an image of the same size keeps its place. The old one stays until the new one has
  // arrived.
  frame.show = (entry) => {
    frame.wanted = entry;
    if (frame.is_visible) XrayPicture.hurry(entry);
    if (frame.entry !== entry && entry.is_ready) {
      const same = (what) => JSON.stringify(entry[what]) === JSON.stringify((frame.entry || {})[what]);
      if (!same('width_px') || !same('height_px')) frame.port = null;
      if (!same('ranges')) frame.window = entry.ranges && XrayPicture.windowOf(entry.ranges);
      Object.assign(frame, {entry, picture: null});
    }
    frame.draw();
  };
  frame.relook = () => {
    if (!frame.entry || !frame.entry.numbers) return;
    Object.assign(frame, {window: XrayPicture.windowOf(frame.entry.ranges), picture: null});
    frame.draw();
  };
  frame.fit = () => {
    if (!entryIsShown(frame)) return;
    const {flip_u, flip_v} = frame.port || {flip_u: false, flip_v: false};
    frame.port = {...Viewport.fitted(frame.entry.width_px, frame.entry.height_px, ...sizeOf(box)), flip_u, flip_v};
    frame.draw();
  };
  frame.change = (next) => {
    frame.port = next;
    frame.draw();
  };
  frame.setWindow = (low, high) => {
    frame.window = [low, Math.max(low + 1, high)];
    frame.picture = null;
    frame.draw();
  };
  let is_waiting = false;
  frame.draw = () => {
    if (is_waiting || !frame.is_visible) return;
    is_waiting = true;
    requestAnimationFrame(() => {
      is_waiting = false;
      if (!frame.port) frame.fit();
      draw(frame, canvas, tool);
    });
  };
  frame.place = (event) => {
    const {left, top} = box.getBoundingClientRect();
    return [event.clientX - left - box.clientLeft, event.clientY - top - box.clientTop];
  };
  listen(frame, tool);
  const watcher = new ResizeObserver(() => {
    if (frame.port && box.clientWidth) frame.port = Viewport.resized(frame.port, ...sizeOf(box));
    frame.draw();
  });
  watcher.observe(box);
  const sight = new IntersectionObserver(([{isIntersecting}]) => {
    frame.is_visible = isIntersecting;
    if (!isIntersecting) return;
    if (frame.wanted) XrayPicture.hurry(frame.wanted);
    frame.draw();
  });
  sight.observe(box);
  frame.dispose = () => {
    watcher.disconnect();
    sight.disconnect();
  };
  return frame;
}

// In parts of a CSS pixel; clientWidth is rounded, and a click would be half a pixel off.
function sizeOf(box) {
  const {width, height} = box.getBoundingClientRect();
  return [width, height];
}

const entryIsShown = ({entry, box}) => entry && entry.numbers && box.clientWidth > 0;

function draw(frame, canvas, tool) {
  const {box, entry} = frame, dots = window.devicePixelRatio || 1;
  const [width, height] = sizeOf(box);
  canvas.width = Math.round(width * dots);
  canvas.height = Math.round(height * dots);
  frame.overlay.setAttribute('viewBox', `0 0 ${width} ${height}`);
  frame.overlay.replaceChildren();
  if (!entry || !entry.numbers || !frame.port) return;
  frame.picture = frame.picture || XrayPicture.painted(entry, frame.window, XrayPicture.greyCurve(entry.ranges));
  const pen = canvas.getContext('2d');
  pen.setTransform(...Viewport.canvasTransform(frame.port, canvas.width / width));
  pen.imageSmoothingEnabled = frame.port.zoom < 3;
  pen.drawImage(frame.picture, 0, 0);
  pen.imageSmoothingEnabled = false;  // a pixel is masked or not
  if (frame.mask) pen.drawImage(frame.mask, 0, 0);
  canvas.dataset.shown = entry.width_px;
  frame.overlay.append(...tool().marks(frame).filter(Boolean));
}

// Shows -0 as 0.
export const tenths = (value) => value.toFixed(1).replace(/^-0\.0$/, '0.0');

function tell(frame, pixel) {
  const grey = XrayPicture.valueAt(frame.entry, pixel);
  frame.value.textContent = grey === null ?
      '' :
      `(${tenths(pixel[0])}, ${tenths(pixel[1])}) px: ` + (frame.entry.scale === 1 ? grey : grey.toPrecision(5));
}

// One pointer uses the tool or moves the image. Two pointers on a touch screen zoom and move it.
function listen(frame, tool) {
  const {box} = frame, pointers = new Map();
  let doing = null, last = null;
  const stop = (how, pixel) => {
    if (doing && doing[how]) doing[how](pixel);
    doing = null;
  };
  box.addEventListener('pointerdown', (event) => {
    if (!frame.port) return;
    box.focus({preventScroll: true});
    box.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, frame.place(event));
    last = frame.place(event);
    if (pointers.size > 1) return stop('cancel');
    const pixel = Viewport.toPixel(frame.port, last);
    if (event.button === 0) doing = tool().press(frame, pixel, event) || panning(frame);
    if (event.button === 1 || event.button === 2) doing = panning(frame);
    event.preventDefault();
  });
  box.addEventListener('pointermove', (event) => {
    if (!frame.port) return;
    const place = frame.place(event), pixel = Viewport.toPixel(frame.port, place);
    if (pointers.size === 2 && pointers.has(event.pointerId)) return pinch(frame, pointers, event.pointerId, place);
    frame.pointer = pixel;
    tell(frame, pixel);
    Viewport.hint(frame.hint, event.pointerType === 'mouse' && tool().says ? tool().says(frame, pixel) : '', place);
    if (doing && pointers.has(event.pointerId)) doing.move(pixel, place, last);
    last = place;
    frame.draw();
  });
  const up = (how) => (event) => {
    if (!pointers.delete(event.pointerId)) return;
    stop(how, Viewport.toPixel(frame.port, frame.place(event)));
  };
  box.addEventListener('pointerup', up('end'));
  box.addEventListener('pointercancel', up('cancel'));
  box.addEventListener('pointerleave', () => {
    frame.pointer = null;
    frame.hint.hidden = true;
    frame.value.textContent = '';
    frame.draw();
  });
  box.addEventListener('contextmenu', (event) => event.preventDefault());
  box.addEventListener('wheel', (event) => {
    if (!frame.port) return;
    event.preventDefault();
    frame.change(Viewport.zoomed(frame.port, Math.exp(-event.deltaY / 400), frame.place(event)));
  }, {passive: false});
  box.addEventListener('keydown', (event) => {
    if (pressed(frame, tool(), event)) {
      event.preventDefault();
      event.stopPropagation();
    }
  });
}

const panning = (frame) => ({
  move: (pixel, place, last) => frame.change(Viewport.panned(frame.port, [place[0] - last[0], place[1] - last[1]]))
});

function pinch(frame, pointers, moved, place) {
  const {factor, around, by} = pinched(pointers, moved, place);
  frame.change(Viewport.panned(Viewport.zoomed(frame.port, factor, around), by));
}

const ARROWS = Object.freeze({ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]});

// Whether the key has a meaning here.
function pressed(frame, tool, event) {
  if (!frame.port || event.ctrlKey || event.metaKey) return false;
  const middle = frame.port.frame.map((side) => side / 2), [low, high] = frame.window, part = (high - low) / 20;
  const arrow = ARROWS[event.key];
  if (arrow) {
    const step = event.shiftKey ? 10 : event.altKey ? 0.1 : 1;
    // An arrow to the right moves to the right on the screen, also in a mirrored image.
    const turn = [frame.port.flip_u ? -1 : 1, frame.port.flip_v ? -1 : 1];
    if (tool.arrow && tool.arrow(frame, arrow.map((one, i) => one * step * turn[i]))) return true;
    frame.change(Viewport.panned(frame.port, arrow.map((one) => -40 * one)));
    return true;
  }
  if (event.altKey) return false;
  const actions = {
    '+': () => frame.change(Viewport.zoomed(frame.port, 1.25, middle)),
    '-': () => frame.change(Viewport.zoomed(frame.port, 0.8, middle)),
    '0': () => frame.fit(),
    w: () => frame.setWindow(low + part, high - part),
    W: () => frame.setWindow(low - part, high + part),
    l: () => frame.setWindow(low + part, high + part),
    L: () => frame.setWindow(low - part, high - part),
    m: () => frame.change({...frame.port, flip_u: !frame.port.flip_u}),
    M: () => frame.change({...frame.port, flip_v: !frame.port.flip_v})
  };
  if (actions[event.key]) {
    actions[event.key]();
    return true;
  }
  return Boolean(tool.key && tool.key(frame, event.key));
}

export const KEYS = [
  ['+ or -', 'in an X-ray: zoom'], ['0', 'in an X-ray: the whole image'],
  ['w or W', 'in an X-ray: narrower or wider window'], ['l or L', 'in an X-ray: window up or down, darker or brighter'],
  ['m or M', 'in an X-ray: show it mirrored, left to right or top to bottom'],
  ['Arrows', 'in an X-ray: move the landmark, the brush or the image; Shift: 10 px, Alt: 0.1 px']
];
