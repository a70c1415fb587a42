// SPDX-License-Identifier: Apache-2.0
// The list of landmarks with their places and errors in the X-rays, and the pose that they give.
import * as Dom from '../../report/page/dom.js';
import {el} from '../../report/page/dom.js';

import * as Shell from './shell.js';
import * as XrayLandmarks from './xray_landmarks.js';

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
  const names = XrayLandmarks.all(bench).map((one) => one.name), next = await askName('Rename landmark', name, names);
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
    const place = XrayLandmarks.placeOf(bench, landmark), fit_off = XrayLandmarks.fitOff(bench, landmark);
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
  const empty = el('p', {class: 'note'}, 'No landmark yet. Choose the tool “Landmark”, and click a point in an X-ray.');
  const head = ['Landmark', ...COLUMNS.map(([, title]) => title)].map((text) => el('th', {scope: 'col'}, text));
  const table =
      el('div', {class: 'scroll'},
         el('table', {class: 'landmarks'},
            el('thead', {}, el('tr', {}, head, el('th', {scope: 'col'}, el('span', {class: 'hidden'}, 'Actions')))),
            body));
  const fit = fitPart(bench);
  const update = () => {
    const landmarks = XrayLandmarks.all(bench);
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
