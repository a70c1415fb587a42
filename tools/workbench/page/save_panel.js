// SPDX-License-Identifier: Apache-2.0
// The panel "Save": writes the draft as a case that `marrow run` reads.
import * as Dom from '../../report/page/dom.js';
import {el} from '../../report/page/dom.js';

import * as CasePage from './case.js';
import * as Ask from './server.js';
import * as Shell from './shell.js';

let save = null;  // saves the case that is shown
const FRACTURE = ['femur/femur-best', 'A fractured femur:'], ANY_BONE = ['bone/bone', 'Any other bone:'];
// Pipelines for fractures segment the fragments themselves.
const pipelinesFor = ({document}) =>
    (Object.values(document.fragments).every(({seeds}) => seeds) ? [FRACTURE, ANY_BONE] : [ANY_BONE]);

// Asks whether comments of the older files may be lost, if some cannot be kept. If the server gives no answer, for
// example because the case is incomplete, saving reports the fault.
async function mayLose(draft) {
  const {lost} = await Ask.json('api/case/lost-comments', {case: draft.path}).catch(() => ({lost: []}));
  if (!lost.length) return true;
  const content = [
    el('p', {}, 'The parts that they belong to have changed, so these comments of the older files will be lost:'),
    el('ul', {class: 'faults', 'data-lost': ''}, lost.map((comment) => el('li', {}, comment)))
  ];
  return Shell.sure(
      'Comments will be lost', content, ['Save without them', {'data-do': 'save-without'}],
      ['Do not save', {'data-do': 'do-not-save'}]);
}

function make(draft) {
  const outcome = el('div', {role: 'status', 'data-saved': ''});
  const button = Dom.button('Save the case', () => save(), {'data-do': 'save'});
  const place = Dom.button(
      'Place and register', () => Shell.go('place', draft.path || '.'), {class: 'primary', 'data-do': 'place'});

  save = async () => {
    await draft.last;  // waits for changes that are being sent
    button.disabled = true;
    outcome.replaceChildren();
    if (!await mayLose(draft)) {
      button.disabled = false;
      return;
    }
    try {
      const {job} = await Ask.post('api/case/save', {case: draft.path, revision: draft.revision});
      const result = await Shell.follow('Saving the case', job);
      draft.take(result.draft);
      outcome.replaceChildren(...written(result));
    } catch (error) {
      outcome.replaceChildren(
          el('p', {}, 'Not saved:'),
          el('ul', {class: 'faults'},
             error.message.split('\n').map((line) => line.trim()).filter(Boolean).map((line) => el('li', {}, line))));
    }
    button.disabled = false;
  };

  const written = ({folder, copied, pipelines}) =>
      [el('p', {}, 'Saved in ', el('strong', {}, folder), copied.length ? '; copied into it: ' + copied.join(', ') : '',
          '.'),
       el('h3', {}, 'Or in a shell'),
       ...pipelinesFor(draft).flatMap(
           ([name, words]) =>
               [el('p', {class: 'note'}, words),
                Dom.command(
                    'marrow run ' + Dom.shellPath(pipelines + '/' + name + '.yaml') + ' ' +
                    'case=' + Dom.shellWord(folder))])];

  return {
    element:
        el('div', {},
           el('p', {class: 'note'},
              'Writes case.yaml and landmarks.yaml into the case\'s folder, copies files from elsewhere into it, ' +
                  'and reads the case back before anything is replaced.'),
           el('div', {class: 'toolbar'}, button, place), outcome),
    dispose: () => (save = null),
    update() {
      button.textContent = draft.is_saved ? 'Save again' : 'Save the case';
      button.classList.toggle('primary', !draft.is_saved);
      place.hidden = !draft.is_saved;
    }
  };
}

CasePage.panel('Save', 'save', 45, make, [['Ctrl+s', 'save the case', () => save && save()]]);
