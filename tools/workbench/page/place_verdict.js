// SPDX-License-Identifier: Apache-2.0
// The verdict on the present poses, in the colour of its judgement.
import {el, percent} from '../../report/page/dom.js';

const LEAST = 0.001;

// The probability of a failure in words: a small one is never "0 %".
export const failureText = (share) => share < LEAST ? 'less than 0.1 %' :
    share > 1 - LEAST                               ? 'more than 99.9 %' :
                                                      percent(share, share < 0.1 ? 1 : 0);

const section = ([bone, {judgement, failure_probability: failure, reasons, remedies}]) =>
    el('div', {class: 'verdict ' + judgement, 'data-judgement': judgement},
       el('p', {class: 'verdict-head'}, bone + ': ', el('strong', {}, judgement)),
       failure !== null && el('p', {}, 'Probability of a failure: ' + failureText(failure)),
       reasons.length > 0 && el('ul', {}, reasons.map((reason) => el('li', {}, reason))),
       remedies.length > 0 &&
           el('details', {}, el('summary', {}, 'What would settle it'),
              el('ul', {}, remedies.map((remedy) => el('li', {}, remedy)))));

// What to show for {BONE: verdict}, or for none.
export const shown = (verdicts, note) =>
    (verdicts ? Object.entries(verdicts).map(section) : [el('p', {class: 'note'}, note || 'not judged yet')]);
