// SPDX-License-Identifier: Apache-2.0
// Puts the page together when the browser has read it.
import * as Cells from './cells.js';
import * as Compared from './compared.js';
import * as Curves from './curves.js';
import * as Data from './data.js';
import * as Detail from './detail.js';
import {button, checkbox, choice, command, el, row, select, startTooltip, table, valueTable} from './dom.js';
import * as Figures from './figures.js';
import * as Glossary from './glossary.js';
import * as Graph from './graph.js';
import * as Leaderboard from './leaderboard.js';
import * as OverTime from './over_time.js';
import * as Parts from './parts.js';
import * as Passes from './passes.js';
import * as Pictures from './pictures.js';
import * as Plots from './plots.js';
import * as Profile from './profile.js';
import * as Recipes from './recipes.js';
import * as Response from './response.js';
import {SceneView} from './scene.js';
import * as Sequence from './sequence.js';
import {shown} from './shown.js';
import * as Summary from './summary.js';
import {startTheme} from './theme.js';
import * as Tuning from './tuning.js';
import * as Verdict from './verdict.js';

// A section with a heading and an entry in the list of contents. Parts that are null are left out.
// How to read it comes after the first part, which is the answer.
function section(id, title, intro, ...parts) {
  const [answer, ...rest] = parts.flat().filter(Boolean);
  const node =
      el('section', {id, 'aria-labelledby': id + '-title'}, el('h2', {id: id + '-title'}, Glossary.term(title)), answer,
         intro && el('p', {class: 'intro'}, intro), rest);
  document.getElementById('contents').append(el('a', {href: '#' + id}, title));
  return node;
}

// If a tenth of the runs end far off, a linear scale would squeeze the others.
function skewed(data) {
  const values = data.variants.flatMap((_, variant) => Data.valuesOf(data, variant, 0).map((item) => item.value))
                     .sort((a, b) => a - b);
  return values[0] > 0 && Data.quantile(values, 0.9) > 6 * Data.quantile(values, 0.25);
}

// A figure over all cells: choice of metric and scale, legend, and the drawing.
function metricFigure(data, kinds, extra, draw) {
  const state = {metric: 0, kind: kinds[skewed(data) ? 1 : 0][0], extra: extra && extra.options[0][0]};
  const place = Plots.responsive((width) => draw(state, width)), again = () => place.redraw();
  const toolbar = el('div', {class: 'toolbar'}, Summary.metricChoice(data, (i) => {
    state.metric = i;
    again();
  }), extra && choice(extra.label, extra.options, state.extra, (value) => {
        state.extra = value;
        again();
      }), choice('Scale', kinds, state.kind, (kind) => {
                       state.kind = kind;
                       again();
                     }));
  return el('div', {}, toolbar, place);
}

function distributions(data) {
  return section(
      'distributions', 'Distributions',
      'Each mark is a run. The box spans the quartiles, its bar is the median, and the whiskers reach from the ' +
          '5th to the 95th percentile. ' +
          'Click a mark to open its run.',
      metricFigure(
          data, [['linear', 'linear'], ['log', 'log']], null,
          (state, width) => Figures.drawDistribution(data, state.metric, state.kind, width)));
}

function paired(data) {
  if (data.baseline < 0 || data.variants.length < 2) return null;
  const draw = (state, width) =>
      (state.extra === 'pairs' ?
           Figures.drawPairs(data, state.metric, state.kind === 'signed' ? 'log' : 'linear', width) :
           Figures.drawDifferences(data, state.metric, state.kind, width));
  return section(
      'paired', 'Against the baseline',
      'Each case and start, run with a variant and with ' + data.variants[data.baseline].name +
          '. Left of zero the variant is better; right of zero if a higher figure is better. ' +
          'The thick bar is the estimated difference with its 95 % interval.',
      metricFigure(
          data, [['linear', 'linear'], ['signed', 'log']],
          {label: 'Show', options: [['differences', 'Differences'], ['pairs', 'Pairs']]}, draw),
      Compared.comparisons(data));
}

function effects(data) {
  const found = Compared.effects(data);
  return found &&
      section(
             'effects', 'Effects of the factors',
             'What each level of a factor does against the factor’s first one: for each case the mean over all ' +
                 'combinations of the others, and of these the median. Each interval is by itself.',
             found);
}

