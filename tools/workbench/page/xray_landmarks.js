// SPDX-License-Identifier: Apache-2.0
// Landmarks in X-rays: the tool that marks them, and their places and errors from all views.
import * as Dom from '../../report/page/dom.js';
import {el, svg} from '../../report/page/dom.js';

import * as Geometry from './geometry.js';
import * as Shell from './shell.js';
import * as Viewport from './viewport.js';

// Asks for a text, and resolves to it, or to undefined. `taken` holds texts that may not be given.
export function askName(title, value, taken) {
  return Shell.dialog(title, (close) => {
    const box = el('input', {type: 'text', value, 'data-name': 'new', required: true, maxlength: 100});
    const fault = el('p', {class: 'fault', role: 'alert'});
    const submit = () => {
      const name = box.value.trim();
      if (!name) return void (fault.textContent = 'Give a name.');
      if (name !== value && taken.includes(name)) return void (fault.textContent = `The name “${name}” is taken.`);
      close(name);
    };
    setTimeout(() => box.select());
    return Dom.form(
        {}, submit, Dom.labelled('Name', box), fault,
        el('div', {class: 'toolbar'}, el('button', {type: 'submit', 'data-do': 'ok'}, 'OK')));
  });
}

async function rename(bench, name) {
  const names = all(bench).map((one) => one.name), next = await askName('Rename landmark', name, names);
  if (!next || next === name) return;
  await bench.draft.change(`rename ${name}`, (document) => {
    document.landmarks.find((one) => one.name === name).name = next;
  });
  bench.choose(next);
}
async function remove(bench, name) {
  await bench.draft.change(`remove ${name}`, (document) => {
    document.landmarks = document.landmarks.filter((one) => one.name !== name);
  });
  bench.choose(null);
}

const COLUMNS = [
  ['seen', 'Seen in (u, v) px'], ['world', 'World, mm'], ['rays', 'Rays apart, mm'], ['off', 'Off, px'],
  ['fit', 'Fit off, px']
];

// Tiny numbers are only rounding errors.
export const figure = (value) => (value === null ? '–' : Math.abs(value) < 0.0005 ? '0.000' : Dom.number(value));

// One row. update(landmark) changes only its figures.
function row(bench, name) {
  const choose = Dom.button(
      name, () => bench.choose(bench.chosen === name ? null : name),
      {'data-choose-landmark': name, 'aria-pressed': 'false', class: 'link'});
  const cells = COLUMNS.map(([what, title]) => el('td', {'data-cell': what, 'data-label': title}));
  const [seen, world, rays, off, fit] = cells;
  const element =
      el('tr', {'data-landmark-row': name}, el('th', {scope: 'row'}, choose), cells,
         el('td', {},
            el('span', {class: 'row-actions'},
               Dom.button('Rename', () => rename(bench, name), {'aria-label': `Rename ${name}`}),
               Dom.button('Remove', () => remove(bench, name), {'aria-label': `Remove ${name}`}))));
  const update = (landmark) => {
    const place = placeOf(bench, landmark), fit_off = fitOff(bench, landmark);
    choose.setAttribute('aria-pressed', String(bench.chosen === name));
    element.classList.toggle('chosen', bench.chosen === name);
    seen.textContent = Object.entries(landmark.pixels)
                           .map(([view, at]) => `${view} (${at.map((one) => one.toFixed(1)).join(', ')})`)
                           .join(' · ') ||
        'nowhere yet';
    world.textContent = place ? place.world_mm.map((one) => one.toFixed(2)).join(', ') : '–';
    rays.textContent = figure(place && place.distance_mm);
    off.textContent = figure(place && Math.max(...place.residuals_px));
    fit.textContent = figure(fit_off);
  };
  return {element, update};
}

