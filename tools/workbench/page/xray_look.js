// SPDX-License-Identifier: Apache-2.0
// The control that says how X-rays are shown. The pages "Case" and "Place" have the same one, and share what it says.
import * as Dom from '../../report/page/dom.js';
import {el} from '../../report/page/dom.js';

const WAYS = [['body', 'Body'], ['equalised', 'Equalised'], ['all', 'All']];
const MEANINGS = {
  body: 'The greys are spread over the body. Air and collimator may be all white and all black.',
  equalised: 'The contrast is the same in all regions, as in the reports. Bone is seen under thick and thin tissue.',
  all: 'The greys are spread over the whole image.'
};
const look = {
  way: 'body',
  brightness: 0,
  contrast: 0
};

// How greys follow the numbers in the window.
export const curveOf = (ranges) =>
    ({gamma: look.way === 'all' ? 1 : ranges.gamma, is_equalised: look.way === 'equalised'});

// The window of an image with these ranges.
export function windowOf(ranges) {
  const [low, high] = look.way === 'all' ? ranges.all : ranges.body;
  const width = (high - low) * 2 ** -look.contrast, middle = (low + high) / 2 - look.brightness * (high - low);
  return [middle - width / 2, middle + width / 2];
}

// The control. changed() is called after each change.
export function control(changed) {
  const reset = Dom.button('Reset', () => {
    Object.assign(look, {brightness: 0, contrast: 0});
    for (const one of [brightness, contrast]) one.querySelector('input').value = 50;
    brightness.querySelector('input').focus();
    reset.hidden = true;
    changed();
  }, {'data-do': 'reset-greys', hidden: !look.brightness && !look.contrast, title: 'Brightness and contrast'});
  const slider = (name, most) => Dom.slider(name, 0.5 + look[name] / (2 * most), (share) => {
    look[name] = (2 * share - 1) * most;
    reset.hidden = false;
    changed();
  });
  const brightness = slider('brightness', 0.6), contrast = slider('contrast', 2);
  const ways = Dom.choice('X-rays', WAYS, look.way, (way) => {
    look.way = way;
    changed();
  });
  for (const [way] of WAYS) ways.querySelector(`[data-value="${way}"]`).title = MEANINGS[way];
  return el('div', {class: 'xray-look'}, ways, brightness, contrast, reset);
}
