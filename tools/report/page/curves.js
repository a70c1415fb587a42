// SPDX-License-Identifier: Apache-2.0
// Figures of one case and start: the cost that the optimizer reached, and the cost about the result along each axis.
import {el, number, svg} from './dom.js';
import * as Plots from './plots.js';

// Costs of different measures cannot be compared. Each is scaled to 0..1, so their shapes can.
function scaled(costs, each) {
  if (!each) return costs;
  const low = Math.min(...costs), high = Math.max(...costs);
  return costs.map((cost) => (cost - low) / (high - low || 1));
}

// cells: [{cell, variant}] with a convergence
function drawConvergence(data, cells, each, width) {
  const series = cells.map((cell) => {
    const points =
        cell.convergence.filter(([evaluations, cost]) => Number.isFinite(evaluations) && Number.isFinite(cost));
    return {cell, at: points.map((point) => point[0]), costs: scaled(points.map((point) => point[1]), each)};
  });
  const {root, x, y} = Plots.frame({
    width,
    height: 300,
    label: 'Cost against evaluations',
    x: {domain: Plots.domain(series.flatMap((item) => item.at), 'linear'), title: 'evaluations of the cost'},
    y: {
      domain: Plots.domain(series.flatMap((item) => item.costs), 'linear'),
      title: each ? 'cost, each scaled to 0–1' : 'cost'
    }
  });
  for (const {cell, at, costs} of series) {
    const tip = data.variants[cell.variant].name + '\n' + number(at[at.length - 1]) + ' evaluations, cost ' +
        number(cell.convergence[0][1]) + ' → ' + number(cell.convergence[cell.convergence.length - 1][1]);
    root.append(svg(
        'g', {'data-tip': tip}, Plots.polyline(at.map((place, i) => [x(place), y(costs[i])]), cell.variant),
        Plots.polyline(
            at.map((place, i) => [x(place), y(costs[i])]), cell.variant, {stroke: 'transparent', 'stroke-width': 12})));
    if (costs.length) root.append(Plots.marker(cell.variant, x(at[at.length - 1]), y(costs[costs.length - 1]), 4));
  }
  return root;
}

function drawLandscape(data, axis, unit, entries, each, width) {
  const series = entries.map((entry) => ({...entry, shown: scaled(entry.profile.costs, each)}));
  const {root, box, x, y} = Plots.frame({
    width,
    height: 210,
    label: 'Cost along ' + axis,
    x: {
      domain: Plots.domain(series.flatMap((item) => item.profile.offsets), 'linear'),
      title: 'offset from the result (' + unit + ')'
    },
    y: {domain: Plots.domain(series.flatMap((item) => item.shown), 'linear'), title: each ? 'cost, scaled' : 'cost'}
  });
  root.append(svg('line', {class: 'zero', x1: x(0), x2: x(0), y1: box.top, y2: box.bottom}));
  for (const {cell, profile, shown} of series) {
    const lowest = profile.costs.indexOf(Math.min(...profile.costs));
    const tip = data.variants[cell.variant].name + '\nlowest at ' + number(profile.offsets[lowest]) + ' ' + unit +
        ', cost ' + number(profile.costs[lowest]);
    root.append(
        svg('g', {'data-tip': tip},
            Plots.polyline(shown.map((cost, i) => [x(profile.offsets[i]), y(cost)]), cell.variant)));
    root.append(Plots.marker(cell.variant, x(profile.offsets[lowest]), y(shown[lowest]), 4, {'data-tip': tip}));
  }
  return root;
}

const having = (cells, name) => cells.filter((cell) => cell && (cell[name] || []).length);

// An element with the convergence of some cells, or null if none was kept.
export function convergence(data, cells, each) {
  const kept = having(cells, 'convergence');
  return kept.length ? Plots.responsive((width) => drawConvergence(data, kept, each, width)) : null;
}

export function landscapes(data, cells, each) {
  const axes = new Map();
  for (const cell of having(cells, 'landscape')) {
    for (const profile of cell.landscape) {
      if (!axes.has(profile.axis)) axes.set(profile.axis, {unit: profile.unit, entries: []});
      axes.get(profile.axis).entries.push({cell, profile});
    }
  }
  if (!axes.size) return null;
  return el(
      'div', {class: 'small-plots'},
      [...axes].map(
          ([axis, {unit, entries}]) =>
              el('figure', {}, el('figcaption', {}, axis),
                 Plots.responsive((width) => drawLandscape(data, axis, unit, entries, each, width)))));
}
