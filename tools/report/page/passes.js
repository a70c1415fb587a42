// SPDX-License-Identifier: Apache-2.0
// The bodies that a run repeated: a line for each pass; failed passes come first, in words.
import * as Dom from './dom.js';
import {el, withUnit} from './dom.js';

const isDone = (pass) => pass.status === 'done';

function summary({node, passes, end}) {
  const failed = passes.filter((pass) => !isDone(pass)).length;
  const seconds = passes.map((pass) => pass.seconds).sort((a, b) => a - b), half = (seconds.length - 1) / 2;
  return node + ': ' + passes.length + (passes.length === 1 ? ' pass' : ' passes') +
      (failed ? ', ' + failed + ' not done' : '') +
      (seconds.length ? '; median ' + withUnit((seconds[Math.floor(half)] + seconds[Math.ceil(half)]) / 2, 's') : '') +
      (end ? '; ended because ' + end : '');
}

const table = (entry) => Dom.table(
    {class: 'figures'}, null, ['Pass', 'Status', ['Time', {class: 'number'}], 'Reason'],
    entry.passes.map(
        (pass) =>
            el('tr', {}, el('th', {scope: 'row'}, pass.name), el('td', {}, pass.status),
               el('td', {class: 'number'}, withUnit(pass.seconds, 's')), el('td', {}, pass.reason || ''))));

export const draw = (data) => data.passes.map(
    (entry) =>
        el('div', {}, el('p', {}, summary(entry)), el('details', {}, el('summary', {}, 'All passes'), table(entry))));
