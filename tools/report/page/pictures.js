// SPDX-License-Identifier: Apache-2.0
// Two pictures of one case on top of each other (wipe), in turn (blink) or side by side; by mouse, touch or keyboard.
import {button, choice, dragAcross, el, select} from './dom.js';
import * as Plots from './plots.js';

const BLINK_MS = 700;  // slower than three times a second
const ZOOMS = [['1', 'fit'], ['2', '2×'], ['4', '4×']];

// One side: the choice of a variant and of a picture's name.
function sideControls(data, letter, side, names, many, changed) {
  const variants =
      select('Variant ' + letter, data.variants.map((variant, i) => [i, variant.name]), side.variant, (value) => {
        side.variant = Number(value);
        changed();
      });
  const pictures = select('Picture ' + letter, names.map((name) => [name, name]), side.name, (value) => {
    side.name = value;
    changed();
  });
  return [data.variants.length > 1 && variants, many && pictures];
}

const partsOf = (name) => ({output: name.split('/')[0], view: name.split('/').pop()});

// The names of two pictures that are worth a comparison: of one view, the outline of the result and what it was found
// by. In the order of the names where there is no outline.
function defaultPair(names) {
  const of = (output, view) =>
      names.find((name) => partsOf(name).output === output && (!view || partsOf(name).view === view));
  const result = of('result') || of('overlay') || names[0], {view} = partsOf(result);
  const other = of('edges', view) || of('borders', view) ||
      names.find((name) => name !== result && partsOf(name).view === view) || names.find((name) => name !== result);
  return [other || result, result];
}

export class Comparer {
  // pair: {cells: [per variant]}; this.same: both sides show pictures of the same name
  constructor(data, pair) {
    this.data = data;
    this.pair = pair;
    this.names = [...new Set(pair.cells.flatMap((cell) => (cell ? cell.pictures.map((entry) => entry.name) : [])))];
    this.same = data.variants.length > 1;
    this.mode = 'wipe';
    this.wipe = 50;
    this.shown = 0;  // which side a blink shows
    this.running = !matchMedia('(prefers-reduced-motion: reduce)').matches;
    const with_pictures = pair.cells.map((cell, i) => (cell && cell.pictures.length ? i : -1)).filter((i) => i >= 0);
    const first = with_pictures.includes(data.baseline) ? data.baseline : with_pictures[0];
    const second = with_pictures.find((i) => i !== first) ?? first, [own, others] = defaultPair(this.names);
    this.sides = [{variant: first, name: this.same ? others : own}, {variant: second, name: others}];
    this.element = el('div', {class: 'comparer', 'data-mode': this.mode});
    this.build();
  }

  build() {
    const update = () => this.update();
    const modes = choice(
        'Mode', [['wipe', 'Wipe'], ['blink', 'Blink'], ['side', 'Side by side']], this.mode,
        (mode) => this.setMode(mode));
    const zoom = choice('Zoom', ZOOMS, '1', (value) => this.stage.style.setProperty('--zoom', value));
    const common = select('Picture', this.names.map((name) => [name, name]), this.sides[0].name, (name) => {
      this.sides.forEach((side) => (side.name = name));
      update();
    });
    this.pause = button(this.running ? 'Pause' : 'Run', () => {
      this.running = !this.running;
      this.pause.textContent = this.running ? 'Pause' : 'Run';
    });
    this.flip = button('Switch', () => this.turn());
    this.images = [0, 1].map((i) => el('img', {
                               class: 'side side-' +
                                   'ab'[i],
                               alt: '',
                               draggable: 'false',
                               onload: () => this.fit()
                             }));
    this.labels = [0, 1].map((i) => el('figcaption', {
                               class: 'label label-' +
                                   'ab'[i]
                             }));
    this.handle = el('div', {
      class: 'handle',
      role: 'slider',
      tabindex: 0,
      'aria-label': 'Wipe between the two pictures',
      'aria-valuemin': 0,
      'aria-valuemax': 100
    });
    this.missing = el('p', {class: 'note', hidden: true});
    this.stage =
        el('div', {
          class: 'stage',
          tabindex: 0,
          role: 'group',
          'aria-label': 'Pictures: arrow keys move the wipe, the space bar switches in a blink'
        },
           el('figure', {class: 'layer-a'}, this.images[0], this.labels[0]),
           el('figure', {class: 'layer-b'}, this.images[1], this.labels[1]), this.handle);
    this.element.append(
        el('div', {class: 'toolbar'}, modes, this.same && common,
           sideControls(this.data, 'A', this.sides[0], this.names, !this.same, update),
           sideControls(this.data, 'B', this.sides[1], this.names, !this.same, update), zoom, this.pause, this.flip),
        this.missing, el('div', {class: 'picture-box'}, this.stage));
    this.listen();
    this.setWipe(50);
    this.update();
    this.setMode('wipe');
    this.timer =
        setInterval(() => this.mode === 'blink' && this.running && this.element.isConnected && this.turn(), BLINK_MS);
  }

