// SPDX-License-Identifier: Apache-2.0
// The pixels and cameras of X-ray views, each read once.
'use strict';

const XrayImages = (() => {
  const known = new Map();
  const key = (view) => JSON.stringify([view.image, view.camera || null]);

  // What is known of a view: {is_ready, fault, width_px, height_px, numbers, offset, scale, camera, warnings, command}.
  // The grey value of a number is offset + scale * number. `fault` says why there is no camera, or no image at all: then
  // `numbers` is missing. changed() is called when it is ready.
  function of(view, changed) {
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

  // The server writes the low byte first, as do all machines that have a browser.
  const numbersOf = (bytes) => new Uint16Array(bytes);

  // The numbers below which 1 %, 50 % and 99 % of some pixels lie.
  function quantiles(numbers, picked) {
    const sorted = Uint16Array.from(picked, (index) => numbers[index]).sort();
    return [0.01, 0.5, 0.99].map((share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))]);
  }
  function every(count, step, accepts = () => true) {
    const picked = [];
    for (let index = 0; index < count; index += step)
      if (accepts(index)) picked.push(index);
    return picked;
  }

  // The darkest and the brightest number that matter, for the window.
  function rangeOf(numbers) {
    const [low, , high] = quantiles(numbers, every(numbers.length, Math.max(1, Math.floor(numbers.length / 60000))));
    return high > low ? [low, high] : [low, low + 1];
  }

  // Whether the middle is much brighter than the border. Air is bright, and it is seen at the border rather than in the
  // middle. A collimator makes the border dark, too, but its edge is a step, and that of a limb is not.
  function looksInverted(entry) {
    const {numbers, width_px, height_px, range: [low, high]} = entry;
    const step = Math.max(1, Math.floor(numbers.length / 60000));
    const isInside = (index, share) => {
      const u = index % width_px, v = Math.floor(index / width_px);
      return u >= share * width_px && u < (1 - share) * width_px && v >= share * height_px &&
          v < (1 - share) * height_px;
    };
    const border = every(numbers.length, step, (index) => !isInside(index, 0.05));
    const middle = every(numbers.length, step, (index) => isInside(index, 0.3));
    if (border.length < 20 || middle.length < 20) return false;
    const is_brighter = quantiles(numbers, middle)[1] - quantiles(numbers, border)[1] > 0.25 * (high - low);
    return is_brighter && !isCollimated(entry);
  }

  // Rows are followed from both sides to where they leave the dark. Behind a step they do not rise much further.
  function isCollimated({numbers, width_px, height_px, range: [low, high]}) {
    const near = Math.max(3, Math.round(0.01 * width_px)), far = Math.max(12, Math.round(0.08 * width_px));
    const shares = [];
    for (let row = 0; row < height_px; row += Math.max(1, Math.floor(height_px / 200)))
      for (const by of [1, -1]) {
        const begin = row * width_px + (by > 0 ? 0 : width_px - 1);
        let at = 0;
        while (at < width_px / 2 && numbers[begin + by * at] <= low + 0.03 * (high - low)) ++at;
        if (at === 0 || at + far >= width_px) continue;
        const [soon, late] = [near, far].map((further) => numbers[begin + by * (at + further)] - low);
        if (late > 0) shares.push(soon / late);
      }
    return shares.length > 10 && shares.sort((a, b) => a - b)[Math.floor(shares.length / 2)] > 0.75;
  }

  // The grey value at a pixel, or null outside the image.
  function valueAt(entry, [u, v]) {
    const column = Math.round(u), row = Math.round(v);
    if (!entry.numbers || column < 0 || row < 0 || column >= entry.width_px || row >= entry.height_px) return null;
    return entry.offset + entry.scale * entry.numbers[row * entry.width_px + column];
  }

  // A canvas with the image in 256 greys; `window` is the pair of numbers that become black and white.
  function painted(entry, [low, high]) {
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

  const forget = () => known.clear();

  return {of, valueAt, painted, forget};
})();
