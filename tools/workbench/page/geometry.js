// SPDX-License-Identifier: Apache-2.0
// Rigid motions and cameras. A motion is a 4 x 4 matrix as rows; points are [x, y, z] in mm; pixels are [u, v] with
// (0, 0) at the centre of the top left pixel. A camera is {intrinsics, camera_from_world, width_px, height_px}.

// Solves 3 x 3 equations; null without a unique solution. Cramer's rule is exact enough for sums of projections.
function solved(rows, right) {
  const columns = [0, 1, 2].map((j) => rows.map((row) => row[j]));
  const volume = (a, b, c) => dot(a, cross(b, c)), whole = volume(...columns);
  if (!(Math.abs(whole) > 1e-9)) return null;
  return [0, 1, 2].map((k) => volume(...columns.map((column, j) => (j === k ? right : column))) / whole);
}

// The point with the least sum of squared distances from the rays of `seen`, a list of {camera, pixel}. Returns
// {world_mm, distance_mm: the largest distance between two rays, residuals_px: of each view}. Null for fewer than two
// rays, for nearly parallel ones, or if the point is not in front of all sources.
export function triangulated(seen) {
  const rays = seen.map(({camera, pixel}) => ray(camera, pixel));
  if (rays.length < 2) return null;
  const across =
      rays.map(({direction: d}) => [0, 1, 2].map((i) => [0, 1, 2].map((j) => (i === j ? 1 : 0) - d[i] * d[j])));
  const apply = (rows, vector) => rows.map((row) => dot(row, vector));
  const sum = [0, 1, 2].map((i) => [0, 1, 2].map((j) => across.reduce((total, rows) => total + rows[i][j], 0)));
  const right = rays.map(({origin}, k) => apply(across[k], origin)).reduce(plus);
  const world_mm = solved(sum, right);
  if (!world_mm) return null;
  const residuals_px = seen.map(({camera, pixel: wanted}) => {
    const at = pixel(camera, world_mm);
    return at && length(minus(at, wanted));
  });
  if (residuals_px.includes(null)) return null;
  let distance_mm = 0;
  for (let i = 0; i < rays.length; ++i)
    for (let k = 0; k < i; ++k) distance_mm = Math.max(distance_mm, distance(rays[i], rays[k]));
  return {world_mm, distance_mm, residuals_px};
}

// The distance of two lines in mm.
function distance(a, b) {
  const between = minus(b.origin, a.origin), normal = cross(a.direction, b.direction), size = length(normal);
  if (size < 1e-9) return length(minus(between, times(a.direction, dot(between, a.direction))));
  return Math.abs(dot(between, normal)) / size;
}

// The ray that ends in `pixel` of `camera`, as `other` sees it: both ends of the part in its image, or null.
export function epipolarLine(camera, pixel, other) {
  const {origin, direction} = ray(camera, pixel);
  const seen = [origin, direction].map((vector, i) => (i === 0 ? moved : turned)(other.camera_from_world, vector));
  // The plane through the other source and the ray, as an image line: normal . K^-1 (u, v, 1) = 0.
  const normal = cross(...seen), [[fx, skew, u0], [, fy, v0]] = other.intrinsics;
  const a = normal[0] / fx, b = (normal[1] - a * skew) / fy, c = normal[2] - a * u0 - b * v0;
  return clipped(a, b, c, other.width_px, other.height_px);
}

// The part of the line a u + b v + c = 0 inside an image, whose border lies half a pixel outside the centres.
function clipped(a, b, c, width_px, height_px) {
  const ends = [];
  const add = (u, v) => {
    if (u < -0.5 - 1e-6 || v < -0.5 - 1e-6 || u > width_px - 0.5 + 1e-6 || v > height_px - 0.5 + 1e-6) return;
    if (ends.every((end) => Math.hypot(end[0] - u, end[1] - v) > 1e-3)) ends.push([u, v]);
  };
  for (const u of [-0.5, width_px - 0.5]) b && add(u, -(a * u + c) / b);
  for (const v of [-0.5, height_px - 0.5]) a && add(-(b * v + c) / a, v);
  return ends.length >= 2 ? ends.slice(0, 2) : null;
}

// From the source to the detector's middle: the ray through the principal point.
export const centralRay = ({intrinsics, ...camera}) =>
    ray({intrinsics, ...camera}, [intrinsics[0][2], intrinsics[1][2]]);

// The angle between the central rays of two cameras, 0 to 180.
export function angle_deg(a, b) {
  const [one, two] = [a, b].map((camera) => centralRay(camera).direction);
  return Math.atan2(length(cross(one, two)), dot(one, two)) * 180 / Math.PI;
}

// Where central rays meet: {world_mm, distance_mm} or null.
export function meeting(cameras) {
  return triangulated(cameras.map((camera) => ({camera, pixel: [camera.intrinsics[0][2], camera.intrinsics[1][2]]})));
}

// A row of a motion has a fourth number, which belongs to the shift.
export const dot = (a, b) => b.reduce((sum, value, i) => sum + value * a[i], 0);
export const plus = (a, b) => a.map((value, i) => value + b[i]);
export const minus = (a, b) => a.map((value, i) => value - b[i]);
export const times = (a, factor) => a.map((value) => value * factor);
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.hypot(...a);
export const unit = (a) => times(a, 1 / length(a));

const identity = () => [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];
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