function capture(data) {
  const bins = Figures.captureBins(data);
  if (!bins.length || !bins[0].length) return null;
  const ranges =
      el('ul', {class: 'verdicts'},
         data.variants.map(
             (variant, i) =>
                 el('li', {style: '--mark: ' + Plots.colour(i)}, variant.name + ': ' + Figures.captureRange(data, i))));
  return section(
      'capture', 'Capture range',
      'How far from the truth a start may be: up to the given error, each bin of starts has a success rate of 95 % ' +
          'or more. Bars are 95 % intervals; they take into account that the starts of a case are not independent. A ' +
          'failed run is not a success.',
      ranges, Plots.legend(data.variants), Plots.responsive((width) => Figures.drawCapture(data, bins, width)),
      el('details', {}, el('summary', {}, 'The counts'), Figures.captureTable(data, bins)));
}

function response(data) {
  const figure = Response.figure(data);
  return figure &&
      section(
             'response', 'Response to options',
             'The figure’s median, or the success rate, over an option that was swept, with its 95 % interval. ' +
                 'All runs with the same value count, whatever their other options.' +
                 (data.tuning ? ' These are runs of the training cases.' : ''),
             figure);
}

function tuning(data) {
  const figure = Tuning.figure(data);
  return figure &&
      section(
             'tuning', 'Tuning',
             'An optimizer chose the tuned variant’s options on training cases. ' +
                 'The response to options is of these cases, too. All other sections are of the held-out cases.',
             figure);
}

function byCase(data) {
  if (data.cases.length < 2) return null;
  const place = el('div', {}, Summary.caseTable(data, 0));
  return section(
      'by-case', 'Case by case',
      'The median over a case’s starts, and how many of them end in success. ' +
          'Sort by a column to find the hard cases.',
      Summary.metricBar(data, (i) => place.replaceChildren(Summary.caseTable(data, i))), place);
}

