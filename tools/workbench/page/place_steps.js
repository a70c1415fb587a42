// SPDX-License-Identifier: Apache-2.0
// The steps on the page "Place" that led to the present poses, their costs and verdicts. The browser keeps them as long
// as its tab, so that they are there again after another page was shown.
import {button, el, number, percent, withUnit} from '../../report/page/dom.js';

const LEAST = 0.001;

// The probability of a failure in words: a small one is never "0 %".
export const failureText = (share) => share < LEAST ? 'less than 0.1 %' :
    share > 1 - LEAST                               ? 'more than 99.9 %' :
                                                      percent(share, share < 0.1 ? 1 : 0);

// The verdict on the present poses, in the colour of its judgement.
const section = ([bone, {judgement, failure_probability: failure, reasons, remedies}]) =>
    el('div', {class: 'verdict ' + judgement, 'data-judgement': judgement},
       el('p', {class: 'verdict-head'}, bone + ': ', el('strong', {}, judgement)),
       failure !== null && el('p', {}, 'Probability of a failure: ' + failureText(failure)),
       reasons.length > 0 && el('ul', {}, reasons.map((reason) => el('li', {}, reason))),
       remedies.length > 0 &&
           el('details', {}, el('summary', {}, 'What would settle it'),
              el('ul', {}, remedies.map((remedy) => el('li', {}, remedy)))));

// What to show for {BONE: verdict}, or for none.
const shown = (verdicts, note) =>
    (verdicts ? Object.entries(verdicts).map(section) : [el('p', {class: 'note'}, note || 'not judged yet')]);

// The costs of the present poses as bars against the best step.

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

const MOST_KEPT = 50;

export class PlaceSteps {
  // goTo(step) makes a step's poses the present ones.
  constructor(path, goTo) {
    Object.assign(this, {key: 'marrow steps of ' + path, goTo, steps: [], views: [], current: null, present: null});
    this.costTable = el('table', {class: 'values place-costs'});
    this.list = el('ol', {class: 'place-steps'});
    this.verdict = el('div', {class: 'place-verdict', role: 'status', tabindex: 0, 'aria-label': 'Verdict'});
  }

  // A step: {what, poses, costs, verdicts, deviations, frame}
  add(what, poses, more) {
    const step = {what, poses: structuredClone(poses), ...more};
    this.steps.push(step);
    this.current = step;
    this.show();
    return step;
  }

  // Takes the steps of an earlier visit if they lead to these poses. Whether it did.
  restore(poses, bones) {
    const fits = (step) => bones.every((bone) => step.poses[bone]) && Object.keys(step.poses).length === bones.length;
    this.steps = this.remembered().filter(fits);
    if (this.find(poses)) return true;
    this.steps = [];
    return false;
  }

  remembered() {
    try {
      return JSON.parse(sessionStorage.getItem(this.key) || '[]');
    } catch (error) {
      return [];
    }
  }

  remember() {
    try {
      sessionStorage.setItem(this.key, JSON.stringify(this.steps.slice(-MOST_KEPT)));
    } catch (error) { /* the browser keeps nothing, or has no room: the steps last until the page is left */
    }
  }

  // After "undo" and "redo": the latest step with these poses is the current one.
  find(poses) {
    const text = JSON.stringify(poses);
    const found = this.steps.findLast((step) => JSON.stringify(step.poses) === text);
    if (found) this.current = found;
    this.show();
    return found;
  }

  showCosts(costs, bone) {
    this.present = {costs, bone};
    fill(this.costTable, costs, bone, this.steps, this.views);
  }

  showVerdict(verdicts, note) {
    this.verdict.replaceChildren(...shown(verdicts, note));
  }

  static deviationText(deviations) {
    return Object.entries(deviations || {})
        .filter(([, one]) => one)
        .map(
            ([bone, one]) => bone + ' predicted deviations: ' +
                Object.entries(one)
                    .map(
                        ([axis, {rotation_deg, shift_mm}]) =>
                            axis + ' ' + withUnit(rotation_deg, '°') + ', ' + withUnit(shift_mm, 'mm'))
                    .join('; '))
        .join('. ');
  }

  show() {
    this.list.replaceChildren(...this.steps.map((step) => {
      const costs = step.costs && Object.values(step.costs).map((one) => number(one.contour.value)).join(', ');
      const verdicts = step.verdicts && Object.values(step.verdicts).map((one) => one.judgement).join(', ');
      const deviations = PlaceSteps.deviationText(step.deviations);
      return el(
          'li', {}, button(step.what, () => this.goTo(step), {'aria-current': step === this.current ? 'step' : null}),
          el('small', {}, [costs && 'contour ' + costs, verdicts].filter(Boolean).join(' · ')),
          deviations && el('small', {class: 'deviations'}, deviations));
    }));
    this.list.scrollTop = this.list.scrollHeight;
    this.remember();
    if (this.present) this.showCosts(this.present.costs, this.present.bone);
  }
}
