// SPDX-License-Identifier: Apache-2.0
// Two runs compared: both verdicts and how far the poses are apart first, then what was changed, the figures by
// importance, the pictures one over the other, and the outputs.
import * as Dom from '../../report/page/dom.js';
import {el} from '../../report/page/dom.js';
import * as Verdict from '../../report/page/verdict.js';

import * as FigureWords from './figure_words.js';
import {wipe} from './picture_wipe.js';
import {folded} from './results_list.js';
import * as Ask from './server.js';
import * as Shell from './shell.js';

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
    FigureWords.withUnit(rotation_deg, 'deg') + ' and ' + FigureWords.withUnit(displacement_mm, 'mm') + ' apart', ''
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
        ': ' + FigureWords.withUnit(Math.abs(amount.axial_rotation_deg), 'deg') + ' about and ' +
            FigureWords.withUnit(Math.abs(amount.axial_displacement_mm), 'mm') + ' along the long axis' :
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
  const text = (by > 0 ? '+' : '') + FigureWords.withUnit(by, one.unit);
  if (!FigureWords.isLessBetter(one.name) || by === 0) return text;
  return [text, el('span', {class: by < 0 ? 'better' : 'worse'}, by < 0 ? ' better' : ' worse')];
}

function figureRow(one) {
  const of = [one.table, one.column].filter(Boolean).join('/');
  return el(
      'tr', {'data-figure': one.name},
      el('th', {scope: 'row'}, FigureWords.term(one.name), of ? el('small', {class: 'option'}, of) : ''),
      el('td', {class: 'number'}, FigureWords.withUnit(one.before, one.unit)),
      el('td', {class: 'number'}, FigureWords.withUnit(one.now, one.unit)),
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
      return Number.isFinite(by) ? by / (FigureWords.limitOf(one, limit) || Number.MIN_VALUE) : Infinity;
    };
    const differ = known.filter((one) => size(one) >= 1), same = known.filter((one) => !differ.includes(one));
    // The last column of a table is the end of a registration, and says more than the stages before it.
    differ.sort(
        (a, b) =>
            FigureWords.rank(a.name) - FigureWords.rank(b.name) || places.get(b) - places.get(a) || size(b) - size(a));
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

export async function show(place, first, second) {
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
