// SPDX-License-Identifier: Apache-2.0
// The page "Case". Its parts are panels: each shows a part of the draft's document and changes it.
import {el} from '../../report/page/dom.js';

import {CaseDraft} from './draft.js';
import * as Shell from './shell.js';

const panels = [];
const keys = [['Ctrl+z', 'undo', () => draft.step('undo')], ['Ctrl+y or Ctrl+Z', 'redo', () => draft.step('redo')]];
let draft = null, open = [];

// Adds a panel. make(draft) returns {element, update(), dispose()}; update() is called after each change of the
// draft. Panels with a smaller `order` come first. `more_keys` are as in Shell.page().
export function panel(title, order, make, more_keys = []) {
  panels.push({title, order, make});
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

async function show(place, parameters, first) {
  draft = await CaseDraft.open(first || 'case');
  const head = bar();
  open = panels.map(({title, make}) => ({title, ...make(draft)}));
  place.append(
      el('div', {class: 'page-head'}, el('h1', {}, draft.path), head.element),
      el('div', {class: 'panels-of-case'},
         open.map(({title,
                    element}) => el('section', {class: 'panel', 'aria-label': title}, el('h2', {}, title), element))));
  const update = () => [head, ...open].forEach((one) => one.update && one.update());
  draft.addEventListener('change', update);
  update();
}

Shell.page('case', {
  title: 'Case',
  show,
  leave() {
    open.forEach((one) => one.dispose && one.dispose());
    open = [];
  },
  keys
});
