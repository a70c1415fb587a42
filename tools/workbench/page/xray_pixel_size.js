// SPDX-License-Identifier: Apache-2.0
// The size of a pixel that would make views agree. A wrong size is the usual mistake of a camera that was typed in: it
// is often the one of the full detector, while the image was binned or zoomed.
import {length, minus} from './geometry.js';
import * as Sight from './sight.js';

const LEAST_POINTS = 3, WRONG_mm = 1, BETTER = 0.4, LEAST_CHANGE = 0.03;

// The camera if its pixels were `factor` times as large.
const scaled = (camera, factor) => ({
  ...camera,
  intrinsics: camera.intrinsics.map((row, i) => (i < 2 ? [row[0] / factor, row[1] / factor, row[2]] : row))
});

// The landmarks that two views or more show, with the rays' ends: [{model_mm, seen: [{view, pixel}]}].
const shared = (views, landmarks) =>
    landmarks
        .map(({model_mm, pixels}) => ({
               model_mm,
               seen: Object.entries(pixels || {}).filter(([name]) => views.some(({view}) => view.name === name))
             }))
        .filter(({seen}) => seen.length > 1);

// How badly the views agree, in mm: the distances of the rays, and how far the distances between landmarks differ from
// those in the CT.
function disagreement(views, points, factorOf) {
  const cameras = new Map(views.map(({view, camera}) => [view.name, scaled(camera, factorOf(view.name))]));
  const found = points.map(
      ({model_mm, seen}) =>
          ({model_mm, at: Sight.triangulated(seen.map(([name, pixel]) => ({camera: cameras.get(name), pixel})))}));
  if (found.some(({at}) => !at)) return Infinity;
  const errors = found.map(({at}) => at.distance_mm), inCt = found.filter(({model_mm}) => model_mm);
  for (let i = 0; i < inCt.length; ++i)
    for (let k = 0; k < i; ++k)
      errors.push(
          length(minus(inCt[i].at.world_mm, inCt[k].at.world_mm)) - length(minus(inCt[i].model_mm, inCt[k].model_mm)));
  return Math.sqrt(errors.reduce((sum, error) => sum + error * error, 0) / errors.length);
}

// The factor with the least disagreement, from a third to three times the present size.
function best(cost) {
  let low = Math.log(1 / 3), high = Math.log(3), at = 0, least = Infinity;
  for (let round = 0; round < 5; ++round) {
    const step = (high - low) / 24;
    for (let i = 0; i <= 24; ++i) {
      const value = cost(Math.exp(low + i * step));
      if (value < least) [at, least] = [low + i * step, value];
    }
    [low, high] = [at - step, at + step];
  }
  return {factor: Math.exp(at), cost: least};
}

// A sentence if another size of the pixels, in one view or in all, explains the landmarks clearly better. Only views
// that are given by the distances of a C-arm have a size that can be wrong.
export function advice(views, landmarks) {
  const points = shared(views, landmarks), arms = views.filter(({view}) => view.camera && view.camera.c_arm);
  if (points.length < LEAST_POINTS || !arms.length) return '';
  const now = disagreement(views, points, () => 1);
  if (!(now > WRONG_mm)) return '';
  const tried = [arms, ...(views.length > 1 ? arms.map((one) => [one]) : [])].map((changed) => {
    const names = new Set(changed.map(({view}) => view.name));
    return {changed, ...best((factor) => disagreement(views, points, (name) => (names.has(name) ? factor : 1)))};
  });
  const found = tried.reduce((a, b) => (b.cost < a.cost - 1e-9 ? b : a));
  if (found.cost > BETTER * now || Math.abs(Math.log(found.factor)) < LEAST_CHANGE) return '';
  const sizes = found.changed.map(({view}) => {
    const {pixel_mm} = view.camera.c_arm;
    return `${(pixel_mm * found.factor).toPrecision(3)} mm instead of ${pixel_mm} mm in ${view.name}`;
  });
  return `The landmarks disagree by ${now.toFixed(1)} mm. With pixels of ${sizes.join(' and ')} it would be ${
      found.cost.toFixed(1)} mm. Is the image binned, zoomed or scaled?`;
}
