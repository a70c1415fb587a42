// SPDX-License-Identifier: Apache-2.0
// The page "Results": the runs and comparisons of the folder, one of them opened, two of them compared.
import * as Dom from '../../report/page/dom.js';
import {el} from '../../report/page/dom.js';
import * as Verdict from '../../report/page/verdict.js';

import * as Ask from './server.js';
import * as Shell from './shell.js';

const when = (text) => text.replace('T', ' ').replace(/(\.\d+)?Z$/, ' UTC');
const reportAddress = (folder, more) => 'results/report.html?' + new URLSearchParams({folder, ...more});

function verdictCell(row) {
  if (row.fault) return el('span', {class: 'outcome failed'}, row.fault);
  if (row.status !== 'done') return el('span', {class: 'outcome failed'}, row.status);
  if (!row.verdicts.length) return el('span', {}, 'done');
  return row.verdicts.map((one) => el('div', {}, Verdict.badge(one.judgement), one.item ? ' ' + one.item : ''));
}

// The figures of a run; its row shows a few. Of several columns, such as the stages of a registration, it shows the
// last.
function figuresCell(row) {
  const lines = (row.sentences || []).map((text) => el('div', {}, text));
  for (const table of row.figures || [])
    for (const one of table.rows) {
      const last = one.values.findLastIndex((value) => Number.isFinite(value));
      if (last < 0) continue;
      const column = table.columns.length > 1 ? table.columns[last] : '';
      lines.push(
          el('div', {}, [column, one.name].filter(Boolean).join(' ') + ' ' + Dom.withUnit(one.values[last], one.unit)));
    }
  const shown = lines.slice(0, 3), more = lines.slice(3);
  return more.length ? [...shown, el('details', {}, el('summary', {}, more.length + ' more'), more)] : shown;
}

