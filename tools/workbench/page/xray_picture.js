// SPDX-License-Identifier: Apache-2.0
// How the numbers of an X-ray become greys. An image is {numbers: Uint16Array, width_px, height_px}; a window is the
// pair of numbers that become black and white.
import {equalised} from './xray_equalise.js';

const MOST_SAMPLES = 60000, BINS = 128, MIDDLE_GREY = 0.45, LEAST_GAMMA = 0.35;

// Linear between ranks, as everywhere in marrow. `sorted` is not empty.
export function quantile(sorted, fraction) {
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
