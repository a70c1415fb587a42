// SPDX-License-Identifier: Apache-2.0
// The form of a node: its options, its wires, and the nodes that would fit in its place.
import * as THREE from 'three';

import {button, checkbox, el, number, row, table, withUnit} from '../../report/page/dom.js';
import {decoded} from '../../report/page/meshes.js';
import {Orbit} from '../../report/page/orbit.js';
import * as Verdict from '../../report/page/verdict.js';

import * as Ask from './server.js';
import * as Shell from './shell.js';

// Surfaces in 3D. Mouse and keys turn them.
export class SurfaceView {
  constructor(label) {
    this.canvas = el('canvas', {class: 'surface', tabindex: 0, role: 'img', 'aria-label': label});
    this.element = el('div', {class: 'slice-box'}, this.canvas);
    this.orbit = new Orbit(this.canvas, () => this.draw());
    this.observer = new ResizeObserver(() => this.draw());
    this.observer.observe(this.canvas);
  }

  dispose() {
    this.observer.disconnect();
    if (!this.renderer) return;
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.world = null;
  }

  // Null if this browser or this build has no WebGL; then the page says so.
  start() {
    if (this.renderer || this.isMissing) return this.renderer;
    try {
      this.renderer = new THREE.WebGLRenderer({canvas: this.canvas, antialias: true, preserveDrawingBuffer: true});
    } catch (error) {
      this.isMissing = true;
      this.element.replaceChildren(
          el('p', {class: 'note'},
             'The surface cannot be shown: this browser has no WebGL, or marrow was built without three.js.'));
      return null;
    }
    this.renderer.setClearColor(0x0b0e11, 1);
    this.lamp = new THREE.DirectionalLight(0xffffff, 0.75);
    this.camera = new THREE.PerspectiveCamera();
    this.camera.matrixAutoUpdate = false;
    return this.renderer;
  }

  // meshes: [{vertices, triangles, colour}], vertices and triangles as typed arrays
  set(meshes) {
    if (!this.start()) return;
    const box = new THREE.Box3();
    this.world = new THREE.Scene();
    this.world.add(new THREE.HemisphereLight(0xffffff, 0x8a8f98, 0.55), this.lamp, this.lamp.target);
    for (const {vertices, triangles, colour} of meshes) {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute('position', new THREE.BufferAttribute(vertices, 3));
      geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
      geometry.computeVertexNormals();
      geometry.computeBoundingBox();
      box.union(geometry.boundingBox);
      this.world.add(new THREE.Mesh(
          geometry,
          new THREE.MeshPhongMaterial({color: colour, specular: 0x222222, shininess: 25, side: THREE.DoubleSide})));
    }
    const sphere = box.getBoundingSphere(new THREE.Sphere());
    const distance = 1.05 * sphere.radius / Math.sin(Orbit.HALF_FIELD);
    if (!this.isPlaced) this.orbit.reset({target: sphere.center.toArray(), distance, azimuth_deg: -90});
    this.isPlaced = true;
    this.radius = sphere.radius;
    this.canvas.dataset.triangles = meshes.reduce((sum, mesh) => sum + mesh.triangles.length / 3, 0);
    this.draw();
  }

  draw() {
    const {clientWidth: width, clientHeight: height} = this.canvas;
    if (!this.world || !width || !height) return;
    const {right, up, back} = this.orbit.axes(), eye = new THREE.Vector3(...this.orbit.eye());
    this.renderer.setPixelRatio(devicePixelRatio || 1);
    this.renderer.setSize(width, height, false);
    this.camera.matrix.makeBasis(new THREE.Vector3(...right), new THREE.Vector3(...up), new THREE.Vector3(...back))
        .setPosition(eye);
    const near = Math.max(1, this.orbit.distance - 2 * this.radius), far = this.orbit.distance + 4 * this.radius;
    this.camera.projectionMatrix.makePerspective(
        ...[-1, 1].map((side) => side * near * Math.tan(Orbit.HALF_FIELD) * width / height),
        ...[1, -1].map((side) => side * near * Math.tan(Orbit.HALF_FIELD)), near, far);
    this.camera.projectionMatrixInverse.getInverse(this.camera.projectionMatrix);
    this.camera.updateMatrixWorld(true);
    this.lamp.position.copy(eye).addScaledVector(new THREE.Vector3(...up), 0.5 * this.orbit.distance);
    this.lamp.target.position.set(...this.orbit.target);
    this.renderer.render(this.world, this.camera);
  }
}

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