// Pictures, 3D view, convergence and landscapes of one case and start, chosen once for all of them.
function closer(data) {
  if (!data.lookedAt.length) return [];
  const places = {pictures: el('div'), scene: el('div'), convergence: el('div'), landscape: el('div')};
  const state = {at: 0, each: false};
  const pickers = [];
  const picker = () => {
    const box = select(
        'Case and start', data.lookedAt.map((pair, i) => [i, Data.pairName(data, pair)]), 0, (i) => choose(Number(i)));
    pickers.push(box.box);
    return data.lookedAt.length < 2 ?
        null :
        el('div', {class: 'toolbar picker'}, box, button('Previous', () => choose(state.at - 1)),
           button('Next', () => choose(state.at + 1)));
  };
  const each = () => (data.variants.length > 1 ? checkbox('each scaled to 0–1', false, (on) => {
    state.each = on;
    curves();
  }) : null);
  const missing = (what) => {
    const pair = data.lookedAt[state.at];
    return pair.part ? Parts.note(data, pair, () => fetch(pair)) : nothing(what);
  };
  const curves = () => {
    const {cells} = data.lookedAt[state.at];
    places.convergence.replaceChildren(Curves.convergence(data, cells, state.each) || missing('curve'));
    places.landscape.replaceChildren(Curves.landscapes(data, cells, state.each) || missing('landscape'));
  };
  let comparer = null, scene = null;
  const show = (at) => {
    state.at = (at + data.lookedAt.length) % data.lookedAt.length;
    pickers.forEach((box) => (box.value = state.at));
    draw(data.lookedAt[state.at]);
  };
  const choose = (at) => {
    show(at);
    if (data.lookedAt[state.at].part) fetch(data.lookedAt[state.at]);
  };
  // Loads the files beside the page.
  const fetch = (pair) => {
    const again = () => data.lookedAt[state.at] === pair && draw(pair);
    Parts.load(data, pair).then(again, again);
    again();
  };
  const draw = (pair) => {
    if (comparer) comparer.dispose();
    comparer = pair.cells.some((cell) => cell && cell.pictures.length) ? new Pictures.Comparer(data, pair) : null;
    places.pictures.replaceChildren(comparer ? comparer.element : missing('picture'));
    curves();
    const entries = pair.cells.filter((cell) => cell && cell.scene)
                        .map((cell) => ({label: data.variants[cell.variant].name, scene: cell.scene}));
    if (scene) scene.dispose();
    scene = null;
    places.scene.replaceChildren(missing('3D scene'));
    const open = () => {
      shown.scene = scene = new SceneView(data, entries);
      places.scene.replaceChildren(scene.element);
      if (shown.player) shown.player.moveModels();
    };
    if (entries.length) whenNear(places.scene, () => data.lookedAt[state.at] === pair && !scene && open());
  };
  Detail.setLookAt((cell) => {
    choose(data.lookedAt.indexOf(data.pairOf(cell)));
    document.getElementById('pictures').scrollIntoView();
  });
  const many = data.variants.length > 1;
  const kinds = new Set(data.lookedAt.flatMap((pair) => pair.cells.flatMap((cell) => Data.kinds(data, cell))));
  const sections = [
    kinds.has('pictures') &&
        section(
            'pictures', 'Pictures',
            (many ? 'Two variants on the same X-ray.' : 'Two pictures on top of each other.') +
                ' Arrow keys move the wipe; in a blink the space bar switches.',
            picker(), places.pictures,
            data.is_run && data.cells[0] &&
                el('details', {open: true}, el('summary', {}, 'All pictures'),
                   Pictures.gallery(data, {pictures: Sequence.stills(data.cells[0])}))),
    kinds.has('scene') &&
        section(
            'scene', '3D view',
            'The model in the found pose, in the true pose and at the start, among the X-rays or as one of them ' +
                'sees it.',
            picker(), places.scene),
    kinds.has('convergence') &&
        section(
            'convergence', 'Convergence', 'The cost that the optimizer had reached, against the evaluations it took.',
            picker(), el('div', {class: 'toolbar'}, each()), many && Plots.legend(data.variants), places.convergence),
    kinds.has('landscape') &&
        section(
            'landscape', 'Cost landscapes',
            'The cost about the result along each axis; the mark is the lowest. ' +
                'A mark off zero, a second valley or a flat floor says where the cost misleads.',
            picker(), el('div', {class: 'toolbar'}, each()), many && Plots.legend(data.variants), places.landscape),
  ].filter(Boolean);
  show(Math.max(0, data.lookedAt.findIndex((pair) => !pair.part)));
  return sections;
}

function sequence(data) {
  const found = data.is_run && data.cells[0] && Sequence.of(data.cells[0]);
  return found ? section(
                     'sequence', 'Sequence', 'The run frame by frame; the arrow keys move the slider by one frame.',
                     (shown.player = new Sequence.Player(data, found)).element) :
                 null;
}

const nothing = (what) => el('p', {class: 'note'}, 'No ' + what + ' of this case and start was kept.');

function whenNear(place, action) {
  const observer = new IntersectionObserver(
      (entries) => entries.some((entry) => entry.isIntersecting) && (observer.disconnect(), action()),
      {rootMargin: '300px'});
  observer.observe(place);
}

const file = (title, text) =>
    (text ? el('details', {}, el('summary', {}, title), el('pre', {class: 'file', tabindex: 0}, text)) : null);

function repeat(data) {
  const {experiment} = data, machine = experiment.machine || {};
  const lines = [
    ['Seed', experiment.seed], ['Started', experiment.started], ['Finished', experiment.finished],
    ['Folder', experiment.folder], ['marrow', data.marrow],
    ['Machine', [machine.cpu, machine.cores && machine.cores + ' cores', machine.cpu_level].filter(Boolean).join(', ')]
  ].filter((line) => line[1] !== undefined && line[1] !== null && line[1] !== '');
  return section(
      'repeat', 'Repeat it', null, experiment.command && command(experiment.command),
      el('div', {class: 'scroll'}, valueTable(lines.map(([name, value]) => [name, String(value)]))),
      file(data.is_run ? 'The run’s settings' : 'The experiment’s file', experiment.text),
      file('The pipeline’s file', experiment.pipeline_text), ...Recipes.all(data),
      (experiment.plugins || []).length > 0 &&
          el('details', {}, el('summary', {}, 'Plugins and their build ids'),
             table({}, null, null, experiment.plugins.map((plugin) => row(plugin.file, [el('code', {},
                                                                                           plugin.build_id)])))));
}