function fitPart(bench) {
  const state = el('p', {class: 'note', role: 'status', 'data-fit': ''});
  const place = el('div', {class: 'toolbar'});
  const command = el('details', {class: 'fit-command'}, el('summary', {}, 'The same in a shell'));
  const update = () => {
    const fragments = Object.keys(bench.draft.document.fragments || {});
    const {fit, fit_fault} = bench;
    state.className = fit_fault ? 'fault' : 'note';
    state.textContent = fit_fault ||
        (fit ? `Fitted pose: ${figure(fit.residual_px)} px root mean square` +
                 (fit.warnings.length ? '. ' + fit.warnings.join(' ') : '') :
               'Landmarks with a place in the CT give the pose of the bone, if two views show three of them.');
    command.hidden = !fit;
    if (fit) command.replaceChildren(command.firstChild, Dom.command(fit.command));
    place.replaceChildren(
        fragments.length > 1 ?
            Dom.select('Fragment', fragments.map((one) => [one, one]), bench.fragment(), bench.chooseFragment) :
            '',
        el('button', {
          type: 'button',
          'data-do': 'use-as-start',
          disabled: !fit || !fragments.length,
          title: fragments.length ? null : 'There is no fragment yet; make one in the CT',
          onclick: () => useAsStart(bench)
        },
           'Use as start'));
  };
  return {element: el('div', {class: 'fit'}, state, place, command), update};
}

function useAsStart(bench) {
  const fragment = bench.fragment(), start = bench.fit.world_from_ct;
  return bench.draft.change(`start of ${fragment} from landmarks`, (document) => {
    document.fragments[fragment].start = start;
  });
}

export function make(bench) {
  const rows = new Map(), body = el('tbody', {});
  const advice = 'No landmark yet. Choose the tool “Landmark”, and click a point in an X-ray.';
  const empty = el('p', {class: 'note'}, advice);
  const head = ['Landmark', ...COLUMNS.map(([, title]) => title)].map((text) => el('th', {scope: 'col'}, text));
  const table =
      el('div', {class: 'scroll'},
         el('table', {class: 'landmarks'},
            el('thead', {}, el('tr', {}, head, el('th', {scope: 'col'}, el('span', {class: 'hidden'}, 'Actions')))),
            body));
  const fit = fitPart(bench);
  const update = () => {
    const landmarks = all(bench);
    if ([...rows.keys()].join('\n') !== landmarks.map((one) => one.name).join('\n')) {
      rows.clear();
      for (const one of landmarks) rows.set(one.name, row(bench, one.name));
      body.replaceChildren(...[...rows.values()].map((one) => one.element));
    }
    for (const one of landmarks) rows.get(one.name).update(one);
    empty.hidden = landmarks.length > 0;
    table.hidden = !landmarks.length;
  };
  const element = el('div', {class: 'landmark-list'}, empty, table, fit.element);
  return {element, update, updateFit: fit.update};
}

const NEAR_CSS_PX = 12, PAUSE_ms = 500;

const rounded = (pixel) => pixel.map((value) => Math.round(value * 1000) / 1000);
// Inside the image, whose border lies half a pixel outside the centres of its outer pixels.
const inside =
    (entry,
     [u, v]) => [Math.min(entry.width_px - 0.5, Math.max(-0.5, u)), Math.min(entry.height_px - 0.5, Math.max(-0.5, v))];

// The document's landmarks, with the place that is being dragged.
function all(bench) {
  const list = (bench.draft.document.landmarks || []).map((one) => ({...one, pixels: {...(one.pixels || {})}}));
  if (!bench.live) return list;
  const {name, view, pixel} = bench.live;
  let one = list.find((landmark) => landmark.name === name);
  if (!one) list.push(one = {name, pixels: {}});
  one.pixels[view] = pixel;
  return list;
}

function freeName(bench) {
  const names = new Set(all(bench).map((one) => one.name));
  for (let number = 1;; ++number)
    if (!names.has('point ' + number)) return 'point ' + number;
}

function put(document, name, view, pixel) {
  document.landmarks = document.landmarks || [];
  let one = document.landmarks.find((landmark) => landmark.name === name);
  if (!one) document.landmarks.push(one = {name});
  one.pixels = {...(one.pixels || {}), [view]: rounded(pixel)};
}

