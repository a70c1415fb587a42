// SPDX-License-Identifier: Apache-2.0
// The costs of the present poses as bars against the best step.
import {el, number} from '../../report/page/dom.js';

const MEASURES = [['contour', 'Contour'], ['grey_values', 'Grey values']];
// Where the best step is on a bar. The bar is full at twice its cost.
const BEST_percent = 50;

const valueOf = (costs, bone, measure, view) => {
  const of_bone = costs && costs[bone] && costs[bone][measure];
  return of_bone ? (view ? of_bone.views[view] : of_bone.value) : undefined;
};

// The least cost of any step.
function bestOf(steps, bone, measure, view) {
  const values = steps.map(({costs}) => valueOf(costs, bone, measure, view)).filter(Number.isFinite);
  return values.length ? Math.min(...values) : NaN;
}

// How a cost stands to the best one. Smaller costs are better; a negative one has no ratio.
function comparison(value, best) {
  if (!Number.isFinite(best) || !Number.isFinite(value)) return '';
  if (value <= best + 0.0005 * Math.abs(best)) return 'the best';
  return best > 0 ? number(value / best) + ' × the best' : number(value - best) + ' above the best';
}

function barOf(value, best) {
  const is_best = value <= best + 0.0005 * Math.abs(best), ratio = best > 0 ? value / best : is_best ? 1 : 2;
  const share = Number.isFinite(best) && Number.isFinite(value) ? Math.min(100, BEST_percent * ratio) : 0;
  return el(
      'span', {class: 'cost-bar' + (is_best ? ' best' : ''), 'aria-hidden': 'true'},
      el('span', {class: 'cost-fill', style: `width: ${share}%`}), el('span', {class: 'cost-best'}));
}

function cell(present, steps, bone, measure, view) {
  const value = valueOf(present, bone, measure, view), best = bestOf(steps, bone, measure, view);
  return el(
      'td', {'data-cost': view ? null : measure, 'data-value': Number.isFinite(value) ? value : null},
      el('span', {class: 'cost-value'}, number(value)), barOf(value, best), el('small', {}, comparison(value, best)));
}

// Fills the table. `views`: the names in the order of the case.
export function fill(table, costs, bone, steps, views) {
  if (!costs || !costs[bone]) return table.replaceChildren();
  const row = (title, view) => el(
      'tr', {}, el('th', {scope: 'row'}, title), MEASURES.map(([measure]) => cell(costs, steps, bone, measure, view)));
  table.replaceChildren(
      el('caption', {}, `How badly ${bone} fits here. The mark on a bar is the best step.`),
      el('thead', {}, el('tr', {}, el('td', {}), MEASURES.map(([, title]) => el('th', {scope: 'col'}, title)))),
      el('tbody', {}, row('all views'), views.map((view) => row(view, view))));
}