function summary(data) {
  const {experiment} = data, cell = data.cells[0], judged = data.is_run && cell && Verdict.all(data, cell);
  const verdict = judged && section('verdict', 'Verdict', null, judged);
  const head = section(
      'summary', 'Result', null,
      ...(data.is_run ? (cell ?
                             [
                               Detail.reason(cell), Detail.absent(cell), Detail.values(data, cell),
                               el('div', {class: 'figure-tables'}, Detail.figures(data))
                             ] :
                             []) :
                        [Leaderboard.table(data), Summary.verdicts(data), Verdict.table(data)]),
      experiment.help && el('p', {class: 'lead'}, experiment.help), Summary.rules(data));
  return [
    el('div', {class: 'head'}, el('p', {class: 'kicker'}, data.is_run ? 'Run' : 'Comparison'),
       el('h1', {}, experiment.name || 'Unnamed'),
       el('p', {class: 'facts'}, data.is_run ? Recipes.link(data, 0) : Summary.facts(data))),
    verdict, head
  ];
}

// Lets the browser show what is there. A page that nobody sees draws no frames, and goes on after a while.
const frame = () => new Promise((done) => {
  requestAnimationFrame(() => setTimeout(done));
  setTimeout(done, 200);
});

// The answer is shown first; all else takes longer.
async function build(data) {
  const {experiment} = data, many = !data.is_run, main = document.getElementById('top');
  document.title = (experiment.name || 'marrow report') + ' · marrow';
  const add = (...parts) => main.append(...parts.flat(2).filter(Boolean));  // at once: figures need their width
  if (data.over_time) {
    add(OverTime.sections(data, section));
    return;
  }
  add(summary(data));
  await frame();
  if (many && data.metrics.length)
    add(effects(data), tuning(data), response(data), distributions(data), paired(data), capture(data), byCase(data));
  add(sequence(data));
  add(closer(data));
  if (data.passes.length) add(section('passes', 'Passes', null, ...Passes.draw(data)));
  if (data.profile)
    add(section(
        'profile', 'Profile',
        'A row for each thread, a bar for each call; it lies below what called it. ' +
            'Click a bar to see its time alone.',
        ...Profile.figure(data.profile)));
  if (data.graph && (data.graph.nodes || []).length) {
    add(section(
        'graph', 'Pipeline', data.variants.length > 1 ? 'Framed nodes differ between the variants.' : null,
        Graph.draw(data.graph)));
  }
  if (many) {
    shown.table = new Cells.Table(data);
    const intro = 'Click a row for all of one run; its address in the browser’s bar is a link to it. Only the ' +
        'visible rows are drawn, so Ctrl+F goes to the filter instead.';
    add(section('cells', 'All runs', intro, shown.table.element),
        section('failures', 'Failures', null, Cells.failures(data)));
  }
  add(repeat(data));
  document.addEventListener('click', (event) => {
    const mark = event.target.closest && event.target.closest('[data-cell]');
    if (mark) Detail.open(data, data.byId.get(mark.dataset.cell));
  });
  Detail.openAddress(data);
  addEventListener('hashchange', () => Detail.openAddress(data));
}

// Marks the section that is being read in the list of contents.
function followScroll() {
  const links = new Map([...document.querySelectorAll('#contents a')].map((link) => [link.hash.slice(1), link]));
  const seen = new IntersectionObserver((entries) => {
    for (const entry of entries.filter((item) => item.isIntersecting)) {
      links.forEach((link) => link.removeAttribute('aria-current'));
      links.get(entry.target.id).setAttribute('aria-current', 'true');
    }
  }, {rootMargin: '-20% 0px -70% 0px'});
  document.querySelectorAll('main > section').forEach((node) => seen.observe(node));
}

async function start() {
  startTheme();
  startTooltip();
  try {
    await build(Data.load());
    followScroll();
  } catch (error) {
    document.getElementById('top').prepend(
        el('p', {class: 'fault', role: 'alert'}, 'This report cannot be shown whole: ' + error.message));
    console.error(error);
  }
  document.documentElement.dataset.ready = 'true';
}

start();
