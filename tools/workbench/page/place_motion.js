// SPDX-License-Identifier: Apache-2.0
// How a bone moves when it is dragged in a view. Each function returns a motion of the world: a 4 x 4 matrix to
// multiply the bone's pose by, from the left. Depth is along z of the camera, away from the X-ray source.
import * as Geometry from './geometry.js';
import {inverse, length, minus, moved, plus, times, turned, unit} from './geometry.js';

const depth_mm = (camera, point_mm) => moved(camera.camera_from_world, point_mm)[2];
const source_mm = (camera) => inverse(camera.camera_from_world).slice(0, 3).map((row) => row[3]);
// A direction of the camera in the world: [1, 0, 0] is to the right in the image, [0, 1, 0] down, [0, 0, 1] away.
export const direction = (camera, vector) => turned(inverse(camera.camera_from_world), vector);

// The point of a pixel's ray at a depth.
function pointAt(camera, pixel, at_mm) {
  const {origin, direction: along} = Geometry.ray(camera, pixel);
  return plus(origin, times(along, at_mm / turned(camera.camera_from_world, along)[2]));
}

// The point under the pixel `from`, at the depth of `middle_mm`, moves under `to`. Nothing moves in depth.
export function shiftInView(camera, middle_mm, from, to) {
  const at_mm = depth_mm(camera, middle_mm);
  return Geometry.shift(minus(pointAt(camera, to, at_mm), pointAt(camera, from, at_mm)));
}

// Clockwise in the view, about the ray through the middle.
export const turnInView = (camera, middle_mm, angle_rad) =>
    Geometry.rotation(minus(middle_mm, source_mm(camera)), angle_rad, middle_mm);

// The angle between two pixels of a pointer's way, seen from the middle.
export function angleAbout(camera, middle_mm, from, to) {
  const centre = Geometry.pixel(camera, middle_mm);
  if (!centre) return 0;
  const angle = ([u, v]) => Math.atan2(v - centre[1], u - centre[0]);
  const turn = angle(to) - angle(from);
  return Math.atan2(Math.sin(turn), Math.cos(turn));
}

// Along the ray through the middle, so that the bone grows or shrinks in this view and stays where it is.
export const shiftInDepth = (camera, middle_mm, by_mm) =>
    Geometry.shift(times(unit(minus(middle_mm, source_mm(camera))), by_mm));

// About the bone's own axis.
export const roll = (axis, middle_mm, angle_rad) => Geometry.rotation(axis, angle_rad, middle_mm);

// Tips the bone towards the source: about the direction in the image that is perpendicular to its long axis.
export function tip(camera, axis, middle_mm, angle_rad) {
  const away = unit(minus(middle_mm, source_mm(camera))), across = Geometry.cross(axis, away);
  return Geometry.rotation(length(across) > 0.05 ? across : direction(camera, [1, 0, 0]), angle_rad, middle_mm);
}

// The angle of a roll: a degree for each millimetre that the pointer moved across the bone's axis.
export function rollAngle(camera, axis, middle_mm, from, to) {
  const at_mm = depth_mm(camera, middle_mm), away = unit(minus(middle_mm, source_mm(camera)));
  const across = Geometry.cross(axis, away);
  if (length(across) < 0.05) return 0;
  const went = minus(pointAt(camera, to, at_mm), pointAt(camera, from, at_mm));
  return Geometry.dot(went, unit(across)) * Math.PI / 180;
}
