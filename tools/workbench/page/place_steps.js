// SPDX-License-Identifier: Apache-2.0
// The texts of the page "Place" about poses: the steps that led to the present one, their costs and verdicts.
import {button, el, number, percent, withUnit} from '../../report/page/dom.js';

export class PlaceSteps {
  // goTo(step) makes a step's poses the present ones.
  constructor(goTo) {
    Object.assign(this, {goTo, steps: [], current: null, present: null});
    this.costTable = el('table', {class: 'values place-costs'});
    this.list = el('ol', {class: 'place-steps'});
    this.verdict = el('div', {class: 'place-verdict', role: 'status'});
  }

  // A step: {what, poses, costs, verdicts, deviations}
  add(what, poses, more) {
    const step = {what, poses: structuredClone(poses), ...more};
    this.steps.push(step);
    this.current = step;
    this.show();
    return step;
  }

  // After "undo" and "redo": the latest step with these poses is the current one.
  find(poses) {
    const text = JSON.stringify(poses);
    const found = this.steps.findLast((step) => JSON.stringify(step.poses) === text);
    if (found) this.current = found;
    this.show();
    return found;
  }

  // The least cost of a bone in any step, by measure.
  best(bone, measure) {
    const values =
        this.steps.filter((step) => step.costs && step.costs[bone]).map((step) => step.costs[bone][measure].value);
    return values.length ? Math.min(...values) : NaN;
  }

  showCosts(costs, bone) {
    this.present = {costs, bone};
    if (!costs || !costs[bone]) return this.costTable.replaceChildren();
    const measures = [['contour', 'contour'], ['grey_values', 'grey values']];
    const row = (title, cell) =>
        el('tr', {}, el('th', {scope: 'row'}, title), measures.map(([measure]) => cell(measure, costs[bone][measure])));
    this.costTable.replaceChildren(
        el('caption', {}, 'How badly ' + bone + ' fits here'),
        el('thead', {}, el('tr', {}, el('td', {}), measures.map(([, title]) => el('th', {scope: 'col'}, title)))),
        el('tbody', {}, row('all views', (measure, {value}) => el('td', {'data-cost': measure}, number(value))),
           row('against the best step', (measure, {value}) => el('td', {}, this.comparison(value, bone, measure))),
           Object.keys(costs[bone].contour.views)
               .map((name) => row(name, (measure, {views}) => el('td', {}, number(views[name]))))));
  }

  comparison(value, bone, measure) {
    const best = this.best(bone, measure);
    if (!Number.isFinite(best)) return '–';
    return value <= best * 1.0005 ? 'the best' : number(value / best) + ' × the best';
  }

  showVerdict(verdicts, note) {
    if (!verdicts) return this.verdict.replaceChildren(el('p', {class: 'note'}, note || 'not judged yet'));
    this.verdict.replaceChildren(...Object.entries(verdicts).map(
        ([bone, verdict]) =>
            el('div', {'data-judgement': verdict.judgement},
               el('p', {}, el('strong', {}, bone + ': ' + verdict.judgement),
                  verdict.failure_probability === null ?
                      '' :
                      ', probability of a failure ' + percent(verdict.failure_probability)),
               el('ul', {}, verdict.reasons.map((reason) => el('li', {}, reason))),
               verdict.remedies.length > 0 && el('p', {}, 'Would settle it: ' + verdict.remedies.join('; ')))));
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
    if (this.present) this.showCosts(this.present.costs, this.present.bone);
  }
}
