// SPDX-License-Identifier: Apache-2.0
// The list of runs and comparisons: sorted by its heads, filtered, and two of them chosen to be compared.
import * as Dom from '../../report/page/dom.js';
import {el} from '../../report/page/dom.js';
import * as Glossary from '../../report/page/glossary.js';
import * as Summary from '../../report/page/summary.js';
import * as Verdict from '../../report/page/verdict.js';

import {ago} from './home.js';
import * as Ask from './server.js';
import * as Shell from './shell.js';

// The figures that say most about a pose, the first one most of all.
const MOST_SAID = [
  'mtre', 'rotation', 'translation', 'axial', 'along', 'rms', 'max', 'gap', 'angulation', 'shortening', 'predicted max',
  'dice', 'matched percent', 'distance'
];
const LESS_IS_BETTER = ['mtre', 'rotation', 'translation', 'rms', 'max', 'gap'];
const WORDS = Object.freeze({mtre: 'mTRE'});

// "rotation" for rotation_deg: the unit stands behind the value.
const plain = (name) => name.replace(/_(mm|deg|px)$/, '').replaceAll('_', ' ').toLowerCase();
const inWords = (name) => WORDS[plain(name)] || plain(name);
export const isLessBetter = (name) => LESS_IS_BETTER.includes(plain(name));

// Small for figures that say much.
export function rank(name) {
  const place = MOST_SAID.indexOf(plain(name));
  return place < 0 ? MOST_SAID.length : place;
}

const unitText = (unit) => (unit === 'deg' ? '°' : unit ? '\u00a0' + unit : '');
export const withUnit = (value, unit) => Dom.number(value) + (Number.isFinite(value) ? unitText(unit) : '');

// The word with its meaning to point at.
export function term(name) {
  const word = inWords(name), tip = Glossary.meaning(name);
  return tip ? el('span', {class: 'term', tabindex: 0, 'data-tip': tip}, word) : word;
}

// Two values count as the same if they differ by less than this. `limit`: in mm, degrees or px; of others, the share of
// the larger value.
export const limitOf = (one, limit) =>
    (['mm', 'deg', 'px'].includes(one.unit) ? limit : limit * Math.max(Math.abs(one.before), Math.abs(one.now)));

// The figures of a run's row, [{name, unit, value, column}], those that say most first. Of several columns, such as the
// stages of a registration, it takes the last.
function ofRun(tables) {
  const all = [];
  for (const table of tables || [])
    for (const one of table.rows) {
      const last = one.values.findLastIndex((value) => Number.isFinite(value));
      if (last >= 0)
        all.push({
          name: one.name,
          unit: one.unit,
          value: one.values[last],
          column: table.columns.length > 1 ? table.columns[last] : ''
        });
    }
  return all.sort((a, b) => rank(a.name) - rank(b.name));
}

const MOST_FIGURES = 3, MOST_CHANGES = 3;
const SEVERITY = ['done', 'trusted', 'doubtful', 'wrong'];
const ALL = '';

const when = (text) => text.replace('T', ' ').replace(/(\.\d+)?Z$/, ' UTC');
const pathOf = (row) => row.folder || '.';
const hasFailed = (row) => Boolean(row.fault) || row.status !== 'done';

// 'failed', the worst judgement, or 'done'.
function outcomeOf(row) {
  if (hasFailed(row)) return 'failed';
  return SEVERITY[Math.max(0, ...row.verdicts.map((one) => SEVERITY.indexOf(one.judgement)))];
}
const severityOf = (row) => (hasFailed(row) ? SEVERITY.length : SEVERITY.indexOf(outcomeOf(row)));

function verdictCell(row) {
  if (row.fault) return el('span', {class: 'outcome failed'}, row.fault);
  if (row.status !== 'done') return el('span', {class: 'outcome failed'}, row.status);
  if (!row.verdicts.length) return el('span', {}, 'done');
  return row.verdicts.map(
      (one) =>
          el('div', {}, Verdict.badge(one.judgement), one.item ? ' ' + one.item : '',
             Number.isFinite(one.failure_probability) &&
                     el('small', {class: 'failure'}, Verdict.failure(one.failure_probability)) ||
                 ''));
}

// The first few lines; the others are folded away.
export function folded(lines, most) {
  const rest = lines.slice(most);
  return [
    ...lines.slice(0, most), rest.length ? el('details', {}, el('summary', {}, rest.length + ' more'), rest) : ''
  ];
}

// "final: mTRE 0.12 mm, rotation 0.24°": the figures that say most, then all others folded away.
function figuresCell(row) {
  if (row.sentences) return folded(row.sentences.map((text) => el('div', {}, text)), MOST_FIGURES);
  const figures = ofRun(row.figures);
  if (!figures.length) return '–';
  const words = (one) => [term(one.name), ' ', el('strong', {}, withUnit(one.value, one.unit))];
  const first = figures.filter((one) => one.column === figures[0].column).slice(0, MOST_FIGURES);
  const rest = figures.filter((one) => !first.includes(one));
  const head =
      el('div', {}, figures[0].column ? figures[0].column + ': ' : '',
         first.map((one, i) => [el('span', {class: 'merit'}, words(one), i + 1 < first.length ? ',' : ''), ' ']));
  return folded([head, ...rest.map((one) => el('div', {}, one.column ? one.column + ': ' : '', words(one)))], 1);
}

