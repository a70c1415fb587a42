// SPDX-License-Identifier: Apache-2.0
// Rigid motions and cameras. A motion is a 4 x 4 matrix as rows; points are [x, y, z] in mm; pixels are [u, v] with
// (0, 0) at the centre of the top left pixel. A camera is {intrinsics, camera_from_world, width_px, height_px}.

// A row of a motion has a fourth number, which belongs to the shift.
export const dot = (a, b) => b.reduce((sum, value, i) => sum + value * a[i], 0);
export const plus = (a, b) => a.map((value, i) => value + b[i]);
export const minus = (a, b) => a.map((value, i) => value - b[i]);
export const times = (a, factor) => a.map((value) => value * factor);
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.hypot(...a);
export const unit = (a) => times(a, 1 / length(a));

export const identity = () => [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];
export const multiply = (a, b) =>
    a.map((row) => [0, 1, 2, 3].map((j) => row.reduce((sum, x, k) => sum + x * b[k][j], 0)));
export const moved = (motion, point) => motion.slice(0, 3).map((row) => dot(row, point) + row[3]);
export const turned = (motion, vector) => motion.slice(0, 3).map((row) => dot(row, vector));
// For rigid motions only.
export function inverse(motion) {
  const columns = [0, 1, 2].map((j) => motion.slice(0, 3).map((row) => row[j]));
  const shift = motion.slice(0, 3).map((row) => row[3]);
  return [...columns.map((column) => [...column, -dot(column, shift)]), [0, 0, 0, 1]];
}
export const shift = (vector) => identity().map((row, i) => (i < 3 ? [...row.slice(0, 3), vector[i]] : row));
// By the right-hand rule about an axis through a point.
export function rotation(axis, angle_rad, through) {
  const [x, y, z] = unit(axis), c = Math.cos(angle_rad), s = Math.sin(angle_rad), k = 1 - c;
  const turn = [
    [c + k * x * x, k * x * y - s * z, k * x * z + s * y, 0], [k * y * x + s * z, c + k * y * y, k * y * z - s * x, 0],
    [k * z * x - s * y, k * z * y + s * x, c + k * z * z, 0], [0, 0, 0, 1]
  ];
  return multiply(shift(through), multiply(turn, shift(times(through, -1))));
}

// Null for a point that is not in front of the camera.
export function pixel(camera, world_mm) {
  const seen = moved(camera.camera_from_world, world_mm);
  if (!(seen[2] > 0)) return null;
  const [a, b] = camera.intrinsics.slice(0, 2).map((row) => dot(row, seen) / seen[2]);
  return [a, b];
}
// The X-ray that ends in a pixel: {origin, direction} in the world, from the source on.
export function ray(camera, [u, v]) {
  const [[fx, skew, u0], [, fy, v0]] = camera.intrinsics;
  const y = (v - v0) / fy, x = (u - u0 - skew * y) / fx;
  const back = inverse(camera.camera_from_world);
  return {origin: back.slice(0, 3).map((row) => row[3]), direction: unit(turned(back, [x, y, 1]))};
}
