// SPDX-License-Identifier: Apache-2.0
// The page "Case": a stage with slices, surfaces and X-rays beside each other, a rail of steps, and the tools of the
// chosen step. Its parts are panels: each shows a part of the draft's document and changes it.
import {el} from '../../report/page/dom.js';

import {CaseDraft} from './draft.js';
import * as Shell from './shell.js';

const entries = (document) => Object.entries(document.fragments || {});
const listed = (names, most = 3) =>
    names.slice(0, most).join(', ') + (names.length > most ? ' and ' + (names.length - most) + ' more' : '');

function boneLacks({document}) {
  const all = entries(document);
  if (!all.length) return 'no bone yet';
  const empty = all.filter(([, {seeds, label, surface}]) => label === undefined && !surface && !(seeds || []).length);
  if (empty.length) return 'no seed in ' + listed(empty.map(([name]) => name));
  return all.every(([, {register}]) => register === false) ? 'no bone is to be registered' : '';
}

function viewLacks({document}) {
  const views = document.views || [], without = views.filter(({camera}) => !camera || !Object.keys(camera).length);
  if (!views.length) return 'no X-ray yet';
  return without.length ? 'no camera: ' + listed(without.map(({name}) => name)) : '';
}

// A case without a CT has labels or surfaces in its place.
const hasBonesOfFiles = ({document}) => entries(document).some(([, one]) => one.label !== undefined || one.surface);

// `lacks`: what is missing, '' if nothing is. `found`: set by the panels, such as the result of a check.
export const STEPS = [
  {
    name: 'ct',
    title: 'CT',
    lacks: (draft) => draft.ct_fault                ? 'cannot be read' :
        draft.document.ct || hasBonesOfFiles(draft) ? '' :
                                                      'no CT yet'
  },
  {name: 'bones', title: 'Bones', lacks: boneLacks}, {name: 'xrays', title: 'X-rays', lacks: viewLacks}, {
    name: 'check',
    title: 'Check',
    lacks: (draft) =>
        (viewLacks(draft) ? 'needs X-rays' :
             draft.check  ? draft.check.lacks :
                            'not checked yet')
  },
  {name: 'save', title: 'Save', lacks: (draft) => (draft.is_saved && draft.document.views ? '' : 'not saved yet')}
];

// The rail: a button for each step. show(name) is called with the chosen one.
function railOf(draft, show) {
  const buttons = STEPS.map(({name, title}, i) => {
    const state = el('small', {}), mark = el('span', {class: 'rail-mark', 'aria-hidden': 'true'}, i + 1);
    const button = el(
        'button', {type: 'button', 'data-step': name, onclick: () => choose(name)}, mark, el('span', {}, title), state);
    return {name, button, state, mark, number: i + 1};
  });
  const choose = (name) => {
    for (const one of buttons)
      if (one.name === name)
        one.button.setAttribute('aria-current', 'step');
      else
        one.button.removeAttribute('aria-current');
    show(name);
  };
  const update = () => STEPS.forEach(({lacks}, i) => {
    const {button, state, mark, number} = buttons[i], missing = lacks(draft);
    state.textContent = missing || 'done';
    mark.textContent = missing ? number : '✓';
    button.classList.toggle('done', !missing);
  });
  draft.addEventListener('steps', update);
  return {
    element: el('nav', {class: 'rail', 'aria-label': 'Steps of the case'}, buttons.map(({button}) => button)),
    update,
    choose,
    // The check comes later, and finds nothing in most cases.
    firstOpen: () => (STEPS.find(({name, lacks}) => name !== 'check' && lacks(draft)) || STEPS.at(-1)).name
  };
}

const panels = [];
const keys = [
  ['Ctrl+z', 'undo', () => draft.step('undo')], ['Ctrl+y or Ctrl+Z', 'redo', () => draft.step('redo')],
  ['1 or 2 or 3 or 4 or 5', 'a step of the rail', (event) => rail.choose(STEPS[Number(event.key) - 1].name)]
];
let draft = null, open = [], rail = null, leaving = null;

// Adds a panel. make(draft, left) returns {element, update(), dispose(), tools, stage}; `left` is a signal that ends
// when the page is left, for the panel's listeners; update() is called after each change of the draft. `tools`: further
// parts for the rail's steps, [{step, title, element}]; without `element` the panel has only these. `stage`: its
// pictures, {slices | surfaces | xrays: element}. Panels with a smaller `order` come first. `more_keys` are as in
// Shell.page().
export function panel(title, step, order, make, more_keys = []) {
  panels.push({title, step, order, make});
  panels.sort((a, b) => a.order - b.order);
  keys.push(...more_keys);
}

function bar() {
  const changes = Shell.undoButtons((way) => draft.step(way));
  const state = el('span', {class: 'note', role: 'status'});
  const update = () => {
    changes.update(draft.state_undo, draft.state_redo);
    state.textContent = draft.is_saved ? 'saved' : 'kept as a draft';
  };
  return {element: el('div', {class: 'toolbar'}, changes.boxes, state), update};
}

// The tools of each step; those of one step are shown.
function toolsOf(parts) {
  const boxes = STEPS.map(
      ({name}) => el(
          'div', {class: 'case-tools', 'data-of-step': name, hidden: true},
          parts.filter(({step}) => step === name)
              .map(({title,
                     element}) => el('section', {class: 'panel', 'aria-label': title}, el('h2', {}, title), element))));
  return {boxes, show: (step) => boxes.forEach((box) => (box.hidden = box.dataset.ofStep !== step))};
}

async function show(place, parameters, first) {
  draft = await CaseDraft.open(first || 'case');
  const head = bar();
  leaving = new AbortController();
  open = panels.map(({title, step, make}) => ({title, step, ...make(draft, leaving.signal)}));
  const parts =
      open.flatMap(({title, step, element, tools = []}) => [...(element ? [{title, step, element}] : []), ...tools]);
  const tools = toolsOf(parts), shown = Object.assign({}, ...open.map((one) => one.stage || {}));
  shown.slices.querySelector('.slices').append(shown.surfaces);  // the fourth picture beside the three slices
  const stage =
      el('div', {class: 'case-stage'},
         el('section', {class: 'stage-slices', 'aria-label': 'Slices and surfaces'}, shown.slices),
         el('section', {class: 'stage-xrays', 'aria-label': 'X-ray pictures'}, shown.xrays));
  rail = railOf(draft, (step) => {
    tools.show(step);
    stage.dataset.step = step;
  });
  place.append(
      el('div', {class: 'case-side'}, el('div', {class: 'page-head'}, el('h1', {}, draft.path), head.element),
         rail.element, tools.boxes),
      stage);
  const update = () => [head, rail, ...open].forEach((one) => one.update && one.update());
  draft.addEventListener('change', update);
  update();
  rail.choose(rail.firstOpen());
}

Shell.page('case', {
  title: 'Case',
  show,
  leave() {
    if (leaving) leaving.abort();
    open.forEach((one) => one.dispose && one.dispose());
    open = [];
  },
  keys
});
