// SPDX-License-Identifier: Apache-2.0
// The first page: the contents of the folder.
import {button, el, form, labelled} from '../../report/page/dom.js';
import * as Verdict from '../../report/page/verdict.js';

import * as Ask from './server.js';
import * as Shell from './shell.js';

const MINUTE_MS = 60000, HOUR_MS = 60 * MINUTE_MS, DAY_MS = 24 * HOUR_MS;

// "5 minutes ago" for a time in UTC; the date after a week.
export function ago(text) {
  const past_ms = Date.now() - Date.parse(text);
  if (!Number.isFinite(past_ms)) return '';
  const count = (one_ms, unit) => {
    const n = Math.floor(past_ms / one_ms);
    return n + ' ' + unit + (n === 1 ? '' : 's') + ' ago';
  };
  if (past_ms < MINUTE_MS) return 'just now';
  if (past_ms < HOUR_MS) return count(MINUTE_MS, 'minute');
  if (past_ms < DAY_MS) return count(HOUR_MS, 'hour');
  return past_ms < 7 * DAY_MS ? count(DAY_MS, 'day') : text.slice(0, 10);
}

// The paths that the pages use: the opened folder itself is '.'.
const known = (paths) => paths.map((path) => path || '.');

function faultOfName(name, taken) {
  if (!name) return 'Give the case a name, such as ' + Shell.freeName('case', taken) + '.';
  if (name.startsWith('/') || name.split('/').some((part) => part.startsWith('.')))
    return 'A name is a folder below this one, such as cases/7, and no part of it begins with a dot.';
  return taken.includes(name) ? 'There is a case ' + name + ' already. Give another name, or open that one.' : '';
}

// Asks for the name of a new case, and opens it.
async function begin(taken) {
  const name = await Shell.dialog('New case', (close) => {
    const fault = el('p', {class: 'reason', role: 'alert', hidden: true});
    const box =
        el('input', {type: 'text', value: Shell.freeName('case', taken), 'data-do': 'name', spellcheck: 'false'});
    const make = () => {
      const given = box.value.trim().replace(/\/+$/, ''), text = faultOfName(given, taken);
      fault.hidden = !text;
      fault.textContent = text;
      if (!text) close(given);
    };
    setTimeout(() => box.select());
    return form(
        {}, make, labelled('Name: the folder that holds the case', box), fault,
        el('p', {class: 'note'},
           'Nothing is written there before you save. Until then each change is kept as a draft.'),
        el('div', {class: 'toolbar'}, el('button', {type: 'submit', class: 'primary', 'data-do': 'make'}, 'Begin')));
  });
  if (name) Shell.go('case', name);
}

async function throwAway(draft, again) {
  const content = [
    el('p', {},
       draft.fault ? 'The draft of ' + draft.case +' cannot be opened. It is lost then.' :
                     'The changes of ' + draft.case +' that are not saved are lost then: ' + draft.changes + '.'),
    el('p', {class: 'note'}, 'What was saved in the case\'s folder stays.')
  ];
  const yes = ['Throw it away', {class: 'danger', 'data-do': 'throw-away'}];
  if (!await Shell.sure('Throw the draft away?', content, yes, ['Keep it'])) return;
  await Shell.guarded(() => Ask.post('api/draft/throw-away', {case: draft.case}));
  again();
}

function row(path, is_case, draft, again) {
  const opens = (page, text, more) => el('a', {href: Shell.addressOf(page, path), ...more}, text);
  const words = draft &&
      (draft.fault ?
           draft.fault :
           draft.changes + (draft.changes === 1 ? ' change' : ' changes') + ' not saved, ' + ago(draft.changed));
  return el(
      'li', {class: 'case-row', 'data-case': path},
      el('div', {}, opens('case', Shell.nameOf(path), {class: 'name'}),
         !is_case && el('span', {class: 'tag'}, 'draft') || '',
         words && el('small', {class: draft.fault ? 'bad' : ''}, words) || ''),
      el('div', {class: 'actions'},
         is_case ? opens('place', 'Place', {class: 'as-button', 'aria-label': 'Place ' + Shell.nameOf(path)}) : '',
         draft ? button(
                     'Throw draft away', () => throwAway(draft, again),
                     {'data-throw': path, 'aria-label': 'Throw draft away: ' + path}) :
                 ''));
}

// A section with the cases, the drafts and "New case ..."; it fills itself again after a change.
function section(contents, drafts) {
  const place = el('section', {class: 'cases card', 'aria-label': 'Cases'});
  const fill = (cases, some) => {
    const saved = known(cases), of = new Map(some.map((one) => [one.case || '.', one]));
    const taken = [...new Set([...saved, ...of.keys()])];
    place.replaceChildren(
        el('div', {class: 'card-head'}, el('h2', {}, 'Cases'),
           button('New case …', () => begin(taken), {class: 'primary', 'data-do': 'new-case'})),
        taken.length ? el('ul', {class: 'files'},
                          taken.sort((a, b) => a.localeCompare(b, undefined, {numeric: true}))
                              .map((path) => row(path, saved.includes(path), of.get(path), again))) :
                       el('p', {class: 'note'},
                          'There is no case yet. A case is a CT with bones, and X-rays with their cameras.'));
  };
  const again = () =>
      Shell.guarded(async () => fill((await Ask.json('api/folder')).cases, await Ask.json('api/drafts')));
  fill(contents.cases, drafts);
  return place;
}

Shell.page('cases', {
  title: 'Cases',
  inBar: false,
  of: 'case',
  async show(place) {
    const [contents, drafts] = await Promise.all([Ask.json('api/folder'), Ask.json('api/drafts')]);
    place.append(el('div', {class: 'page-head'}, el('h1', {}, 'Cases')), section(contents, drafts));
  }
});

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
        el('small', {}, ago(one.when)));
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
           el('div', {}, section(contents, drafts),
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
