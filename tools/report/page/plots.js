// SPDX-License-Identifier: Apache-2.0
// What all plots share: axes, marks, legends, and drawing again when the width changes. Scales, axes and shapes are
// d3's; only the files that are used, as the packages do not let esbuild leave out the others. Ours are the frame about
// them, the ticks of logarithmic scales, and marks that differ in shape and colour.
import './notices.js';

import {axisBottom, axisLeft} from 'd3-axis';
import scaleLinear from 'd3-scale/src/linear.js';
import scaleLog from 'd3-scale/src/log.js';
import scaleSymlog from 'd3-scale/src/symlog.js';
import {select} from 'd3-selection';
import area from 'd3-shape/src/area.js';
import line from 'd3-shape/src/line.js';
import symbol, {symbols} from 'd3-shape/src/symbol.js';

import {el, number, svg} from './dom.js';

const [CIRCLE, CROSS, DIAMOND, SQUARE, , TRIANGLE] = symbols;
const MARKERS = [CIRCLE, SQUARE, TRIANGLE, DIAMOND, CROSS];
const DASHES = ['none', '7 3', '2 3', '9 3 2 3'];

export const colour = (variant) => 'var(--variant-' + (variant % 7 + 1) + ')';
const dash = (variant) => DASHES[Math.floor(variant / 7) % DASHES.length];

// d3 labels the powers of ten only, which may be one label or none. These are 1, 2, 5 or 1, 3 of each power, as many as
// there is place for. Within less than a power of ten, linear ticks.
function ticksLog(scale, count) {
  const [low, high] = scale.domain();
  if (high < 8 * low) return scaleLinear().domain([low, high]).ticks(Math.min(count, 6));
  const all = scale.ticks(100).filter((tick) => tick >= low && tick <= high);
  const digit = (tick) => Number(tick.toExponential(0)[0]);
  return [[1, 2, 5], [1, 3], [1]]
             .map((digits) => all.filter((tick) => digits.includes(digit(tick))))
             .find((ticks) => ticks.length <= count * 1.3) ||
      scale.ticks(count);
}

// Zero, and powers of ten to both sides. d3 gives such a scale the ticks of a linear one, which crowd at its ends.
function ticksSigned([low, high], unit, count) {
  const size = Math.max(Math.abs(low), Math.abs(high)), ticks = [0];
  for (let tick = unit; tick <= size; tick *= 10) ticks.push(tick, -tick);
  const inside = ticks.filter((tick) => tick >= low && tick <= high).sort((a, b) => a - b);
  return inside.length > count ? inside.filter((tick) => tick === 0 || Math.abs(tick) > unit) : inside;
}

// kind: linear, log, or signed (linear about 0 up to "unit", logarithmic beyond). With the ticks for this length.
function scaleOf({kind = 'linear', domain, unit}, range) {
  const length_px = Math.abs(range[1] - range[0]), is_across = range[0] < range[1];
  const count = Math.max(2, length_px / (kind === 'linear' && is_across ? 75 : 55));
  const make = {linear: scaleLinear, log: scaleLog, signed: scaleSymlog}[kind];
  const scale = make().domain(domain).range(range);
  if (kind === 'signed') scale.constant(unit);
  if (kind === 'log') scale.clamp(true);  // a value of 0 lies at the edge
  const ticks = kind === 'log' ? ticksLog(scale, count) :
      kind === 'signed'        ? ticksSigned(domain, unit, count) :
                                 scale.ticks(count);
  return {scale, ticks};
}

// A range of values with a margin, fit for a scale of this kind. It begins where the values begin: 0 is in it only if
// it is among the values or about as near as the margin is wide.
export function domain(values, kind) {
  const finite = values.filter((value) => Number.isFinite(value) && (kind !== 'log' || value > 0));
  if (!finite.length) return kind === 'log' ? [0.1, 10] : [0, 1];
  const [low, high] =
      finite.reduce(([least, most], value) => [Math.min(least, value), Math.max(most, value)], [Infinity, -Infinity]);
  if (kind === 'log') return low === high ? [low / 3, high * 3] : [low / 1.2, high * 1.2];
  const margin = 0.05 * (high - low) || Math.abs(high) || 1;
  const least = low >= 0 ? Math.max(0, low - margin) : low - margin;
  return [least, high <= 0 ? Math.min(0, high + margin) : high + margin];
}

// As elsewhere in the page, but without decimals that say nothing.
function tickText(value) {
  const size = Math.abs(value);
  if (size >= 1e4 || (size !== 0 && size < 1e-3)) return number(value);
  return String(Number(value.toPrecision(6))).replace('-', '−');
}

