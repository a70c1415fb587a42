// SPDX-License-Identifier: Apache-2.0
// One X-ray view of the page "Place": requests the bones at their newest poses, paints them, and reports the pointer's
// actions.
import {el} from '../../report/page/dom.js';

import * as Ask from './server.js';
import * as XrayPicture from './xray_picture.js';

// Paints bones over an X-ray image. Layers come from the server: {bone, u_px, v_px, step_px, columns, rows, bytes}, or
// {bone, points: Float32Array of u, v} for an outline.
class PlacePaint {
  // A pixel of the canvas is a square of `step_px` pixels of the X-ray.
  constructor(canvas, width, height, step_px) {
    Object.assign(this, {canvas, width, height, step_px, layers: new Map(), last: null});
    canvas.width = width;
    canvas.height = height;
    this.context = canvas.getContext('2d', {alpha: false});
    this.image = this.context.createImageData(width, height);
    this.out = new Uint32Array(this.image.data.buffer);
    this.show(new Uint8Array(width * height));
  }

  // An image of this size in 8 bit.
  show(grey) {
    this.grey = grey;
    this.base = this.base || new Uint32Array(grey.length);
    for (let i = 0; i < grey.length; ++i) this.base[i] = 0xff000000 | grey[i] * 0x010101;
  }

  static greyColour(value) {
    return (0xff000000 | value << 16 | value << 8 | value) >>> 0;
  }

  // Columns and rows of the canvas that a layer covers, the ends left out.
  covered(layer) {
    const middle = (this.step_px - 1) / 2, at = (value) => (value - middle) / this.step_px;
    const half = layer.step_px / this.step_px / 2;
    const clip = (value, most) => Math.max(0, Math.min(most, value));
    return {
      left: clip(Math.round(at(layer.u_px) + 0.5 - half), this.width),
      top: clip(Math.round(at(layer.v_px) + 0.5 - half), this.height),
      right: clip(Math.round(at(layer.u_px + layer.step_px * (layer.columns - 1)) + 0.5 + half), this.width),
      bottom: clip(Math.round(at(layer.v_px + layer.step_px * (layer.rows - 1)) + 0.5 + half), this.height)
    };
  }

  // style: {mode, strength (0 to 1), wipe (0 to 1), colours: {BONE: [r, g, b]}}
  paint(style) {
    this.out.set(this.base);
    for (const [bone, layer] of this.layers) {
      if (layer.points)
        this.points(layer, style.colours[bone]);
      else if (layer.columns > 0 && layer.rows > 0)
        this.layer(layer, style, style.colours[bone]);
    }
    this.context.putImageData(this.image, 0, 0);
  }

  layer(layer, style, [r, g, b]) {
    const {left, top, right, bottom} = this.covered(layer), {out, grey, width} = this;
    const ratio = this.step_px / layer.step_px, middle = (this.step_px - 1) / 2;
    const beginU = (middle - layer.u_px) / layer.step_px, beginV = (middle - layer.v_px) / layer.step_px;
    const weights = new Uint16Array(256).map((_, t) => Math.round(256 * Math.min(1, style.strength * 2 * t / 255)));
    const isCompared = style.mode === 'wipe' || style.mode === 'checkerboard';
    const line = style.wipe * width, square = Math.max(8, width >> 3);
    for (let y = top; y < bottom; ++y) {
      const row = Math.min(layer.rows - 1, Math.max(0, Math.round(y * ratio + beginV))) * layer.columns;
      for (let x = left; x < right; ++x) {
        const column = Math.min(layer.columns - 1, Math.max(0, Math.round(x * ratio + beginU)));
        const value = layer.bytes[row + column], at = y * width + x;
        if (value === 0) continue;
        if (isCompared) {
          const isBone = style.mode === 'wipe' ? x >= line : ((x / square | 0) + (y / square | 0)) & 1;
          if (isBone) out[at] = PlacePaint.greyColour(255 - value);
          continue;
        }
        const weight = weights[value], rest = 256 - weight, under = grey[at];
        out[at] = (0xff000000 | (under * rest + b * weight) >> 8 << 16 | (under * rest + g * weight) >> 8 << 8 |
                   (under * rest + r * weight) >> 8) >>>
            0;
      }
    }
  }

