// SPDX-License-Identifier: Apache-2.0
// Masks of X-rays: zero marks pixels that must not be used. Each stroke is one change of the case.
import {svg} from '../../report/page/dom.js';

import * as Geometry from './geometry.js';
import * as Ask from './server.js';
import * as Shell from './shell.js';
import * as Viewport from './viewport.js';
import * as XrayImages from './xray_picture.js';

// A mask has `used`, a byte for each pixel, 0 or 255, and `picture`, a canvas that shows the unused pixels.
function blank(width_px, height_px, used) {
  const picture = document.createElement('canvas');
  picture.width = width_px;
  picture.height = height_px;
  const mask = {width_px, height_px, used: used || new Uint8Array(width_px * height_px).fill(255), picture};
  if (used) show(mask, 0, 0, width_px, height_px);
  return mask;
}

// Paints the part of the picture with these corners again.
function show({width_px, used, picture}, left, top, right, bottom) {
  if (right <= left || bottom <= top) return;
  const part = new ImageData(right - left, bottom - top), dots = new Uint32Array(part.data.buffer);
  for (let row = top, i = 0; row < bottom; ++row)
    for (let column = left; column < right; ++column, ++i) dots[i] = used[row * width_px + column] ? 0 : 0x800055ff;
  picture.getContext('2d').putImageData(part, left, top);
}

// Sets all pixels with is_inside(u, v) whose centres are in the box of `a` and `b`, widened by `grow`.
function fill(mask, a, b, grow, value, is_inside) {
  const {width_px, height_px, used} = mask;
  const low = [0, 1].map((i) => Math.max(0, Math.ceil(Math.min(a[i], b[i]) - grow)));
  const high = [0, 1].map((i) => Math.min([width_px, height_px][i] - 1, Math.floor(Math.max(a[i], b[i]) + grow)));
  for (let v = low[1]; v <= high[1]; ++v)
    for (let u = low[0]; u <= high[0]; ++u)
      if (is_inside(u, v)) used[v * width_px + u] = value;
  show(mask, low[0], low[1], high[0] + 1, high[1] + 1);
}

// All pixels within `radius` of the line from a to b.
function stroke(mask, a, b, radius, value) {
  const along = Geometry.minus(b, a), square = Geometry.dot(along, along);
  fill(mask, a, b, radius, value, (u, v) => {
    const share = square ? Math.max(0, Math.min(1, ((u - a[0]) * along[0] + (v - a[1]) * along[1]) / square)) : 0;
    return Math.hypot(u - a[0] - share * along[0], v - a[1] - share * along[1]) <= radius;
  });
}

// How many pixels are used, then not used, and so on, row after row.
function runsOf(used) {
  const runs = [];
  let value = 255, length = 0;
  for (const one of used) {
    if ((one !== 0) !== (value !== 0)) {
      runs.push(length);
      [value, length] = [one, 0];
    }
    ++length;
  }
  return [...runs, length];
}

