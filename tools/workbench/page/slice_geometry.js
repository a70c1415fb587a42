// SPDX-License-Identifier: Apache-2.0
// The places of a CT's voxels, and how its slices are shown. A CT is {size, spacing_mm, origin_mm, direction} as
// Grid of the library: an index [i, j, k] is a voxel's centre, point = origin + direction * (index * spacing), patient
// axes LPS (x to the left, y to the back, z to the head).
//
// A plane is {across, right, down}: the grid's axis that is across the slices, and the ones that run to the right and
// down on the screen, each {axis, sign}. A view is {centre, scale, width, height}: the index at the middle of the
// canvas, canvas units per mm, and the canvas's size. Places on the canvas are continuous; [0, 0] is its corner.

export const point = (ct, index) => ct.origin_mm.map(
    (start, row) => start + [0, 1, 2].reduce((sum, k) => sum + ct.direction[row][k] * index[k] * ct.spacing_mm[k], 0));
export const index = (ct, point_mm) => [0, 1, 2].map(
    (k) => [0, 1, 2].reduce((sum, row) => sum + ct.direction[row][k] * (point_mm[row] - ct.origin_mm[row]), 0) /
        ct.spacing_mm[k]);

// For each of the patient's axes: the nearest axis of the grid, and whether it has the same direction.
function nearestAxes(ct) {
  const orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
  const agreement = (order) => order.reduce((sum, axis, row) => sum + Math.abs(ct.direction[row][axis]), 0);
  const best = orders.reduce((a, b) => (agreement(b) > agreement(a) + 1e-9 ? b : a));
  return best.map((axis, row) => ({axis, sign: ct.direction[row][axis] < 0 ? -1 : 1}));
}

// As radiologists look: axial from the feet, coronal from the front, sagittal from the left; the head is up.
export function planes(ct) {
  const [left, back, head] = nearestAxes(ct), feet = {axis: head.axis, sign: -head.sign};
  return {
    axial: {across: head.axis, right: left, down: back},
    coronal: {across: back.axis, right: left, down: feet},
    sagittal: {across: left.axis, right: back, down: feet}
  };
}

// Steps on the canvas for one step of the index along each axis of the grid.
const steps = (ct, plane, view) => ({
  right: plane.right.sign * ct.spacing_mm[plane.right.axis] * view.scale,
  down: plane.down.sign * ct.spacing_mm[plane.down.axis] * view.scale
});

export function place(ct, plane, view, at) {
  const step = steps(ct, plane, view);
  return [
    view.width / 2 + step.right * (at[plane.right.axis] - view.centre[plane.right.axis]),
    view.height / 2 + step.down * (at[plane.down.axis] - view.centre[plane.down.axis])
  ];
}

export function indexAt(ct, plane, view, [x, y], slice) {
  const step = steps(ct, plane, view), at = [0, 0, 0];
  at[plane.across] = slice;
  at[plane.right.axis] = view.centre[plane.right.axis] + (x - view.width / 2) / step.right;
  at[plane.down.axis] = view.centre[plane.down.axis] + (y - view.height / 2) / step.down;
  return at;
}

// The numbers of CanvasRenderingContext2D.setTransform() that draw a slice's picture in its place. The picture has
// the lower of the two axes along its rows; its pixel [a, b] is the square around the index [a + 0.5, b + 0.5].
export function pictureTransform(ct, plane, view) {
  const step = steps(ct, plane, view), is_straight = plane.right.axis < plane.down.axis;
  const corner = [0, 0, 0].map(() => -0.5), [x, y] = place(ct, plane, view, corner);
  return is_straight ? [step.right, 0, 0, step.down, x, y] : [0, step.down, step.right, 0, x, y];
}

// The view that shows a whole slice.
export function whole(ct, plane, width, height) {
  const side = ({axis}) => ct.size[axis] * ct.spacing_mm[axis];
  return {
    centre: ct.size.map((n) => (n - 1) / 2),
    scale: Math.min(width / side(plane.right), height / side(plane.down)),
    width,
    height
  };
}

// The same view on a canvas of another size. The scale against that of the whole slice stays.
export function resized(ct, plane, view, width, height) {
  const scaleOf = (size) => whole(ct, plane, size.width, size.height).scale;
  return {...view, width, height, scale: view.scale * scaleOf({width, height}) / scaleOf(view)};
}

// The patient's directions at the right or lower end of the screen: "L", or "LA" if the grid is oblique.
export function letters(ct, {axis, sign}) {
  const names = [['L', 'R'], ['P', 'A'], ['H', 'F']];
  return [0, 1, 2]
      .map((row) => ({row, part: sign * ct.direction[row][axis]}))
      .filter(({part}) => Math.abs(part) > 0.25)
      .sort((a, b) => Math.abs(b.part) - Math.abs(a.part))
      .map(({row, part}) => names[row][part > 0 ? 0 : 1])
      .join('');
}
export const opposite = ({axis, sign}) => ({axis, sign: -sign});

export const isInside = (ct, at) => at.every((value, k) => value >= -0.5 && value <= ct.size[k] - 0.5);
