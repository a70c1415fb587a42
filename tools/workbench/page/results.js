// SPDX-License-Identifier: Apache-2.0
// The page "Results": the runs and comparisons of the folder, one of them opened, two of them compared.
import * as Dom from '../../report/page/dom.js';
import {dragAcross, el} from '../../report/page/dom.js';
import * as Verdict from '../../report/page/verdict.js';

import * as ResultsList from './results_list.js';
import {folded} from './results_list.js';
import * as Ask from './server.js';
import * as Shell from './shell.js';

// first, second: {src, text}. Left of the line is the first.
function wipe(first, second, what) {
  const image = (one, name) =>
      el('img', {src: one.src, alt: what + ' of ' + one.text, class: name, draggable: 'false'});
  const stage =
      el('div', {class: 'wipe'}, image(first, 'below'), image(second, 'above'), el('span', {class: 'line'}),
         el('span', {class: 'label left'}, first.text), el('span', {class: 'label right'}, second.text));
  const slider = el('input', {
    type: 'range',
    min: 0,
    max: 100,
    step: 0.5,
    value: 50,
    'aria-label': 'Line between the two pictures',
    oninput: () => set(Number(slider.value))
  });
  function set(percent) {
    slider.value = percent;
    stage.style.setProperty('--at', percent + '%');
  }
  dragAcross(stage, set);
  set(50);
  return el('figure', {class: 'wiped'}, stage, slider);
}

const MOST_REASONS = 2, MOST_LINES = 4;
const SAME_POSE = 0.001;  // degrees and mm
const LIMITS = [
  [0, 'nothing: the last digit counts'], [0.001, '0.001 mm, deg or px; 0.1 % of others'],
  [0.01, '0.01 mm, deg or px; 1 % of others'], [0.1, '0.1 mm, deg or px; 10 % of others']
];

// numbers: how many of the last columns hold numbers
const table = (caption, head, rows, numbers = 0) => rows.length ?
    el('div', {class: 'scroll', tabindex: 0, role: 'region', 'aria-label': caption},
       el('table', {}, el('caption', {}, caption),
          el('thead', {},
             el('tr', {},
                head.map((text, i) => el('th', {scope: 'col', class: i >= head.length - numbers && 'number'}, text)))),
          el('tbody', {}, rows))) :
    '';

function verdictCard(title, folder, verdicts) {
  const one = (verdict) =>
      el('div', {class: 'verdict ' + verdict.judgement},
         el('p', {class: 'verdict-head'}, verdict.item ? verdict.item + ': ' : '', el('strong', {}, verdict.judgement),
            ' ', el('small', {}, Verdict.failure(verdict.failure_probability))),
         verdict.reasons.slice(0, MOST_REASONS).map((text) => el('p', {class: 'note'}, text)));
  return el(
      'section', {class: 'card', 'aria-label': title + ' run'},
      el('p', {class: 'kicker'}, title, ' run: ', el('a', {href: Shell.addressOf('results', folder)}, folder)),
      verdicts.length ? verdicts.map(one) : el('p', {class: 'note'}, 'This run gives no verdict.'));
}

// "0.42° and 0.31 mm apart", or that the two are the same.
function distanceOf({rotation_deg, displacement_mm}) {
  if (rotation_deg < SAME_POSE && displacement_mm < SAME_POSE)
    return ['the same', ', to less than ' + SAME_POSE + '° and ' + SAME_POSE + ' mm'];
  return [
    ResultsList.withUnit(rotation_deg, 'deg') + ' and ' + ResultsList.withUnit(displacement_mm, 'mm') + ' apart', ''
  ];
}

// How far each pose of the second run is from that of the first: of the output "pose", or of the first with poses.
function poseLines(outputs) {
  const moved = (output) => output.items.filter(({amount}) => amount && Number.isFinite(amount.rotation_deg));
  const some = outputs.filter((output) => moved(output).length);
  const output = some.find((one) => one.name === 'pose') || some[0];
  if (!output) {
    const pose = outputs.find((one) => one.name === 'pose');
    return pose && pose.identical ? ['Both runs found the same pose.'] : [];
  }
  return moved(output).map(({place, amount}) => {
    const [words, more] = distanceOf(amount);
    const along = !more && Number.isFinite(amount.axial_rotation_deg) ?
        ': ' + ResultsList.withUnit(Math.abs(amount.axial_rotation_deg), 'deg') + ' about and ' +
            ResultsList.withUnit(Math.abs(amount.axial_displacement_mm), 'mm') + ' along the long axis' :
        '';
    return ['The poses' + (place ? ' of ' + place : '') + ' are ', el('strong', {}, words), more + along + '.'];
  });
}

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