export function clearOutputs() {
  for (const view of open) view.dispose();
  open = [];
}

// Elements for the answer of api/pipeline/look.
export function showOutputs(node, outputs) {
  clearOutputs();
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

let count = 0;

// A field with a label, a control and a remark below it.
function field(label, control, remark, more) {
  const id = 'field-' + (++count);
  control.id = id;
  control.setAttribute('aria-describedby', id + '-about');
  return el(
      'div', {class: 'form-field'},
      el('label',
         {for: id
         },
         label),
      el('div', {class: 'control'}, control, more || ''), el('p', {class: 'note', id: id + '-about'}, remark));
}

// What holds where this file does not give the option: the value of the file that it extends, or the default.
const unwritten = (option) => option.written ? option.now + ', written in ' + option.written : option.default;

function control(option, written, changed) {
  const attributes = {'data-option': option.name};
  const choices = option.type === 'true/false' ? ['true', 'false'] : option.choices;
  const typed = written !== undefined && choices && !choices.includes(written);  // such as $input
  if (choices && !typed)
    return el(
        'select', {...attributes, onchange: (event) => changed(event.target.value || null)},
        el('option', {value: '', selected: written === undefined},
           option.written ? unwritten(option) : 'default (' + option.default + ')'),
        choices.map((value) => el('option', {value, selected: value === written}, value)));
  return el('input', {
    ...attributes,
    type: 'text',
    value: written === undefined ? '' : written,
    placeholder: option.required && !option.written ? 'required' : unwritten(option),
    onchange: (event) => changed(event.target.value === '' ? null : event.target.value)
  });
}

function optionField(option, written, edit) {
  const changed = (value) => edit({what: 'option', name: option.name, value});
  const given = written !== undefined;
  const about = [
    option.help, option.range,
    option.required    ? 'required' :
        given          ? 'default ' + option.default :
        option.written ? 'written in ' + option.written :
                         'at its default'
  ].filter(Boolean).join('; ');
  return field(
      option.name, control(option, written, changed), about,
      given && !option.required &&
          button(
              'Default', () => changed(null),
              {'data-default': option.name, 'aria-label': 'Reset ' + option.name + ' to its default'}));
}

// The possible sources of a port: outputs of other nodes with its type.
function sources(nodes, id, port) {
  const names = [];
  for (const [other, {info}] of Object.entries(nodes)) {
    if (other === id || !info) continue;
    const fitting = info.outputs.filter((output) => output.type === port.type);
    for (const output of fitting) names.push(info.outputs.length === 1 ? other : other + '.' + output.name);
  }
  return names;
}

function wireField(port, written, nodes, id, edit) {
  const list =
      el('datalist', {id: 'sources-' + (++count)}, sources(nodes, id, port).map((name) => el('option', {value: name})));
  const box = el('input', {
    type: 'text',
    list: list.id,
    value: written === undefined ? '' : written,
    placeholder: port.optional ? 'not wired' : 'required',
    'data-wire': port.name,
    onchange: (event) =>
        edit({what: 'wire', name: port.name, value: event.target.value === '' ? null : event.target.value})
  });
  const type = port.type + (port.axis ? ', a list over ' + port.axis : '');
  return field(port.name, box, [port.help, type].filter(Boolean).join('; '), list);
}

function fitting(file, node, edit) {
  const place = el('div', {class: 'fits'});
  const find = button(
      'Which nodes fit here?', () => Shell.guarded(async () => {
        place.replaceChildren(el('p', {class: 'note', role: 'status'}, 'Each node is tried in its place …'));
        const fits = await Ask.json('api/pipeline/fits', {file, node});
        const part = (title, verdict, lines) => {
          const some = fits.filter((one) => one.fits === verdict);
          if (!some.length) return null;
          return el(
              verdict === 'yes' ? 'div' : 'details', {}, el(verdict === 'yes' ? 'h4' : 'summary', {}, title),
              el('ul', {class: 'files'},
                 some.map(
                     (one) =>
                         el('li', {},
                            verdict === 'yes' ? button(
                                                    'Use ' + one.node, () => edit({what: 'uses', value: one.node}),
                                                    {'data-use': one.node}) :
                                                el('code', {}, one.node),
                            ' ', el('small', {}, one.summary),
                            lines && one[lines].map((line) => el('small', {class: 'option'}, line))))));
        };
        place.replaceChildren(
            ...[part('These fit', 'yes'), part('These fit when more is wired or given', 'with more', 'missing'),
                part('These do not fit', 'no', 'faults')]
                .filter(Boolean));
        if (!fits.length) place.append(el('p', {class: 'note'}, 'No other node fits here.'));
      }),
      {'data-do': 'fits'});
  return el('div', {}, el('p', {class: 'note'}, 'Another node starts with the defaults of its options.'), find, place);
}

// A node that this file does not write itself: what it is, where it is written, and how this file changes it.
function elsewhere(id, node, head) {
  const change = id.replaceAll('/', '.'), first = node.info && node.info.options[0];
  return el(
      'div', {}, head, el('p', {}, node.info ? node.info.summary : ''),
      el('p', {class: 'note'}, 'Written in ',
         el('a', {href: Shell.addressOf('pipeline', node.file), 'data-do': 'file'}, node.file), ', line ' + node.line,
         node.uses_written ? '; what it uses is written in ' + node.uses_written : '',
         '. To change it in this file only, write  set: {' + change + '.' + (first ? first.name : 'option') + ': …}'),
      node.info && node.info.options.length ?
          el('table', {},
             node.info.options.map(
                 (option) =>
                     el('tr', {}, el('td', {}, option.name), el('td', {}, option.now),
                        el('td', {class: 'note'}, option.written ? 'written in ' + option.written : '')))) :
          '');
}

// The form of node `id` in `state` (api/pipeline). edit(change) asks for a change of the file.
export function form(state, id, edit, goTo) {
  const node = state.nodes[id], own = (change) => edit({node: id, uses: node.uses, ...change});
  const head =
      el('p', {class: 'node-head'}, el('strong', {}, id), ' ', el('code', {}, node.uses || 'repeats ' + node.body), ' ',
         node.file ? '' : button('line ' + node.line, () => goTo(node.line), {class: 'link', 'data-do': 'line'}));
  if (node.file) return elsewhere(id, node, head);
  const info = node.info;
  if (!info) return el('div', {}, head, el('p', {class: 'note'}, 'The form is shown when the file has no faults.'));
  const inputs = info.inputs.map((port) => wireField(port, node.in[port.name], state.nodes, id, own));
  if (node.is_repeated)
    return el(
        'div', {}, head, el('p', {class: 'note'}, 'This node runs a body again and again. Change it in the text.'),
        el('h3', {}, 'Wires'), inputs);
  const given = info.options.filter((option) => option.name in node.with);
  const others = info.options.filter((option) => !(option.name in node.with));
  const fields = (options) => options.map((option) => optionField(option, node.with[option.name], own));
  return el(
      'div', {}, head, el('p', {}, info.summary), el('h3', {}, 'Options'),
      info.options.length ? '' : el('p', {class: 'note'}, 'It has no options.'), fields(given), fields(others),
      info.relations.length ? el('ul', {class: 'note relations'}, info.relations.map((text) => el('li', {}, text))) :
                              '',
      checkbox(
          'may fail without ending the run', node.may_fail,
          (value) => own({what: 'may_fail', value: value ? 'true' : null})),
      el('h3', {}, 'Wires'), inputs.length ? inputs : el('p', {class: 'note'}, 'It has no inputs.'),
      el('h3', {}, 'Another node in its place'), fitting(state.file, id, own));
}