  points({points}, [r, g, b]) {
    const colour = (0xff000000 | b << 16 | g << 8 | r) >>> 0, middle = (this.step_px - 1) / 2;
    for (let i = 0; i < points.length; i += 2) {
      const x = Math.round((points[i] - middle) / this.step_px),
            y = Math.round((points[i + 1] - middle) / this.step_px);
      for (const [column, row] of [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]])
        if (column >= 0 && row >= 0 && column < this.width && row < this.height)
          this.out[row * this.width + column] = colour;
    }
  }
}

export class PlaceView {
  // page: {casePath, style(), poses(), drag(view, drag), dragEnded(), wheel(view, notches), chosen(view)}
  static async make(view, page) {
    const made = new PlaceView();
    const MOST_PX = 1024, size = Math.max(view.camera.width_px, view.camera.height_px);
    Object.assign(made, {
      name: view.name,
      camera: view.camera,
      page,
      step_px: Math.ceil(size / MOST_PX),
      pointers: new Map(),
      wanted: null,
      inFlight: false,
      drag: null
    });
    const {camera, step_px} = made;
    const {bytes} = await Ask.bytes('api/place/image', {case: page.casePath, view: view.name, step_px});
    made.canvas = el('canvas', {
      class: 'place-canvas',
      tabindex: 0,
      role: 'application',
      'aria-label': 'X-ray ' + view.name + ', the bone over it. Arrow keys move the bone.',
      'data-view': view.name
    });
    const width_px = Math.floor(camera.width_px / step_px), height_px = Math.floor(camera.height_px / step_px);
    made.image = new Uint16Array(bytes);  // of the case
    made.paint = new PlacePaint(made.canvas, width_px, height_px, step_px);
    made.showImage(made.image);
    made.window = el('div', {class: 'place-window'}, made.canvas);
    made.factor = 1;
    made.observer = new ResizeObserver(() => made.fit());
    made.observer.observe(made.window);
    made.element = el('figure', {class: 'place-view'}, el('figcaption', {}, view.name), made.window);
    made.listen();
    return made;
  }

  listen() {
    const {canvas} = this;
    canvas.addEventListener('pointerdown', (event) => this.down(event));
    canvas.addEventListener('pointermove', (event) => this.move(event));
    for (const name of ['pointerup', 'pointercancel']) canvas.addEventListener(name, (event) => this.up(event));
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('focus', () => this.page.chosen(this));
    canvas.addEventListener('wheel', (event) => {
      if (!event.ctrlKey) return;
      event.preventDefault();
      this.page.wheel(this, -Math.sign(event.deltaY));
    }, {passive: false});
  }

  // The image fills its window, times the zoom. The place in the middle stays.
  fit() {
    const {clientWidth: width, clientHeight: height} = this.window, {canvas, paint} = this;
    if (!width || !height) return;
    const before = canvas.getBoundingClientRect();
    const middle = [
      (this.window.scrollLeft + width / 2) / (before.width || 1),
      (this.window.scrollTop + height / 2) / (before.height || 1)
    ];
    const scale = this.factor * Math.min(width / paint.width, height / paint.height);
    canvas.style.width = Math.floor(scale * paint.width) + 'px';
    canvas.style.height = Math.floor(scale * paint.height) + 'px';
    this.window.scrollTo(middle[0] * scale * paint.width - width / 2, middle[1] * scale * paint.height - height / 2);
  }

  // Shows the image larger, with a place of the X-ray in the middle.
  zoom(factor, [u, v]) {
    this.factor = factor;
    this.fit();
    const size = this.paint.width * this.step_px / this.canvas.getBoundingClientRect().width;
    this.window.scrollTo(u / size - this.window.clientWidth / 2, v / size - this.window.clientHeight / 2);
  }

  dispose() {
    this.observer.disconnect();
  }

  // The place in the X-ray under the pointer.
  pixel(event) {
    const box = this.canvas.getBoundingClientRect();
    return [
      (event.clientX - box.left) / box.width * this.paint.width * this.step_px - 0.5,
      (event.clientY - box.top) / box.height * this.paint.height * this.step_px - 0.5
    ];
  }

