// SPDX-License-Identifier: Apache-2.0
// The pipelines of the folder, and marrow's own, which are copied into it.
import {button, el} from '../../report/page/dom.js';

import * as Ask from './server.js';
import * as Shell from './shell.js';

// What most people need first.
const ADVISED = [['femur/femur-best', 'A fractured femur'], ['bone/bone', 'Any other bone']];
const FAMILIES = {
  bone: 'Any bone',
  calibration: 'Calibration of cameras',
  femur: 'Femur',
  guidance: 'Guidance',
  implant: 'Implants',
  simulate: 'Simulated data',
  track: 'Sequences',
  wrist: 'Wrist'
};

const fileOf = (one) => one.name.split('/')[1] + '.yaml';
const firstSentence = (text) => (/^.*?[.](?=\s|$)/s.exec(text.trim()) || [text.trim()])[0];

function row(one, files, title) {
  const file = fileOf(one);
  const copy = () => Shell.guarded(async () => {
    const {file: made} = await Ask.post('api/pipeline/copy', {name: one.name});
    Shell.notice(made + ' is now in this folder, and yours to change.');
    Shell.go('pipeline', made);
  });
  return el(
      'li', {class: 'case-row', 'data-own': one.name},
      el('div', {class: 'about'}, el('span', {class: 'name'}, title || one.name.split('/')[1]),
         title ? el('code', {}, ' ' + file) : '', el('small', {}, firstSentence(one.help))),
      el('div', {class: 'actions'},
         files.includes(file) ?
             el('a', {class: 'as-button', href: Shell.addressOf('pipeline', file)}, 'Open ' + file) :
             button('Copy ' + file + ' into this folder', copy, {'data-copy': one.name, class: title && 'primary'})));
}

function ownSection(own, files) {
  const some = (wanted) => own.filter(wanted);
  const advised = ADVISED.map(([name, title]) => [own.find((one) => one.name === name), title]).filter(([one]) => one);
  return el(
      'section', {class: 'card', 'aria-label': 'marrow\'s own pipelines'},
      el('div', {class: 'card-head'}, el('h2', {}, 'marrow\'s own')),
      el('p', {class: 'note'}, 'A copy is yours to change. It goes on using marrow\'s files for its parts.'),
      el('ul', {class: 'files'}, advised.map(([one, title]) => row(one, files, title))),
      Object.entries(FAMILIES).map(([family, title]) => {
        const members = some((one) => one.name.startsWith(family + '/'));
        return members.length ?
            el('details', {'data-family': family}, el('summary', {}, title + ' (' + members.length + ')'),
               el('ul', {class: 'files'}, members.map((one) => row(one, files)))) :
            '';
      }));
}

export async function show(place) {
  const [{pipelines}, own] = await Promise.all([Ask.json('api/folder'), Ask.json('api/pipeline/own')]);
  place.append(
      el('div', {class: 'page-head'}, el('h1', {}, 'Pipelines')),
      el('div', {class: 'card-columns'},
         el('section', {class: 'card', 'aria-label': 'In this folder'},
            el('div', {class: 'card-head'}, el('h2', {}, 'In this folder')),
            Shell.links('pipeline', pipelines, 'There is none yet. Copy one of marrow\'s own.')),
         own.length ? ownSection(own, pipelines) : ''));
}
