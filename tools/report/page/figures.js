// SPDX-License-Identifier: Apache-2.0
// The figures over all cells: distributions, differences to the baseline, success against the distance of the start.
import * as Data from './data.js';
import {el, number, percent, svg, table, withUnit} from './dom.js';
import * as Plots from './plots.js';

const MOST_POINTS = 400;

// Where the rows of a plot are: on a narrow screen a row's note has a line of its own.
const rowsFor = (width) => (width < 560 ? {height: 82, middle: 56, has_lines: true} : {height: 66, middle: 40});


const axisTitle = (metric) => metric.label + (metric.unit ? ' (' + metric.unit + ')' : '');
const point = (cell, tip) => ({'data-tip': tip, 'data-cell': cell.id, class: 'point'});

// All points. If there are too many: points at even ranks, and the twenty worst.
function thinned(sorted) {
  if (sorted.length <= MOST_POINTS) return sorted;
  const step = sorted.length / MOST_POINTS;
  return sorted.filter((_, i) => i >= sorted.length - 20 || Math.floor(i / step) !== Math.floor((i - 1) / step));
}

function rowTitle(root, data, variant, top, note, {has_lines}) {
  const {name, is_baseline} = data.variants[variant];
  const words = [is_baseline && 'baseline', note].filter(Boolean);
  root.append(
      svg('text', {class: 'row-name', x: 8, y: top + 14}, name,
          svg('tspan', {class: 'row-note', ...(has_lines ? {x: 8, dy: 15} : {dx: 9})}, words.join('\u2002'))));
}

function box(root, x, middle, [low, q1, median, q3, high], tip) {
  const half = 10, line = (x1, x2, y1, y2, width) => svg('line', {class: 'box', x1, x2, y1, y2, 'stroke-width': width});
  root.append(
      svg('g', {'data-tip': tip}, line(x(low), x(q1), middle, middle, 1.5), line(x(q3), x(high), middle, middle, 1.5),
          line(x(low), x(low), middle - 5, middle + 5, 1.5), line(x(high), x(high), middle - 5, middle + 5, 1.5),
          svg('rect', {
            class: 'box',
            x: x(q1),
            width: Math.max(1, x(q3) - x(q1)),
            y: middle - half,
            height: 2 * half,
            'stroke-width': 1.5
          }),
          line(x(median), x(median), middle - half, middle + half, 3)));
}

export function drawDistribution(data, metricIndex, kind, width) {
  const metric = data.metrics[metricIndex], place = rowsFor(width);
  const rows =
      data.variants.map((_, variant) => Data.valuesOf(data, variant, metricIndex).sort((a, b) => a.value - b.value));
  const all = rows.flatMap((row) => row.map((item) => item.value));
  // A limit far from all values would press them into a corner of a linear scale.
  const limit = Data.limit(metric),
        drawn = limit !== null && (kind === 'log' || limit <= 3 * all.reduce((a, b) => Math.max(a, b), 0));
  const {root, box: area, x} = Plots.frame({
    width,
    height: place.height * rows.length + 62,
    label: 'Distribution of ' + metric.label + ', one row for each variant; the numbers are in the table of the result',
    x: {kind, domain: Plots.domain(all.concat(drawn ? limit : []), kind), title: axisTitle(metric)}
  });
  if (drawn) {
    root.append(svg('line', {
      class: 'threshold',
      x1: x(limit),
      x2: x(limit),
      y1: area.top,
      y2: area.bottom,
      'data-tip': 'Success: ' + Data.limitText(metric)
    }));
  }
  rows.forEach((row, variant) => {
    const top = area.top + variant * place.height, middle = top + place.middle, all_runs = data.cellsOf[variant].length,
          lacking = all_runs - row.length;
    rowTitle(
        root, data, variant, top, lacking ? lacking + ' of ' + all_runs + ' runs without it, not drawn' : '', place);
    thinned(row).forEach(
        (item, i) => root.append(Plots.marker(
            variant, x(item.value), middle + 13 * Plots.spread(i), 3.2,
            point(
                item.cell,
                Data.cellName(data, item.cell) + '\n' + metric.label + ': ' + withUnit(item.value, metric.unit)))));
    if (!row.length) return;
    const sorted = row.map((item) => item.value),
          given = ((data.summary[variant] || {}).metrics || {})[metric.name] || {};
    const five = [
      given.p5 ?? Data.quantile(sorted, 0.05), given.q1 ?? Data.quantile(sorted, 0.25),
      given.median ?? Data.quantile(sorted, 0.5), given.q3 ?? Data.quantile(sorted, 0.75),
      given.p95 ?? Data.quantile(sorted, 0.95)
    ];
    box(root, x, middle, five,
        data.variants[variant].name + '\nmedian ' + number(five[2]) + ', quartiles ' + number(five[1]) + ' to ' +
            number(five[3]) + ',\n5th to 95th percentile ' + number(five[0]) + ' to ' + withUnit(five[4], metric.unit));
  });
  return root;
}

