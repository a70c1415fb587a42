// SPDX-License-Identifier: Apache-2.0
// The pipeline as a layered drawing: a node is below everything that it uses. What variants change is marked.
import {el, svg} from './dom.js';

const BOX = {
  width: 186,
  height: 46,
  line: 16,
  gap: 26,
  rise: 46
};

// The layer of a node is the length of the longest way to it from a node without inputs. A pipeline has no cycles. The
// number of nodes limits the rounds for a damaged one that has.
function layersOf(nodes, edges) {
  const layer = new Map(nodes.map((node) => [node.id, 0]));
  for (let round = 0; round < nodes.length; ++round) {
    let changed = false;
    for (const {from, to} of edges) {
      if (layer.get(to) <= layer.get(from) && layer.get(from) + 1 < nodes.length) {
        layer.set(to, layer.get(from) + 1);
        changed = true;
      }
    }
    if (!changed) break;
  }
  for (const node of nodes) {  // a node without inputs is right above its first user
    const uses = edges.filter((edge) => edge.from === node.id).map((edge) => layer.get(edge.to));
    if (uses.length && !edges.some((edge) => edge.to === node.id))
      layer.set(node.id, Math.max(0, Math.min(...uses) - 1));
  }
  return layer;
}

// Rows of items. An edge holds a place in every layer that it crosses, so that edges pass between the boxes. Edges that
// leave the same node share these places.
function rowsOf(nodes, edges) {
  const layer = layersOf(nodes, edges), rows = [];
  const place = (item, at) => ((rows[at] = rows[at] || []).push(item), item);
  const items = new Map(
      nodes.map((node) => [node.id, place({node, above: [], below: [], width: BOX.width}, layer.get(node.id))]));
  const shared = new Map();
  const passage = (from, at) => {
    const key = at + ' ' + from;
    if (!shared.has(key)) shared.set(key, place({above: [], below: [], width: 8}, at));
    return shared.get(key);
  };
  const chains = edges.map((edge) => {
    const chain = [items.get(edge.from)];
    for (let at = layer.get(edge.from) + 1; at < layer.get(edge.to); ++at) chain.push(passage(edge.from, at));
    chain.push(items.get(edge.to));
    for (let i = 1; i < chain.length; ++i) {
      if (!chain[i].above.includes(chain[i - 1])) chain[i].above.push(chain[i - 1]);
      if (!chain[i - 1].below.includes(chain[i])) chain[i - 1].below.push(chain[i]);
    }
    return {edge, chain};
  });
  return {rows: rows.filter(Boolean), chains};
}

const mean = (items, fallback) =>
    (items.length ? items.reduce((sum, item) => sum + item.x, 0) / items.length : fallback);

function spreadRow(row) {
  let left = 0;
  for (const item of row) {
    item.x = left + item.width / 2;
    left += item.width + BOX.gap;
  }
  const shift = (left - BOX.gap) / 2;
  for (const item of row) item.x -= shift;
}

// Each box moves to the mean place of its neighbours. Then boxes that overlap are pushed apart.
function settle(row, neighbours) {
  for (const item of row) item.wish = mean(item[neighbours], item.x);
  row.sort((a, b) => a.wish - b.wish);
  for (const item of row) item.x = item.wish;
  for (let round = 0; round < 60; ++round) {
    let moved = false;
    for (let i = 1; i < row.length; ++i) {
      const overlap = (row[i - 1].width + row[i].width) / 2 + BOX.gap - (row[i].x - row[i - 1].x);
      if (overlap < 0.5) continue;
      row[i - 1].x -= overlap / 2;
      row[i].x += overlap / 2;
      moved = true;
    }
    if (!moved) break;
  }
}

