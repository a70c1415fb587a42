// SPDX-License-Identifier: Apache-2.0
// How the numbers of an X-ray become greys. An image is {numbers: Uint16Array, width_px, height_px}; a window is the
// pair of numbers that become black and white.
import * as Dom from '../../report/page/dom.js';
import {el} from '../../report/page/dom.js';

import * as Ask from './server.js';

// The control that says how X-rays are shown. The pages "Case" and "Place" have the same one, and share what it says.
const WAYS = [['body', 'Body'], ['equalised', 'Equalised'], ['all', 'All']];
const MEANINGS = {
  body: 'The greys are spread over the body. Air and collimator may be all white and all black.',
  equalised: 'The contrast is the same in all regions, as in the reports. Bone is seen under thick and thin tissue.',
  all: 'The greys are spread over the whole image.'
};
const look = {
  way: 'body',
  brightness: 0,
  contrast: 0
};

// How greys follow the numbers in the window.
export const greyCurve = (ranges) =>
    ({gamma: look.way === 'all' ? 1 : ranges.gamma, is_equalised: look.way === 'equalised'});

// The window of an image with these ranges.
export function windowOf(ranges) {
  const [low, high] = look.way === 'all' ? ranges.all : ranges.body;
  const width = (high - low) * 2 ** -look.contrast, middle = (low + high) / 2 - look.brightness * (high - low);
  return [middle - width / 2, middle + width / 2];
}

// The control. changed() is called after each change.
export function control(changed) {
  const reset = Dom.button('Reset', () => {
    Object.assign(look, {brightness: 0, contrast: 0});
    for (const one of [brightness, contrast]) one.querySelector('input').value = 50;
    brightness.querySelector('input').focus();
    reset.hidden = true;
    changed();
  }, {'data-do': 'reset-greys', hidden: !look.brightness && !look.contrast, title: 'Brightness and contrast'});
  const slider = (name, most) => Dom.slider(name, 0.5 + look[name] / (2 * most), (share) => {
    look[name] = (2 * share - 1) * most;
    reset.hidden = false;
    changed();
  });
  const brightness = slider('brightness', 0.6), contrast = slider('contrast', 2);
  const ways = Dom.choice('X-rays', WAYS, look.way, (way) => {
    look.way = way;
    changed();
  });
  for (const [way] of WAYS) ways.querySelector(`[data-value="${way}"]`).title = MEANINGS[way];
  return el('div', {class: 'xray-look'}, ways, brightness, contrast, reset);
}

// The pixels and cameras of X-ray views, each read once, a few at a time, those in sight first.
const MOST_AT_ONCE = 3;
const known = new Map();
const waiting = [];  // the entries to read; the last one is next
let running = 0;

const key = (view) => JSON.stringify([view.image, view.camera || null]);

// The data of a view: {is_ready, fault, width_px, height_px, numbers, offset, scale, camera, warnings, command}. The
// grey value of a number is offset + scale * number. `fault` says why there is no camera, or no image at all: then
// `numbers` is missing. changed() is called once when it is ready, however often it was given.
export function of (view, changed) {
  const name = key(view);
  if (!known.has(name)) known.set(name, begun(view));
  const entry = known.get(name);
  if (!entry.is_ready && changed) entry.told.add(changed);
  return entry;
}

function begun(view) {
  const entry = {is_ready: false, told: new Set()};
  entry.reading = new Promise((resolve) => (entry.start = async () => {
                                await read(view, entry);
                                resolve();
                              }));
  waiting.unshift(entry);
  next();
  return entry;
}

// Reads this one next.
export function hurry(entry) {
  const at = waiting.indexOf(entry);
  if (at >= 0) waiting.push(...waiting.splice(at, 1));
}

function next() {
  while (running < MOST_AT_ONCE && waiting.length) {
    const entry = waiting.pop();
    ++running;
    entry.start().then(() => {
      --running;
      next();
    });
  }
}

async function read(view, entry) {
  try {
    const {bytes, about} = await Ask.postForBytes('api/xray/view', {image: view.image, camera: view.camera || null});
    Object.assign(entry, about, {numbers: numbersOf(bytes)});
    entry.ranges = rangesOf(entry);
    entry.is_inverted = looksInverted(entry);
  } catch (error) {
    entry.fault = error.message;
  }
  entry.is_ready = true;
  const {told} = entry;
  entry.told = new Set();
  for (const one of told) one();
}

