// SPDX-License-Identifier: Apache-2.0
// How an optimizer came to the tuned options: the figure at each point that it tried on the training cases.
'use strict';

const Tuning = (() => {
  const {el, svg, number} = Dom;

  const pointText = (tuning, i) => 'point ' + (i + 1) + ': ' +
      tuning.options.map((option, o) => option.option + ' = ' + number(tuning.points[i].values[o])).join(', ') + ', ' +
      tuning.figure + ' ' + Dom.withUnit(tuning.points[i].figure, tuning.unit);

  function bestSoFar(tuning) {
    const better = tuning.higher_is_better ? Math.max : Math.min;
    let best = tuning.points[0].figure;
    return tuning.points.map((point) => (best = better(best, point.figure)));
  }

  function draw(tuning, width) {
    const figures = tuning.points.map((point) => point.figure), best = bestSoFar(tuning);
    const plot = Plots.frame({
      width,
      height: 300,
      x: {kind: 'linear', domain: [0, figures.length + 1], title: 'points tried'},
      y: {
        domain: Plots.domain([...figures, tuning.untuned.figure], 'linear'),
        title: 'mean ' + tuning.figure + (tuning.unit ? ' [' + tuning.unit + ']' : '')
      },
      label: 'mean ' + tuning.figure + ' at each point that was tried'
    });
    const level = plot.y(tuning.untuned.figure);
    plot.root.append(
        svg('line', {
          class: 'untuned',
          x1: plot.x(0),
          x2: plot.x(figures.length + 1),
          y1: level,
          y2: level,
          stroke: Plots.colour(0),
          'stroke-dasharray': '7 3'
        }),
        Plots.polyline(best.map((figure, i) => [plot.x(i + 1), plot.y(figure)]), 1));
    figures.forEach(
        (figure, i) => plot.root.append(Plots.marker(
            1, plot.x(i + 1), plot.y(figure), i === tuning.best ? 6 : 3, {'data-tip': pointText(tuning, i)})));
    return plot.root;
  }

  // null if nothing was tuned.
  function figure(data) {
    const {tuning} = data;
    if (!tuning) return null;
    const names =
        [{name: tuning.variant + ', as it is'}, {name: 'the best point so far; the large mark is the chosen one'}];
    return el(
        'div', {}, el('p', {}, tuning.sentence.replace(/^t/, 'T') + '.'), Plots.legend(names),
        Plots.responsive((width) => draw(tuning, width)),
        el('p', {class: 'note'},
           'The optimizer ended: ' + tuning.stopped_because + '. A run that failed counts as ' +
               Dom.withUnit(tuning.failed_as, tuning.unit) + ', and so does one that is worse.'));
  }

  return {figure};
})();
