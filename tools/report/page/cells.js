// SPDX-License-Identifier: Apache-2.0
// The table of all cells: filters and sorting; and the list of those that failed.
import * as Data from './data.js';
import * as Detail from './detail.js';
import * as Dom from './dom.js';
import {el, number} from './dom.js';
import * as Rows from './rows.js';
import * as Verdict from './verdict.js';

const OUTCOMES = ['success', 'missed', 'failed', 'done'];

const NAMES = Object.freeze({pictures: 'pictures', scene: '3D', convergence: 'curve'});

const longest = (texts, least, most) =>
    Math.min(most, texts.reduce((length, text) => Math.max(length, String(text).length), least));

// The rank of each text among all.
function ranks(texts) {
  const places = [];
  Rows.order(texts, (text) => text).forEach((place, rank) => (places[place] = rank));
  return places;
}

function columns(data) {
  const variants = data.variants.map((variant) => variant.name), {cases, starts} = data;
  const [byVariant, byCase, byStart] = [variants, cases, starts].map(ranks);
  const named = (title, texts, rank, place) =>
      ({title, key: (c) => rank[place(c)], cell: (c) => texts[place(c)], width: longest(texts, title.length, 26)});
  const figure = (title, key, unit) =>
      ({title, key, cell: (c) => number(key(c)), number: true, unit, width: longest(title.split(' '), 7, 11)});
  const id = (c) => (byVariant[c.variant] * cases.length + byCase[c.case]) * starts.length + byStart[c.start];
  const button = (c) => Dom.button(String(c.id), () => Detail.open(data, c), {class: 'link', title: c.id});
  const outcome = {title: 'Outcome', key: (c) => Data.outcome(c), cell: Detail.outcomeBadge, width: 9};
  const probability = (c) => c.failure_probability;
  const contents = (c) => Data.kinds(data, c).map((kind) => NAMES[kind]).filter(Boolean).join(', ');
  return [
    {title: 'Cell', key: id, cell: button, width: longest(data.cells.map((c) => c.id), 6, 30)},
    named('Case', cases, byCase, (c) => c.case), named('Start', starts, byStart, (c) => c.start), outcome,
    ...(data.cells.some((c) => c.verdict) ?
            [
              {title: 'Verdict', key: (c) => c.verdict || '', cell: (c) => Verdict.badge(c.verdict), width: 9},
              {...figure('Failure', probability), cell: (c) => Dom.percent(probability(c))}
            ] :
            []),
    ...(data.initial_error ? [figure('Start’s error', (c) => c.initial_error, data.initial_error.unit)] : []),
    ...data.metrics.map((metric, i) => figure(metric.label, (c) => c.values[i], metric.unit)),
    figure('Time', (c) => c.seconds, 's'),
    {...figure('Evaluations', (c) => c.evaluations), cell: (c) => String(c.evaluations ?? '–')},
    {title: 'Kept', key: contents, cell: (c) => el('small', {}, contents(c)), width: 14}
  ];
}