async function list(place) {
  const {results, folder} = await Ask.json('api/results');
  const chosen = [];
  const compare = Dom.button(
      'Compare the two', () => Shell.go('results', chosen[0], {with: chosen[1]}),
      {disabled: true, 'data-do': 'compare'});
  const said = el('span', {class: 'note', role: 'status'}, 'Choose two runs to compare them.');
  const toggle = (path, is) => {
    if (is)
      chosen.push(path);
    else
      chosen.splice(chosen.indexOf(path), 1);
    compare.disabled = chosen.length !== 2;
    said.textContent = chosen.length === 2 ?
        'First: ' + Shell.nameOf(chosen[0]) + ', second: ' + Shell.nameOf(chosen[1]) :
        chosen.length > 2 ? 'Choose only two runs.' :
                            'Choose two runs to compare them.';
  };
  const row = (one) => el(
      'tr', {'data-result': one.folder},
      el('td', {},
         one.kind === 'run' && !one.fault && el('input', {
           type: 'checkbox',
           'aria-label': 'Compare ' + Shell.nameOf(one.folder),
           onchange: (event) => toggle(one.folder || '.', event.target.checked)
         }) ||
             ''),
      el('th', {scope: 'row'}, el('a', {href: Shell.addressOf('results', one.folder || '.')}, Shell.nameOf(one.folder)),
         el('small', {class: 'option'}, [one.kind, one.name].filter(Boolean).join(' '))),
      el('td', {}, when(one.when)), el('td', {}, verdictCell(one)), el('td', {}, figuresCell(one)));
  const head = (text) => el('th', {scope: 'col'}, text);
  place.append(
      el('div', {class: 'page-head'}, el('h1', {}, 'Results'), el('div', {class: 'toolbar'}, compare, said)),
      results.length ?
          el('div', {class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Runs and comparisons'},
             el('table', {class: 'results'},
                el('thead', {},
                   el('tr', {}, head(el('span', {class: 'hidden'}, 'Compare')), head('Folder'), head('When'),
                      head('Verdict'), head('Figures of merit'))),
                el('tbody', {}, results.map(row)))) :
          el('p', {class: 'note'}, 'There is no run in ' + folder + ' yet. The page "Pipeline" makes some.'));
}

// A report in its frame can load nothing. It asks for its parts by a message, and this page reads them for it.
function reportFrame(folder) {
  const frame = el('iframe', {
    class: 'report',
    title: 'Report of ' + folder,
    sandbox: 'allow-scripts',
    'aria-busy': 'true',
    src: reportAddress(folder),
    onload: () => {
      frame.removeAttribute('aria-busy');
      frame.contentWindow.postMessage({marrow: 'gives parts'}, '*');
    }
  });
  const give = async ({source, data}) => {
    if (!frame.isConnected) return removeEventListener('message', give);
    if (source !== frame.contentWindow || !data || data.marrow !== 'part') return;
    const file = String(data.file), answer = await fetch('results/part.txt?' + new URLSearchParams({folder, file}));
    const text = answer.ok ? await answer.text() : '';
    frame.contentWindow.postMessage({marrow: 'part', file, text}, '*');
  };
  addEventListener('message', give);
  return frame;
}

async function one(place, folder) {
  const {command} = await Ask.post('api/results/report', {folder});
  place.append(
      el('div', {class: 'page-head'}, el('h1', {}, folder),
         el('div', {class: 'toolbar'},
            el('a', {href: reportAddress(folder), target: '_blank', rel: 'noopener', 'data-do': 'tab'}, 'In a new tab'),
            el('a', {href: reportAddress(folder, {download: 1}), download: '', 'data-do': 'download'},
               'Download as one file'),
            el('a', {href: '#results='}, 'All results'))),
      reportFrame(folder), command ? el('h2', {}, 'The same on the command line') : '',
      command ? Dom.command(command) : '');
}

// The first lines; the others are folded away.
function folded(lines) {
  const some = lines.map((line) => el('div', {}, line)), rest = some.splice(4);
  return rest.length ? [...some, el('details', {}, el('summary', {}, rest.length + ' more'), rest)] : some;
}

function differing(outputs) {
  const rows = [];
  for (const output of outputs) {
    for (const item of output.items) rows.push([[output.name, item.place].filter(Boolean).join(' '), item.text]);
    for (const note of output.notes) rows.push([output.name, [note]]);
  }
  return rows;
}

// numbers: how many of the last columns hold numbers
const table = (caption, head, rows, numbers = 0) => rows.length ?
    el('div', {class: 'scroll', tabindex: 0, role: 'region', 'aria-label': caption},
       el('table', {}, el('caption', {}, caption),
          el('thead', {},
             el('tr', {},
                head.map((text, i) => el('th', {scope: 'col', class: i >= head.length - numbers && 'number'}, text)))),
          el('tbody', {}, rows))) :
    '';

function changesTable(findings) {
  const roots = [findings.first, ...findings.differ_by_themselves].filter(Boolean), rows = [];
  const row = (one, how) => rows.push(
      el('tr', {'data-change': one.node + '.' + (one.name || one.what)}, el('th', {scope: 'row'}, one.node),
         el('td', {}, one.name ? one.what + ' ' + one.name : one.what), el('td', {}, one.before), el('td', {}, one.now),
         el('td', {}, how)));
  roots.forEach(
      (root, i) => root.why.forEach((one) => row(one, i === 0 ? 'the first difference' : 'differs on its own')));
  findings.other_changes.forEach((one) => row(one, 'changes nothing by itself'));
  return table('What was changed', ['Node', 'What', 'First run', 'Second run', 'Effect'], rows);
}

function figuresTable(figures) {
  const row = (one) => {
    const both = Number.isFinite(one.before) && Number.isFinite(one.now);
    return el(
        'tr', {'data-figure': one.name},
        el('th', {scope: 'row'}, [one.table, one.column].filter(Boolean).join('/') + ' ' + one.name),
        el('td', {class: 'number'}, Dom.withUnit(one.before, one.unit)),
        el('td', {class: 'number'}, Dom.withUnit(one.now, one.unit)),
        el('td', {class: 'number'}, both ? (one.now > one.before ? '+' : '') + Dom.number(one.now - one.before) : '–'));
  };
  const head = ['Figure', 'First run', 'Second run', 'Difference'];
  const known = figures.filter((one) => Number.isFinite(one.before) || Number.isFinite(one.now));
  const same = known.filter((one) => Dom.number(one.before) === Dom.number(one.now));
  const others = known.filter((one) => !same.includes(one));
  return el(
      'div', {}, table('Figures of merit that differ', head, others.map(row), 3),
      same.length ? el('details', {'data-do': 'same-figures'},
                       el('summary', {}, 'The same in both, as rounded here: ' + same.length),
                       table('Figures of merit that are the same', head, same.map(row), 3)) :
                    '');
}

function sideBySide(pictures, first, second) {
  if (!pictures.length) return '';
  const address = (folder, name) => 'results/picture.png?' + new URLSearchParams({folder, name});
  const short = (name) => name.replace(/^outputs\//, '').replace(/\.png$/, '');
  const place = el('div', {class: 'overlays'});
  const show = (name) => place.replaceChildren(...[first, second].map(
      (folder) =>
          el('figure', {}, el('img', {src: address(folder, name), alt: short(name) + ' of ' + folder}),
             el('figcaption', {}, folder))));
  const start = pictures.find((name) => name.includes('result')) || pictures.find((name) => name.includes('overlay')) ||
      pictures[0];
  show(start);
  return el(
      'section', {'aria-label': 'Pictures side by side'}, el('h2', {}, 'Pictures side by side'),
      el('div', {class: 'toolbar'}, Dom.select('Picture', pictures.map((name) => [name, short(name)]), start, show)),
      place);
}

async function two(place, first, second) {
  const {findings, figures, pictures, command} = await Ask.json('api/results/diff', {first, second});
  const rows = differing(findings.outputs)
                   .map(
                       ([name, lines]) => el(
                           'tr', {'data-output': name}, el('th', {scope: 'row'}, name), el('td', {}, folded(lines))));
  const same = findings.outputs.filter((one) => one.identical && one.same_items).map((one) => one.name);
  const root = findings.first;
  place.append(
      el('div', {class: 'page-head'}, el('h1', {}, 'Two runs compared'),
         el('div', {class: 'toolbar'}, el('a', {href: '#results='}, 'All results'),
            el('a', {href: Shell.addressOf('results', second, {with: first}), 'data-do': 'swap'}, 'Swap the two'))),
      el('p', {}, 'First run: ', el('a', {href: Shell.addressOf('results', first)}, first),
         ', second run: ', el('a', {href: Shell.addressOf('results', second)}, second)),
      el('p', {class: 'says', role: 'status'},
         findings.identical ? 'The two runs are identical: all ' + findings.nodes.same + ' nodes came out the same.' :
             root           ? 'They begin to differ at the node ' + root.node + ' (' + root.uses + ').' :
                              'The nodes that both have came out the same.'),
      findings.damaged_files.map((text) => el('p', {class: 'reason'}, text)), changesTable(findings),
      figuresTable(figures), table('Outputs that differ', ['Output', 'Difference'], rows),
      same.length ? el('p', {class: 'note'}, 'The same: ' + same.join(', ')) : '', sideBySide(pictures, first, second),
      el('h2', {}, 'The same on the command line'), Dom.command(command));
}

Shell.page('results', {
  title: 'Results',
  show(place, parameters, first) {
    if (!first) return list(place);
    return parameters.get('with') ? two(place, first, parameters.get('with')) : one(place, first);
  },
  keys: [
    ['Space', 'choose a run to compare'],
    [
      'c', 'compare the two',
      () => {
        const button = document.querySelector('[data-do="compare"]');
        if (button && !button.disabled) button.click();
      }
    ]
  ]
});
