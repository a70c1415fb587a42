// SPDX-License-Identifier: Apache-2.0
// One slice of the CT on a canvas, and everything that mouse, touch and keys do in it.
import {el} from '../../report/page/dom.js';

import * as Shell from './shell.js';
import * as SliceGeometry from './slice_geometry.js';
import {letters, opposite} from './slice_geometry.js';
import * as SliceInput from './slice_input.js';
import * as Viewport from './viewport.js';

// The processor draws: slices are small, and sending each to a graphics card takes longer.
const PLAIN = Object.freeze({willReadFrequently: true});
let table = null, table_for = '';

// The grey value of each HU, as the four bytes of a pixel.
function tableOf({level, width}) {
  const key = level + ' ' + width;
  if (table_for === key) return table;
  table = table || new Uint32Array(65536);
  for (let value = -32768; value < 32768; ++value) {
    const grey = Math.max(0, Math.min(255, Math.round(255 * ((value - level) / width + 0.5))));
    table[value + 32768] = 0xff000000 | grey << 16 | grey << 8 | grey;
  }
  table_for = key;
  return table;
}

function fill(view, values) {
  const {ct, window} = view.state, [low, high] = [0, 1, 2].filter((axis) => axis !== view.plane.across);
  const overlay = view.state.overlay && view.state.overlay.slice(ct.name, view.plane.across, view.wanted);
  const [width, height] = [ct.size[low], ct.size[high]];
  const key = [ct.name, view.wanted, tableKey(window), overlay ? overlay.key : ''].join(' ');
  if (view.filled === key) return;
  if (view.picture.width !== width || view.picture.height !== height) Object.assign(view.picture, {width, height});
  const pen = view.picture.getContext('2d', PLAIN), image = pen.createImageData(width, height);
  const pixels = new Uint32Array(image.data.buffer), greys = tableOf(window);
  for (let i = 0; i < pixels.length; ++i) pixels[i] = greys[values[i] + 32768];
  if (overlay) mix(image.data, overlay);
  pen.putImageData(image, 0, 0);
  view.filled = key;
}

// Colours the pixels of labelled voxels.
function mix(bytes, {places, colours}) {
  for (let i = 0; i < places.length; ++i) {
    if (!places[i]) continue;
    const {bytes: colour, opacity} = colours[places[i] - 1];
    for (let k = 0; k < 3; ++k) bytes[4 * i + k] += opacity * (colour[k] - bytes[4 * i + k]);
  }
}

const tableKey = ({level, width}) => level + '/' + width;

function crosshair(view, pen) {
  const [x, y] = view.placeOf(view.state.cursor_mm), gap = 6;
  pen.strokeStyle = 'rgb(120 200 255 / 75%)';
  pen.lineWidth = 1;
  pen.beginPath();
  for (const [from, to] of [
           [[0, y], [x - gap, y]], [[x + gap, y], [view.view.width, y]], [[x, 0], [x, y - gap]],
           [[x, y + gap], [x, view.view.height]]]) {
    pen.moveTo(...from);
    pen.lineTo(...to);
  }
  pen.stroke();
}

function marks(view, pen) {
  for (const mark of view.state.allMarks()) {
    const [x, y] = view.placeOf(mark.point_mm), is_here = view.distance(mark.point_mm) <= 0.5 + 1e-6;
    pen.globalAlpha = is_here ? 1 : 0.35;
    pen.beginPath();
    pen.arc(x, y, is_here ? 5 : 3, 0, 2 * Math.PI);
    pen.lineWidth = 3;
    pen.strokeStyle = '#000';
    pen.stroke();
    pen.lineWidth = 1.5;
    pen.strokeStyle = mark.colour;
    pen.stroke();
    if (is_here) {
      pen.fillStyle = mark.colour;
      pen.beginPath();
      pen.arc(x, y, 1.5, 0, 2 * Math.PI);
      pen.fill();
      if (mark.label) label(pen, mark.label, x + 9, y - 7, mark.colour);
    }
    pen.globalAlpha = 1;
  }
}

function label(pen, text, x, y, colour, align) {
  pen.textAlign = align || 'left';
  pen.lineWidth = 3;
  pen.strokeStyle = 'rgb(0 0 0 / 85%)';
  pen.strokeText(text, x, y);
  pen.fillStyle = colour;
  pen.fillText(text, x, y);
}

