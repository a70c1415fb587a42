// SPDX-License-Identifier: Apache-2.0
// The inputs of a pipeline, its stale nodes, and the button that runs them.
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
