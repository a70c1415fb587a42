// SPDX-License-Identifier: Apache-2.0
// Geometry of a point in several views: its place, the agreement of the views, and the line on which another view must
// show it.
import * as Geometry from './geometry.js';
import {cross, dot, length, minus, plus, times} from './geometry.js';

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
  const rays = seen.map(({camera, pixel}) => Geometry.ray(camera, pixel));
  if (rays.length < 2) return null;
  const across =
      rays.map(({direction: d}) => [0, 1, 2].map((i) => [0, 1, 2].map((j) => (i === j ? 1 : 0) - d[i] * d[j])));
  const apply = (rows, vector) => rows.map((row) => dot(row, vector));
  const sum = [0, 1, 2].map((i) => [0, 1, 2].map((j) => across.reduce((total, rows) => total + rows[i][j], 0)));
  const right = rays.map(({origin}, k) => apply(across[k], origin)).reduce(plus);
  const world_mm = solved(sum, right);
  if (!world_mm) return null;
  const residuals_px = seen.map(({camera, pixel}) => {
    const at = Geometry.pixel(camera, world_mm);
    return at && length(minus(at, pixel));
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
  const {origin, direction} = Geometry.ray(camera, pixel);
  const seen = [origin, direction].map(
      (vector, i) => (i === 0 ? Geometry.moved : Geometry.turned)(other.camera_from_world, vector));
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
    Geometry.ray({intrinsics, ...camera}, [intrinsics[0][2], intrinsics[1][2]]);

// The angle between the central rays of two cameras, 0 to 180.
export function angle_deg(a, b) {
  const [one, two] = [a, b].map((camera) => centralRay(camera).direction);
  return Math.atan2(length(cross(one, two)), dot(one, two)) * 180 / Math.PI;
}

// Where central rays meet: {world_mm, distance_mm} or null.
export function meeting(cameras) {
  return triangulated(cameras.map((camera) => ({camera, pixel: [camera.intrinsics[0][2], camera.intrinsics[1][2]]})));
}