function layOut(graph) {
  const known = new Set(graph.nodes.map((node) => node.id));
  const {rows, chains} = rowsOf(
      graph.nodes,
      (graph.edges || []).filter((edge) => known.has(edge.from) && known.has(edge.to) && edge.from !== edge.to));
  rows.forEach(spreadRow);
  for (let round = 0; round < 8; ++round) {
    rows.forEach((row) => settle(row, 'above'));
    [...rows].reverse().forEach((row) => settle(row, 'below'));
  }
  rows.forEach((row) => settle(row, 'above'));
  let top = 4;
  for (const row of rows) {
    const lines = Math.max(0, ...row.map((item) => (item.node ? Object.keys(item.node.differs || {}).length : 0)));
    for (const item of row)
      Object.assign(item, {
        top,
        height: BOX.height + (item.node ? BOX.line * Object.keys(item.node.differs || {}).length : lines * BOX.line)
      });
    top += BOX.height + BOX.line * lines + BOX.rise;
  }
  const all = rows.flat(), left = Math.min(...all.map((item) => item.x - item.width / 2)) - 6;
  for (const item of all) item.x -= left;
  return {all, chains, width: Math.max(...all.map((item) => item.x + item.width / 2)) + 6, height: top - BOX.rise + 6};
}

const shortened = (text, length) => (text.length > length ? text.slice(0, length - 1) + '…' : text);

function path(chain) {
  let text = '';
  for (let i = 1; i < chain.length; ++i) {
    const [a, b] = [chain[i - 1], chain[i]], from = a.top + a.height, to = b.top, half = (to - from) / 2;
    text += (i === 1 ? 'M' + a.x + ' ' + from : 'L' + a.x + ' ' + from) + ' C' + a.x + ' ' + (from + half) + ' ' + b.x +
        ' ' + (to - half) + ' ' + b.x + ' ' + to;
  }
  return text;
}

function drawNode(item, chosen) {
  const {node, x, top, height} = item, differs = Object.entries(node.differs || {}), left = x - BOX.width / 2;
  const about = node.id + ', uses ' + node.uses +
      (differs.length ? ', differs in ' + differs.map((entry) => entry[0]).join(', ') : '');
  const choose = () => chosen(node, group);
  const group =
      svg('g', {
        class: 'node' + (differs.length ? ' differs' : ''),
        tabindex: 0,
        role: 'button',
        'aria-label': about,
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
  const row = (name, value) =>
      el('tr', {}, el('th', {scope: 'row'}, name),
         el('td', {}, el('code', {}, typeof value === 'string' ? value : JSON.stringify(value))));
  const options = Object.entries(node.options || {}), differs = Object.entries(node.differs || {});
  return [
    el('h3', {}, node.id, ' ', el('code', {}, node.uses)),
    differs.length > 0 &&
        el('div', {class: 'scroll'},
           el('table', {}, el('caption', {}, 'What differs'),
              el('tbody', {}, differs.map(([name, text]) => row(name, text))))),
    el('div', {class: 'scroll'},
       el('table', {}, el('caption', {}, options.length ? 'Options' : 'No options given: all at their defaults'),
          el('tbody', {}, options.map(([name, value]) => row(name, value)))))
  ].filter(Boolean);
}

// chose(node) is called for a node that is clicked. Without it, the node's options are shown below the graph.
export function draw(graph, chose) {
  const {all, chains, width, height} = layOut(graph), boxes = all.filter((item) => item.node);
  const root = svg('svg', {
    class: 'graph',
    viewBox: '0 0 ' + width + ' ' + height,
    width,
    height,
    role: 'group',
    'aria-label': 'The pipeline\'s nodes'
  });
  const details =
      el('div', {class: 'node-details', 'aria-live': 'polite'},
         el('p', {class: 'note'}, 'Choose a node to see its options.'));
  const lines = chains.map(({edge, chain}) => {
    const line = svg(
        'path',
        {class: 'edge', d: path(chain), 'data-tip': edge.from + ' → ' + edge.to + (edge.port ? '.' + edge.port : '')});
    line.ends = [edge.from, edge.to];
    return line;
  });
  const chosen = (node, group) => {
    root.querySelectorAll('.chosen').forEach((item) => item.classList.remove('chosen'));
    group.classList.add('chosen');
    lines.filter((line) => line.ends.includes(node.id)).forEach((line) => line.classList.add('chosen'));
    if (chose) return chose(node);
    details.replaceChildren(...about(node));
    return undefined;
  };
  root.append(...lines, ...boxes.map((item) => drawNode(item, chosen)));
  const box = el('div', {class: 'scroll graph-box', tabindex: 0, role: 'region', 'aria-label': 'Pipeline'}, root);
  requestAnimationFrame(
      () => (box.scrollLeft = (box.scrollWidth - box.clientWidth) / 2));  // on a narrow screen: the middle first
  return el('div', {}, box, chose ? '' : details);
}
