// SPDX-License-Identifier: Apache-2.0
// The table of all cells: filters, sorting, pages; and the list of those that failed.
'use strict';

const Cells = (() => {
  const {el, number} = Dom;
  const PAGE = 50;
  const OUTCOMES = {success: 'success', missed: 'missed', failed: 'failed', done: 'done'};

  const badge = (cell) => el('span', {class: 'outcome ' + Data.outcome(cell)}, OUTCOMES[Data.outcome(cell)]);
  const contents =
      (cell) => [cell.pictures.length && 'pictures', cell.scene && '3D', (cell.convergence || []).length && 'curve']
                    .filter(Boolean)
                    .join(', ');

  function columns(data) {
    const one = (title, key, cell, isNumber, unit) => ({title, key, cell, number: isNumber, unit});
    return [
      one('Cell', (c) => String(c.id), (c) => Dom.button(String(c.id), () => Detail.open(data, c), {class: 'link'})),
      one('Variant', (c) => data.variants[c.variant].name, (c) => data.variants[c.variant].name),
      one('Case', (c) => data.cases[c.case], (c) => data.cases[c.case]),
      one('Start', (c) => data.starts[c.start], (c) => data.starts[c.start]),
      one('Outcome', (c) => Data.outcome(c), badge),
      ...(data.cells.some((c) => c.verdict) ?
              [
                one('Verdict', (c) => c.verdict || '', (c) => Verdict.badge(c.verdict)),
                one('Failure', (c) => c.failure_probability, (c) => Dom.percent(c.failure_probability), true)
              ] :
              []),
      one('Start’s mTRE', (c) => c.initial_mtre_mm, (c) => number(c.initial_mtre_mm), true, 'mm'),
      ...data.metrics.map(
          (metric, i) => one(metric.label, (c) => c.values[i], (c) => number(c.values[i]), true, metric.unit)),
      one('Time', (c) => c.seconds, (c) => number(c.seconds), true, 's'),
      one('Evaluations', (c) => c.evaluations, (c) => number(c.evaluations), true),
      one('Kept', contents, (c) => el('small', {}, contents(c))),
    ];
  }

  function compare(a, b) {
    if (typeof a === 'string' || typeof b === 'string')
      return String(a ?? '').localeCompare(String(b ?? ''), undefined, {numeric: true});
    return (Number.isFinite(a) ? a : Infinity) - (Number.isFinite(b) ? b : Infinity) || 0;
  }

  function csv(data, cells) {
    const asText = (text) =>
        (/^[=+@\t\r\n-]/.test(text) && !Number.isFinite(Number(text)) ? '\'' + text :
                                                                        text);  // what a spreadsheet would compute
    const quoted = (value) => {
      const text = value === null || value === undefined ? '' :
          typeof value === 'string'                      ? asText(value) :
                                                           String(value);
      return /[",\r\n]/.test(text) ? '"' + text.replaceAll('"', '""') + '"' : text;
    };
    const head = [
      'id', 'variant', 'case', 'start', 'outcome', 'verdict', 'failure_probability', 'reason', 'initial_mtre_mm',
      ...data.metrics.map((metric) => metric.name), 'seconds', 'evaluations', 'folder'
    ];
    const rows = cells.map(
        (cell) =>
            [cell.id, data.variants[cell.variant].name, data.cases[cell.case], data.starts[cell.start],
             Data.outcome(cell), cell.verdict, cell.failure_probability, cell.reason || cell.absent,
             cell.initial_mtre_mm, ...data.metrics.map((_, i) => cell.values[i]), cell.seconds, cell.evaluations,
             cell.folder]);
    return [head, ...rows].map((row) => row.map(quoted).join(',')).join('\n') + '\n';
  }

  function save(text, name) {
    const link = el('a', {href: URL.createObjectURL(new Blob([text], {type: 'text/csv'})), download: name});
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  class Table {
    constructor(data) {
      Object.assign(this, {
        data,
        columns: columns(data),
        filter: {variant: '', case: '', outcome: '', text: ''},
        column: null,
        down: false,
        page: 0
      });
      const words = (c) => [c.id, data.variants[c.variant].name, data.cases[c.case], data.starts[c.start], c.reason,
                            Data.outcome(c), c.verdict]
                               .join(' ')
                               .toLowerCase();
      this.words = new Map(data.cells.map((cell) => [cell, words(cell)]));
      this.body = el('tbody', {onclick: (event) => this.click(event)});
      this.heads = this.columns.map(
          (column, i) =>
              el('th', {scope: 'col', class: column.number ? 'number' : null},
                 Dom.button(
                     [column.title, column.unit && el('small', {}, ' ' + column.unit)].filter(Boolean),
                     () => this.sort(i), {class: 'sort'})));
      this.count = el('span', {class: 'count', role: 'status'});
      this.previous = Dom.button('Previous', () => this.turn(-1));
      this.next = Dom.button('Next', () => this.turn(1));
      this.element =
          el('div', {}, this.filters(),
             el('div', {class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'All cells'},
                el('table', {class: 'sortable cells'}, el('thead', {}, el('tr', {}, this.heads)), this.body)),
             el('div', {class: 'toolbar pager'}, this.count, this.previous, this.next,
                Dom.button('Save these rows as CSV', () => save(csv(data, this.rows()), 'cells.csv'))));
      this.show();
    }

    filters() {
      const {data, filter} = this, set = (name) => (value) => {
        filter[name] = value;
        this.page = 0;
        this.show();
      };
      const text = el('input', {
        type: 'search',
        placeholder: 'id, name or reason',
        oninput: (event) => set('text')(event.target.value.toLowerCase())
      });
      const used = ['success', 'missed', 'failed', 'done'].filter(
          (name) => data.cells.some((cell) => Data.outcome(cell) === name));
      const outcome =
          Dom.select('Outcome', [['', 'all'], ...used.map((name) => [name, OUTCOMES[name]])], '', set('outcome'));
      this.showOutcome = (name) => {
        outcome.box.value = name;
        set('outcome')(name);
      };
      return el(
          'div', {class: 'toolbar filters'},
          Dom.select(
              'Variant', [['', 'all'], ...data.variants.map((variant, i) => [i, variant.name])], '', set('variant')),
          Dom.select('Case', [['', 'all'], ...data.cases.map((name, i) => [i, name])], '', set('case')), outcome,
          el('label', {class: 'field'}, el('span', {}, 'Text'), text));
    }

    rows() {
      const {variant, case: place, outcome, text} = this.filter;
      const rows = this.data.cells.filter(
          (cell) => (variant === '' || cell.variant === Number(variant)) &&
              (place === '' || cell.case === Number(place)) && (outcome === '' || Data.outcome(cell) === outcome) &&
              (text === '' || this.words.get(cell).includes(text)));
      if (this.column === null) return rows;
      const {key} = this.columns[this.column];
      return rows.sort((a, b) => (this.down ? -1 : 1) * compare(key(a), key(b)));
    }

    sort(column) {
      this.down = this.column === column ? !this.down : false;
      this.column = column;
      this.page = 0;
      this.show();
    }

    turn(pages) {
      this.page += pages;
      this.show();
    }

    click(event) {
      const row = event.target.closest('tr');
      if (row && !event.target.closest('button') && !String(getSelection()))
        Detail.open(this.data, this.data.byId.get(row.dataset.id));
    }

    show() {
      const rows = this.rows(), last = Math.max(0, Math.ceil(rows.length / PAGE) - 1);
      this.page = Math.max(0, Math.min(last, this.page));
      const shown = rows.slice(this.page * PAGE, (this.page + 1) * PAGE);
      this.heads.forEach(
          (head, i) => head.setAttribute(
              'aria-sort',
              this.column !== i ? 'none' :
                  this.down     ? 'descending' :
                                  'ascending'));
      this.body.replaceChildren(...shown.map(
          (cell) =>
              el('tr', {'data-id': cell.id},
                 this.columns.map((column) => el('td', {class: column.number ? 'number' : null}, column.cell(cell))))));
      this.count.textContent = rows.length ?
          this.page * PAGE + 1 + '–' + (this.page * PAGE + shown.length) + ' of ' + rows.length :
          'No cell fits the filter';
      this.previous.disabled = this.page === 0;
      this.next.disabled = this.page === last;
    }
  }

  // Failed cells, those of the same reason together.
  function failures(data) {
    const reasons = new Map();
    for (const cell of data.cells.filter((item) => item.status === 'failed')) {
      const reason = cell.reason || 'no reason given';
      reasons.set(reason, [...(reasons.get(reason) || []), cell]);
    }
    if (!reasons.size) return el('p', {}, 'No cell failed.');
    const sorted = [...reasons].sort((a, b) => b[1].length - a[1].length), most = 40;
    return el(
        'ul', {class: 'failures'},
        sorted.map(
            ([reason, cells]) =>
                el('li', {}, el('pre', {class: 'reason'}, reason),
                   el('p', {}, cells.length + (cells.length === 1 ? ' cell: ' : ' cells: '),
                      cells.slice(0, most).map(
                          (cell, i) => [i ? ', ' : '', Dom.button(String(cell.id), () => Detail.open(data, cell), {
                            class: 'link'
                          })]),
                      cells.length > most ? ' and ' + (cells.length - most) + ' more' : ''))));
  }

  return {Table, failures, badge};
})();