  listen() {
    dragAcross(this.stage, (percent) => this.mode === 'wipe' && this.setWipe(percent));
    this.stage.addEventListener('keydown', (event) => {
      const step = {ArrowLeft: -2, ArrowRight: 2, PageDown: -10, PageUp: 10, Home: -100, End: 100}[event.key];
      if (this.mode === 'wipe' && step)
        this.setWipe(this.wipe + step);
      else if (this.mode === 'blink' && (event.key === ' ' || step))
        this.turn();
      else
        return;
      event.preventDefault();
    });
  }

  setMode(mode) {
    this.mode = this.element.dataset.mode = mode;
    this.pause.hidden = this.flip.hidden = mode !== 'blink';
    this.handle.hidden = mode !== 'wipe';
    this.show();
  }

  setWipe(percent) {
    this.wipe = Math.max(0, Math.min(100, percent));
    this.stage.style.setProperty('--wipe', this.wipe + '%');
    this.handle.setAttribute('aria-valuenow', Math.round(this.wipe));
  }

  turn() {
    this.shown = 1 - this.shown;
    this.show();
  }

  show() {
    this.element.dataset.shown = this.shown ? 'b' : 'a';
  }

  pictureOf(side) {
    const cell = this.pair.cells[side.variant], entry = cell && cell.pictures.find((item) => item.name === side.name);
    return entry ? this.data.pictures[entry.picture] : null;
  }

  update() {
    const absent = [];
    this.sides.forEach((side, i) => {
      const source = this.pictureOf(side),
            title = this.data.variants.length > 1 ? this.data.variants[side.variant].name : side.name;
      if (source)
        this.images[i].src = source;
      else
        this.images[i].removeAttribute('src');
      this.images[i].alt = source ? side.name + ', ' + this.data.variants[side.variant].name : '';
      this.labels[i].textContent = title;
      this.labels[i].style.setProperty('--mark', Plots.colour(side.variant));
      if (!source) absent.push(title);
    });
    this.missing.hidden = !absent.length;
    this.missing.textContent = 'No such picture of this case and start was kept for: ' + absent.join(', ') + '.';
  }

  fit() {
    const aspects =
        this.images.filter((item) => item.naturalWidth).map((item) => item.naturalWidth / item.naturalHeight);
    if (aspects.length) this.stage.style.setProperty('--aspect', Math.min(...aspects));
  }

  dispose() {
    clearInterval(this.timer);
  }
}

// All pictures of a cell, small; a click shows one in the full width.
export function gallery(data, cell) {
  return el('div', {class: 'gallery'}, cell.pictures.map((entry) => {
    const button =
        el('button', {
          type: 'button',
          'aria-expanded': 'false',
          onclick: () => button.setAttribute('aria-expanded', String(button.classList.toggle('large')))
        },
           el('img', {src: data.pictures[entry.picture], alt: '', loading: 'lazy'}), el('span', {}, entry.name));
    return button;
  }));
}
