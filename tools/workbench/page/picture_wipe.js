// SPDX-License-Identifier: Apache-2.0
// Two pictures one over the other, with a line between them that is moved by a slider, or by dragging over the picture.
import {dragAcross, el} from '../../report/page/dom.js';

// first, second: {src, text}. Left of the line is the first.
export function wipe(first, second, what) {
  const image = (one, name) =>
      el('img', {src: one.src, alt: what + ' of ' + one.text, class: name, draggable: 'false'});
  const stage =
      el('div', {class: 'wipe'}, image(first, 'below'), image(second, 'above'), el('span', {class: 'line'}),
         el('span', {class: 'label left'}, first.text), el('span', {class: 'label right'}, second.text));
  const slider = el('input', {
    type: 'range',
    min: 0,
    max: 100,
    step: 0.5,
    value: 50,
    'aria-label': 'Line between the two pictures',
    oninput: () => set(Number(slider.value))
  });
  function set(percent) {
    slider.value = percent;
    stage.style.setProperty('--at', percent + '%');
  }
  dragAcross(stage, set);
  set(50);
  return el('figure', {class: 'wiped'}, stage, slider);
}
