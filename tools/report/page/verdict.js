// SPDX-License-Identifier: Apache-2.0
// The verdict on a pose: the judgement, its reasons, what would settle it, the overlays and the pose.
import * as Dom from './dom.js';
import {el, number, percent, row} from './dom.js';
import * as Glossary from './glossary.js';
import * as Summary from './summary.js';

const CLASSES = Object.freeze({trusted: 'success', doubtful: 'doubtful', wrong: 'failed'});

export const failure = (probability) =>
    'failure ' + (Number.isFinite(probability) ? percent(probability, probability < 0.0995 ? 1 : 0) : 'not known');

// The judgement as a mark and a word.
export const badge = (judgement) =>
    (judgement ? el('span', {class: 'outcome ' + (CLASSES[judgement] || ''), 'data-tip': Glossary.meaning(judgement)},
                    judgement) :
                 null);

const list = (title, texts) =>
    (texts.length ?
         [
           el('h3', {}, title),
           el('ul', {class: 'verdict-list'}, texts.map((text) => el('li', {}, Glossary.explained(text))))
         ] :
         []);

// The pictures of an item that show the result; otherwise those of the first output with pictures of it.
function overlays(cell, item) {
  const parts = (entry) => entry.name.split('/');
  const own = cell.pictures.filter((entry) => !item || parts(entry).slice(1).includes(item));
  const outputs = [...new Set(own.map((entry) => parts(entry)[0]))];
  const chosen = ['result', 'overlay'].find((name) => outputs.includes(name)) || outputs[0];
  return own.filter((entry) => parts(entry)[0] === chosen);
}

function pose(entry) {
  const {matrix, deviations} = entry;
  const cell = (value, column) => value.toFixed(column < 3 ? 5 : 2) + (column < 3 ? '' : ' mm');
  const rows = [0, 1, 2].map((i) => row('xyz'[i], matrix.slice(4 * i, 4 * i + 4).map(cell), {class: 'number'}));
  const text = (from, unit) => deviations.slice(from, from + 3).map((value) => number(value)).join(', ') + unit;
  const box = Dom.table({class: 'values pose'}, entry.name + ': ' + entry.target + '_from_' + entry.source, null, rows);
  if (deviations)
    box.append(
        el('p', {class: 'note'},
           'Predicted standard deviations about and along the ' +
               (entry.has_bone_axes ? 'frontal, lateral and long' : 'x, y and z') + ' axes: ' + text(0, ' deg') + '; ' +
               text(3, ' mm')));
  return box;
}

// The judgement, its reasons, and what would settle it.
export const words = (verdict) =>
    [el('p', {class: 'verdict-head'}, verdict.item && el('span', {}, verdict.item + ': '),
        el('strong', {}, Glossary.term(verdict.judgement)), ' ',
        el('small', {class: 'term', tabindex: 0, 'data-tip': Glossary.meaning('failure')},
           failure(verdict.failure_probability))),
     ...list('Why', verdict.reasons), ...list('What would settle it', verdict.remedies)];

function one(data, cell, verdict) {
  const pictures = overlays(cell, verdict.item),
        poses = cell.poses.filter((entry) => !verdict.item || entry.name.split('/').includes(verdict.item));
  return el(
      'article', {class: 'verdict ' + verdict.judgement}, words(verdict),
      pictures.length > 0 &&
          el('div', {class: 'overlays'},
             pictures.map(
                 (entry) =>
                     el('figure', {}, el('img', {src: data.pictures[entry.picture], alt: 'X-ray with outlines'}),
                        el('figcaption', {}, entry.name)))),
      poses.map(pose));
}

// All verdicts of a cell; null if it has none.
export const all = (data, cell) =>
    (cell.verdicts.length ? el('div', {}, cell.verdicts.map((verdict) => one(data, cell, verdict))) : null);

// Rates of a variant, as a bar with its interval.
const rate = (item) => (item && item.of ? Summary.rateBar(item) : '–');

// How good the verdicts of each variant were; null if no variant has verdicts.
export function table(data) {
  const of = (i) => (data.summary[i] || {}).verdicts || {};
  if (!data.summary.some((item) => item.verdicts)) return null;
  const share = (item) => (item && item.of ? item.rate : NaN);
  return el(
      'div', {}, el('h3', {}, 'Verdicts'),
      el('p', {class: 'note'},
         'A silent failure is a run that is no success, although its verdict is “trusted”. A false alarm is a ' +
             'success with the verdict “doubtful” or “wrong”.'),
      Summary.sortable(
          data.variants.map((_, i) => i),
          [
            {title: 'Variant', key: (i) => data.variants[i].name, cell: (i) => el('strong', {}, data.variants[i].name)},
            {
              title: 'Silent failures, of all misses',
              key: (i) => share(of(i).silent_failures),
              cell: (i) => rate(of(i).silent_failures)
            },
            {title: 'Caught', key: (i) => of(i).caught, cell: (i) => String(of(i).caught ?? '–'), number: true},
            {
              title: 'False alarms, of all successes',
              key: (i) => share(of(i).false_alarms),
              cell: (i) => rate(of(i).false_alarms)
            },
            {
              title: 'Runs with a verdict',
              key: (i) => of(i).cells,
              cell: (i) => String(of(i).cells ?? '–'),
              number: true
            },
          ],
          {}, 'Verdicts'));
}