export function make(shared) {
  const known = new Map();  // by what keyOf() gives
  let working = null;       // {view, mask, what} while a stroke is being made or kept

  // The data with which the server converts between the file of a mask and the mask of the shown image. Without a
  // usable camera, the image is shown as it is in its file.
  const sourceOf = (view) => ({image: view.image, camera: XrayImages.of(view).fault ? null : view.camera || null});
  const keyOf = (view) => JSON.stringify([view.mask, view.image, view.camera || null]);

  async function read(view) {
    await XrayImages.of(view).reading;
    const {bytes, about} = await Ask.postForBytes('api/xray/shown-mask', {mask: view.mask, ...sourceOf(view)});
    known.set(keyOf(view), blank(about.width_px, about.height_px, new Uint8Array(bytes)));
    shared.refresh();
  }
  function ofView(view) {
    if (!view.mask) return null;
    if (!known.has(keyOf(view))) {
      known.set(keyOf(view), null);
      read(view).catch((error) => Shell.notice(`${view.mask}: ${error.message}`, 'fault'));
    }
    return known.get(keyOf(view));
  }

  function begin(frame) {
    if (working && working.view === frame.name) return working.mask;
    if (working) keep();
    const view = shared.views().find((one) => one.name === frame.name), old = ofView(view);
    if (view.mask && !old) return null;  // it is still being read
    if (old && (old.width_px !== frame.entry.width_px || old.height_px !== frame.entry.height_px)) {
      Shell.notice(
          `${view.mask} has ${old.width_px} x ${old.height_px} pixels, but the image has ${frame.entry.width_px} x ` +
              `${frame.entry.height_px}; remove the mask first`,
          'fault');
      return null;
    }
    const mask = blank(frame.entry.width_px, frame.entry.height_px, old && old.used.slice());
    working = {view: frame.name, mask};
    frame.mask = mask.picture;
    return mask;
  }

  // Writes the stroke to a file, and enters the file into the draft.
  async function keep() {
    const done = working;
    if (!done) return;
    const {view, mask} = done, shown = shared.views().find((one) => one.name === view);
    await Shell.guarded(async () => {
      const body = {width_px: mask.width_px, height_px: mask.height_px, runs: runsOf(mask.used), ...sourceOf(shown)};
      const {mask: path} = await Ask.post('api/xray/mask', body);
      const next = {...shown, mask: path};
      if (path && XrayImages.of(shown).is_straightened)
        await read(next);  // pixels that share a pixel of the image's file were painted together
      else
        known.set(keyOf(next), mask);
      await shared.draft.change(`paint the mask of ${view}`, (document) => {
        const one = document.views.find((other) => other.name === view);
        if (path)
          one.mask = path;
        else
          delete one.mask;
      });
    });
    if (working === done) working = null;
    shared.refresh();
  }
  function cancel() {
    working = null;
    shared.refresh();
  }

  const radius = () => shared.brush_px / 2;
  // A round brush. By the keyboard, Enter puts it down and lifts it.
  function brush(value) {
    const paint = (frame, a, b) => {
      const mask = begin(frame);
      if (mask) stroke(mask, a, b, radius(), value);
      frame.draw();
    };
    return {
      says: () => (value ? 'drag to erase the mask' : 'drag over what must not be used'),
      press(frame, pixel) {
        let last = pixel;
        paint(frame, pixel, pixel);
        return {
          move(next) {
            paint(frame, last, next);
            last = next;
          },
          end: keep,
          cancel
        };
      },
      arrow(frame, step) {
        const before = cursorOf(frame);
        frame.cursor = Geometry.plus(before, step);
        if (frame.is_down) paint(frame, before, frame.cursor);
        frame.draw();
        return true;
      },
      key(frame, name) {
        if (name === 'Escape' && frame.is_down) {
          frame.is_down = false;
          cancel();
          return true;
        }
        if (name !== 'Enter') return false;
        frame.cursor = cursorOf(frame);
        frame.is_down = !frame.is_down;
        if (frame.is_down)
          paint(frame, frame.cursor, frame.cursor);
        else
          keep();
        return true;
      }
    };
  }
  const cursorOf = (frame) =>
      frame.cursor || Viewport.toPixel(frame.port, frame.port.frame.map((side) => side / 2)).map(Math.round);

  // By the keyboard, Enter sets one corner and then the other.
  const rectangle = {
    says: () => 'drag a box over what must not be used',
    press(frame, pixel) {
      frame.corner = pixel;
      return {
        move(next) {
          frame.other = next;
        },
        end(next) {
          box(frame, next);
        },
        cancel() {
          frame.corner = frame.other = null;
        }
      };
    },
    arrow(frame, step) {
      frame.cursor = Geometry.plus(cursorOf(frame), step);
      if (frame.corner) frame.other = frame.cursor;
      frame.draw();
      return true;
    },
    key(frame, name) {
      if (name === 'Escape' && frame.corner) {
        frame.corner = frame.other = null;
        frame.draw();
        return true;
      }
      if (name !== 'Enter') return false;
      frame.cursor = cursorOf(frame);
      if (frame.corner)
        box(frame, frame.cursor);
      else
        frame.corner = frame.cursor;
      frame.draw();
      return true;
    }
  };
  function box(frame, other) {
    const corner = frame.corner;
    frame.corner = frame.other = null;
    const mask = begin(frame);
    if (!mask) return;
    fill(mask, corner, other, 0, 0, () => true);
    keep();
  }

  const is_painting = () => ['brush', 'eraser', 'rectangle'].includes(shared.tool);
  function marks(frame) {
    if (!is_painting()) return [];
    const at = frame.cursor || frame.pointer, shapes = [];
    if (at && shared.tool !== 'rectangle') {
      const [cx, cy] = Viewport.toScreen(frame.port, at);
      shapes.push(svg('circle', {class: 'brush', cx, cy, r: radius() * frame.port.zoom}));
    }
    if (frame.corner && frame.other) {
      const [a, b] = [frame.corner, frame.other].map((one) => Viewport.toScreen(frame.port, one));
      shapes.push(svg('rect', {
        class: 'brush',
        x: Math.min(a[0], b[0]),
        y: Math.min(a[1], b[1]),
        width: Math.abs(a[0] - b[0]),
        height: Math.abs(a[1] - b[1])
      }));
    }
    return shapes;
  }

  function update() {
    for (const view of shared.views()) {
      const frame = shared.frames.get(view.name);
      if (!frame || (working && working.view === view.name)) continue;
      const mask = ofView(view);
      frame.mask = mask && mask.picture;
      frame.draw();
    }
  }
  return {tools: {brush: brush(0), eraser: brush(255), rectangle}, marks, update};
}
