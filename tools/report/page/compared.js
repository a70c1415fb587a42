// SPDX-License-Identifier: Apache-2.0
// Which variants differ, how they rank, and what each factor of a matrix does.
import {el, number, probability, withUnit} from './dom.js';
import * as Plots from './plots.js';
import * as Summary from './summary.js';

const other = (item) => item.reference ?? 'the baseline';

const sideOf = (value, metric) => ((value > 0) === Boolean(metric.higher_is_better) ? 'better' : 'worse');

// "0.12 mm worse", as in the sentences. 0 is neither.
const amount = (value, metric) =>
    withUnit(Math.abs(value), metric.unit) + (value === 0 ? '' : ' ' + sideOf(value, metric));

// The median difference. If failures decide, says who fails more often.
function difference(item, metric) {
  if (Number.isFinite(item.difference)) return amount(item.difference, metric);
  if (!item.fails_more) return '–';
  return item.fails_more === 'variant' ? 'fails more often' : other(item) + ' fails more often';
}

// "0.08 to 0.17 mm worse" or "0.03 mm better to 0.05 mm worse", the bounds in the order of the sentences: that in the
// direction of the difference comes last. A bound that is not a number stands for a failure of one of the two. Where
// the sentence gives no interval, there is none here.
function interval(item, metric) {
  const {low, high} = item;
  if (item.has_interval === false || (!Number.isFinite(low) && !Number.isFinite(high))) return '–';
  const failure = (is_high) =>
      (is_high !== Boolean(metric.higher_is_better) ? 'a failure' : other(item) + '’s failure');
  const bound = (value, is_high) => (Number.isFinite(value) ? amount(value, metric) : failure(is_high));
  const is_turned =
      item.fails_more ? (item.fails_more === 'variant') === Boolean(metric.higher_is_better) : item.difference < 0;
  if (low * high > 0 && Number.isFinite(low) && Number.isFinite(high)) {
    const [near, far] = is_turned ? [high, low] : [low, high];
    return number(Math.abs(near)) + ' to ' + amount(far, metric);
  }
  const bounds = [bound(low, false), bound(high, true)];
  return (is_turned ? bounds.reverse() : bounds).join(' to ');
}

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
      key: (i) => list[i].sentence || '',
      cell: (i) => el('span', {class: 'words'}, list[i].sentence || '')
    },
  ];
}

const text = (title, of, mark) => ({title, key: of, cell: (i) => (mark ? el('strong', {}, of(i)) : of(i))});

function table(data, list, before, caption) {
  return list.length ? Summary.sortable(list.map((_, i) => i), [...before, ...numbers(data, list)], {}, caption) : null;
}

// Every comparison with the baseline, or with 'compare_all' every pair: the numbers behind the figure of the pairs.
export function comparisons(data) {
  const list = data.all_pairs || data.comparisons;
  const before = [
    text('Variant', (i) => nameOf(data, list[i].variant), true),
    ...(data.all_pairs ? [text('Against', (i) => nameOf(data, list[i].reference))] : []),
    text('Metric', (i) => metricOf(data, list[i]).label)
  ];
  return table(data, list, before, data.all_pairs ? 'Comparisons of all pairs' : 'Comparisons with the baseline');
}

// Best first; those that share a letter are not told apart.
function rankingTable(data, ranking) {
  const {places} = ranking, {label, unit} = metricOf(data, ranking);
  const all = [
    {title: 'Rank', key: (i) => places[i].rank, cell: (i) => String(places[i].rank), number: true},
    {
      title: 'Variant',
      key: (i) => places[i].variant,
      cell: (i) =>
          el('div', {class: 'variant-name'}, Plots.swatch(data.variantIndex(places[i].variant)),
             el('strong', {}, nameOf(data, places[i].variant)))
    },
    text('Groups', (i) => places[i].group ?? '–'),
    {
      title: 'Median of all runs',
      unit,
      key: (i) => places[i].median,
      cell: (i) => (Number.isFinite(places[i].median) ? number(places[i].median) : 'a failure'),
      number: true
    },
    {title: 'Lost', key: (i) => places[i].lost, cell: (i) => String(places[i].lost), number: true},
  ];
  return el(
      'div', {}, el('p', {class: 'ranking'}, ranking.sentence),
      Summary.sortable(places.map((_, i) => i), all, {}, 'Ranking by ' + label));
}

export function rankings(data) {
  if (!data.rankings) return null;
  const place = el('div'), show = (metric) => place.replaceChildren(rankingTable(data, data.rankings[metric]));
  show(0);
  return el('div', {}, Summary.metricBar(data, show), place);
}

export function effects(data) {
  const list = data.effects || [];
  const before = [
    text('Factor', (i) => list[i].factor), text('Level', (i) => list[i].variant, true),
    text('Against', (i) => list[i].reference), text('Metric', (i) => metricOf(data, list[i]).label)
  ];
  return table(data, list, before, 'Effects of the factors');
}