// The views that show the landmark and have a camera: [{view, camera, pixel}].
const seenIn = (bench, landmark) => Object.entries(landmark.pixels)
                                        .map(([view, pixel]) => ({view, pixel, camera: bench.cameraOf(view)}))
                                        .filter(({camera}) => camera);

// {world_mm, distance_mm, off_px: by view} or null.
function placeOf(bench, landmark) {
  const seen = seenIn(bench, landmark), found = Geometry.triangulated(seen);
  if (!found) return null;
  return {...found, off_px: Object.fromEntries(seen.map(({view}, i) => [view, found.residuals_px[i]]))};
}

// The distance in each view between the marked landmark and the one of the fitted pose.
function fitOff(bench, landmark) {
  if (!bench.fit || !landmark.model_mm) return null;
  const world_mm = Geometry.moved(bench.fit.world_from_ct, landmark.model_mm);
  const off = seenIn(bench, landmark).map(({camera, pixel}) => {
    const at = Geometry.pixel(camera, world_mm);
    return at ? Geometry.length(Geometry.minus(at, pixel)) : Infinity;
  });
  return off.length ? Math.max(...off) : null;
}

// Writes the moved place to the draft. Called after a pause of the keys, and before any other action.
export function commit(bench) {
  clearTimeout(bench.pause);
  const live = bench.live;
  if (!live) return Promise.resolve();
  return bench.draft
      .change(`mark ${live.name} in ${live.view}`, (document) => put(document, live.name, live.view, live.pixel))
      .then(() => {
        if (bench.live === live) bench.live = null;
        bench.refresh();
      });
}

function move(bench, name, view, pixel) {
  const entry = bench.frames.get(view).entry;
  bench.live = {name, view, pixel: rounded(inside(entry, pixel))};
  bench.refresh();
}

function marked(bench, name, view) {
  const one = all(bench).find((landmark) => landmark.name === name);
  return one && one.pixels[view];
}

function nearest(bench, frame, pixel) {
  let best = null, least = NEAR_CSS_PX;
  for (const one of all(bench)) {
    const at = one.pixels[frame.name];
    if (!at) continue;
    const away =
        Geometry.length(Geometry.minus(Viewport.toScreen(frame.port, at), Viewport.toScreen(frame.port, pixel)));
    if (away < least) [best, least] = [one.name, away];
  }
  return best;
}

// The landmark that a click places: the chosen one if this view does not show it yet, otherwise a new one.
const nameToPlace = (bench, view) =>
    (bench.chosen && !marked(bench, bench.chosen, view) ? bench.chosen : freeName(bench));

function press(bench, frame, pixel) {
  commit(bench);
  const hit = nearest(bench, frame, pixel);
  const name = hit || nameToPlace(bench, frame.name);
  const grab = hit ? Geometry.minus(marked(bench, hit, frame.name), pixel) : [0, 0];
  bench.choose(name);
  if (!hit) move(bench, name, frame.name, pixel);
  return {
    move: (at) => move(bench, name, frame.name, Geometry.plus(at, grab)),
    end: () => commit(bench),
    cancel() {
      bench.live = null;
      bench.refresh();
    }
  };
}

function arrow(bench, frame, step) {
  const at = bench.chosen && marked(bench, bench.chosen, frame.name);
  if (at) {
    clearTimeout(bench.pause);
    if (bench.live && (bench.live.view !== frame.name || bench.live.name !== bench.chosen)) commit(bench);
    move(bench, bench.chosen, frame.name, Geometry.plus(at, step));
    bench.pause = setTimeout(() => commit(bench), PAUSE_ms);
  } else {
    const middle = Viewport.toPixel(frame.port, frame.port.frame.map((side) => side / 2)).map(Math.round);
    frame.cursor = inside(frame.entry, frame.cursor ? Geometry.plus(frame.cursor, step) : middle);
    frame.draw();
  }
  return true;
}

