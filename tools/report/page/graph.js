// SPDX-License-Identifier: Apache-2.0
// The pipeline as a layered drawing: a node is below everything that it uses. What variants change is marked. dagre
// chooses the places. The boxes are ours, as they show what differs, and keys and screen readers reach them.
import './notices.js';

import {monotoneY} from 'd3-shape/src/curve/monotone.js';
import line from 'd3-shape/src/line.js';
import * as Dagre from 'dagre';

import {button, el, row, svg, table} from './dom.js';

const BOX = Object.freeze({width: 186, height: 46, line: 16});
const SMALLEST = 0.7;  // the scale of the drawing at which its text can still be read
const GAPS = Object.freeze({nodesep: 26, edgesep: 12, ranksep: 46, marginx: 6, marginy: 6});

// Edges between the same two nodes are drawn as one, with all their ports.
function joined(graph) {
  const known = new Set(graph.nodes.map((node) => node.id)), edges = new Map();
  for (const {from, to, port} of graph.edges || []) {
    if (!known.has(from) || !known.has(to) || from === to) continue;
    const key = JSON.stringify([from, to]);
    if (!edges.has(key)) edges.set(key, {from, to, ports: []});
    if (port) edges.get(key).ports.push(port);
  }
  return [...edges.values()];
}

const heightOf = (node) => BOX.height + BOX.line * Object.keys(node.differs || {}).length;

// dagre's plan of items with a width and height: in `plan.node(id)`, the middle {x, y}.
function planOf(items, ends) {
  const plan = new Dagre.graphlib.Graph();
  plan.setGraph({...GAPS});
  for (const [id, {width, height}] of items) plan.setNode(id, {width, height});
  for (const [from, to] of ends) plan.setEdge(from, to, {});
  Dagre.layout(plan);
  return plan;
}

// The items layer by layer, and the chain of items that each edge runs through. An edge holds a place in every layer
// that it crosses, so that it passes between the boxes; edges that leave the same node share these places.
function layersOf(graph) {
  const edges = joined(graph), ends = new Map();
  const items = new Map(graph.nodes.map((node) => [node.id, {node, width: BOX.width, height: heightOf(node)}]));
  const first = planOf(items, edges.map(({from, to}) => [from, to]));
  const heights = [...new Set(graph.nodes.map(({id}) => first.node(id).y))].sort((a, b) => a - b);
  const layer = (id) => heights.indexOf(first.node(id).y);
  const chains = edges.map((edge) => {
    const step = layer(edge.from) < layer(edge.to) ? 1 : -1, chain = [edge.from];
    for (let at = layer(edge.from) + step; at !== layer(edge.to); at += step) {
      const passage = JSON.stringify([edge.from, at]);
      if (!items.has(passage)) items.set(passage, {width: 8, height: BOX.height});
      chain.push(passage);
    }
    chain.push(edge.to);
    chain.slice(1).forEach((id, i) => ends.set(JSON.stringify([chain[i], id]), [chain[i], id]));
    return {edge, chain: chain.map((id) => items.get(id))};
  });
  const plan = planOf(items, ends.values());
  for (const [id, item] of items) Object.assign(item, {x: plan.node(id).x, y: plan.node(id).y, near: []});
  for (const [from, to] of [...ends.values()].map((pair) => pair.map((id) => items.get(id)))) {
    from.near.push(to);
    to.near.push(from);
  }
  const all = [...items.values()].sort((a, b) => a.x - b.x);
  const rows = [...new Set(all.map((item) => item.y))].map((y) => all.filter((item) => item.y === y));
  return {rows, chains, height: plan.graph().height};
}

// Each item moves to the mean of its neighbours, as far as those beside it leave it place. dagre leaves more space
// between the items than there is text: a common pipeline was drawn 1400 px wide, and is 950.
function settle(row) {
  for (const item of row)
    if (item.near.length) item.x = item.near.reduce((sum, other) => sum + other.x, 0) / item.near.length;
  for (let round = 0; round < 60; ++round)
    row.slice(1).forEach((item, i) => {
      const overlap = (row[i].width + item.width) / 2 + GAPS.nodesep - (item.x - row[i].x);
      if (overlap < 0.5) return;
      row[i].x -= overlap / 2;
      item.x += overlap / 2;
    });
}

function layOut(graph) {
  const {rows, chains, height} = layersOf(graph), all = rows.flat();
  for (let round = 0; round < 12; ++round) rows.forEach(settle);
  const left = Math.min(...all.map((item) => item.x - item.width / 2)) - GAPS.marginx;
  for (const item of all) item.x -= left;
  const width = Math.max(...all.map((item) => item.x + item.width / 2)) + GAPS.marginx;
  return {boxes: all.filter((item) => item.node), chains, width, height};
}

const shortened = (text, length) => (text.length > length ? text.slice(0, length - 1) + '…' : text);

const path = line().curve(monotoneY);

