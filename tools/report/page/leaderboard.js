// SPDX-License-Identifier: Apache-2.0
// The variants of a comparison, best first: what they are, how good and how fast, and what differs from the baseline.
import * as Data from './data.js';
import {difference} from './differences.js';
import {el, number} from './dom.js';
import * as Plots from './plots.js';
import * as Recipes from './recipes.js';
import * as Summary from './summary.js';

const OTHER_RUNS =
    'The variants have this figure in different runs, so these numbers are not of the same cases and starts.';

const spread = (item, unit) =>
    (item && Number.isFinite(item.median) ?
         [number(item.median), ' ', el('small', {}, '(' + number(item.q1) + ' to ' + number(item.q3) + ')')] :
         '–');

// With the bounds of the median, where they are known.
const median = (item) =>
    (item && Number.isFinite(item.median_low) ?
         el('span', {'data-tip': '95 % interval ' + number(item.median_low) + ' to ' + number(item.median_high)},
            spread(item)) :
         spread(item));

// Runs that failed, and runs that went on without a figure because its node may fail.
const lost = ({failed, incomplete}) =>
    [String(failed ?? '–'),
     incomplete > 0 &&
         el('small', {'data-tip': 'done, but without a figure whose node may fail'},
            ' + ' + incomplete + ' incomplete')];

// Where it does not fit, a name is continued after its dots.
const breakable = (text) => text.split('.').flatMap((part, i) => (i ? ['.', el('wbr'), part] : [part]));

function variantName(data, i) {
  const variant = data.variants[i], options = Object.entries(variant.options);
  return el(
      'div', {class: 'variant-name'}, Plots.swatch(i),
      el('div', {}, el('strong', {}, variant.name), variant.is_baseline && el('span', {class: 'tag'}, 'baseline'),
         options.map(
             ([name, value]) =>
                 el('code', {class: 'option'}, breakable(name), ' = ',
                    breakable(typeof value === 'string' ? value : JSON.stringify(value)))),
         Recipes.link(data, i)));
}

// The comparison with the baseline in words: its difference, or that none is shown.
function againstBaseline(data, metric, i) {
  if (i === data.baseline) return el('span', {class: 'tag'}, 'baseline');
  const item = data.comparisons.find((one) => data.variantIndex(one.variant) === i && one.metric === metric.name);
  if (!item) return '–';
  const words = difference(item, metric);
  return item.is_shown ? el('strong', {}, words) :
                         [el('span', {}, 'no difference shown'), ' ', el('small', {}, '(' + words + ')')];
}

// Best first: by the ranking of all pairs where there is one; otherwise by the success rate, and then the median.
function bestFirst(data, metric, place) {
  const sign = metric.higher_is_better ? -1 : 1, of = (i) => data.summary[i] || {};
  const key = (i) => {
    const {median} = (of(i).metrics || {})[metric.name] || {};
    return [
      place(i) ? place(i).rank : Infinity, -((of(i).success || {}).rate || 0),
      Number.isFinite(median) ? sign * median : Infinity, i
    ];
  };
  const keys = data.variants.map((_, i) => key(i));
  const compare = (a, b) => {
    const at = keys[a].findIndex((one, k) => one !== keys[b][k]);
    return at < 0 ? 0 : keys[a][at] - keys[b][at];
  };
  return data.variants.map((_, i) => i).sort(compare);
}

// The places of a ranking; those that share a letter are not told apart.
function rankColumns(place, unit) {
  const of = (i) => place(i) || {};
  return [
    {title: 'Rank', key: (i) => of(i).rank, cell: (i) => String(of(i).rank ?? '–'), number: true},
    {title: 'Groups', key: (i) => of(i).group ?? '–', cell: (i) => el('strong', {}, of(i).group ?? '–')}, {
      title: 'Median of all runs',
      unit,
      key: (i) => of(i).median,
      cell: (i) => (Number.isFinite(of(i).median) ? number(of(i).median) : 'a failure'),
      number: true
    },
    {title: 'Lost', key: (i) => of(i).lost, cell: (i) => String(of(i).lost ?? '–'), number: true}
  ];
}

function columns(data, metric, place) {
  const of = (i) => data.summary[i] || {}, found = (i) => (of(i).metrics || {})[metric.name] || {};
  const has = (key) => data.summary.some((item) => item[key] && Number.isFinite(item[key].rate ?? item[key].median));
  const [rank, groups, all_runs, lost_runs] = place ? rankColumns(place, metric.unit) : [];
  return [
    rank,
    groups,
    {title: 'Variant', key: (i) => data.variants[i].name, cell: (i) => variantName(data, i), wide: true},
    has('success') &&
        {title: 'Success', key: (i) => -(of(i).success || {}).rate, cell: (i) => Summary.rateBar(of(i).success)},
    {
      title: 'Median (quartiles)',
      unit: metric.unit,
      key: (i) => found(i).median,
      cell: (i) => median(found(i)),
      number: true
    },
    all_runs,
    data.baseline >= 0 && data.comparisons.length > 0 && {
      title: 'Against the baseline',
      key: (i) =>
          (data.comparisons.find((one) => data.variantIndex(one.variant) === i && one.metric === metric.name) || {
            difference: 0
          }).difference,
      cell: (i) => againstBaseline(data, metric, i)
    },
    {
      title: metric.higher_is_better ? '5th percentile' : '95th percentile',
      unit: metric.unit,
      key: (i) => Data.worseEnd(metric, found(i)),
      cell: (i) => number(Data.worseEnd(metric, found(i))),
      number: true
    },
    {title: 'Worst', unit: metric.unit, key: (i) => found(i).worst, cell: (i) => number(found(i).worst), number: true},
    {
      title: 'Of runs',
      key: (i) => found(i).count,
      cell: (i) => el('span', {'data-tip': 'runs that have the figure, of all'}, Summary.countOf(found(i))),
      number: true
    },
    lost_runs,
    {title: 'Failed', key: (i) => of(i).failed + of(i).incomplete, cell: (i) => lost(of(i)), number: true},
    has('seconds') && {
      title: 'Time (quartiles)',
      unit: 's',
      key: (i) => (of(i).seconds || {}).median,
      cell: (i) => spread(of(i).seconds),
      number: true
    },
    has('evaluations') && {
      title: 'Evaluations',
      key: (i) => (of(i).evaluations || {}).median,
      cell: (i) => String((of(i).evaluations || {}).median ?? '–'),
      number: true
    },
  ].filter(Boolean);
}

// The leaderboard of a metric: groups and ranks where all pairs were compared.
function leaderboard(data, m, state) {
  const metric = data.metrics[m], ranking = (data.rankings || [])[m];
  const place = ranking && ((i) => ranking.places.find((one) => data.variantIndex(one.variant) === i));
  return [
    ranking && el('p', {class: 'ranking'}, ranking.sentence),
    Summary.sortable(
        bestFirst(data, metric, place || (() => null)), columns(data, metric, place), state,
        'Variants: ' + metric.label),
    metric.same_runs === false && el('p', {class: 'note'}, OTHER_RUNS)
  ].filter(Boolean);
}

export function table(data) {
  const place = el('div', {class: 'leaderboard'}), state = {};
  const show = (metric) => place.replaceChildren(...leaderboard(data, metric, state));
  if (!data.metrics.length) return null;
  show(0);
  return el('div', {}, Summary.metricBar(data, show), place);
}