function contours(view, pen) {
  const {ct} = view.state;
  for (const one of view.state.contours.values())
    for (const {colour, ends} of one.lines(view.plane.across, view.wanted, () => view.draw()) || []) {
      pen.beginPath();
      for (let i = 0; i + 5 < ends.length; i += 6) {
        pen.moveTo(...SliceGeometry.place(ct, view.plane, view.view, ends.slice(i, i + 3)));
        pen.lineTo(...SliceGeometry.place(ct, view.plane, view.view, ends.slice(i + 3, i + 6)));
      }
      pen.lineWidth = 1.5;
      pen.strokeStyle = colour;
      pen.stroke();
    }
}

function directions(view, pen) {
  const {ct} = view.state, {width, height} = view.view, {right, down} = view.plane;
  const colour = '#ffd866';
  pen.textBaseline = 'middle';
  label(pen, letters(ct, right), width - 6, height / 2, colour, 'right');
  label(pen, letters(ct, opposite(right)), 6, height / 2, colour, 'left');
  label(pen, letters(ct, down), width / 2, height - 10, colour, 'center');
  label(pen, letters(ct, opposite(down)), width / 2, 11, colour, 'center');
}

// Draws the slice in its place on the screen. Until its values arrive, the last slice stays.
function place(view, density) {
  const {width, height} = view.canvas, {ct} = view.state;
  const numbers = SliceGeometry.pictureTransform(ct, view.plane, view.view);
  const key = [view.filled, ...numbers, width, height].join(' ');
  if (view.placed_for === key) return;
  view.placed_for = key;
  Object.assign(view.placed, {width, height});
  const pen = view.placed.getContext('2d', PLAIN);
  pen.fillStyle = '#000';
  pen.fillRect(0, 0, width, height);
  if (!view.filled) return;
  pen.setTransform(...numbers.map((number) => number * density));
  pen.imageSmoothingEnabled =
      view.view.scale * Math.min(...ct.spacing_mm) < 4;  // voxels of 4 pixels and more are shown as squares
  pen.drawImage(view.picture, 0, 0);
}

function draw(view) {
  const {state, canvas} = view, {ct} = state;
  if (!ct || !view.view) return;
  const pen = canvas.getContext('2d', PLAIN), density = canvas.width / view.view.width;
  const values = view.slices.get(view.wanted);
  if (values) fill(view, values);
  place(view, density);
  pen.setTransform(1, 0, 0, 1, 0, 0);
  pen.drawImage(view.placed, 0, 0);
  pen.setTransform(density, 0, 0, density, 0, 0);
  pen.font = '13px system-ui, sans-serif';
  contours(view, pen);
  crosshair(view, pen);
  marks(view, pen);
  directions(view, pen);
  canvas.dataset.shown = values ? view.wanted : '';
}

export class SliceView {
  constructor(name, state) {
    Object.assign(this, {name, state, slices: new Map(), wanted: null, isAsking: false, drag: null, under: null});
    this.canvas = el('canvas', {tabindex: 0, role: 'application', 'data-slice': name});
    this.hint = el('span', {class: 'cursor-hint', 'aria-hidden': 'true', hidden: true});
    this.slider = el('input', {type: 'range', min: 0, step: 1, 'aria-label': name + ' slice'});
    this.number = el('span', {class: 'note'});
    this.element =
        el('figure', {class: 'slice'}, el('div', {class: 'slice-box'}, this.canvas, this.hint),
           el('figcaption', {}, el('strong', {}, name[0].toUpperCase() + name.slice(1)), this.slider, this.number));
    this.slider.addEventListener('input', () => this.goToSlice(Number(this.slider.value)));
    this.picture = document.createElement('canvas');  // the slice, a pixel for each voxel
    this.placed = document.createElement('canvas');   // the same in its place on the screen; kept while only lines move
    this.observer = new ResizeObserver(() => this.resized());
    this.observer.observe(this.canvas);
    this.listen();
  }

  dispose() {
    this.observer.disconnect();
    cancelAnimationFrame(this.frame);
  }

  // Another CT, or none.
  reset() {
    this.slices.clear();
    this.filled = null;  // what the picture holds
    const {ct} = this.state;
    if (!ct) return;
    this.plane = SliceGeometry.planes(ct)[this.name];
    this.slider.max = ct.size[this.plane.across] - 1;
    this.canvas.setAttribute(
        'aria-label',
        this.name + ' slice. Arrow keys move the crosshair, Page Up and Page Down go through the slices.');
    this.view = null;
    this.resized();
  }

  resized() {
    const {clientWidth: width, clientHeight: height} = this.canvas, {ct} = this.state;
    if (!ct || !width || !height) return;
    this.view = this.view ? SliceGeometry.resized(ct, this.plane, this.view, width, height) :
                            SliceGeometry.whole(ct, this.plane, width, height);
    const density = devicePixelRatio || 1;
    this.canvas.width = Math.round(width * density);
    this.canvas.height = Math.round(height * density);
    this.show();
  }

