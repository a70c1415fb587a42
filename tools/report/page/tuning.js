// SPDX-License-Identifier: Apache-2.0
// How an optimizer found the tuned options: the score of each point that it tried on the training cases. A score is
// not the mean of the figure, because failed and very bad runs count as a fixed value.
import * as Dom from './dom.js';
import {el, number, svg} from './dom.js';
import * as Plots from './plots.js';

function runsText(tuning, point) {
  const withUnit = (value) => Dom.withUnit(value, tuning.unit);
  if (point.refused) return 'refused by the pipeline: ' + point.refused;
  if (point.mean === null) return 'no figure in any of ' + point.runs + ' runs';
  return 'mean ' + tuning.figure + ' ' + withUnit(point.mean) + ' of ' +
      (point.failed ? point.runs - point.failed + ' of ' : '') + point.runs + ' runs' +
      (point.failed ? ', ' + point.failed + ' failed or without the figure' : '') +
      (point.capped ? ', ' + point.capped + ' worse than ' + withUnit(tuning.failed_as) : '');
}

const pointText = (tuning, i) => 'point ' + (i + 1) + ': ' +
    tuning.options.map((option, o) => option.option + ' = ' + number(tuning.points[i].values[o])).join(', ') +
    '; score ' + Dom.withUnit(tuning.points[i].score, tuning.unit) + '; ' + runsText(tuning, tuning.points[i]);

function bestSoFar(tuning) {
  const better = tuning.higher_is_better ? Math.max : Math.min;
  let best = tuning.points[0].score;
  return tuning.points.map((point) => (best = better(best, point.score)));
}

function draw(tuning, width) {
  const scores = tuning.points.map((point) => point.score), best = bestSoFar(tuning);
  const plot = Plots.frame({
    width,
    height: 300,
    x: {kind: 'linear', domain: [0.5, scores.length + 0.5], title: 'points tried'},
    y: {
      domain: Plots.domain([...scores, tuning.untuned.score], 'linear'),
      title: 'score' + (tuning.unit ? ' (' + tuning.unit + ')' : '')
    },
    label: 'score of each point that was tried: ' + tuning.score_rule
  });
  const level = plot.y(tuning.untuned.score);
  plot.root.append(
      svg('line', {
        class: 'untuned',
        x1: plot.box.left,
        x2: plot.box.right,
        y1: level,
        y2: level,
        stroke: Plots.colour(0),
        'stroke-dasharray': '7 3'
      }),
      Plots.polyline(best.map((score, i) => [plot.x(i + 1), plot.y(score)]), 1));
  scores.forEach(
      (score, i) => plot.root.append(Plots.marker(
          1, plot.x(i + 1), plot.y(score), i === tuning.best ? 6 : 3, {'data-tip': pointText(tuning, i)})));
  return plot.root;
}

// null if nothing was tuned.
export function figure(data) {
  const {tuning} = data;
  if (!tuning) return null;
  const chosen = tuning.best === null ? 'none was chosen' : 'the large mark is the chosen one';
  const names = [{name: tuning.variant + ', as it is'}, {name: 'the best point so far; ' + chosen}];
  return el(
      'div', {}, el('p', {}, tuning.sentence.replace(/^t/, 'T') + '.'), Plots.legend(names),
      Plots.responsive((width) => draw(tuning, width)),
      el('p', {class: 'note'},
         'The optimizer ended: ' + tuning.stopped_because + '. Score: ' + tuning.score_rule + '.'));
}