// The server writes the low byte first, like all machines with a browser.
const numbersOf = (bytes) => new Uint16Array(bytes);

// Whether the image shows a bright limb on a dark ground. A limb leaves the image at one side or more, and the ground
// is at two opposite sides. A round field or a collimator is dark at all four sides, or only in the corners.
function looksInverted({numbers, width_px, height_px, ranges: {all: [low, high]}}) {
  const median = (left, top, right, bottom) => {
    const picked = [],
          step = Math.max(1, Math.floor(Math.sqrt((right - left) * (bottom - top) * width_px * height_px / 2000)));
    for (let v = Math.floor(top * height_px); v < bottom * height_px; v += step)
      for (let u = Math.floor(left * width_px); u < right * width_px; u += step) picked.push(numbers[v * width_px + u]);
    return (quantile(Uint16Array.from(picked).sort(), 0.5) - low) / (high - low);
  };
  const DARK = 0.15, BRIGHT = 0.4;
  const across = [median(0, 0.4, 0.05, 0.6), median(0.95, 0.4, 1, 0.6)];
  const along = [median(0.4, 0, 0.6, 0.05), median(0.4, 0.95, 0.6, 1)];
  const leaves = (ground, limb) => ground.every((one) => one < DARK) && limb.some((one) => one > BRIGHT);
  return median(0.4, 0.4, 0.6, 0.6) > BRIGHT && (leaves(across, along) || leaves(along, across));
}

// The grey value at a pixel, or null outside the image.
export function valueAt(entry, [u, v]) {
  const column = Math.round(u), row = Math.round(v);
  if (!entry.numbers || column < 0 || row < 0 || column >= entry.width_px || row >= entry.height_px) return null;
  return entry.offset + entry.scale * entry.numbers[row * entry.width_px + column];
}

export const forget = () => known.clear();

// Evens out the contrast of an image region by region: each region gets greys by the ranks of its own pixels, with a
// limit so that noise stays small (CLAHE). The reports show X-rays the same way.
const TILES = 8, LIMIT = 3;

// The grey that each grey becomes in one region.
function curveOf(grey, width, {left, top, right, bottom}) {
  const counts = new Float64Array(256), total = (right - left) * (bottom - top);
  for (let v = top; v < bottom; ++v)
    for (let u = left; u < right; ++u) ++counts[grey[v * width + u]];
  const most = LIMIT * total / 256;
  const excess = counts.reduce((sum, count) => sum + Math.max(0, count - most), 0) / 256;
  let below = 0;
  return counts.map((count) => 255 * (below += Math.min(count, most) + excess) / total);
}

// For each place along a side: the two nearest regions and the share of the second.
function neighbours(size) {
  return Array.from({length: size}, (_, at) => {
    const place = Math.max(0, Math.min(TILES - 1, (at + 0.5) * TILES / size - 0.5)), first = Math.floor(place);
    return {first, second: Math.min(TILES - 1, first + 1), share: place - first};
  });
}

export function equalised(grey, width, height) {
  const side = (size, i) => Math.floor(size * i / TILES), curves = [];
  if (width < TILES || height < TILES) return grey;
  for (let row = 0; row < TILES; ++row)
    for (let column = 0; column < TILES; ++column)
      curves.push(curveOf(grey, width, {
        left: side(width, column),
        right: side(width, column + 1),
        top: side(height, row),
        bottom: side(height, row + 1)
      }));
  const across = neighbours(width), shown = new Uint8Array(grey.length);
  neighbours(height).forEach((down, v) => {
    for (let u = 0, at = v * width; u < width; ++u, ++at) {
      const {first, second, share} = across[u], value = grey[at];
      const row = (one) =>
          (1 - share) * curves[TILES * one + first][value] + share * curves[TILES * one + second][value];
      shown[at] = (1 - down.share) * row(down.first) + down.share * row(down.second) + 0.5;
    }
  });
  return shown;
}

const MOST_SAMPLES = 60000, BINS = 128, MIDDLE_GREY = 0.45, LEAST_GAMMA = 0.35;

// Linear between ranks, as everywhere in marrow. `sorted` is not empty.
function quantile(sorted, fraction) {
  const position = fraction * (sorted.length - 1), low = Math.floor(position);
  return sorted[low] + (position - low) * ((sorted[low + 1] ?? sorted[low]) - sorted[low]);
}
const range = (sorted, low, high) => {
  const ends = [quantile(sorted, low), quantile(sorted, high)];
  return ends[1] > ends[0] ? ends : [ends[0], ends[0] + 1];
};