function key(bench, frame, name) {
  if (name === 'Enter') {
    if (!frame.cursor) return arrow(bench, frame, [0, 0]);
    const place = frame.cursor, landmark = nameToPlace(bench, frame.name);
    frame.cursor = null;
    bench.choose(landmark);
    move(bench, landmark, frame.name, place);
    commit(bench);
    return true;
  }
  if (name === 'Delete' && bench.chosen && marked(bench, bench.chosen, frame.name)) {
    const chosen = bench.chosen;
    commit(bench);
    bench.draft.change(`remove ${chosen} from ${frame.name}`, (document) => {
      const one = document.landmarks.find((landmark) => landmark.name === chosen);
      delete one.pixels[frame.name];
    });
    return true;
  }
  if (name === 'Escape') {
    frame.cursor = null;
    bench.choose(null);
    return true;
  }
  if (name === 'n') {
    const names = all(bench).map((one) => one.name), next = names.indexOf(bench.chosen) + 1;
    bench.choose(names[next] || null);
    return true;
  }
  return false;
}

const line = (frame, ends, attributes) => {
  const [[x1, y1], [x2, y2]] = ends.map((end) => Viewport.toScreen(frame.port, end));
  return svg('line', {x1, y1, x2, y2, ...attributes});
};
function cross(frame, pixel, size, attributes) {
  const [x, y] = Viewport.toScreen(frame.port, pixel);
  return svg('path', {d: `M${x - size} ${y}h${2 * size}M${x} ${y - size}v${2 * size}`, ...attributes});
}

// The chosen landmark from the other views: a line for each, and the place on which all agree.
function linesOf(bench, frame, landmark) {
  const camera = bench.cameraOf(frame.name);
  if (!camera) return [];
  const lines = seenIn(bench, landmark).filter(({view}) => view !== frame.name).map((seen) => {
    const ends = Geometry.epipolarLine(seen.camera, seen.pixel, camera);
    return ends && line(frame, ends, {class: 'epipolar', 'data-from': seen.view});
  });
  const place = placeOf(bench, landmark), at = place && Geometry.pixel(camera, place.world_mm);
  return [...lines, at && cross(frame, at, 7, {class: 'agreed'})];
}

export function marks(bench, frame) {
  const camera = bench.cameraOf(frame.name), shown = [];
  for (const one of all(bench)) {
    const is_chosen = one.name === bench.chosen;
    if (is_chosen) shown.push(...linesOf(bench, frame, one));
    if (bench.fit && one.model_mm && camera) {
      const at = Geometry.pixel(camera, Geometry.moved(bench.fit.world_from_ct, one.model_mm));
      if (at) shown.push(cross(frame, at, 5, {class: 'fitted'}));
    }
    const at = one.pixels[frame.name];
    if (!at) continue;
    const [cx, cy] = Viewport.toScreen(frame.port, at);
    shown.push(
        svg('circle', {class: 'landmark-rim', cx, cy, r: 6}),
        svg('circle', {class: 'landmark' + (is_chosen ? ' chosen' : ''), cx, cy, r: 6, 'data-landmark': one.name}),
        svg('circle', {class: 'landmark-dot', cx, cy, r: 1}), svg('text', {x: cx + 9, y: cy - 7}, one.name));
  }
  if (frame.cursor) shown.push(cross(frame, frame.cursor, 14, {class: 'keyboard-cursor'}));
  return shown;
}

function says(bench, frame, pixel) {
  const hit = nearest(bench, frame, pixel);
  return hit ? 'drag to move ' + hit : 'click to mark ' + nameToPlace(bench, frame.name);
}

export const tool = (bench) => ({
  says: (frame, pixel) => says(bench, frame, pixel),
  press: (frame, pixel) => press(bench, frame, pixel),
  arrow: (frame, step) => arrow(bench, frame, step),
  key: (frame, name) => key(bench, frame, name)
});

export const KEYS = [
  ['Enter', 'in an X-ray: place a landmark, or put the brush down and lift it'],
  ['n', 'in an X-ray: the next landmark'], ['Delete', 'in an X-ray: remove the landmark from it'],
  ['Esc', 'in an X-ray: choose no landmark']
];
