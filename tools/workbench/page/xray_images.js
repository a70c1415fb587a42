// SPDX-License-Identifier: Apache-2.0
// The pixels and cameras of X-ray views, each read once.
import * as Ask from './server.js';

const known = new Map();
const key = (view) => JSON.stringify([view.image, view.camera || null]);

// The data of a view: {is_ready, fault, width_px, height_px, numbers, offset, scale, camera, warnings, command}. The
// grey value of a number is offset + scale * number. `fault` says why there is no camera, or no image at all: then
// `numbers` is missing. changed() is called when it is ready.
export function of (view, changed) {
  const name = key(view);
  if (!known.has(name)) {
    const entry = {is_ready: false};
    known.set(name, entry);
    entry.reading = read(view, entry);
  }
  const entry = known.get(name);
  if (!entry.is_ready && changed) entry.reading.then(changed);
  return entry;
}

async function read(view, entry) {
  try {
    const {bytes, about} = await Ask.postForBytes('api/xray/view', {image: view.image, camera: view.camera || null});
    Object.assign(entry, about, {numbers: numbersOf(bytes)});
    entry.range = rangeOf(entry.numbers);
    entry.is_inverted = looksInverted(entry);
  } catch (error) {
    entry.fault = error.message;
  }
  entry.is_ready = true;
}

// The server writes the low byte first, like all machines with a browser.
const numbersOf = (bytes) => new Uint16Array(bytes);

// The quantiles of 1 %, 50 % and 99 % of some pixels, linear between ranks, as everywhere in marrow.
function quantiles(numbers, picked) {
  const sorted = Uint16Array.from(picked, (index) => numbers[index]).sort();
  return [0.01, 0.5, 0.99].map((fraction) => {
    const position = fraction * (sorted.length - 1), low = Math.floor(position);
    return sorted[low] + (position - low) * ((sorted[low + 1] ?? sorted[low]) - sorted[low]);
  });
}
function every(count, step) {
  const picked = [];
  for (let index = 0; index < count; index += step) picked.push(index);
  return picked;
}

// The darkest and the brightest number that matter, for the window.
function rangeOf(numbers) {
  const [low, , high] = quantiles(numbers, every(numbers.length, Math.max(1, Math.floor(numbers.length / 60000))));
  return high > low ? [low, high] : [low, low + 1];
}

// Whether the image shows a bright limb on a dark ground. A limb leaves the image at one side or more, and the ground
// is at two opposite sides. A round field or a collimator is dark at all four sides, or only in the corners.
function looksInverted({numbers, width_px, height_px, range: [low, high]}) {
  const median = (left, top, right, bottom) => {
    const picked = [],
          step = Math.max(1, Math.floor(Math.sqrt((right - left) * (bottom - top) * width_px * height_px / 2000)));
    for (let v = Math.floor(top * height_px); v < bottom * height_px; v += step)
      for (let u = Math.floor(left * width_px); u < right * width_px; u += step) picked.push(v * width_px + u);
    return (quantiles(numbers, picked)[1] - low) / (high - low);
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

// A canvas with the image in 256 greys; `window` is the pair of numbers that become black and white.
export function painted(entry, [low, high]) {
  const canvas = document.createElement('canvas');
  canvas.width = entry.width_px;
  canvas.height = entry.height_px;
  const picture = new ImageData(entry.width_px, entry.height_px), dots = new Uint32Array(picture.data.buffer);
  const grey = new Uint32Array(65536);
  for (let n = 0; n < 65536; ++n) {
    const level = Math.max(0, Math.min(255, Math.round(255 * (n - low) / (high - low))));
    grey[n] = 0xff000000 | level << 16 | level << 8 | level;
  }
  for (let i = 0; i < dots.length; ++i) dots[i] = grey[entry.numbers[i]];
  canvas.getContext('2d').putImageData(picture, 0, 0);
  return canvas;
}

export const forget = () => known.clear();
