// SPDX-License-Identifier: Apache-2.0
// The pose of a bone in a frame of a sequence, from keyframes and tracked poses. Keyframes: {FRAME: {pose, used}},
// where `used` says that the tracking used the keyframe. Tracked: the poses from frame 1 on, with null where the bone
// was lost.
import {minus, moved, plus, times} from './geometry.js';

// [x, y, z, w] of a motion's rotation, by its largest component.
function quaternion(m) {
  const squares = [
    1 + m[0][0] - m[1][1] - m[2][2], 1 - m[0][0] + m[1][1] - m[2][2], 1 - m[0][0] - m[1][1] + m[2][2],
    1 + m[0][0] + m[1][1] + m[2][2]
  ];
  const at = squares.indexOf(Math.max(...squares)), [x, y, z, w] = [
    [squares[0], m[1][0] + m[0][1], m[0][2] + m[2][0], m[2][1] - m[1][2]],
    [m[1][0] + m[0][1], squares[1], m[2][1] + m[1][2], m[0][2] - m[2][0]],
    [m[0][2] + m[2][0], m[2][1] + m[1][2], squares[2], m[1][0] - m[0][1]],
    [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1], squares[3]]
  ][at];
  const length = Math.hypot(x, y, z, w);
  return [x, y, z, w].map((value) => value / length);
}

function rotationOf([x, y, z, w]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]
  ];
}

// Slerp: the shorter way, at constant speed.
function slerp(a, b, share) {
  let cosine = a.reduce((sum, value, i) => sum + value * b[i], 0);
  const sign = cosine < 0 ? -1 : 1;
  cosine = Math.min(1, Math.abs(cosine));
  const angle = Math.acos(cosine), sine = Math.sin(angle);
  const [from, to] =
      sine < 1e-9 ? [1 - share, share] : [Math.sin((1 - share) * angle) / sine, Math.sin(share * angle) / sine];
  const mixed = a.map((value, i) => from * value + to * sign * b[i]), length = Math.hypot(...mixed);
  return mixed.map((value) => value / length);
}

// Interpolates the rotation by slerp, and the middle of the bone on a straight line. share 0: the first pose, 1: the
// second.
export function between(first, second, share, middle_mm) {
  const rotation = rotationOf(slerp(quaternion(first), quaternion(second), share));
  const begin = moved(first, middle_mm), end = moved(second, middle_mm);
  const middle = plus(begin, times(minus(end, begin), share));
  const shift = minus(middle, rotation.map((row) => row.reduce((sum, value, i) => sum + value * middle_mm[i], 0)));
  return [...rotation.map((row, i) => [...row, shift[i]]), [0, 0, 0, 1]];
}

// What is known in the frame itself: {pose, is}, or null.
function known(frame, keyframes, tracked) {
  const keyframe = keyframes[frame], found = (tracked || [])[frame - 1];
  if (keyframe && !(keyframe.used && found)) return {pose: keyframe.pose, is: 'keyframe'};
  if (found) return {pose: found, is: keyframe ? 'tracked from the keyframe' : 'tracked'};
  return null;
}

// {pose, is} of a bone {middle_mm}; null if nothing is known in any frame.
export function at(frame, frames, bone, keyframes, tracked) {
  const here = known(frame, keyframes, tracked);
  if (here) return here;
  let before = frame - 1, after = frame + 1, one = null, other = null;
  while (before >= 1 && !(one = known(before, keyframes, tracked))) --before;
  while (after <= frames && !(other = known(after, keyframes, tracked))) ++after;
  const lost = tracked ? 'lost; ' : '';
  if (one && other)
    return {
      pose: between(one.pose, other.pose, (frame - before) / (after - before), bone.middle_mm),
      is: lost + `between frames ${before} and ${after}`
    };
  if (one || other) return {pose: (one || other).pose, is: lost + `as in frame ${one ? before : after}`};
  return null;
}
