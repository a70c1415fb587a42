// SPDX-License-Identifier: Apache-2.0
// One cell: all its values, options and pictures, why it failed, and how to run just it. In a dialog, or as the page of
// a run.
'use strict';

const Detail = (() => {
  const {el, number, withUnit} = Dom;
  let opened = null;  // the dialog's 3D view, which holds memory of the graphics card

  const rows = (entries) =>
      el('div', {class: 'scroll'},
         el('table', {class: 'values'},
            el('tbody', {},
               entries.filter((entry) => entry[1] !== null && entry[1] !== undefined && entry[1] !== '')
                   .map(([name, value]) => el('tr', {}, el('th', {scope: 'row'}, name), el('td', {}, value))))));

  function values(data, cell) {
    return rows([
      ['Outcome', Cells.badge(cell)],
      ['Verdict', cell.verdict ? [Verdict.badge(cell.verdict), ' ', Verdict.failure(cell.failure_probability)] : null],
      ...data.metrics.map(
          (metric, i) =>
              [metric.label,
               [
                 withUnit(cell.values[i], metric.unit),
                 Data.limit(metric) !== null && el('small', {}, '  success ' + Data.limitText(metric))
               ].filter(Boolean)]),
      ['mTRE of the start', Number.isFinite(cell.initial_mtre_mm) ? withUnit(cell.initial_mtre_mm, 'mm') : null],
      ['Time', Number.isFinite(cell.seconds) ? withUnit(cell.seconds, 's') : null],
      ['Evaluations', Number.isFinite(cell.evaluations) ? number(cell.evaluations) : null],
      ['Nodes from the cache', Number.isFinite(cell.cached_nodes) ? String(cell.cached_nodes) : null],
      ['Tries', Number.isFinite(cell.tries) ? String(cell.tries) : null],
      ['Folder', cell.folder ? el('code', {}, cell.folder) : null],
    ]);
  }

  // A table of many items is easier to read with a row an item.
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
  const figures = (data) => data.figures.map(upright).map(
      (table) => el(
          'div', {class: 'scroll'},
          el('table', {class: 'figures'}, el('caption', {}, table.name),
             el('thead', {},
                el('tr', {}, el('th', {scope: 'col'}, 'Figure'),
                   table.columns.map((column) => el('th', {scope: 'col', class: 'number'}, column)),
                   el('th', {scope: 'col'}, 'Unit'))),
             el('tbody', {},
                table.rows.map(
                    (row) => el(
                        'tr', {}, el('th', {scope: 'row'}, row.name),
                        table.columns.map(
                            (_, i) => el(
                                'td', {class: 'number'}, Number.isFinite(row.values[i]) ? number(row.values[i]) : '')),
                        el('td', {}, row.unit)))))));

  function options(variant) {
    const entries = Object.entries(variant.options);
    return entries.length ?
        rows(entries.map(
            ([
              name, value
            ]) => [el('code', {}, name), el('code', {}, typeof value === 'string' ? value : JSON.stringify(value))])) :
        el('p', {class: 'note'}, 'The pipeline as it is, no option changed.');
  }

  function command(data, cell) {
    if (data.is_run) return null;
    const file = data.experiment.file || (data.experiment.name || 'experiment') + '.yaml';
    const id = String(cell.id), rest = id.startsWith('-') ? ' -- ' : ' ';  // no option either
    return el(
        'div', {}, el('h3', {}, 'Run just this cell'),
        Dom.command('marrow cell ' + Dom.shellPath(file) + rest + Dom.shellWord(id)));
  }

  const reason = (cell) =>
      (cell.status === 'failed' ? el('div', {}, el('h3', {}, 'Why it failed'),
                                     el('pre', {class: 'reason'}, cell.reason || 'no reason given')) :
                                  null);

  // What is not there because a node failed that may fail.
  const absent = (cell) => (
      cell.absent ? el('div', {}, el('h3', {}, 'What is not there'), el('pre', {class: 'reason'}, cell.absent)) : null);

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
          Detail.lookAt(cell);
        });
    dialog.replaceChildren(
        el('div', {class: 'dialog-head'}, el('h2', {tabindex: -1}, Data.cellName(data, cell)),
           el('div', {class: 'toolbar'}, step(-1), step(1), Dom.button('Close', () => dialog.close()))),
        el('p', {class: 'note'}, 'Cell ', el('code', {}, String(cell.id))),
        ...[reason(cell), Verdict.all(data, cell), absent(cell), values(data, cell),
            el('h3', {}, 'Options of ' + data.variants[cell.variant].name), options(data.variants[cell.variant]),
            command(data, cell), cell.pictures.length > 0 && el('h3', {}, 'Pictures'),
            cell.pictures.length > 0 && Pictures.gallery(data, cell), closer, ...plots(data, cell),
            ...scene(data, cell)]
            .filter(Boolean));
  }

  // So that a cell can be linked to. Some browsers refuse it to pages from disk, which does no harm.
  function nameInAddress(address) {
    try {
      history.replaceState(null, '', address);
    } catch (error) { /* no link then */
    }
  }

  function disposeScene() {
    if (opened) opened.dispose();
    opened = null;
  }

  function open(data, cell) {
    const dialog = document.getElementById('cell');
    disposeScene();
    if (!dialog.open) {
      dialog.showModal();
      dialog.onclose = () => {
        disposeScene();
        nameInAddress(location.pathname + location.search);
      };
      dialog.onclick = (event) => event.target === dialog && dialog.close();
    }
    fillDialog(data, cell, dialog);
    dialog.scrollTop = 0;
    dialog.querySelector('h2').focus();
    nameInAddress('#cell=' + encodeURIComponent(cell.id));
  }

  // lookAt(cell) is set by the page: it shows the cell's case and start in the comparison of pictures.
  return {open, values, figures, options, reason, absent, lookAt: () => {}};
})();
