// SPDX-License-Identifier: Apache-2.0
// The placement of an image on the screen. Places on the screen are [x, y] in CSS pixels from the top left corner of
// the frame that shows the image; pixels are [u, v] with (0, 0) at the centre of the top left pixel.

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
