// SPDX-License-Identifier: Apache-2.0
// The first page: the contents of the folder.
import {el} from '../../report/page/dom.js';
import * as Verdict from '../../report/page/verdict.js';

import * as Cases from './cases.js';
import * as Ask from './server.js';
import * as Shell from './shell.js';

const MOST_SHOWN = 8;

// A card with links to a page; what is more than a few is folded away.
function card(title, page, paths, none, all) {
  const rest = paths.slice(MOST_SHOWN), listed = Shell.links(page, paths.slice(0, MOST_SHOWN), none);
  return el(
      'section', {class: 'card', 'aria-label': title},
      el('div', {class: 'card-head'}, el('h2', {}, title), all ? el('a', {href: Shell.addressOf(page)}, all) : ''),
      el('div', {class: 'listed'}, listed),
      rest.length ? el('details', {}, el('summary', {}, rest.length + ' more'), Shell.links(page, rest, '')) : '');
}

// Puts the newest results with their verdicts into the card of runs, when they have been read.
async function showVerdicts(place) {
  const {results} = await Ask.json('api/results');
  const row = (one) => {
    const failed = one.fault || one.status !== 'done';
    return el(
        'li', {class: 'run-row'},
        el('a', {href: Shell.addressOf('results', one.folder || '.')}, Shell.nameOf(one.folder)), ' ',
        failed ? el('span', {class: 'outcome failed'}, 'failed') :
                 one.verdicts.map(({judgement}) => [Verdict.badge(judgement), ' ']),
        el('small', {}, Cases.ago(one.when)));
  };
  const runs = results.filter((one) => one.kind === 'run');
  if (runs.length && place.isConnected)
    place.replaceChildren(el('ul', {class: 'files'}, runs.slice(0, MOST_SHOWN).map(row)));
}

Shell.page('home', {
  title: 'Folder',
  async show(place) {
    const [contents, drafts] = await Promise.all([Ask.json('api/folder'), Ask.json('api/drafts')]);
    const path = contents.folder, name = path.split('/').pop() || path;
    place.append(
        el('div', {class: 'head'}, el('h1', {}, name), el('p', {class: 'note path'}, path)),
        contents.is_cut && el('p', {class: 'note'}, 'There are too many files to look at all of them.') || '',
        el('div', {class: 'card-columns'},
           el('div', {}, Cases.section(contents, drafts),
              card(
                  'Runs', 'results', contents.runs, 'There is no run here. The page "Pipeline" makes some.',
                  contents.runs.length ? 'All with verdicts and figures' : ''),
              card(
                  'Comparisons', 'results', contents.comparisons,
                  'There is no comparison here. marrow compare makes them.')),
           el('div', {},
              card(
                  'Pipelines', 'pipeline', contents.pipelines,
                  'There is no pipeline here. Copy one of marrow\'s own into this folder.',
                  'Copy one of marrow\'s own …'))));
    Shell.guarded(() => showVerdicts(place.querySelector('[aria-label="Runs"] .listed')));
  }
});
