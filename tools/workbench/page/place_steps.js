// SPDX-License-Identifier: Apache-2.0
// The steps on the page "Place" that led to the present poses, their costs and verdicts. The browser keeps them as long
// as its tab, so that they are there again after another page was shown.
import {button, el, number, withUnit} from '../../report/page/dom.js';

import * as PlaceCosts from './place_costs.js';
import * as PlaceVerdict from './place_verdict.js';

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
    PlaceCosts.fill(this.costTable, costs, bone, this.steps, this.views);
  }

  showVerdict(verdicts, note) {
    this.verdict.replaceChildren(...PlaceVerdict.shown(verdicts, note));
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