// The windows of an image: `all` shows all numbers, `body` only those of the body. `gamma` is the exponent by which the
// middle number of the body gets a middle grey: detector values fall exponentially, so bone would be nearly black.
export function rangesOf(image) {
  const {numbers} = image;
  const step = Math.max(1, Math.floor(numbers.length / MOST_SAMPLES));
  const sorted = Uint16Array.from({length: Math.ceil(numbers.length / step)}, (_, i) => numbers[i * step]).sort();
  if (!sorted.length) return {all: [0, 1], body: [0, 1], gamma: 1};
  const all = range(sorted, 0.01, 0.99), inside = withoutGround(sorted, all, cornersOf(image));
  if (inside.length < 0.05 * sorted.length) return {all, body: all, gamma: 1};
  const body = range(inside, 0.01, 0.99), middle = (quantile(inside, 0.5) - body[0]) / (body[1] - body[0]);
  const gamma = Math.log(MIDDLE_GREY) / Math.log(Math.max(1e-3, Math.min(0.99, middle)));
  return {all, body, gamma: Math.max(LEAST_GAMMA, Math.min(1, gamma))};
}

// The middle number of each corner.
function cornersOf({numbers, width_px, height_px}) {
  const side = Math.max(1, Math.floor(0.03 * Math.min(width_px, height_px)));
  return [[0, 0], [width_px - side, 0], [0, height_px - side], [width_px - side, height_px - side]].map(([u, v]) => {
    const part = [];
    for (let row = v; row < v + side; ++row)
      for (let column = u; column < u + side; ++column) part.push(numbers[row * width_px + column]);
    return quantile(Uint16Array.from(part).sort(), 0.5);
  });
}

// The numbers between the two grounds. Air is a narrow peak at the bright end of the histogram, a collimator one at the
// dark end. Beside such a peak there are few pixels, because the body's edge is thin. A collimator is in corners; thick
// bone and metal are not.
function withoutGround(sorted, [low, high], corners) {
  const counts = new Array(BINS).fill(0), width = (high - low) / BINS;
  const binOf = (number) => Math.max(0, Math.min(BINS - 1, Math.floor((number - low) / width)));
  for (const number of sorted) ++counts[binOf(number)];
  const air = groundOf([...counts].reverse(), sorted.length), dark = groundOf(counts, sorted.length);
  const field = corners.filter((number) => binOf(number) < dark).length >= 2 ? dark : 0;
  return sorted.filter((number) => binOf(number) >= field && binOf(number) < BINS - air);
}

// How many bins the peak at the beginning takes; 0 if there is no peak.
function groundOf(counts, total) {
  const END = 0.15, LEAST = 0.06, FOOT = 0.12;
  const top = counts.indexOf(Math.max(...counts.slice(0, END * BINS)));
  const near = counts.slice(Math.max(0, top - 2), top + 3).reduce((sum, count) => sum + count, 0);
  if (near < LEAST * total) return 0;
  let end = top;
  while (end < 2 * END * BINS && counts[end] > FOOT * counts[top]) ++end;
  return end < 2 * END * BINS ? end : 0;
}

// A grey for each pixel. curve: {gamma, is_equalised}
export function greys(image, window, curve) {
  const table = tableOf(window, curve), {numbers} = image, shown = new Uint8Array(numbers.length);
  for (let i = 0; i < shown.length; ++i) shown[i] = table[numbers[i]];
  return curve.is_equalised ? equalised(shown, image.width_px, image.height_px) : shown;
}

const tableOf = ([low, high], {gamma}) =>
    Uint8ClampedArray.from({length: 65536}, (_, number) => 255 * Math.max(0, (number - low) / (high - low)) ** gamma);

// A canvas with the image.
export function painted(image, window, curve) {
  const canvas = document.createElement('canvas');
  Object.assign(canvas, {width: image.width_px, height: image.height_px});
  const picture = new ImageData(image.width_px, image.height_px), dots = new Uint32Array(picture.data.buffer);
  const shown = greys(image, window, curve);
  for (let i = 0; i < dots.length; ++i) dots[i] = 0xff000000 | shown[i] * 0x010101;
  canvas.getContext('2d').putImageData(picture, 0, 0);
  return canvas;
}
