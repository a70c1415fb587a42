// SPDX-License-Identifier: Apache-2.0
// The graph of a pipeline in a frame: dragging moves it, Ctrl+wheel, two fingers and buttons zoom, and a small map
// shows which part is seen. d3-zoom does the gestures.
import {event, select} from 'd3-selection';
import {zoom, zoomIdentity} from 'd3-zoom';

import {button, el, svg} from '../../report/page/dom.js';

import * as Shell from './shell.js';

const WORDS = {
  cached: 'up to date',
  function: 'function',
  runs: 'stale',
  depends: 'may be stale',
  started: 'running',
  finished: 'done',
  failed: 'failed',
  skipped: 'skipped',
  waiting: 'waits'
};

// The name of a node's box for screen readers: the words in it, so that who speaks to the browser can say what is seen.
export function nameAsSeen(group) {
  const texts = [...group.querySelectorAll('text')];
  for (const one of texts)
    if (!one.nextSibling || one.nextSibling.nodeName !== '#text') one.after(' ');  // keeps the words apart
  group.setAttribute('aria-label', texts.map((one) => one.textContent.trim()).filter(Boolean).join(', '));
}

// Writes a node's state above its box in the graph. Colour only repeats what the words say.
export function mark(graph, id, state, text, tip) {
  const group = graph && [...graph.querySelectorAll('[data-node]')].find((one) => one.dataset.node === id);
  if (!group) return;
  group.dataset.state = state;
  let label = group.querySelector('.state');
  if (!label) {
    const box = group.querySelector('rect');
    label = svg('text', {
      class: 'state',
      'text-anchor': 'end',
      x: Number(box.getAttribute('x')) + Number(box.getAttribute('width')) - 2,
      y: Number(box.getAttribute('y')) - 4
    });
    group.append(label);
  }
  label.textContent = text || WORDS[state] || '';
  nameAsSeen(group);
  if (tip) group.dataset.tip = tip;
}

export function inputField(input, value, changed) {
  const id = 'input-' + input.name;
  const box = el('input', {
    type: 'text',
    id,
    value,
    placeholder: input.default === null ? 'required' : input.default,
    'data-input': input.name,
    'aria-describedby': id + '-about',
    onchange: () => changed(input.name, box.value.trim())
  });
  const choose = input.type === 'path' && button('Choose', async () => {
                   const path = await Shell.choose('Choose ' + input.name, {folders: true, accepts: () => true});
                   if (path === undefined) return;
                   box.value = path || '.';
                   changed(input.name, box.value);
                 }, {'data-choose-for': input.name, 'aria-label': 'Choose ' + input.name});
  return el(
      'div', {class: 'form-field'},
      el('label',
         {for: id
         },
         input.name),
      el('div', {class: 'control'}, box, choose || ''),
      el('p', {class: 'note', id: id + '-about'}, [input.help, input.type].filter(Boolean).join('; ')));
}

// Follows a run and marks the nodes. Resolves to its result.
export async function follow(title, job, graph) {
  const total = new Map();
  return Shell.follow(title, job, (event) => {
    if (event.event === 'progress')
      mark(graph(), event.node, 'started', Math.round(100 * event.fraction) + ' %');
    else if (event.event === 'finished' || event.event === 'cached') {
      total.set(event.node, (total.get(event.node) || 0) + (event.seconds || 0));
      mark(
          graph(), event.node, 'finished',
          event.event === 'cached' ? 'read back' : 'done, ' + total.get(event.node).toFixed(1) + ' s');
    } else if (WORDS[event.event])
      mark(graph(), event.node, event.event, '', event.text);
  });
}

const LEAST_READABLE = 0.55;  // below it, the words in the boxes cannot be read
const MARGIN_PX = 12, MAP_PX = 150, STEP = 1.3;

