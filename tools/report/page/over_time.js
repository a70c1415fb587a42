// SPDX-License-Identifier: Apache-2.0
// Sequences compared over time: both curves of each figure, the difference beneath, and its statistics. The data are
// those of curves.json, whose keys docs/comparing.md lists.
import * as Dom from './dom.js';
import {el, number, percent, svg, withUnit} from './dom.js';
import * as Plots from './plots.js';

const FIRST = 0, SECOND = 1, DIFFERENCE = 2;

const timeTitle = (figure) => (figure.time_unit === 's' ? 'time (s)' : 'frame');
const withUnitTitle = (title, unit) => title + (unit ? ' (' + unit + ')' : '');

// A value that is not there is null, which d3 would take for 0.
const place = (scale, value) => (Number.isFinite(value) ? scale(value) : NaN);

const drawCurve = ({root, x, y}, at, values, variant, attributes) =>
    root.append(Plots.polyline(at.map((time, i) => [x(time), place(y, values[i])]), variant, attributes));

// Between two curves, where both are known.
const drawBand = ({root, x, y}, at, lower, upper) =>
    root.append(Plots.band(at.map((time, i) => [x(time), place(y, lower[i]), place(y, upper[i])])));

function plot(figure, width, height, title, values) {
  const all = Plots.frame({
    width,
    height,
    label: figure.name + ': ' + title,
    x: {domain: Plots.domain(figure.at, 'linear'), title: timeTitle(figure)},
    y: {domain: Plots.domain(values, 'linear'), title: withUnitTitle(title, figure.unit)}
  });
  const [low, high] = all.y.domain();
  if (low < 0 && high > 0)
    all.root.append(svg('line', {class: 'zero', x1: all.box.left, x2: all.box.right, y1: all.y(0), y2: all.y(0)}));
  return all;
}

function drawBoth(figure, width) {
  const all = plot(figure, width, 260, 'value', [...figure.first, ...figure.second]);
  drawCurve(all, figure.at, figure.first, FIRST);
  drawCurve(all, figure.at, figure.second, SECOND);
  return all.root;
}

// The band holds 95 % of the single differences; the line is their mean.
function drawDifference(figure, width) {
  const [low, high] = figure.agreement || [figure.bias, figure.bias];
  const all = plot(figure, width, 200, 'difference', [...figure.difference, low, high, 0]);
  const {root, box, y} = all;
  root.append(svg('rect', {
    class: 'band',
    x: box.left,
    width: box.right - box.left,
    y: y(high),
    height: Math.max(0, y(low) - y(high)),
    'data-tip': '95 % of single differences: ' + number(low) + ' to ' + number(high)
  }));
  root.append(svg('line', {
    x1: box.left,
    x2: box.right,
    y1: y(figure.bias),
    y2: y(figure.bias),
    stroke: Plots.colour(DIFFERENCE),
    'stroke-dasharray': '6 4'
  }));
  drawCurve(all, figure.at, figure.difference, DIFFERENCE, {'stroke-dasharray': 'none'});
  return root;
}

// The trials' differences, their mean, and both bands.
function drawTrials(figure, width) {
  const shifted = (half, sign) => figure.mean.map((value, i) => value + sign * half[i]);
  const bounds = figure.mean ? [...shifted(figure.simultaneous, 1), ...shifted(figure.simultaneous, -1)] : [];
  const all =
      plot(figure, width, 300, 'difference', [0, ...bounds, ...figure.curves.flatMap((curve) => curve.difference)]);
  if (figure.mean)
    for (const half of [figure.simultaneous, figure.pointwise])
      drawBand(all, figure.at, shifted(half, -1), shifted(half, 1));
  for (const curve of figure.curves)
    drawCurve(all, figure.at, curve.difference, DIFFERENCE, {'stroke-width': 0.8, opacity: 0.5});
  if (figure.mean) drawCurve(all, figure.at, figure.mean, FIRST);
  return all.root;
}

const range = (values) => (values ? number(values[0]) + ' to ' + number(values[1]) : '–');

const COLUMNS = {
  sequences: [
    ['Figure', (one) => one.name], ['Both', (one) => one.both + ' of ' + one.times],
    ['Only first', (one) => percent(one.only_first / one.times)],
    ['Only second', (one) => percent(one.only_second / one.times)], ['Bias', (one) => withUnit(one.bias, one.unit)],
    ['95 % interval', (one) => range(one.bias_interval)], ['RMS', (one) => number(one.rms)],
    ['Largest', (one) => number(one.largest) + ' at ' + number(one.largest_at)],
    ['95 % of differences', (one) => range(one.agreement)], ['Correlation', (one) => number(one.correlation)],
    ['Lag', (one) => withUnit(one.lag, one.time_unit === 's' ? 's' : 'frames')]
  ],
  trials: [
    ['Figure', (one) => one.name], ['Trials', (one) => one.curves.length], ['Times', (one) => one.at.length],
    ['Bias', (one) => withUnit(one.bias, one.unit)], ['95 % interval', (one) => range(one.bias_interval)]
  ]
};

const table = (figures, columns) => Dom.table(
    {}, null, columns.map(([title]) => title),
    figures.map((figure) => el('tr', {}, columns.map(([, text]) => el('td', {}, text(figure))))));

const NOTES = {
  sequences: 'Differences are second − first. Beneath each pair of curves is the difference; its band holds ' +
      '95 % of single differences, its dashed line is the mean.',
  trials: 'Differences are second − first, one thin curve a trial. The wide band holds the whole mean difference ' +
      'in 95 %, the narrow one that of each single time.'
};

function figureOf(figure, kind) {
  const draw = kind === 'trials' ? [drawTrials] : [drawBoth, drawDifference];
  return el(
      'div', {class: 'over-time'}, el('h3', {}, figure.name), el('p', {class: 'note'}, figure.sentence),
      draw.map((drawn) => Plots.responsive((width) => drawn(figure, width))));
}

// One section for each comparison. `section` is that of main.js.
export function sections(data, section) {
  const head = el(
      'div', {class: 'head'}, el('p', {class: 'kicker'}, 'Comparison over time'), el('h1', {}, data.experiment.name));
  const of = (kind) => data.over_time[kind].map((one, i) => {
    const variants = [{name: one.first + ' (first)'}, {name: one.second + ' (second)'}];
    return section(
        kind + '-' + i, one.second, NOTES[kind],
        kind === 'sequences' ? Plots.legend(variants) : el('p', {}, variants.map((item) => item.name).join(', ')),
        table(one.figures, COLUMNS[kind]),
        one.notes.length > 0 && el('ul', {}, one.notes.map((note) => el('li', {}, note))),
        one.figures.map((figure) => figureOf(figure, kind)));
  });
  return [head, ...of('sequences'), ...of('trials')];
}