function changesCell(row) {
  if (row.kind !== 'run' || row.fault) return '';
  if (!row.changes) return el('small', {}, 'no earlier run');
  if (!row.changes.length) return el('small', {}, 'none');
  return folded(
      row.changes.map(
          (one) =>
              el('div', {class: 'change'}, el('code', {}, one.what), ' ',
                 el('span', {class: 'note'}, one.before + ' → '), one.now)),
      MOST_CHANGES);
}

function nameCell(row, chosen, toggle) {
  const path = pathOf(row);
  return el(
      'div', {class: 'result-name', 'data-result': row.folder},
      row.kind === 'run' && !row.fault ? el('input', {
        type: 'checkbox',
        'aria-label': 'Compare ' + Shell.nameOf(row.folder),
        checked: chosen.includes(path),
        onchange: (event) => toggle(path, event.target.checked)
      }) :
                                         el('span'),
      el('div', {}, el('a', {href: Shell.addressOf('results', path)}, Shell.nameOf(row.folder)),
         el('small', {class: 'option'}, [row.kind, row.name].filter(Boolean).join(' '))));
}

const columns = (chosen, toggle) =>
    [{title: 'Result', key: (row) => row.folder, cell: (row) => nameCell(row, chosen, toggle), wide: true}, {
      title: 'Case',
      key: (row) => row.case || '\uffff',
      cell: (row) =>
          (row.case ? el('a', {href: Shell.addressOf('case', row.case), class: 'case-of-run'}, row.case) : '–')
    },
     {title: 'Changed options', key: (row) => (row.changes || []).length, cell: changesCell, wide: true},
     {title: 'Verdict', key: severityOf, cell: verdictCell},
     {title: 'Key figures', key: (row) => (ofRun(row.figures)[0] || {}).value, cell: figuresCell, wide: true}, {
       title: 'When',
       key: (row) => -Date.parse(row.when),
       cell: (row) => el('time', {datetime: row.when, title: when(row.when)}, ago(row.when))
     }];

// Whether each word of the filter is somewhere in the row.
function matches(row, text) {
  const own = [
    row.folder, row.kind, row.name, row.case, row.fault, outcomeOf(row), row.when,
    ...(row.changes || []).map((one) => one.what + ' ' + one.now), ...(row.sentences || [])
  ].join(' ').toLowerCase();
  return text.toLowerCase().split(/\s+/).every((word) => own.includes(word));
}

// The button that compares, and what it says about the runs that are chosen.
function comparing(chosen) {
  const button = Dom.button(
      'Compare the two', () => Shell.go('results', chosen[0], {with: chosen[1]}),
      {disabled: true, class: 'primary', 'data-do': 'compare'});
  const said = el('span', {class: 'note', role: 'status'});
  const update = () => {
    button.disabled = chosen.length !== 2;
    said.textContent = chosen.length === 2 ?
        'First: ' + Shell.nameOf(chosen[0]) + ', second: ' + Shell.nameOf(chosen[1]) :
        chosen.length > 2 ? 'Choose only two runs.' :
                            'Choose two runs to compare them.';
  };
  update();
  return {elements: [button, said], update};
}

// The controls of the filter. changed() is called after each change; passes(row) says whether a row is shown.
function filter(rows, changed) {
  const wanted = {text: '', case: ALL, outcome: ALL};
  const set = (name) => (value) => {
    wanted[name] = value;
    changed();
  };
  const search = el('input', {
    type: 'search',
    'data-do': 'filter',
    placeholder: 'folder, case, option …',
    oninput: (event) => set('text')(event.target.value.trim())
  });
  const values =
      (of) => [...new Set(rows.map(of).filter(Boolean))].sort((a, b) => a.localeCompare(b, undefined, {numeric: true}));
  const choice = (label, name, all, of) => {
    const some = values(of);
    return some.length > 1 ? Dom.select(label, [[ALL, all], ...some.map((one) => [one, one])], ALL, set(name)) : '';
  };
  return {
    elements: [
      Dom.labelled('Filter', search), choice('Case', 'case', 'all cases', (row) => row.case),
      choice('Outcome', 'outcome', 'all', outcomeOf)
    ],
    passes: (row) => (!wanted.text || matches(row, wanted.text)) && (!wanted.case || row.case === wanted.case) &&
        (!wanted.outcome || outcomeOf(row) === wanted.outcome)
  };
}

export async function show(place) {
  const {results, folder} = await Ask.json('api/results');
  const head = (...more) =>
      el('div', {class: 'page-head'}, el('h1', {}, 'Results'), el('div', {class: 'toolbar'}, more));
  if (!results.length)
    return place.append(
        head(), el('p', {class: 'note'}, 'There is no run in ' + folder + ' yet. The page "Pipeline" makes some.'));
  const chosen = [], order = {}, table = el('div', {class: 'results'}), compare = comparing(chosen);
  const count = el('span', {class: 'note', role: 'status', 'data-do': 'count'});
  const toggle = (path, is) => {
    if (is)
      chosen.push(path);
    else
      chosen.splice(chosen.indexOf(path), 1);
    compare.update();
  };
  const fill = () => {
    const shown = results.filter(filters.passes);
    count.textContent = shown.length === results.length ? '' : shown.length + ' of ' + results.length;
    table.replaceChildren(
        shown.length ? Summary.sortable(shown, columns(chosen, toggle), order, 'Runs and comparisons') :
                       el('p', {class: 'note'}, 'No result passes the filter.'));
  };
  const filters = filter(results, fill);
  fill();
  return place.append(
      head(compare.elements), el('div', {class: 'toolbar filters', role: 'search'}, filters.elements, count), table);
}
