// SPDX-License-Identifier: Apache-2.0
// Which variants differ, and what each factor of a matrix does.
import {difference, interval, other} from './differences.js';
import {el, probability} from './dom.js';
import * as Summary from './summary.js';

const metricOf = (data, item) => data.metrics.find((one) => one.name === item.metric) || {label: item.metric};
const nameOf = (data, name) => (data.variants[data.variantIndex(name)] || {name}).name;

function lostRuns(item) {
  const own = item.runs_variant_lost, others = item.runs_reference_lost ?? item.runs_baseline_lost;
  return own || others ?
      el('small', {'data-tip': 'lost by it alone, and by ' + other(item) + ' alone'}, ' lost ' + own + ' / ' + others) :
      null;
}

// The columns that comparisons and effects share.
function numbers(data, list) {
  return [
    {
      title: 'Difference',
      key: (i) => list[i].difference,
      cell: (i) => difference(list[i], metricOf(data, list[i])),
      number: true
    },
    {
      title: '95 % interval',
      key: (i) => list[i].low,
      cell: (i) => interval(list[i], metricOf(data, list[i])),
      number: true
    },
    ...(list.some((item) => 'p' in item) ?
            [
              {title: 'p', key: (i) => list[i].p, cell: (i) => probability(list[i].p), number: true},
              {title: 'p (Holm)', key: (i) => list[i].p_holm, cell: (i) => probability(list[i].p_holm), number: true}
            ] :
            []),
    {
      title: 'Cases',
      key: (i) => list[i].cases,
      cell: (i) => Summary.countOf({count: list[i].cases, of: list[i].of_cases}),
      number: true
    },
    {
      title: 'Pairs',
      key: (i) => list[i].pairs,
      cell: (i) => [Summary.countOf({count: list[i].pairs, of: list[i].runs}), lostRuns(list[i])],
      number: true
    },
    {
      title: 'In words',
      wide: true,
      key: (i) => list[i].sentence || '',
      cell: (i) => el('span', {class: 'words'}, list[i].sentence || '')
    },
  ];
}

const text = (title, of, mark) => ({title, key: of, cell: (i) => (mark ? el('strong', {}, of(i)) : of(i))});

function table(data, list, before, caption) {
  return list.length ? Summary.sortable(list.map((_, i) => i), [...before, ...numbers(data, list)], {}, caption) : null;
}

// Every comparison with the baseline, and behind a line to open, with 'compare_all', those of all pairs.
export function comparisons(data) {
  const before = (list) =>
      [text('Variant', (i) => nameOf(data, list[i].variant), true),
       ...(list === data.all_pairs ? [text('Against', (i) => nameOf(data, list[i].reference))] : []),
       text('Metric', (i) => metricOf(data, list[i]).label)];
  const of = (list, caption) => table(data, list || [], before(list), caption);
  const pairs = of(data.all_pairs, 'Comparisons of all pairs');
  return el(
      'div', {}, of(data.comparisons, 'Comparisons with the baseline'),
      pairs && el('details', {class: 'all-pairs'}, el('summary', {}, 'All pairs of variants'), pairs));
}

export function effects(data) {
  const list = data.effects || [];
  const before = [
    text('Factor', (i) => list[i].factor), text('Level', (i) => list[i].variant, true),
    text('Against', (i) => list[i].reference), text('Metric', (i) => metricOf(data, list[i]).label)
  ];
  return table(data, list, before, 'Effects of the factors');
}
