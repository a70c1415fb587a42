// SPDX-License-Identifier: Apache-2.0
// The outputs of a node: pictures, slices, surfaces, figures and texts.
import {el, number, row, table, withUnit} from '../../report/page/dom.js';
import {decoded} from '../../report/page/meshes.js';
import * as Verdict from '../../report/page/verdict.js';

import {SurfaceView} from './surface_view.js';

let open = [];  // the 3D views that are shown

function slices(part) {
  const words = ['from the side', 'from the front', 'from above'];
  return el(
      'div', {class: 'slices'}, part.slices.map((slice, i) => {
        const canvas = el('canvas', {
          width: slice.width,
          height: slice.height,
          role: 'img',
          'aria-label': 'Slice through the middle, ' + words[i],
          style: 'aspect-ratio: ' + slice.width + ' / ' + slice.height * slice.stretch
        });
        const pixels = new ImageData(slice.width, slice.height), grey = decoded(slice.grey);
        for (let k = 0; k < grey.length; ++k) pixels.data.set([grey[k], grey[k], grey[k], 255], 4 * k);
        canvas.getContext('2d').putImageData(pixels, 0, 0);
        return canvas;
      }),
      el('p', {class: 'note'},
         'Slices through the middle; black is ' + number(part.least) + ', white is ' + number(part.most)));
}

function surface(part) {
  const view =
      new SurfaceView('Surface in 3D, ' + part.text + '. Arrow keys turn it, plus and minus zoom, 0 goes back');
  open.push(view);
  view.set([{
    vertices: new Float32Array(decoded(part.vertices).buffer),
    triangles: new Uint32Array(decoded(part.triangles).buffer),
    colour: 0xd8c9a8
  }]);
  return el(
      'div', {}, view.element, el('p', {class: 'note'}, part.text + '. Drag or arrow keys turn it, + and − zoom.'));
}

const figures = (part) => table(
    {class: 'values'}, null, null,
    part.figures.map((one) => row(one.name, [withUnit(one.value, one.unit)], {class: 'number'})));

function shown(part, what) {
  const name = part.name && el('p', {class: 'note'}, part.name);
  const content = part.kind === 'picture' ?
      el('img', {src: part.picture, alt: what + (part.name ? ', ' + part.name : '')}) :
      part.kind === 'slices'  ? slices(part) :
      part.kind === 'mesh'    ? surface(part) :
      part.kind === 'verdict' ? el('div', {class: 'verdict ' + part.judgement}, Verdict.words(part)) :
      part.kind === 'figures' ? figures(part) :
                                el('pre', {class: 'file', tabindex: 0}, part.text);
  return el('div', {class: 'part', 'data-kind': part.kind}, name || '', content);
}

export function clear() {
  for (const view of open) view.dispose();
  open = [];
}

// Elements for the answer of api/pipeline/look.
export function show(node, outputs) {
  clear();
  return outputs.map(
      (output) =>
          el('div', {class: 'output', 'data-output': output.name},
             el('h3', {}, output.name, ' ', el('small', {class: 'note'}, output.type)),
             output.help && el('p', {class: 'note'}, output.help) || '',
             el('div', {class: 'items'},
                output.items.map(
                    (item) => el(
                        'div', {class: 'item'}, item.place && el('h4', {}, item.place) || '',
                        item.parts.map(
                            (part) => shown(part, node + ' ' + output.name + (item.place ? ' ' + item.place : '')))))),
             output.left_out > 0 && el('p', {class: 'note'}, 'and ' + output.left_out + ' more') || ''));
}
