// SPDX-License-Identifier: Apache-2.0
// What a node made: pictures, slices, surfaces, figures and texts.
import * as THREE from 'three';

import {el, number, withUnit} from '../../report/page/dom.js';
import {Orbit} from '../../report/page/orbit.js';

let open = [];  // what must be freed when other outputs are shown

function bytes(text) {
  const raw = atob(text), all = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; ++i) all[i] = raw.charCodeAt(i);
  return all;
}

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
        const pixels = new ImageData(slice.width, slice.height), grey = bytes(slice.grey);
        for (let k = 0; k < grey.length; ++k) pixels.data.set([grey[k], grey[k], grey[k], 255], 4 * k);
        canvas.getContext('2d').putImageData(pixels, 0, 0);
        return canvas;
      }),
      el('p', {class: 'note'},
         'Slices through the middle; black is ' + number(part.least) + ', white is ' + number(part.most)));
}

function surface(part) {
  if (!THREE.WebGLRenderer) return el('p', {class: 'note'}, 'The 3D view needs three.js: ' + part.text);
  const canvas = el('canvas', {
    class: 'scene',
    tabindex: 0,
    role: 'img',
    'aria-label': 'Surface in 3D, ' + part.text + '. Arrow keys turn it, plus and minus zoom, 0 goes back'
  });
  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({canvas, antialias: true, alpha: true});
  } catch (error) {
    return el('p', {class: 'note'}, 'This browser draws no 3D: ' + part.text);
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(bytes(part.vertices).buffer), 3));
  geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(bytes(part.triangles).buffer), 1));
  geometry.computeVertexNormals();
  geometry.computeBoundingSphere();
  const scene = new THREE.Scene(), light = new THREE.DirectionalLight(0xffffff, 0.9);
  const camera = new THREE.PerspectiveCamera(2 * Orbit.HALF_FIELD * 180 / Math.PI, 1, 1, 20000);
  camera.up.set(0, 0, 1);
  scene.add(
      new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({color: 0xd8c9a8, side: THREE.DoubleSide})), light,
      new THREE.AmbientLight(0xffffff, 0.35));
  let orbit = null, is_waiting = false, is_over = false;
  const draw = () => {
    is_waiting = false;
    if (is_over || !canvas.clientWidth) return;
    renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    renderer.setSize(canvas.clientWidth, canvas.clientHeight, false);
    camera.aspect = canvas.clientWidth / canvas.clientHeight;
    camera.updateProjectionMatrix();
    camera.position.set(...orbit.eye());
    camera.lookAt(...orbit.target);
    light.position.copy(camera.position);
    renderer.render(scene, camera);
  };
  const changed = () => {
    if (!orbit || is_waiting) return;
    is_waiting = true;
    requestAnimationFrame(draw);
  };
  orbit = new Orbit(canvas, changed);
  const {center, radius} = geometry.boundingSphere;
  orbit.reset({target: center.toArray(), distance: radius / Math.sin(Orbit.HALF_FIELD) * 1.05, azimuth_deg: -65});
  const size = new ResizeObserver(changed);
  size.observe(canvas);
  open.push(() => {
    is_over = true;
    size.disconnect();
    geometry.dispose();
    renderer.dispose();
    renderer.forceContextLoss();
  });
  return el('div', {}, canvas, el('p', {class: 'note'}, part.text + '. Drag or arrow keys turn it, + and − zoom.'));
}

const figures = (part) =>
    el('div', {class: 'scroll'},
       el('table', {class: 'values'},
          el('tbody', {},
             part.figures.map(
                 (one) =>
                     el('tr', {}, el('th', {scope: 'row'}, one.name),
                        el('td', {class: 'number'}, withUnit(one.value, one.unit)))))));

const verdict = (part) =>
    el('div', {class: 'verdict ' + part.judgement},
       el('p', {class: 'verdict-head'}, el('strong', {}, part.judgement), ' ',
          el('small', {},
             part.failure_probability === null ? '' : 'failure ' + (100 * part.failure_probability).toFixed(1) + ' %')),
       el('ul', {class: 'verdict-list'}, [...part.reasons, ...part.remedies].map((text) => el('li', {}, text))));

function shown(part, what) {
  const name = part.name && el('p', {class: 'note'}, part.name);
  const content = part.kind === 'picture' ?
      el('img', {src: part.picture, alt: what + (part.name ? ', ' + part.name : '')}) :
      part.kind === 'slices'  ? slices(part) :
      part.kind === 'mesh'    ? surface(part) :
      part.kind === 'verdict' ? verdict(part) :
      part.kind === 'figures' ? figures(part) :
                                el('pre', {class: 'file', tabindex: 0}, part.text);
  return el('div', {class: 'part', 'data-kind': part.kind}, name || '', content);
}

export function clear() {
  for (const end of open) end();
  open = [];
}

// Elements for what api/pipeline/look answers.
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
