// SPDX-License-Identifier: Apache-2.0
// The pixels and cameras of X-ray views, each read once, a few at a time, those in sight first.
import * as Ask from './server.js';
import * as XrayPicture from './xray_picture.js';

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
    entry.ranges = XrayPicture.rangesOf(entry);
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
    return (XrayPicture.quantile(Uint16Array.from(picked).sort(), 0.5) - low) / (high - low);
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