const compared = (data) => data.variants.map((_, i) => i).filter((i) => i !== data.baseline);
const comparison = (data, variant, metric) =>
    data.comparisons.find((item) => data.variantIndex(item.variant) === variant && item.metric === metric.name);

// Says how many pairs are not drawn because only one of the two has a value.
function lostText(item) {
  const {runs_variant_lost: own, runs_baseline_lost: others} = item || {};
  return own || others ? '; it alone lost ' + own + ', the baseline alone ' + others : '';
}

// The difference of every pair, and the estimate with its interval.
export function drawDifferences(data, metricIndex, kind, width) {
  const metric = data.metrics[metricIndex], variants = compared(data), place = rowsFor(width);
  const rows = variants.map(
      (variant) =>
          Data.pairedValues(data, variant, metricIndex).map((item) => ({...item, difference: item.value - item.base})));
  const sizes = rows.flat().map((item) => item.difference),
        typical = Data.quantile(sizes.map(Math.abs).sort((a, b) => a - b), 0.5) || 1;
  const found = variants.map((variant) => comparison(data, variant, metric)),
        unit = 10 ** Math.floor(Math.log10(typical)) || typical;  // for the least double, the power of ten is 0
  const {root, box: area, x} = Plots.frame({
    width,
    height: place.height * rows.length + 62,
    label: 'Difference of ' + metric.label +
        ' to the baseline, one row for each variant; the numbers are in the table below',
    x: {
      kind,
      unit,
      domain: Plots.domain(
          sizes.concat(0, found.flatMap((item) => (item ? [item.low, item.high, item.difference] : []))), 'linear'),
      title: 'variant − baseline: ' + axisTitle(metric)
    }
  });
  root.append(svg('line', {class: 'zero', x1: x(0), x2: x(0), y1: area.top, y2: area.bottom}));
  rows.forEach((row, i) => {
    const variant = variants[i], top = area.top + i * place.height, middle = top + place.middle;
    rowTitle(
        root, data, variant, top,
        row.length + ' pairs, better in ' + row.filter((item) => Data.isBetter(metric, item.value, item.base)).length +
            lostText(found[i]),
        place);
    thinned(row.sort((a, b) => a.difference - b.difference))
        .forEach(
            (item, k) => root.append(Plots.marker(
                variant, x(item.difference), middle + 13 * Plots.spread(k), 3.2,
                point(
                    item.cell,
                    Data.pairName(data, data.pairOf(item.cell)) + '\nbaseline ' + number(item.base) + ', ' +
                        data.variants[variant].name + ' ' + withUnit(item.value, metric.unit)))));
    const {low, high, difference, sentence} = found[i] || {};
    const is_given = (found[i] || {}).has_interval !== false && (Number.isFinite(low) || Number.isFinite(high));
    const ends = [[low, area.left], [high, area.right]].map(
        ([bound, edge]) => (Number.isFinite(bound) ? x(bound) : edge));  // a failure lies beyond the edge
    root.append(
        svg('g', {class: 'estimate', 'data-tip': sentence || ''},
            is_given && svg('line', {x1: ends[0], x2: ends[1], y1: middle, y2: middle, 'stroke-width': 4}),
            Number.isFinite(difference) && svg('circle', {cx: x(difference), cy: middle, r: 5})));
  });
  return root;
}