// "−1.25 mm, better"; a dash if one run lacks the figure.
function differenceCell(one) {
  if (!Number.isFinite(one.before) || !Number.isFinite(one.now)) return '–';
  const by = one.now - one.before;
  const text = (by > 0 ? '+' : '') + ResultsList.withUnit(by, one.unit);
  if (!ResultsList.isLessBetter(one.name) || by === 0) return text;
  return [text, el('span', {class: by < 0 ? 'better' : 'worse'}, by < 0 ? ' better' : ' worse')];
}

function figureRow(one) {
  const of = [one.table, one.column].filter(Boolean).join('/');
  return el(
      'tr', {'data-figure': one.name},
      el('th', {scope: 'row'}, ResultsList.term(one.name), of ? el('small', {class: 'option'}, of) : ''),
      el('td', {class: 'number'}, ResultsList.withUnit(one.before, one.unit)),
      el('td', {class: 'number'}, ResultsList.withUnit(one.now, one.unit)),
      el('td', {class: 'number'}, differenceCell(one)));
}

function figuresSection(figures) {
  const known = figures.filter((one) => Number.isFinite(one.before) || Number.isFinite(one.now));
  if (!known.length) return '';
  const place = el('div'), head = ['Figure', 'First run', 'Second run', 'Difference'];
  const columns = [...new Set(known.map((one) => one.column))];
  const places = new Map(known.map((one) => [one, columns.indexOf(one.column)]));
  const fill = (limit) => {
    // How many times the limit the two are apart; without a value in one run, as far as can be.
    const size = (one) => {
      const by = Math.abs(one.now - one.before);
      return Number.isFinite(by) ? by / (ResultsList.limitOf(one, limit) || Number.MIN_VALUE) : Infinity;
    };
    const differ = known.filter((one) => size(one) >= 1), same = known.filter((one) => !differ.includes(one));
    // The last column of a table is the end of a registration, and says more than the stages before it.
    differ.sort(
        (a, b) =>
            ResultsList.rank(a.name) - ResultsList.rank(b.name) || places.get(b) - places.get(a) || size(b) - size(a));
    place.replaceChildren(
        differ.length ? table('Figures that differ', head, differ.map(figureRow), 3) :
                        el('p', {class: 'note'}, 'No figure differs by more than that.'),
        same.length ? el('details', {'data-do': 'same-figures'}, el('summary', {}, 'The same in both: ' + same.length),
                         table('Figures that are the same', head, same.map(figureRow), 3)) :
                      '');
  };
  fill(0.01);
  return el(
      'section', {'aria-label': 'Figures'}, el('h2', {}, 'Figures'),
      el('div', {class: 'toolbar'},
         Dom.select('Called the same if they differ by less than', LIMITS, 0.01, (value) => fill(Number(value)))),
      place);
}