// From the lower side of a box, straight through each passage, to the upper side of the other box.
function drawLine({edge, chain}) {
  const [first, last] = [chain[0], chain[chain.length - 1]];
  const side = (item, down) => [item.x, item.y + (down ? item.height / 2 : -item.height / 2)];
  const through = chain.slice(1, -1).flatMap((item) => [side(item, first.y > last.y), side(item, first.y < last.y)]);
  const drawn = svg('path', {
    class: 'edge',
    d: path([side(first, first.y < last.y), ...through, side(last, first.y > last.y)]),
    'data-tip': edge.from + ' → ' + edge.to + (edge.ports.length ? ': ' + edge.ports.join(', ') : '')
  });
  drawn.ends = [edge.from, edge.to];
  return drawn;
}

function drawNode({node, x, y, height}, chosen) {
  const differs = Object.entries(node.differs || {}), left = x - BOX.width / 2, top = y - height / 2;
  const choose = () => chosen(node, group);
  const group =
      svg('g', {
        class: 'node' + (differs.length ? ' differs' : ''),
        tabindex: 0,
        role: 'button',
        'data-node': node.id,
        onclick: choose,
        onkeydown: (event) => (event.key === 'Enter' || event.key === ' ') && (event.preventDefault(), choose())
      },
          svg('rect', {x: left, y: top, width: BOX.width, height, rx: 6}),
          svg('text', {class: 'id', x: left + 10, y: top + 19}, shortened(node.id, 22)),
          svg('text', {class: 'uses', x: left + 10, y: top + 36}, shortened(node.uses, 27)));
  differs.forEach(
      ([variant, text], i) => group.append(svg(
          'text', {class: 'other', x: left + 10, y: top + 36 + BOX.line * (i + 1), 'data-tip': variant + ': ' + text},
          shortened(variant + ': ' + text, 27))));
  return group;
}

function about(node) {
  const rows = (entries) => entries.map(
      ([name, value]) => row(name, [el('code', {}, typeof value === 'string' ? value : JSON.stringify(value))]));
  const options = Object.entries(node.options || {}), differs = Object.entries(node.differs || {});
  return [
    el('h3', {}, node.id, ' ', el('code', {}, node.uses)),
    differs.length > 0 && table({}, 'What differs', null, rows(differs)),
    table({}, options.length ? 'Options' : 'No options given: all at their defaults', null, rows(options))
  ].filter(Boolean);
}

// For narrow screens, where a drawing would have to be scrolled sideways: each node with what it uses.
const list = (graph, choose) => el('ul', {class: 'node-list'}, graph.nodes.map((node) => {
  const from = [...new Set((graph.edges || []).filter((edge) => edge.to === node.id).map((edge) => edge.from))];
  const differs = Object.entries(node.differs || {}).map(([name, text]) => name + ': ' + text);
  return el(
      'li', {}, button(node.id, () => choose(node), {class: 'link'}), ' ', el('code', {}, node.uses),
      from.length > 0 && el('div', {class: 'note'}, 'from ' + from.join(', ')),
      differs.length > 0 && el('div', {class: 'note'}, 'differs: ' + differs.join('; ')));
}));

// chose(node) is called for a node that is clicked. Without it, the node's options are shown below the graph.
export function draw(graph, chose) {
  const {boxes, chains, width, height} = layOut(graph), lines = chains.map(drawLine);
  const root = svg('svg', {
    class: 'graph',
    viewBox: '0 0 ' + width + ' ' + height,
    width,
    height,
    role: 'group',
    'aria-label': 'The pipeline\'s nodes'
  });
  if (!chose)  // fits into the page, as far as its text can be read
    root.style.cssText = 'width: 100%; height: auto; max-width: ' + width + 'px; min-width: ' + SMALLEST * width + 'px';
  const details =
      el('div', {class: 'node-details', 'aria-live': 'polite'},
         el('p', {class: 'note'}, 'Choose a node to see its options.'));
  const chosen = (node, group) => {
    root.querySelectorAll('.chosen').forEach((item) => item.classList.remove('chosen'));
    group.classList.add('chosen');
    lines.filter((line) => line.ends.includes(node.id)).forEach((line) => line.classList.add('chosen'));
    if (chose) return chose(node);
    details.replaceChildren(...about(node));
    return undefined;
  };
  root.append(...lines, ...boxes.map((item) => drawNode(item, chosen)));
  const box = el(
      'div', {class: 'scroll graph-box', tabindex: 0, role: 'region', 'aria-label': 'Drawing of the pipeline'}, root);
  requestAnimationFrame(
      () => (box.scrollLeft = (box.scrollWidth - box.clientWidth) / 2));  // on a narrow screen: the middle first
  if (chose) return el('div', {}, box);
  const show = (node) => {
    details.replaceChildren(...about(node));
    details.scrollIntoView({block: 'nearest'});
  };
  return el('div', {}, box, list(graph, show), details);
}
