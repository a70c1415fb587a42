// SPDX-License-Identifier: Apache-2.0
// Imports seeds, landmarks and starts from files of the folder, and exports them.
import * as Dom from '../../report/page/dom.js';
import {el} from '../../report/page/dom.js';

import * as Ask from './server.js';
import * as Shell from './shell.js';
import * as XrayExport from './xray_export.js';

const TITLES = {
  seeds: 'Seeds',
  landmarks: 'Landmarks',
  pose: 'Start'
};

const fragmentOf = (document, name) => {
  document.fragments = document.fragments || {};
  return document.fragments[name] = document.fragments[name] || {seeds: [], register: true};
};

// Enters the content of a file into the document. Landmarks of the same name get the places in the file. Everything
// else stays.
const PUT = {
  seeds(document, {seeds}) {
    for (const [name, one] of Object.entries(seeds)) Object.assign(fragmentOf(document, name), one);
  },
  landmarks(document, {landmarks}) {
    document.landmarks = document.landmarks || [];
    for (const one of landmarks) {
      const old = document.landmarks.find((other) => other.name === one.name);
      if (old)
        Object.assign(old, one, {pixels: {...(old.pixels || {}), ...(one.pixels || {})}});
      else
        document.landmarks.push(one);
    }
  },
  pose(document, {world_from_ct}, fragment) {
    fragmentOf(document, fragment).start = world_from_ct;
  }
};

async function importFrom(shared, what) {
  const path = await Shell.choose(`Import: ${TITLES[what].toLowerCase()}`);
  if (path === undefined) return;
  await Shell.guarded(async () => {
    const got = await Ask.json('api/xray/import', {what, path});
    await shared.draft.change(`import ${path}`, (document) => PUT[what](document, got, shared.fragment()));
    for (const warning of got.warnings) Shell.notice(warning);
    Shell.notice(`${TITLES[what]} read from ${path}`);
  });
}

const NAMES = {
  ...TITLES,
  cameras: 'Cameras',
  result: 'Result’s pose'
};

export function make(shared) {
  const command = el('div', {role: 'status', 'data-exported': ''});
  const told = ({path, command: text}) => command.replaceChildren(...(
      text ? [el('p', {class: 'note'}, `The same as ${path} in a shell, into the folder runs:`), Dom.command(text)] :
             []));
  const button = (text, what, does) => Dom.button(
      text, does, {[`data-${text.toLowerCase()}`]: what, 'aria-label': `${text} ${NAMES[what].toLowerCase()}`});
  const row = (what) => el(
      'span', {class: 'field'}, el('span', {}, NAMES[what]),
      el('span', {class: 'pair'}, TITLES[what] && button('Import', what, () => importFrom(shared, what)),
         button(
             'Export', what,
             () => (what === 'result' ? XrayExport.beginResult(shared, told) : XrayExport.begin(shared, what, told)))));
  return {element: el('div', {class: 'exchange'}, el('div', {class: 'toolbar'}, Object.keys(NAMES).map(row)), command)};
}
