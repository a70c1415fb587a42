// SPDX-License-Identifier: Apache-2.0
// The steps from files to a case, and what each still lacks.
import {el} from '../../report/page/dom.js';

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
export function rail(draft, show) {
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
