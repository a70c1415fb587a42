// SPDX-License-Identifier: Apache-2.0
// What all plots share: scales, axes, marks, legends, and drawing again when the width changes.
import {el, svg} from './dom.js';

const MARKERS = ['circle', 'square', 'triangle', 'diamond', 'cross'];
const DASHES = ['none', '7 3', '2 3', '9 3 2 3'];

export const colour = (variant) => 'var(--variant-' + (variant % 7 + 1) + ')';
const dash = (variant) => DASHES[Math.floor(variant / 7) % DASHES.length];

function ticksLinear([low, high], count) {
  const raw = (high - low) / Math.max(1, count), power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].find((factor) => factor * power >= raw * 0.999) * power;
  const ticks = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-9; ++i)
    ticks.push(Number((i * step).toPrecision(12)));
  return ticks;
}

function ticksLog([low, high], count) {
  const powers = [];
  for (let p = Math.floor(Math.log10(low)); p <= Math.ceil(Math.log10(high)); ++p) powers.push(p);
  for (const factors of [[1, 2, 5], [1, 3], [1]]) {
    const ticks = powers.flatMap((p) => factors.map((factor) => Number((factor * 10 ** p).toPrecision(6))))
                      .filter((tick) => tick >= low * 0.999 && tick <= high * 1.001);
    if (ticks.length <= count * 1.3) return ticks;
  }
  return powers.map((p) => 10 ** p).filter((tick) => tick >= low && tick <= high);
}

function ticksSigned([low, high], unit, count) {
  const size = Math.max(Math.abs(low), Math.abs(high)), ticks = [0];
  for (let tick = unit; tick <= size; tick *= 10) ticks.push(tick, -tick);
  const inside = ticks.filter((tick) => tick >= low && tick <= high).sort((a, b) => a - b);
  return inside.length > count ? inside.filter((tick) => tick === 0 || Math.abs(tick) > unit) : inside;
}

// kind: linear, log, or signed (linear about 0 up to "unit", logarithmic beyond).
function scale(kind, domain, range, unit) {
  const forward = kind === 'log' ? Math.log10 : kind === 'signed' ? (x) => Math.asinh(x / unit) : (x) => x;
  const [from, to] = domain.map(forward), [left, right] = range;
  const map = (value) =>
      left + (forward(kind === 'log' ? Math.max(value, domain[0]) : value) - from) / (to - from || 1) * (right - left);
  const count = Math.max(2, Math.abs(right - left) / (kind === 'linear' && range[0] < range[1] ? 75 : 55));
  map.ticks = kind === 'log' ? ticksLog(domain, count) :
      kind === 'signed'      ? ticksSigned(domain, unit, count) :
                               ticksLinear(domain, count);
  map.domain = domain;
  return map;
}

// A range of values with a margin, fit for a scale of this kind.
export function domain(values, kind, with_zero) {
  const finite = values.filter((value) => Number.isFinite(value) && (kind !== 'log' || value > 0));
  if (!finite.length) return kind === 'log' ? [0.1, 10] : [0, 1];
  let [low, high] =
      finite.reduce(([least, most], value) => [Math.min(least, value), Math.max(most, value)], [Infinity, -Infinity]);
  if (kind === 'log') return low === high ? [low / 3, high * 3] : [low / 1.2, high * 1.2];
  if (with_zero) [low, high] = [Math.min(0, low), Math.max(0, high)];
  const margin = 0.05 * (high - low) || Math.abs(high) || 1;
  return [with_zero && low === 0 ? 0 : low - margin, high + margin];
}

const tickText = (value) =>
    (value === 0                                          ? '0' :
         Math.abs(value) >= 1e5 || Math.abs(value) < 1e-3 ? value.toExponential(0) :
                                                            String(Number(value.toPrecision(6))))
        .replace('-', '−');

// An empty plot: axes, grid, titles. Returns {root, box, x, y}; draw into root. Without "y" there is no vertical
// axis.
export function frame({width, height, x, y, label, format}) {
  const box = {left: y ? 58 : 8, right: width - 14, top: 12, bottom: height - 46};
  const root = svg('svg', {viewBox: '0 0 ' + width + ' ' + height, class: 'plot', role: 'img', 'aria-label': label});
  const across = scale(x.kind || 'linear', x.domain, [box.left + (y ? 0 : 6), box.right], x.unit);
  for (const tick of across.ticks) {
    root.append(svg('line', {class: 'grid', x1: across(tick), x2: across(tick), y1: box.top, y2: box.bottom}));
    root.append(
        svg('text', {x: across(tick), y: box.bottom + 16, 'text-anchor': 'middle'}, (x.format || tickText)(tick)));
  }
  root.append(svg('line', {class: 'axis', x1: box.left, x2: box.right, y1: box.bottom, y2: box.bottom}));
  root.append(svg(
      'text', {class: 'title', x: (box.left + box.right) / 2, y: box.bottom + 36, 'text-anchor': 'middle'}, x.title));
  if (!y) return {root, box, x: across};
  const up = scale(y.kind || 'linear', y.domain, [box.bottom, box.top], y.unit);
  for (const tick of up.ticks) {
    root.append(svg('line', {class: 'grid', x1: box.left, x2: box.right, y1: up(tick), y2: up(tick)}));
    root.append(
        svg('text', {x: box.left - 8, y: up(tick) + 4, 'text-anchor': 'end'}, (y.format || format || tickText)(tick)));
  }
  root.append(
      svg('text', {
        class: 'title',
        transform: 'translate(13 ' + (box.top + box.bottom) / 2 + ') rotate(-90)',
        'text-anchor': 'middle'
      },
          y.title));
  return {root, box, x: across, y: up};
}

// A mark. Its shape also tells the variants apart, not only its colour.
export function marker(variant, x, y, size, attributes) {
  const all = {fill: colour(variant), ...attributes};
  const shape = MARKERS[variant % MARKERS.length], r = size;
  if (shape === 'circle') return svg('circle', {cx: x.toFixed(1), cy: y.toFixed(1), r, ...all});
  const paths = {
    square: [[-1, -1], [1, -1], [1, 1], [-1, 1]],
    triangle: [[0, -1.2], [1.2, 1], [-1.2, 1]],
    diamond: [[0, -1.4], [1.4, 0], [0, 1.4], [-1.4, 0]],
    cross: [
      [-1.3, -0.5], [-0.5, -0.5], [-0.5, -1.3], [0.5, -1.3], [0.5, -0.5], [1.3, -0.5], [1.3, 0.5], [0.5, 0.5],
      [0.5, 1.3], [-0.5, 1.3], [-0.5, 0.5], [-1.3, 0.5]
    ]
  };
  const points = paths[shape].map(([dx, dy]) => (x + 0.9 * r * dx).toFixed(1) + ',' + (y + 0.9 * r * dy).toFixed(1));
  return svg('polygon', {points: points.join(' '), ...all});
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

export const polyline = (points, variant, attributes) => svg('polyline', {
  fill: 'none',
  stroke: colour(variant),
  'stroke-width': 2,
  'stroke-linejoin': 'round',
  'stroke-dasharray': dash(variant),
  points: points.map(([x, y]) => x.toFixed(1) + ',' + y.toFixed(1)).join(' '),
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
