// SPDX-License-Identifier: Apache-2.0
// Seeds, landmarks and starts from files of the folder, and to files.
'use strict';

const XrayExchange = (() => {
  const {el} = Dom;
  const TITLES = {seeds: 'Seeds', landmarks: 'Landmarks', pose: 'Start'};

  const fragmentOf = (document, name) => {
    document.fragments = document.fragments || {};
    return document.fragments[name] = document.fragments[name] || {seeds: [], register: true};
  };

  // How the content of a file becomes a part of the document. Landmarks of the same name get the file's places, and
  // keep what the file does not say.
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

  // What is written, or a sentence that says why there is nothing.
  const GET = {
    seeds(document) {
      const found = Object.entries(document.fragments || {}).filter(([, one]) => (one.seeds || []).length);
      if (!found.length) return 'There are no seeds yet.';
      const fragments = found.map(([name, one]) => [name, {seeds: one.seeds, register: one.register !== false}]);
      return {fragments: Object.fromEntries(fragments)};
    },
    landmarks(document, fragment) {
      const fragments = {};
      for (const one of document.landmarks || []) {
        if (!one.model_mm) continue;
        const name = one.fragment || fragment, to = fragments[name] = fragments[name] || {points: {}, seen: {}};
        to.points[one.name] = one.model_mm;
        for (const [view, at] of Object.entries(one.pixels || {})) (to.seen[view] = to.seen[view] || {})[one.name] = at;
      }
      return Object.keys(fragments).length ?
          {fragments} :
          'No landmark has a place in the CT, and the file needs it; a landmark of X-rays alone stays in the case.';
    },
    pose(document, fragment) {
      const matrix = ((document.fragments || {})[fragment] || {}).start;
      return matrix ? {matrix} : `The fragment “${fragment}” has no start yet.`;
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

  async function exportTo(shared, what) {
    const content = GET[what](shared.draft.document, shared.fragment());
    if (typeof content === 'string') return void Shell.notice(content, 'fault');
    const beside = shared.draft.path ? shared.draft.path + '.' : '';
    const path =
        await XrayTable.askName(`Export: ${TITLES[what].toLowerCase()}, to the file`, `${beside}${what}.yaml`, []);
    if (!path) return;
    await Shell.guarded(async () => {
      const {path: written} = await Ask.post('api/xray/export', {what, path, content});
      Shell.notice(`Written: ${written}`);
    });
  }

  function make(shared) {
    const rows = Object.keys(TITLES).map(
        (what) =>
            el('span', {class: 'field'}, el('span', {}, TITLES[what]),
               el('span', {class: 'pair'},
                  Dom.button(
                      'Import', () => importFrom(shared, what),
                      {'data-import': what, 'aria-label': `Import ${TITLES[what].toLowerCase()}`}),
                  Dom.button(
                      'Export', () => exportTo(shared, what),
                      {'data-export': what, 'aria-label': `Export ${TITLES[what].toLowerCase()}`}))));
    return {element: el('div', {class: 'exchange'}, el('h3', {}, 'Files'), el('div', {class: 'toolbar'}, rows))};
  }

  return {make};
})();