// The pictures that both runs have, one over the other: all views of an output beside each other.
function picturesSection(pictures, first, second) {
  if (!pictures.length) return '';
  const address = (folder, name) => 'results/picture.png?' + new URLSearchParams({folder, name});
  const short = (name) => name.replace(/^outputs\//, '').replace(/\.png$/, '');
  const groupOf = (name) => short(name).split('/').slice(0, -1).join('/') || short(name);
  const groups = [...new Set(pictures.map(groupOf))], place = el('div', {class: 'wipes'});
  const show = (group) => place.replaceChildren(
      ...pictures.filter((name) => groupOf(name) === group)
          .map(
              (name) => wipe(
                  {src: address(first, name), text: first}, {src: address(second, name), text: second}, short(name))));
  const start = groups.find((name) => name.startsWith('result')) || groups.find((name) => name.startsWith('overlay')) ||
      groups[0];
  show(start);
  return el(
      'section', {'aria-label': 'Pictures'}, el('h2', {}, 'Pictures'),
      groups.length > 1 ?
          el('div', {class: 'toolbar'}, Dom.select('Pictures', groups.map((name) => [name, name]), start, show)) :
          '',
      place);
}

function outputsSection(outputs) {
  const rows = [];
  for (const output of outputs) {
    for (const item of output.items) rows.push([[output.name, item.place].filter(Boolean).join(' '), item.text]);
    for (const note of output.notes) rows.push([output.name, [note]]);
  }
  const same = outputs.filter((one) => one.identical && one.same_items).map((one) => one.name);
  return el(
      'section', {'aria-label': 'Outputs'}, el('h2', {}, 'Outputs'),
      table(
          'Outputs that differ', ['Output', 'Difference'],
          rows.map(
              ([name, lines]) =>
                  el('tr', {'data-output': name}, el('th', {scope: 'row'}, name),
                     el('td', {}, folded(lines.map((line) => el('div', {}, line)), MOST_LINES))))),
      same.length ? el('p', {class: 'note'}, 'The same: ' + same.join(', ')) : '');
}

async function show(place, first, second) {
  const {findings, figures, pictures, verdicts, command} = await Ask.json('api/results/diff', {first, second});
  const root = findings.first;
  place.append(
      el('div', {class: 'page-head'}, el('h1', {}, 'Two runs compared'),
         el('div', {class: 'toolbar'}, el('a', {href: '#results='}, 'All results'),
            el('a', {href: Shell.addressOf('results', second, {with: first}), 'data-do': 'swap'}, 'Swap the two'))),
      el('div', {class: 'card-columns'}, verdictCard('First', first, verdicts.before),
         verdictCard('Second', second, verdicts.now)),
      ...poseLines(findings.outputs).map((line) => el('p', {class: 'pose-difference'}, line)),
      el('p', {class: 'says', role: 'status'},
         findings.identical ? 'The two runs are identical: all ' + findings.nodes.same + ' nodes came out the same.' :
             root           ? 'They begin to differ at the node ' + root.node + ' (' + root.uses + ').' :
                              'The nodes that both have came out the same.'),
      ...findings.damaged_files.map((text) => el('p', {class: 'reason'}, text)), changesTable(findings),
      figuresSection(figures), picturesSection(pictures, first, second), outputsSection(findings.outputs),
      el('h2', {}, 'The same on the command line'), Dom.command(command));
}

const reportAddress = (folder, more) => 'results/report.html?' + new URLSearchParams({folder, ...more});

// A report in its frame can load nothing. It asks for its parts by a message, and this page reads them for it.
function reportFrame(folder, loaded) {
  const button = document.getElementById('theme');
  const tellTheme = () => {
    if (!frame.isConnected) return button.removeEventListener('click', tellTheme);
    return frame.contentWindow.postMessage({marrow: 'theme', theme: document.documentElement.dataset.theme}, '*');
  };
  const frame = el('iframe', {
    class: 'report',
    title: 'Report of ' + folder,
    sandbox: 'allow-scripts',
    'aria-busy': 'true',
    src: reportAddress(folder),
    onload: () => {
      frame.removeAttribute('aria-busy');
      loaded();
      tellTheme();
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
  button.addEventListener('click', tellTheme);
  return frame;
}

async function one(place, folder) {
  const says = el('p', {class: 'note', role: 'status'}, 'Loading the report …');
  const box = el('div', {class: 'report-box'}, says);
  place.append(
      el('div', {class: 'page-head'}, el('h1', {}, Shell.nameOf(folder)),
         el('div', {class: 'toolbar'},
            el('a', {href: reportAddress(folder), target: '_blank', rel: 'noopener', 'data-do': 'tab'}, 'In a new tab'),
            el('a', {href: reportAddress(folder, {download: 1}), download: '', 'data-do': 'download'},
               'Download as one file'),
            el('a', {href: '#results='}, 'All results'))),
      box);
  try {
    const {command} = await Ask.post('api/results/report', {folder});
    box.append(reportFrame(folder, () => says.remove()));
    if (command) place.append(el('h2', {}, 'The same on the command line'), Dom.command(command));
  } catch (error) {
    says.remove();
    throw error;
  }
}

Shell.page('results', {
  title: 'Results',
  show(place, parameters, first) {
    if (!first) return ResultsList.show(place);
    return parameters.get('with') ? show(place, first, parameters.get('with')) : one(place, first);
  },
  keys: [
    ['Space', 'choose a run to compare'],
    [
      'c', 'compare the two',
      () => {
        const button = document.querySelector('[data-do="compare"]');
        if (button && !button.disabled) button.click();
      }
    ],
    [
      '/', 'filter the list',
      () => {
        const box = document.querySelector('[data-do="filter"]');
        if (box) box.focus();
      }
    ]
  ]
});
