// SPDX-License-Identifier: Apache-2.0
// Draws a slice: its values, the labels over them, the outlines of fragments, the crosshair, points, and the patient's
// directions.
import * as SliceGeometry from './slice_geometry.js';
import {letters, opposite} from './slice_geometry.js';

// The processor draws: slices are small, and sending each to a graphics card takes longer.
const PLAIN = {
  willReadFrequently: true
};
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

export function draw(view) {
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
