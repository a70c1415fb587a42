// SPDX-License-Identifier: Apache-2.0
// Response curves: how a figure depends on an option that was swept, with the band of its 95 % interval.
import {el, number, percent, select} from './dom.js';
import * as Plots from './plots.js';

const labelOf = (data, figure) => {
  if (figure === 'success') return 'success rate';
  const metric = data.metrics.find((one) => one.name === figure);
  return metric ? metric.label + (metric.unit ? ' (' + metric.unit + ')' : '') : figure;
};

// The text at the mark of a point, with its number of runs.
function pointText(data, curve, point) {
  const shown = curve.figure === 'success' ? percent : number;
  const interval = Number.isFinite(point.low) ? ', 95 % interval ' + shown(point.low) + ' to ' + shown(point.high) : '';
  return curve.option + ' = ' + number(point.value) + '\n' + labelOf(data, curve.figure) + ': ' + shown(point.middle) +
      interval + '\n' + point.runs + ' of ' + point.of + ' runs';
}

function draw(data, curves, width) {
  const points = curves.flatMap((curve) => curve.points.filter((point) => point.runs));
  const kind = curves[0].scale, ends = points.flatMap((point) => [point.middle, point.low, point.high]);
  const plot = Plots.frame({
    width,
    height: 300,
    x: {kind, domain: Plots.domain(points.map((point) => point.value), kind), title: curves[0].option},
    y: {domain: Plots.domain(ends.filter(Number.isFinite), 'linear'), title: labelOf(data, curves[0].figure)},
    label: labelOf(data, curves[0].figure) + ' over ' + curves[0].option
  });
  curves.forEach((curve, i) => {
    const known = curve.points.filter((point) => point.runs);
    const banded = known.filter((point) => Number.isFinite(point.low));
    plot.root.append(
        Plots.band(
            banded.map((point) => [plot.x(point.value), plot.y(point.low), plot.y(point.high)]),
            {fill: Plots.colour(i), 'fill-opacity': 0.18}),
        Plots.polyline(known.map((point) => [plot.x(point.value), plot.y(point.middle)]), i));
    for (const point of known)
      plot.root.append(
          Plots.marker(i, plot.x(point.value), plot.y(point.middle), 4, {'data-tip': pointText(data, curve, point)}));
  });
  return plot.root;
}

// Says how many runs each point has, and that some lack the figure.
function runsText(curves) {
  const points = curves.flatMap((curve) => curve.points), lacking = points.filter((point) => point.runs < point.of);
  const sum = (list, key) => list.reduce((all, point) => all + point[key], 0);
  return sum(points, 'runs') + ' of ' + sum(points, 'of') + ' runs have this figure' +
      (lacking.length ? '; points without some of theirs are not of the same cases as the others' : '') + '.';
}

// One plot for each option and figure, chosen by two lists; null without a sweep.
export function figure(data) {
  const all = data.curves || [];
  if (!all.length) return null;
  const distinct = (key) => [...new Set(all.map((curve) => curve[key]))];
  const names = distinct('variant').map((name) => ({name: name || 'the pipeline as it is'}));
  const chosen = {option: distinct('option')[0], figure: distinct('figure')[0]};
  const shown = () => all.filter((curve) => curve.option === chosen.option && curve.figure === chosen.figure);
  const note = el('p', {class: 'note'});
  const place = Plots.responsive((width) => {
    note.textContent = runsText(shown());
    return draw(data, shown(), width);
  });
  const change = (key) => (value) => {
    chosen[key] = value;
    place.redraw();
  };
  return el(
      'div', {},
      el('div', {class: 'toolbar'},
         select('Option', distinct('option').map((name) => [name, name]), chosen.option, change('option')),
         select(
             'Figure', distinct('figure').map((name) => [name, labelOf(data, name)]), chosen.figure, change('figure'))),
      names.length > 1 && Plots.legend(names), place, note);
}
