// SPDX-License-Identifier: Apache-2.0
// The dialog that asks what a camera file of another program leaves open (docs/formats.md).
import {el, form, labelled, select} from '../../report/page/dom.js';

import * as Shell from './shell.js';

const MIRRORS = [
  ['none', 'not at all: it is seen from the source, with rows from the top'],
  ['left_right', 'left to right: it is seen from the detector'],
  ['upside_down', 'upside down: its rows begin at the bottom']
];
const is_rtk = (file) => /\.xml$/i.test(file);
const holdsProjections = (file) => /\.(xml|h5|hdf5)$/i.test(file);

// Resolves to the draft's camera, {file, projection, mirror, pixel_mm}, or to undefined.
const ask = (file) => Shell.dialog('Camera file with projections', (close) => {
  const projection =
      el('input', {type: 'number', min: 0, step: 1, value: 0, required: true, 'data-camera-file': 'projection'});
  const pixel =
      el('input', {type: 'number', min: 0.000001, max: 1000, step: 'any', required: true, 'data-camera-file': 'pixel'});
  const mirror = select(
      'How the program’s image was turned over to become this one', MIRRORS, is_rtk(file) ? 'upside_down' : 'none',
      () => {});
  mirror.box.dataset.cameraFile = 'mirror';
  const submit = () => {
    const camera = {file, projection: Number(projection.value)};
    if (mirror.box.value !== 'none') camera.mirror = mirror.box.value;
    if (is_rtk(file)) camera.pixel_mm = [Number(pixel.value), Number(pixel.value)];
    close(camera);
  };
  return form(
      {class: 'arm-fields'}, submit, el('p', {class: 'note'}, file),
      labelled('Number of the projection, counted from 0', projection), mirror,
      is_rtk(file) && labelled('Size of a pixel on the detector, mm', pixel),
      el('div', {class: 'toolbar'}, el('button', {type: 'submit', 'data-camera-file': 'ok'}, 'Use this camera')));
});

// The draft's camera for a chosen file. Asks for what the file does not say.
export const cameraOf = (file) => (holdsProjections(file) ? ask(file) : {file});

export const inWords = ({file, projection, mirror}) => file +
    (projection === undefined ? '' : `, projection ${projection}`) +
    (mirror ? `, image turned over ${mirror === 'left_right' ? 'left to right' : 'upside down'}` : '');
