// SPDX-License-Identifier: Apache-2.0
// The head of the page: what was compared, and each result as a sentence. Tables whose columns sort, for all sections.
import * as Data from './data.js';
import {el, number, percent, select} from './dom.js';
import * as Plots from './plots.js';
import * as Rows from './rows.js';

const plural = (count, word) => count + ' ' + word + (count === 1 ? '' : 's');

export function facts(data) {
  const failed = data.cells.filter((cell) => cell.status === 'failed').length;
  const incomplete =
      data.cells.filter((cell) => cell.status !== 'failed' && !cell.values.every(Number.isFinite)).length;
  const parts =
      [plural(data.variants.length, 'variant'), plural(data.cases.length, 'case'), plural(data.starts.length, 'start')];
  return parts.join(' × ') + ': ' + plural(data.cells.length, 'run') +
      (failed ? ', ' + failed + ' failed' : ', none failed') + (incomplete ? ', ' + incomplete + ' incomplete' : '') +
      '.';
}

// The sentences about the main metric; all sentences if it has none.
export function verdicts(data) {
  const main = data.metrics[0] && data.comparisons.filter((item) => item.metric === data.metrics[0].name);
  const shown = (main && main.length ? main : data.comparisons).filter((item) => item.sentence);
  return shown.length ?
      el('ul', {class: 'verdicts'},
         shown.map(
             (item) => el('li', {style: '--mark: ' + Plots.colour(data.variantIndex(item.variant))}, item.sentence))) :
      null;
}

export function rateBar(success) {
  if (!success || !Number.isFinite(success.rate)) return '–';
  const text = success.count + ' of ' + success.of + ' = ' + percent(success.rate) + ', 95 % interval ' +
      percent(success.low) + ' to ' + percent(success.high);
  const at = (fraction) => (100 * fraction).toFixed(2) + '%';
  return el(
      'div', {class: 'rate', 'data-tip': text},
      el('span', {class: 'rate-bar', role: 'img', 'aria-label': text},
         el('span', {class: 'rate-fill', style: 'width: ' + at(success.rate)}), el('span', {
           class: 'rate-interval',
           style: 'left: ' + at(success.low) + '; width: ' + at(success.high - success.low)
         })),
      el('span', {class: 'rate-text'}, percent(success.rate), ' ', el('small', {}, success.count + '/' + success.of)));
}

export const countOf = (item) => (item && Number.isFinite(item.of) ? item.count + ' of ' + item.of : '–');

// A table whose columns sort: rows are indices, a column {title, unit, key, cell, number}.
export function sortable(rows, all, state, caption) {
  const compare = (a, b) =>
      (typeof a === 'string' ? a.localeCompare(b, undefined, {numeric: true}) :
                               (Number.isFinite(a) ? a : Infinity) - (Number.isFinite(b) ? b : Infinity) || 0);
  const body = el('tbody', {role: 'rowgroup'});
  const sort = (i) => {
    state.down = state.column === i ? !state.down : false;
    state.column = i;
    fill();
  };
  const heads = all.map((column, i) => Rows.sortHead(column, () => sort(i), {role: 'columnheader'}));
  const fill = () => {
    const sorted = [...rows];
    if (state.column !== undefined)
      sorted.sort((a, b) => (state.down ? -1 : 1) * compare(all[state.column].key(a), all[state.column].key(b)));
    Rows.markSorted(heads, state.column, state.down);
    body.replaceChildren(
        ...sorted.map((row) => el('tr', {'data-row': row, role: 'row'}, all.map((column) => {
                        const kind = [column.number && 'number', column.wide && 'wide'].filter(Boolean).join(' ');
                        const title = column.title + (column.unit ? ', ' + column.unit : '');
                        return el('td', {class: kind || null, role: 'cell', 'data-title': title}, column.cell(row));
                      }))));
  };
  fill();
  return el(
      'div', {class: 'scroll', tabindex: 0, role: 'region', 'aria-label': caption},
      el('table', {class: 'sortable cards', role: 'table'}, el('caption', {class: 'hidden'}, caption),
         el('thead', {role: 'rowgroup'}, el('tr', {role: 'row'}, heads)), body));
}

// The choice of a metric; false if there is only one.
export const metricChoice = (data, changed) => data.metrics.length > 1 &&
    select('Metric', data.metrics.map((metric, i) => [i, metric.label]), 0, (i) => changed(Number(i)));
export const metricBar = (data, changed) =>
    data.metrics.length > 1 && el('div', {class: 'toolbar'}, metricChoice(data, changed));

// Shows which cases are hard: each case's median and successes, with a column for each variant. Without limits of
// success, it counts the starts that have the figure.
export function caseTable(data, metric) {
  const cells = data.variants.map(() => data.cases.map(() => []));
  for (const cell of data.cells) cells[cell.variant][cell.case].push(cell);
  const median = (list) => Data.quantile(
      list.filter((cell) => cell.status !== 'failed')
          .map((cell) => cell.values[metric])
          .filter(Number.isFinite)
          .sort((a, b) => a - b),
      0.5);
  const has_limits = data.metrics.some((item) => Data.limit(item) !== null);
  const is_good = (cell) => (has_limits ? cell.success === true : Number.isFinite(cell.values[metric]));
  const good = (list) => list.filter(is_good).length;
  const tip = (list) =>
      good(list) + ' of ' + list.length + ' starts ' + (has_limits ? 'end in success' : 'have the figure');
  const of = (list) =>
      (list.length ?
           el('span', {'data-tip': tip(list)},
              el('span', {class: 'share', style: '--part: ' + Math.round(100 * good(list) / list.length) + '%'}),
              number(median(list)), ' ', el('small', {}, good(list) + '/' + list.length)) :
           '–');
  const all = [
    {title: 'Case', key: (i) => data.cases[i], cell: (i) => data.cases[i]},
    ...data.variants.map((variant, v) => ({
                           title: variant.name,
                           unit: data.metrics[metric].unit,
                           key: (i) => median(cells[v][i]),
                           cell: (i) => of(cells[v][i]),
                           number: true
                         }))
  ];
  return sortable(
      data.cases.map((_, i) => i), all, {}, 'Medians and successes of each case: ' + data.metrics[metric].label);
}

export function rules(data) {
  const lines = [
    ['Starts', data.experiment.starts_protocol], ['Success', data.experiment.success_rule],
    ['Time', data.experiment.time_rule]
  ].filter((line) => line[1]);
  return lines.length ?
      el('dl', {class: 'rules'}, lines.map(([name, text]) => el('div', {}, el('dt', {}, name), el('dd', {}, text)))) :
      null;
}