  down(event) {
    event.preventDefault();
    this.canvas.focus({preventScroll: true});
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, this.pixel(event));
    const kind = this.pointers.size > 1      ? 'two' :
        event.altKey                         ? 'roll' :
        event.shiftKey || event.button === 2 ? 'turn' :
                                               'shift';
    if (this.drag) this.page.dragEnded(this.drag);
    this.drag = {kind, view: this, from: this.pixel(event), to: this.pixel(event), poses: this.page.poses(), turned: 0};
  }

  move(event) {
    if (!this.drag || !this.pointers.has(event.pointerId)) return;
    const before = this.pointers.get(event.pointerId), now = this.pixel(event);
    this.pointers.set(event.pointerId, now);
    if (this.drag.kind === 'two') {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId);
      if (!other) return;
      const angle = (point) => Math.atan2(point[1] - other[1][1], point[0] - other[1][0]);
      const turn = angle(now) - angle(before);
      this.drag.turned += Math.atan2(Math.sin(turn), Math.cos(turn));
    }
    this.drag.previous = this.drag.to;
    this.drag.to = now;
    this.page.drag(this.drag);
  }

  up(event) {
    this.pointers.delete(event.pointerId);
    if (!this.drag || this.pointers.size) return;
    const {drag} = this;
    this.drag = null;
    this.page.dragEnded(drag);
  }

  // If drawing all pixels takes too long, only every second one is drawn while a bone moves. On release, all are drawn.
  judgeSpeed(took_ms, isMoving) {
    const LONG_MS = 40, SHORT_MS = 8;
    if (!isMoving) return;
    this.usual_ms = 0.8 * (this.usual_ms || took_ms) + 0.2 * took_ms;
    if (this.usual_ms > LONG_MS && !this.isSlow)
      Object.assign(this, {isSlow: true, usual_ms: LONG_MS / 2});
    else if (this.usual_ms < SHORT_MS && this.isSlow)
      Object.assign(this, {isSlow: false, usual_ms: LONG_MS / 2});
  }

  // Requests pictures of bones: {BONE: pose}. One request runs at a time, and the newest wish comes next.
  want(poses, isMoving) {
    this.wanted = {poses: {...(this.wanted || {}).poses, ...poses}, isMoving, since: performance.now()};
    if (!this.inFlight) this.ask();
  }

  async ask() {
    this.inFlight = true;
    try {
      while (this.wanted) {
        const {poses, since, isMoving} = this.wanted, style = this.page.style(), begin = performance.now();
        this.wanted = null;
        const what = {edges: 'edges', outline: 'outline'}[style.mode] || 'radiograph';
        const answer = await Ask.postForBytes('api/place/overlay', {
          case: this.page.casePath,
          view: this.name,
          what,
          step_px: what === 'outline' ? 1 : this.step_px * (isMoving && this.isSlow ? 2 : 1),
          poses
        });
        this.take(answer);
        this.draw();
        this.judgeSpeed(performance.now() - begin, isMoving);
        this.page.painted(this, since);
      }
    } catch (error) {
      this.page.failed(error);
    } finally {
      this.inFlight = false;
    }
  }

  take({bytes, about}) {
    let at = 0;
    for (const layer of about.layers) {
      const isOutline = layer.columns === undefined;
      const part = bytes.slice(at, at + layer.bytes);
      this.paint.layers.set(
          layer.bone, isOutline ? {points: new Float32Array(part)} : {...layer, bytes: new Uint8Array(part)});
      at += layer.bytes;
    }
  }

  // Shows an image: the case's own, or a frame of a sequence.
  showImage(numbers) {
    this.shown = {numbers, width_px: this.paint.width, height_px: this.paint.height};
    this.ranges = XrayPicture.rangesOf(this.shown);
    this.relook();
  }

  // Makes greys of the image's numbers as the control says.
  relook() {
    const {ranges} = this;
    this.paint.show(XrayPicture.greys(this.shown, XrayPicture.windowOf(ranges), XrayPicture.greyCurve(ranges)));
    this.draw();
  }

  draw() {
    this.paint.paint(this.page.style());
  }
}