// A line for each pair, from baseline to variant; a panel for each variant.
export function drawPairs(data, metricIndex, kind, width) {
  const metric = data.metrics[metricIndex], variants = compared(data),
        columns = Math.max(1, Math.min(variants.length, Math.floor(width / 250)));
  const all = variants.map((variant) => Data.pairedValues(data, variant, metricIndex));
  const domain = Plots.domain(all.flat().flatMap((item) => [item.value, item.base]), kind);
  return el(
      'div', {class: 'panels', style: 'grid-template-columns: repeat(' + columns + ', 1fr)'},
      variants.map((variant, i) => {
        const {root, x, y} = Plots.frame({
          width: Math.max(230, width / columns - 12),
          height: 300,
          label: 'Pairs of baseline and ' + data.variants[variant].name,
          x: {
            domain: [-0.35, 1.35],
            title: '',
            format: (tick) =>
                (tick === 0     ? 'baseline' :
                     tick === 1 ? data.variants[variant].name.slice(0, 22) :
                                  '')
          },
          y: {kind, domain, title: axisTitle(metric)}
        });
        const sorted = all[i].sort((a, b) => (a.value - a.base) - (b.value - b.base));
        for (const item of thinned(sorted)) {
          const better = Data.isBetter(metric, item.value, item.base);
          root.append(svg('line', {
            class: better ? 'better' : 'worse',
            x1: x(0),
            x2: x(1),
            y1: y(item.base),
            y2: y(item.value),
            'data-cell': item.cell.id,
            'data-tip': Data.pairName(data, data.pairOf(item.cell)) + '\n' + number(item.base) + ' → ' +
                withUnit(item.value, metric.unit)
          }));
        }
        return root;
      }));
}

// Success in bins of the start's error: a row for each variant, all equally long.
export function captureBins(data) {
  const rows = data.variants.map((_, variant) => ((data.summary[variant] || {}).capture || {}).bins || []),
        longest = rows.reduce((a, b) => (b.length > a.length ? b : a), []);
  return rows.map((row) => longest.map(({from, to}, bin) => ({
                                         count: 0,
                                         of: 0,
                                         ...row[bin],
                                         from,
                                         to,
                                         rate: row[bin] && row[bin].of ? row[bin].count / row[bin].of : NaN
                                       })));
}

export function captureRange(data, variant) {
  const capture = (data.summary[variant] || {}).capture;
  return capture && Number.isFinite(capture.range) ?
      (capture.is_open ? 'at least ' : '') + withUnit(capture.range, data.initial_error.unit) :
      '–';
}

export function drawCapture(data, bins, width) {
  const farthest = Math.max(...bins[0].map((item) => item.to)), wide = bins[0][0].to - bins[0][0].from;
  const {name, unit} = data.initial_error;
  const {root, x, y} = Plots.frame({
    width,
    height: 340,
    label: 'Success rate against the error of the start; the numbers are in the table below',
    x: {
      domain: [0, farthest],
      title: name + (unit ? ' (' + unit + ')' : '') + ', bins of ' + wide + (unit ? ' ' + unit : '')
    },
    y: {domain: [0, 1], title: 'success rate (95 % interval)', format: percent}
  });
  const shift = Math.min(7, 0.7 * (x(wide) - x(0)) / bins.length);
  bins.forEach((row, variant) => {
    const place = (item) => x(0.5 * (item.from + item.to)) + (variant - (bins.length - 1) / 2) * shift,
          full = row.filter((item) => item.of);
    root.append(
        Plots.polyline(full.map((item) => [place(item), y(item.rate)]), variant, {'stroke-width': 1.5, opacity: 0.8}));
    for (const item of full) {
      const tip = data.variants[variant].name + ', start ' + item.from + ' to ' + item.to + (unit ? ' ' + unit : '') +
          '\n' + item.count + ' of ' + item.of + ' = ' + percent(item.rate) + ', 95 % interval ' + percent(item.low) +
          ' to ' + percent(item.high);
      root.append(
          svg('g', {'data-tip': tip}, svg('line', {
                x1: place(item),
                x2: place(item),
                y1: y(item.low),
                y2: y(item.high),
                stroke: Plots.colour(variant),
                'stroke-width': 1.5,
                opacity: 0.6
              }),
              Plots.marker(variant, place(item), y(item.rate), 4.5)));
    }
  });
  return root;
}

export function captureTable(data, bins) {
  const used = bins[0].map((_, bin) => bin).filter((bin) => bins.some((row) => row[bin].of));
  const cell = (one, i) =>
      el('td', {class: 'number', 'data-title': data.variants[i].name}, one.of ? one.count + ' / ' + one.of : '–', ' ',
         one.of ? el('small', {}, percent(one.low) + ' to ' + percent(one.high)) : '');
  return table(
      {class: 'counts cards', role: 'table'}, null,
      [
        'Start' + (data.initial_error.unit ? ', ' + data.initial_error.unit : ''),
        ...data.variants.map((variant) => [variant.name, {class: 'number'}])
      ],
      used.map(
          (bin) =>
              el('tr', {}, el('th', {scope: 'row'}, bins[0][bin].from + '–' + bins[0][bin].to),
                 bins.map((row, i) => cell(row[bin], i)))));
}
