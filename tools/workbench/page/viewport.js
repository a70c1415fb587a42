// SPDX-License-Identifier: Apache-2.0
// The placement of an image on the screen. Places on the screen are [x, y] in CSS pixels from the top left corner of
// the frame that shows the image; pixels are [u, v] with (0, 0) at the centre of the top left pixel.

// Arranges pictures in a box so that they are as large as possible. If they would become too small, the box scrolls.
const LEAST_px = 180, GAP_px = 8, CAPTION_px = 24;

// The number of columns that shows `count` pictures largest. aspect: width by height of a picture.
export function columnsFor(count, aspect, width, height) {
  const heightOf = (columns) => {
    const rows = Math.ceil(count / columns);
    return Math.min(
        (height - GAP_px * (rows - 1)) / rows - CAPTION_px, (width - GAP_px * (columns - 1)) / columns / aspect);
  };
  let best = 1;
  for (let columns = 2; columns <= count; ++columns)
    if (heightOf(columns) > heightOf(best)) best = columns;
  if (heightOf(best) >= LEAST_px) return {columns: best, is_scrolled: false};
  return {columns: Math.max(1, Math.min(count, Math.floor(width / LEAST_px))), is_scrolled: true};
}

// Keeps the children of a grid arranged. aspectOf() is asked for the pictures' shape. Returns {update, dispose}.
export function arranged(grid, aspectOf) {
  const update = () => {
    const count = grid.children.length, {clientWidth: width, clientHeight: height} = grid;
    if (!count || !width || !height) return;
    const {columns, is_scrolled} = columnsFor(count, aspectOf(), width, height);
    grid.style.gridTemplateColumns = `repeat(${columns}, minmax(0, 1fr))`;
    grid.style.gridAutoRows =
        is_scrolled ? Math.max(LEAST_px, width / columns / aspectOf() + CAPTION_px) + 'px' : 'minmax(0, 1fr)';
  };
  const observer = new ResizeObserver(update);
  observer.observe(grid);
  return {update, dispose: () => observer.disconnect()};
}

// What two fingers on a touch screen did when one of them moved to `place`. pointers: the places of both by their ids;
// it gets the new place. Returns {factor: how much further apart they are, around: the middle before, by: the way of
// the middle}.
export function pinched(pointers, moved, place) {
  const before = pointers.get(moved), other = [...pointers].find(([id]) => id !== moved)[1];
  const apart = (at) => Math.hypot(at[0] - other[0], at[1] - other[1]);
  const middle = (at) => at.map((value, i) => (value + other[i]) / 2);
  pointers.set(moved, place);
  return {
    factor: apart(place) / Math.max(1, apart(before)),
    around: middle(before),
    by: place.map((value, i) => (value - before[i]) / 2)
  };
}

// Shows a text beside the pointer. It is a child of the box in which `place` is given.
export function hint(hint, text, [x, y]) {
  hint.hidden = !text;
  if (!text) return;
  hint.textContent = text;
  const {offsetWidth: width, offsetHeight: height, parentElement: box} = hint;
  const left = x + 16 + width > box.clientWidth ? x - 12 - width : x + 16;
  const top = y + 18 + height > box.clientHeight ? y - 10 - height : y + 18;
  hint.style.transform = `translate(${Math.max(0, left)}px, ${Math.max(0, top)}px)`;
}

const LEAST_ZOOM = 0.02, MOST_ZOOM = 64;

const whole = ([width_px, height_px], [width, height]) => Math.min(width / width_px, height / height_px);

// The whole image in the middle of the frame. `zoom`: CSS pixels per pixel of the image; `centre`: the pixel in the
// middle of the frame; `flip_u`, `flip_v`: shown mirrored, which changes no pixel's name.
export function fitted(width_px, height_px, frame_width, frame_height) {
  const image = [width_px, height_px], frame = [frame_width, frame_height];
  return {
    zoom: whole(image, frame),
    centre: [(width_px - 1) / 2, (height_px - 1) / 2],
    flip_u: false,
    flip_v: false,
    image,
    frame
  };
}
const scales = (port) => [port.flip_u ? -port.zoom : port.zoom, port.flip_v ? -port.zoom : port.zoom];
export const toScreen = (port, pixel) =>
    scales(port).map((scale, i) => port.frame[i] / 2 + scale * (pixel[i] - port.centre[i]));
export const toPixel = (port, place) =>
    scales(port).map((scale, i) => port.centre[i] + (place[i] - port.frame[i] / 2) / scale);

// Zooms; the pixel under `place` stays there.
export function zoomed(port, factor, place) {
  const zoom = Math.min(MOST_ZOOM, Math.max(LEAST_ZOOM, port.zoom * factor)), fixed = toPixel(port, place);
  const next = {...port, zoom};
  return {...next, centre: fixed.map((value, i) => value - (place[i] - port.frame[i] / 2) / scales(next)[i])};
}
// The image moves with the pointer by [dx, dy].
export const panned = (port, by) => ({...port, centre: scales(port).map((scale, i) => port.centre[i] - by[i] / scale)});
// The frame has another size. Its middle stays, and so does the zoom against the whole image: a whole image stays
// whole, and going back to the old size gives the old picture.
export function resized(port, frame_width, frame_height) {
  const frame = [frame_width, frame_height];
  return {...port, zoom: port.zoom * whole(port.image, frame) / whole(port.image, port.frame), frame};
}
// The six numbers of a canvas' setTransform() that draws the image so that its pixels lie as toScreen() says. On a
// canvas, pixel (0, 0) covers the square from (0, 0) to (1, 1), so its centre is at (0.5, 0.5).
export function canvasTransform(port, screen_per_css) {
  const [a, d] = scales(port), [x, y] = toScreen(port, [-0.5, -0.5]);
  return [a, 0, 0, d, x, y].map((value) => value * screen_per_css);
}
