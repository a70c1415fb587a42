// SPDX-License-Identifier: Apache-2.0
// One cell: all its values, options and pictures, why it failed, and how to run just it. In a dialog, or as the page of
// a run.
import * as Curves from './curves.js';
import * as Data from './data.js';
import * as Dom from './dom.js';
import {el, number, withUnit} from './dom.js';
import * as Glossary from './glossary.js';
import * as Links from './links.js';
import * as Parts from './parts.js';
import * as Pictures from './pictures.js';
import {SceneView} from './scene.js';
import * as Verdict from './verdict.js';

let lookAt = () => {};
let opened = null;  // the dialog's 3D view, which holds memory of the graphics card

const rows = (entries) =>
    el('div', {class: 'scroll'},
       Dom.valueTable(entries.filter((entry) => entry[1] !== null && entry[1] !== undefined && entry[1] !== '')
                          .map(([name, value]) => [typeof name === 'string' ? Glossary.term(name) : name, value])));

const startError = (data, cell) =>
    (data.initial_error && Number.isFinite(cell.initial_error) ?
         [withUnit(cell.initial_error, data.initial_error.unit), el('small', {}, '  ' + data.initial_error.name)] :
         null);

// Sets the function that shows a cell's case and start in the comparison of pictures.
export const setLookAt = (show) => (lookAt = show);

export function outcomeBadge(cell) {
  const outcome = Data.outcome(cell);
  return el('span', {class: 'outcome ' + outcome, 'data-tip': Glossary.meaning(outcome)}, outcome);
}

// A link, where the page lies in the comparison's folder.
function folder(data, cell) {
  if (!cell.folder) return null;
  const name = el('code', {}, cell.folder);
  return data.is_run ? name : el('a', {href: Links.toFolder(cell.folder)}, name);
}

export function values(data, cell) {
  return rows([
    ['Outcome', outcomeBadge(cell)],
    ['Verdict', cell.verdict ? [Verdict.badge(cell.verdict), ' ', Verdict.failure(cell.failure_probability)] : null],
    ...data.metrics.map(
        (metric, i) =>
            [metric.label,
             [
               withUnit(cell.values[i], metric.unit),
               Data.limit(metric) !== null && el('small', {}, '  success ' + Data.limitText(metric))
             ].filter(Boolean)]),
    ['Error of the start', startError(data, cell)],
    ['Time', Number.isFinite(cell.seconds) ? withUnit(cell.seconds, 's') : null],
    ['Evaluations', Number.isFinite(cell.evaluations) ? String(cell.evaluations) : null],
    ['Nodes from the cache', Number.isFinite(cell.cached_nodes) ? String(cell.cached_nodes) : null],
    ['Tries', Number.isFinite(cell.tries) ? String(cell.tries) : null],
    ['Key of what it was made from', cell.key ? el('code', {}, cell.key) : null],
    ['Folder', folder(data, cell)],
  ]);
}

// A table of many items is easier to read with one row for each item.
function upright(table) {
  if (table.columns.length <= 8 || table.columns.length <= table.rows.length) return table;
  const title = (row) => row.name + (row.unit ? ' (' + row.unit + ')' : '');
  return {
    name: table.name,
    columns: table.rows.map(title),
    rows: table.columns.map(
        (name, i) => ({name, unit: '', values: table.rows.map((row) => (i in row.values ? row.values[i] : null))}))
  };
}

// Figures of merit of a run, a table for each group of them.
export const figures = (data) => data.figures.map(upright).map(
    (table) => Dom.table(
        {class: 'figures'}, table.name,
        ['Figure', ...table.columns.map((column) => [column, {class: 'number'}]), 'Unit'], table.rows.map((row) => {
          const values = table.columns.map((_, i) => (Number.isFinite(row.values[i]) ? number(row.values[i]) : ''));
          const line = Dom.row(Glossary.term(row.name), values, {class: 'number'});
          line.append(el('td', {}, row.unit));
          return line;
        })));

function options(variant) {
  const entries = Object.entries(variant.options);
  return entries.length ?
      rows(entries.map(
          ([
            name, value
          ]) => [el('code', {}, name), el('code', {}, typeof value === 'string' ? value : JSON.stringify(value))])) :
      el('p', {class: 'note'}, 'The pipeline as it is, no option changed.');
}

// The command that runs a cell, in the comparison's own folder.
function commandOf(data, cell) {
  const {file, name, out} = data.experiment, id = String(cell.id);
  const place = out ? ' --out ' + Dom.shellPath(out) : '', rest = id.startsWith('-') ? ' -- ' : ' ';  // no option
  return 'marrow cell ' + Dom.shellPath(file || (name || 'experiment') + '.yaml') + place + rest + Dom.shellWord(id);
}

const command = (data, cell) =>
    (data.is_run ? null : el('div', {}, el('h3', {}, 'Run just this cell'), Dom.command(commandOf(data, cell))));

const recipe = (data, cell) =>
    [el('h3', {}, 'Its recipe'),
     Dom.command('marrow recipe ' + Dom.shellPath((data.experiment.folder || '.') + '/' + cell.folder))];