export class GraphView {
  constructor() {
    this.box = el('div', {class: 'graph-view', tabindex: 0, role: 'region', 'aria-label': 'Graph: drag moves it'});
    this.map = svg('svg', {class: 'minimap', 'aria-hidden': 'true', onpointerdown: (one) => this.follow(one)});
    this.map.addEventListener('pointermove', (one) => one.buttons && this.follow(one));
    const tool = (text, label, action) => button(text, action, {'aria-label': label, title: label});
    this.tools =
        el('div', {class: 'graph-tools'},
           button('Fit', () => this.fit(), {'data-do': 'fit', title: 'Show the whole graph'}),
           tool('−', 'Zoom out', () => this.by(1 / STEP)), tool('+', 'Zoom in', () => this.by(STEP)));
    this.element = el('div', {class: 'graph-frame'}, this.box, this.map, this.tools);
    this.zoom = zoom()
                    .scaleExtent([0.1, 2.5])
                    .filter(() => (event.type === 'wheel' ? event.ctrlKey : !event.button))
                    .on('zoom', () => this.place(event.transform));
    this.box.addEventListener('wheel', (one) => one.ctrlKey && one.preventDefault(), {passive: false});
    this.box.addEventListener('focusin', (one) => one.target.matches('[data-node]') && this.reveal(one.target));
    this.box.addEventListener('scroll', () => this.box.scrollTo(0, 0));  // the browser scrolls to what gets the focus
    select(this.box).call(this.zoom).on('dblclick.zoom', null);
    this.observer = new ResizeObserver(() => (this.moved ? this.place(this.at) : this.start()));
    this.observer.observe(this.box);
  }

  dispose() {
    this.observer.disconnect();
  }

  // Shows a drawing, from where the last one was seen.
  set(drawing) {
    this.drawing = drawing;
    this.size = {width: Number(drawing.getAttribute('width')), height: Number(drawing.getAttribute('height'))};
    this.box.replaceChildren(drawing);
    this.drawMap();
    if (this.moved)
      this.place(this.at);
    else
      this.start();
  }

  // The largest scale at which all is seen.
  wholeScale() {
    const room = (px) => Math.max(1, px - 2 * MARGIN_PX);
    return Math.min(1, room(this.box.clientWidth) / this.size.width, room(this.box.clientHeight) / this.size.height);
  }

  // The whole graph; of a large one as much as can be read, from its top.
  start() {
    if (!this.drawing || !this.box.clientWidth) return;
    this.show(Math.max(LEAST_READABLE, this.wholeScale()));
    this.moved = false;
  }
  fit() {
    this.show(this.wholeScale());
  }
  show(scale) {
    const left = (this.box.clientWidth - scale * this.size.width) / 2,
          top = Math.max(MARGIN_PX, (this.box.clientHeight - scale * this.size.height) / 2);
    select(this.box).call(this.zoom.transform, zoomIdentity.translate(left, top).scale(scale));
  }
  by(factor) {
    select(this.box).call(this.zoom.scaleBy, factor);
  }
  // Puts a place of the drawing into the middle.
  centre(x, y) {
    select(this.box).call(this.zoom.translateTo, x, y);
  }

  place(transform) {
    this.at = transform;
    this.moved = true;
    if (!this.drawing) return;
    this.drawing.style.transform = 'translate(' + transform.x + 'px, ' + transform.y + 'px) scale(' + transform.k + ')';
    const seen = {
      x: -transform.x / transform.k,
      y: -transform.y / transform.k,
      width: this.box.clientWidth / transform.k,
      height: this.box.clientHeight / transform.k
    };
    for (const [name, value] of Object.entries(seen)) this.window.setAttribute(name, value);
    const is_whole = seen.x <= 0 && seen.y <= 0 && seen.x + seen.width >= this.size.width &&
        seen.y + seen.height >= this.size.height;
    this.map.classList.toggle('off', is_whole);
  }

  // Moves the graph if this node's box is not seen.
  reveal(node) {
    const box = node.querySelector('rect').getBoundingClientRect(), frame = this.box.getBoundingClientRect();
    if (box.left >= frame.left && box.right <= frame.right && box.top >= frame.top && box.bottom <= frame.bottom)
      return;
    const x = ((box.left + box.right) / 2 - frame.left - this.at.x) / this.at.k,
          y = ((box.top + box.bottom) / 2 - frame.top - this.at.y) / this.at.k;
    this.centre(x, y);
  }

  drawMap() {
    const {width, height} = this.size, scale = MAP_PX / Math.max(width, height);
    this.map.setAttribute('viewBox', '0 0 ' + width + ' ' + height);
    this.map.setAttribute('width', scale * width);
    this.map.setAttribute('height', scale * height);
    this.window = svg('rect', {class: 'window'});
    const boxes = [...this.drawing.querySelectorAll('[data-node] rect')].map((one) => {
      const of = (name) => one.getAttribute(name);
      return svg('rect', {x: of('x'), y: of('y'), width: of('width'), height: of('height')});
    });
    this.map.replaceChildren(...boxes, this.window);
  }

  // The place of the map under the pointer goes into the middle.
  follow(one) {
    const box = this.map.getBoundingClientRect();
    this.centre(
        (one.clientX - box.left) / box.width * this.size.width,
        (one.clientY - box.top) / box.height * this.size.height);
  }
}