  // Shows what the state says: draws what is loaded, and requests the rest.
  show() {
    const {ct} = this.state;
    if (!ct || !this.view) return;
    this.wanted = this.state.sliceAt(this.plane.across);
    this.slider.value = this.wanted;
    this.number.textContent = (this.wanted + 1) + ' / ' + ct.size[this.plane.across];
    this.ask();
    this.draw();
  }

  draw() {
    cancelAnimationFrame(this.frame);
    this.frame = requestAnimationFrame(() => draw(this));
  }

  // One request runs at a time, and the newest slice comes next. Afterwards the neighbours are fetched.
  async ask() {
    if (this.isAsking) return;
    this.isAsking = true;
    try {
      for (let index; (index = this.missing()) !== null;) {
        const {name} = this.state.ct, values = await this.state.slice(this.plane.across, index);
        if (!values || !this.state.ct || this.state.ct.name !== name) break;
        this.slices.set(index, values);
        if (this.slices.size > 64) this.slices.delete(this.slices.keys().next().value);
        if (index === this.wanted) {
          this.draw();
          if (this.under) this.tell(this.under, this.at(this.under).value_hu);
          this.state.tell('slice');
        }
      }
    } catch (error) {
      if (error.status !== 0 || !this.isTold) Shell.notice(error.message, 'fault');
      this.isTold = true;
    }
    this.isAsking = false;
  }

  missing() {
    const {ct} = this.state;
    if (!ct) return null;
    for (const step of [0, 1, -1, 2, -2, 3, -3]) {
      const index = this.wanted + step;
      if (index >= 0 && index < ct.size[this.plane.across] && !this.slices.has(index)) return index;
    }
    return null;
  }

  goToSlice(slice) {
    const index = this.state.cursorIndex();
    index[this.plane.across] = slice;
    this.state.moveCursor(index);
  }

  // The index at a place on the canvas, and the value there (null outside).
  at(place) {
    const index = SliceGeometry.indexAt(this.state.ct, this.plane, this.view, place, this.wanted);
    const values = this.slices.get(this.wanted), {ct} = this.state;
    if (!values || !SliceGeometry.isInside(ct, index)) return {index, value_hu: null};
    const [low, high] = [0, 1, 2].filter((axis) => axis !== this.plane.across);
    return {index, value_hu: values[Math.round(index[high]) * ct.size[low] + Math.round(index[low])]};
  }

  placeOf(point_mm) {
    return SliceGeometry.place(this.state.ct, this.plane, this.view, SliceGeometry.index(this.state.ct, point_mm));
  }

  // How many voxels a point is away from this slice.
  distance(point_mm) {
    return Math.abs(SliceGeometry.index(this.state.ct, point_mm)[this.plane.across] - this.wanted);
  }

  // Says at the pointer what a click does there, and what is there.
  tell([x, y], value_hu) {
    const {tool} = this.state, mark = this.markAt([x, y]);
    const text = mark ? 'drag to move ' + mark.label : tool ? tool.says(value_hu) : '';
    Viewport.hint(this.hint, text, [x, y]);
  }

  markAt([x, y]) {
    const near = this.state.allMarks()
                     .filter((mark) => this.distance(mark.point_mm) <= 1.5)
                     .map((mark) => {
                       const [u, v] = this.placeOf(mark.point_mm);
                       return {mark, away: Math.hypot(u - x, v - y)};
                     })
                     .filter(({away}) => away < 9)
                     .sort((a, b) => a.away - b.away);
    return near.length ? near[0].mark : null;
  }

  zoom(factor, [x, y]) {
    const {ct} = this.state;
    const before = SliceGeometry.indexAt(ct, this.plane, this.view, [x, y], 0);
    const fit = SliceGeometry.whole(ct, this.plane, this.view.width, this.view.height).scale;
    this.view.scale = Math.max(0.5 * fit, Math.min(60 * fit, this.view.scale * factor));
    const after = SliceGeometry.indexAt(ct, this.plane, this.view, [x, y], 0);
    this.view.centre = this.view.centre.map((value, k) => value + before[k] - after[k]);
    this.draw();
  }

  pan(dx, dy) {
    const {ct} = this.state, middle = [this.view.width / 2 - dx, this.view.height / 2 - dy];
    const to = SliceGeometry.indexAt(ct, this.plane, this.view, middle, 0);
    to[this.plane.across] = this.view.centre[this.plane.across];
    this.view.centre = to;
    this.draw();
  }

  fit() {
    this.view = SliceGeometry.whole(this.state.ct, this.plane, this.view.width, this.view.height);
    this.draw();
  }

  listen() {
    SliceInput.listen(this);
  }
}