function csv(data, cells) {
  const asText = (text) =>
      (/^[=+@\t\r\n-]/.test(text) && !Number.isFinite(Number(text)) ? '\'' + text :
                                                                      text);  // what a spreadsheet would compute
  const quoted = (value) => {
    const text = value === null || value === undefined ? '' : typeof value === 'string' ? asText(value) : String(value);
    return /[",\r\n]/.test(text) ? '"' + text.replaceAll('"', '""') + '"' : text;
  };
  const head = [
    'id', 'variant', 'case', 'start', 'outcome', 'verdict', 'failure_probability', 'reason', 'initial_error',
    ...data.metrics.map((metric) => metric.name), 'seconds', 'evaluations', 'folder'
  ];
  const rows = cells.map(
      (cell) =>
          [cell.id, data.variants[cell.variant].name, data.cases[cell.case], data.starts[cell.start],
           Data.outcome(cell), cell.verdict, cell.failure_probability, cell.reason || cell.absent, cell.initial_error,
           ...data.metrics.map((_, i) => cell.values[i]), cell.seconds, cell.evaluations, cell.folder]);
  return [head, ...rows].map((row) => row.map(quoted).join(',')).join('\n') + '\n';
}

export class Table {
  constructor(data) {
    Object.assign(this, {
      data,
      columns: columns(data),
      filter: {variant: '', case: '', outcome: '', text: ''},
      column: null,
      down: false,
      orders: new Map(),  // the cells sorted by a column, made when it is first asked for
      words: new Map()
    });
    this.table = new Rows.Table('All runs; the arrow keys go from row to row', this.columns, {
      attributes: (cell) => ({'data-id': cell.id}),
      sort: (column) => this.sort(column),
      open: (cell) => Detail.open(data, cell)
    });
    this.count = el('span', {class: 'count', role: 'status'});
    this.element =
        el('div', {}, this.filters(), this.table.element,
           el('div', {class: 'toolbar pager'}, this.count,
              Dom.button('Save these rows as CSV', () => Dom.save(csv(data, this.rows()), 'cells.csv', 'text/csv'))));
    document.addEventListener('keydown', (event) => this.find(event));
    this.show();
  }

  filters() {
    const {data, filter} = this, set = (name) => (value) => {
      filter[name] = value;
      this.show();
    };
    this.text = el('input', {
      type: 'search',
      placeholder: 'id, name or reason',
      'aria-keyshortcuts': 'Control+F',
      oninput: (event) => set('text')(event.target.value.toLowerCase())
    });
    const used = OUTCOMES.filter((name) => data.cells.some((cell) => Data.outcome(cell) === name));
    const outcome = Dom.select('Outcome', [['', 'all'], ...used.map((name) => [name, name])], '', set('outcome'));
    return el(
        'div', {class: 'toolbar filters'},
        Dom.select(
            'Variant', [['', 'all'], ...data.variants.map((variant, i) => [i, variant.name])], '', set('variant')),
        Dom.select('Case', [['', 'all'], ...data.cases.map((name, i) => [i, name])], '', set('case')), outcome,
        Dom.labelled('Text', this.text));
  }

  // The text that the filter searches.
  wordsOf(cell) {
    if (!this.words.has(cell)) {
      const {data} = this, words = [
        cell.id, data.variants[cell.variant].name, data.cases[cell.case], data.starts[cell.start], cell.reason,
        Data.outcome(cell), cell.verdict
      ];
      this.words.set(cell, words.join(' ').toLowerCase());
    }
    return this.words.get(cell);
  }

  sorted() {
    const {cells} = this.data, name = this.column + ' ' + this.down;
    if (this.column === null) return cells;
    if (!this.orders.has(name)) {
      const places = Rows.order(cells, this.columns[this.column].key, this.down);
      this.orders.set(name, Array.from(places, (i) => cells[i]));
    }
    return this.orders.get(name);
  }

  rows() {
    const {variant, case: place, outcome, text} = this.filter;
    return this.sorted().filter(
        (cell) => (variant === '' || cell.variant === Number(variant)) &&
            (place === '' || cell.case === Number(place)) && (outcome === '' || Data.outcome(cell) === outcome) &&
            (text === '' || this.wordsOf(cell).includes(text)));
  }

  sort(column) {
    this.down = this.column === column ? !this.down : false;
    this.column = column;
    this.show();
  }

  // The browser's own find sees only the rows that are drawn. A second Ctrl+F gives it.
  find(event) {
    if (event.key !== 'f' || !(event.ctrlKey || event.metaKey) || event.altKey || event.shiftKey) return;
    const box = this.element.getBoundingClientRect(), {activeElement} = document;
    const is_here = box.top < 0.7 * innerHeight && box.bottom > 0.3 * innerHeight;
    if (!is_here || activeElement === this.text || document.getElementById('cell').open) return;
    event.preventDefault();
    this.text.focus();
    this.text.select();
  }

  show() {
    const rows = this.rows(), all = this.data.cells.length, many = (count) => count.toLocaleString('en');
    this.table.show(rows, this.column, this.down);
    this.count.textContent = rows.length === all ? many(all) + (all === 1 ? ' run' : ' runs') :
        rows.length                              ? many(rows.length) + ' of ' + many(all) + ' runs' :
                                                   'No cell fits the filter';
  }
}

// Failed cells, those of the same reason together.
export function failures(data) {
  const reasons = new Map();
  for (const cell of data.cells.filter((item) => item.status === 'failed')) {
    const reason = cell.reason || 'no reason given';
    if (!reasons.has(reason)) reasons.set(reason, []);
    reasons.get(reason).push(cell);
  }
  if (!reasons.size) return el('p', {}, 'No cell failed.');
  const sorted = [...reasons].sort((a, b) => b[1].length - a[1].length), most = 40;
  const more = sorted.length - most;
  return el(
      'ul', {class: 'failures'},
      sorted.slice(0, most).map(
          ([reason, cells]) => el(
              'li', {}, el('pre', {class: 'reason'}, reason),
              el('p', {}, cells.length + (cells.length === 1 ? ' cell: ' : ' cells: '),
                 cells.slice(0, most).map(
                     (cell, i) =>
                         [i ? ', ' : '', Dom.button(String(cell.id), () => Detail.open(data, cell), {class: 'link'})]),
                 cells.length > most ? ' and ' + (cells.length - most) + ' more' : ''))),
      more > 0 &&
          el('li', {}, 'And ' + more + ' more reasons, each of fewer cells: choose the outcome “failed” above.'));
}
