// SPDX-License-Identifier: Apache-2.0
// A sequence of a run: its pictures frame by frame, with a slider, and the motion of each bone with its deviations.
import {button, el, select, svg, withUnit} from './dom.js';
import * as Plots from './plots.js';
import {shown} from './shown.js';

const AXES = [
  ['about the frontal axis', 'deg'], ['about the lateral axis', 'deg'], ['about the long axis', 'deg'],
  ['along the frontal axis', 'mm'], ['along the lateral axis', 'mm'], ['along the long axis', 'mm']
];
const BAND = 2;  // standard deviations to either side

// "overlay/0007/bone/frontal" is frame 0007 of "overlay/bone/frontal".
function partsOf(name) {
  const parts = name.split('/'), at = parts.findIndex((part) => /^\d+$/.test(part));
  return at < 0 ? null : {frame: parts[at], name: parts.filter((_, i) => i !== at).join('/')};
}

// {frames: [names in order], films: Map(name -> Map(frame -> picture id)), ways: trajectories}; null for a run without
// a sequence.
export function of (cell) {
  const films = new Map();
  for (const entry of cell.pictures) {
    const parts = partsOf(entry.name);
    if (!parts) continue;
    if (!films.has(parts.name)) films.set(parts.name, new Map());
    films.get(parts.name).set(parts.frame, entry.picture);
  }
  for (const [name, film] of films)
    if (film.size < 2) films.delete(name);
  const ways = (cell.trajectories || []).filter((way) => way.frames.length > 1);
  const names = new Set([...films.values()].flatMap((film) => [...film.keys()]));
  ways.forEach((way) => way.frames.forEach((name) => names.add(name)));
  return names.size ? {frames: [...names].sort((a, b) => a - b), films, ways} : null;
}

export const stills = (cell) => {
  const sequence = of(cell);
  return cell.pictures.filter((entry) => {
    const parts = partsOf(entry.name);
    return !(parts && sequence && sequence.films.has(parts.name));
  });
};

function drawCurve(way, axis, width) {
  const [title, unit] = AXES[axis], values = way.motion.map((motion) => motion[axis]),
                spread = way.deviation.map((deviation) => BAND * deviation[axis]);
  const {root, box, x, y} = Plots.frame({
    width,
    height: 210,
    label: way.name + ': motion ' + title,
    x: {domain: [1, way.frames.length], title: 'frame'},
    y: {
      domain: Plots.domain(values.flatMap((value, i) => [value - spread[i], value + spread[i]]), 'linear'),
      title: 'motion (' + unit + ')'
    }
  });
  way.found.forEach((found, i) => {
    if (!found)
      root.append(svg('rect', {
        class: 'lost',
        x: x(i + 0.5),
        y: box.top,
        width: Math.max(1, x(2) - x(1)),
        height: box.bottom - box.top,
        'data-tip': 'frame ' + way.frames[i] + ': the bone is lost'
      }));
  });
  root.append(Plots.band(values.map((value, i) => [x(i + 1), y(value - spread[i]), y(value + spread[i])])));
  root.append(Plots.polyline(values.map((value, i) => [x(i + 1), y(value)]), 0));
  const cursor = svg('line', {class: 'cursor', y1: box.top, y2: box.bottom});
  root.append(cursor);
  root.moveTo = (frame) => {
    const at = way.frames.indexOf(frame);
    cursor.setAttribute('visibility', at < 0 ? 'hidden' : 'visible');
    cursor.setAttribute('x1', x(at + 1));
    cursor.setAttribute('x2', x(at + 1));
  };
  return root;
}

export class Player {
  constructor(data, sequence) {
    this.data = data;
    this.sequence = sequence;
    this.at = 0;
    this.rate = 10;
    this.timer = null;
    this.plots = [];
    this.build();
    this.show(0);
  }

  build() {
    const last = this.sequence.frames.length - 1;
    this.slider = el('input', {
      type: 'range',
      min: 0,
      max: last,
      value: 0,
      'aria-label': 'Frame',
      oninput: () => {
        this.stop();
        this.show(Number(this.slider.value));
      }
    });
    this.label = el('output', {class: 'frame-name'});
    this.play = button('Play', () => (this.timer ? this.stop() : this.start()));
    const rate = select('Frames a second', [2, 5, 10, 20, 30].map((value) => [value, value]), this.rate, (value) => {
      this.rate = Number(value);
      if (this.timer) this.start();
    });
    this.films = [...this.sequence.films].map(([name, film]) => {
      const image = el('img', {alt: name}), note = el('small');
      return {name, film, image, note, element: el('figure', {}, image, el('figcaption', {}, name, ' ', note))};
    });
    this.element =
        el('div', {class: 'player'},
           el('div', {class: 'toolbar'}, this.play, rate,
              el('label', {class: 'field frames'}, el('span', {}, 'Frame'), this.slider), this.label),
           el('div', {class: 'films'}, this.films.map((one) => one.element)),
           this.sequence.ways.map((way) => this.curves(way)));
  }

  curves(way) {
    const lost = way.found.filter((found) => !found).length;
    const plots = AXES.map((_, axis) => {
      const place = Plots.responsive((width) => {
        const plot = drawCurve(way, axis, width);
        place.plot = plot;
        plot.moveTo(this.sequence.frames[this.at]);
        return plot;
      });
      this.plots.push(place);
      return el('figure', {}, el('figcaption', {}, AXES[axis][0]), place);
    });
    return el(
        'div', {}, el('h3', {}, way.name),
        el('p', {class: 'note'},
           'Motion from the first frame, in the bone’s own axes; the band is ' + BAND +
               ' standard deviations to either side. ' +
               (lost ? 'Lost in ' + lost + ' of ' + way.frames.length + ' frames, which are grey.' :
                       'Found in all ' + way.frames.length + ' frames.')),
        el('div', {class: 'small-plots'}, plots));
  }

  start() {
    this.stop();
    this.play.textContent = 'Pause';
    this.timer = setInterval(
        () => (this.element.isConnected ? this.show((this.at + 1) % this.sequence.frames.length) : this.stop()),
        1000 / this.rate);
  }

  stop() {
    clearInterval(this.timer);
    this.timer = null;
    this.play.textContent = 'Play';
  }

  // The 3D view's models are named like the bones: the last part of a way's name.
  moveModels() {
    if (!shown.scene) return;
    const poses = {};
    for (const way of this.sequence.ways) {
      const at = way.frames.indexOf(this.sequence.frames[this.at]);
      if (at >= 0) poses[way.name.split('/').pop()] = way.world_from_model[at];
    }
    shown.scene.moveTo(poses);
  }

  show(at) {
    this.at = at;
    this.slider.value = at;
    const frame = this.sequence.frames[at], way = this.sequence.ways[0];
    const time = way ? way.time_s[way.frames.indexOf(frame)] : undefined;
    this.label.textContent = frame + (Number.isFinite(time) ? ', ' + withUnit(time, 's') : '');
    for (const {film, image, note} of this.films) {
      const source = this.data.pictures[film.get(frame)];
      image.style.visibility = source ? 'visible' : 'hidden';
      if (source) image.src = source;
      note.textContent = source ? '' : 'none in this frame';
    }
    for (const place of this.plots)
      if (place.plot) place.plot.moveTo(frame);
    this.moveModels();
  }
}