// An axis with its ticks, their lines across the plot, and its title.
function drawScale(axis, ticks, format, across_px, place) {
  const group = svg('g', {class: 'scale', ...place}), text = (tick) => (format || tickText)(tick);
  select(group).call(axis.tickValues(ticks).tickFormat(text).tickSizeInner(-across_px).tickSizeOuter(0).tickPadding(8));
  return group;
}

// An empty plot: axes, grid, titles. Returns {root, box, x, y}; draw into root. Without "y" there is no vertical
// axis.
export function frame({width, height, x, y, label, format}) {
  const box = {left: y ? 58 : 8, right: width - 14, top: 12, bottom: height - 46};
  const root = svg('svg', {viewBox: '0 0 ' + width + ' ' + height, class: 'plot', role: 'img', 'aria-label': label});
  const tall = box.bottom - box.top, wide = box.right - box.left;
  const across = scaleOf(x, [box.left + (y ? 0 : 6), box.right]);
  root.append(
      drawScale(axisBottom(across.scale), across.ticks, x.format, tall, {transform: 'translate(0 ' + box.bottom + ')'}),
      svg('text', {class: 'title', x: (box.left + box.right) / 2, y: box.bottom + 36, 'text-anchor': 'middle'},
          x.title));
  if (!y) return {root, box, x: across.scale};
  const up = scaleOf(y, [box.bottom, box.top]), middle = (box.top + box.bottom) / 2;
  root.append(
      drawScale(axisLeft(up.scale), up.ticks, y.format || format, wide, {transform: 'translate(' + box.left + ' 0)'}),
      svg('text', {class: 'title', transform: 'translate(13 ' + middle + ') rotate(-90)', 'text-anchor': 'middle'},
          y.title));
  return {root, box, x: across.scale, y: up.scale};
}

// A mark. Its shape also tells the variants apart, not only its colour.
export function marker(variant, x, y, size, attributes) {
  const shape = symbol().type(MARKERS[variant % MARKERS.length]).size(Math.PI * size ** 2);
  const place = 'translate(' + x.toFixed(1) + ' ' + y.toFixed(1) + ')';
  return svg('path', {d: shape(), transform: place, fill: colour(variant), ...attributes});
}

export const swatch = (variant) => svg(
    'svg', {class: 'swatch', viewBox: '0 0 22 12', 'aria-hidden': 'true'},
    svg('line',
        {x1: 0, x2: 22, y1: 6, y2: 6, stroke: colour(variant), 'stroke-width': 2.5, 'stroke-dasharray': dash(variant)}),
    marker(variant, 11, 6, 4));

export const legend = (variants, shown) => el(
    'ul', {class: 'legend', 'aria-label': 'Legend'},
    variants.map(
        (variant, i) =>
            (!shown || shown(i) ?
                 el('li', {}, swatch(i), variant.name, variant.is_baseline && el('span', {class: 'tag'}, 'baseline')) :
                 null)));

const is_known = ([x, y]) => Number.isFinite(x) && Number.isFinite(y);

// A line through points in pixels. It has gaps where a point is not known; a point between two gaps is a dot.
export const polyline = (points, variant, attributes) => svg('path', {
  class: 'line',
  fill: 'none',
  stroke: colour(variant),
  'stroke-width': 2,
  'stroke-linejoin': 'round',
  'stroke-linecap': 'round',
  'stroke-dasharray': dash(variant),
  d: line().defined(is_known)(points),
  ...attributes
});

// The area between two curves, [x, lower, upper] each in pixels, where both are known.
export const band = (points, attributes) => svg('path', {
  class: 'band',
  d: area()
         .x(([x]) => x)
         .y0(([, lower]) => lower)
         .y1(([, , upper]) => upper)
         .defined(([x, lower, upper]) => is_known([x, lower]) && is_known([x, upper]))(points),
  ...attributes
});

// A place that is drawn by draw(width) now, and again whenever its width or what is chosen changes.
export function responsive(draw) {
  const place = el('div', {class: 'figure'});
  let width = 0;
  place.redraw = () => {
    width = place.clientWidth;
    if (width) place.replaceChildren(draw(Math.max(240, width)));
  };
  new ResizeObserver(() => place.clientWidth !== width && requestAnimationFrame(place.redraw)).observe(place);
  return place;
}

// A repeatable number in [-1, 1] from a count. It spreads points that would cover each other.
export const spread = (i) => 2 * ((i * 0.6180339887) % 1) - 1;