// Why there is no picture, and how to get some.
function noPictures(data, cell) {
  if (data.is_run || cell.pictures.length) return null;
  const {part} = data.pairOf(cell), note = (...parts) => el('p', {class: 'note'}, ...parts);
  const beside = part && cell.status !== 'failed';
  if (beside && part.loading) return note('The pictures are being loaded (' + Parts.size(part.bytes) + ').');
  const text = cell.status === 'failed' ?
      'There are no pictures of this cell, because it failed. When its cause is gone, this makes them:' :
      beside ? Parts.missing(data, data.pairOf(cell)) + ' Or make them again:' :
               'No pictures of this cell are in this report. This makes them, and a page that shows them:';
  const folder = 'marrow show ' + Dom.shellPath((data.experiment.folder || '.') + '/pictures/' + cell.id);
  return el('div', {}, el('h3', {}, 'Pictures'), note(text), Dom.command(commandOf(data, cell) + ' && ' + folder));
}

export const reason = (cell) =>
    (cell.status === 'failed' ?
         el('div', {}, el('h3', {}, 'Why it failed'), el('pre', {class: 'reason'}, cell.reason || 'no reason given')) :
         null);

// What is missing because a node failed; the run may go on without it.
export const absent = (cell) =>
    (cell.absent ? el('div', {}, el('h3', {}, 'What is not there'), el('pre', {class: 'reason'}, cell.absent)) : null);

function plots(data, cell) {
  const convergence = Curves.convergence(data, [cell], false), landscapes = Curves.landscapes(data, [cell], false);
  return [
    convergence && el('h3', {}, 'Convergence'), convergence, landscapes && el('h3', {}, 'Cost about the result'),
    landscapes
  ].filter(Boolean);
}

function scene(data, cell) {
  if (!cell.scene) return [];
  const place = el('div', {}, Dom.button('Show in 3D', () => {
    opened = new SceneView(data, [{label: data.variants[cell.variant].name, scene: cell.scene}]);
    place.replaceChildren(opened.element);
  }));
  return [el('h3', {}, '3D'), place];
}

function fillDialog(data, cell, dialog) {
  const list = data.cells, at = list.indexOf(cell),
        step = (by) =>
            Dom.button(by < 0 ? 'Previous' : 'Next', () => open(data, list[at + by]), {disabled: !list[at + by]});
  const closer =
      Data.hasMaterial(cell) && data.variants.length > 1 && Dom.button('Compare with the other variants', () => {
        dialog.close();
        lookAt(cell);
      });
  dialog.replaceChildren(
      el('div', {class: 'dialog-head'}, el('h2', {tabindex: -1}, Data.cellName(data, cell)),
         el('div', {class: 'toolbar'}, step(-1), step(1), Dom.button('Close', () => dialog.close()))),
      el('p', {class: 'note'}, 'Cell ', el('code', {}, String(cell.id))),
      ...[reason(cell), Verdict.all(data, cell), absent(cell), values(data, cell),
          el('h3', {}, 'Options of ' + data.variants[cell.variant].name), options(data.variants[cell.variant]),
          command(data, cell), noPictures(data, cell), cell.pictures.length > 0 && el('h3', {}, 'Pictures'),
          cell.pictures.length > 0 && Pictures.gallery(data, cell), closer, ...plots(data, cell), ...scene(data, cell),
          ...recipe(data, cell)]
          .filter(Boolean));
}

function disposeScene() {
  if (opened) opened.dispose();
  opened = null;
}

function show() {
  const dialog = document.getElementById('cell');
  disposeScene();
  if (!dialog.open) {
    dialog.showModal();
    dialog.onclose = () => {
      disposeScene();
      Links.unname();
    };
    dialog.onclick = (event) => event.target === dialog && dialog.close();
  }
  dialog.scrollTop = 0;
  return dialog;
}

// Opens a cell. Its part beside the page is loaded, and shown as soon as it is there.
export function open(data, cell) {
  const dialog = show(), pair = data.pairOf(cell), shown = {};
  if (pair.part) {
    const again = () => dialog.open && dialog.shown === shown && fillDialog(data, cell, dialog);
    Parts.load(data, pair).then(again, again);
  }
  dialog.shown = shown;
  fillDialog(data, cell, dialog);
  dialog.querySelector('h2').focus();
  Links.name(Links.to(cell));
}

// Says that the report has no such cell.
function openUnknown(data, name) {
  const dialog = show();
  dialog.shown = null;
  const example = data.cells.length ? ', for example ' + data.cells[0].id : '';
  dialog.replaceChildren(
      el('div', {class: 'dialog-head'}, el('h2', {tabindex: -1}, 'No such cell'),
         el('div', {class: 'toolbar'}, Dom.button('Close', () => dialog.close()))),
      el('p', {},
         'The link asks for the cell “' + name + '”, which this report does not have. A cell is named ' +
             'VARIANT/CASE/START' + example + '. The table “All runs” has all of them.'));
  dialog.querySelector('h2').focus();
}

// Opens what an address asks for, if it asks for a cell.
export function openAddress(data) {
  const asked = Links.asked(data, location.hash);
  if (asked && asked.cell) open(data, asked.cell);
  if (asked && !asked.cell) openUnknown(data, asked.unknown);
}
