// SPDX-License-Identifier: Apache-2.0
// The page "Results": the runs and comparisons of the folder, one of them opened, two of them compared.
import * as Dom from '../../report/page/dom.js';
import {el} from '../../report/page/dom.js';

import * as ResultsList from './results_list.js';
import * as ResultsTwo from './results_two.js';
import * as Ask from './server.js';
import * as Shell from './shell.js';

const reportAddress = (folder, more) => 'results/report.html?' + new URLSearchParams({folder, ...more});

// A report in its frame can load nothing. It asks for its parts by a message, and this page reads them for it.
function reportFrame(folder, loaded) {
  const button = document.getElementById('theme');
  const tellTheme = () => {
    if (!frame.isConnected) return button.removeEventListener('click', tellTheme);
    return frame.contentWindow.postMessage({marrow: 'theme', theme: document.documentElement.dataset.theme}, '*');
  };
  const frame = el('iframe', {
    class: 'report',
    title: 'Report of ' + folder,
    sandbox: 'allow-scripts',
    'aria-busy': 'true',
    src: reportAddress(folder),
    onload: () => {
      frame.removeAttribute('aria-busy');
      loaded();
      tellTheme();
      frame.contentWindow.postMessage({marrow: 'gives parts'}, '*');
    }
  });
  const give = async ({source, data}) => {
    if (!frame.isConnected) return removeEventListener('message', give);
    if (source !== frame.contentWindow || !data || data.marrow !== 'part') return;
    const file = String(data.file), answer = await fetch('results/part.txt?' + new URLSearchParams({folder, file}));
    const text = answer.ok ? await answer.text() : '';
    frame.contentWindow.postMessage({marrow: 'part', file, text}, '*');
  };
  addEventListener('message', give);
  button.addEventListener('click', tellTheme);
  return frame;
}

async function one(place, folder) {
  const says = el('p', {class: 'note', role: 'status'}, 'Loading the report …');
  const box = el('div', {class: 'report-box'}, says);
  place.append(
      el('div', {class: 'page-head'}, el('h1', {}, Shell.nameOf(folder)),
         el('div', {class: 'toolbar'},
            el('a', {href: reportAddress(folder), target: '_blank', rel: 'noopener', 'data-do': 'tab'}, 'In a new tab'),
            el('a', {href: reportAddress(folder, {download: 1}), download: '', 'data-do': 'download'},
               'Download as one file'),
            el('a', {href: '#results='}, 'All results'))),
      box);
  try {
    const {command} = await Ask.post('api/results/report', {folder});
    box.append(reportFrame(folder, () => says.remove()));
    if (command) place.append(el('h2', {}, 'The same on the command line'), Dom.command(command));
  } catch (error) {
    says.remove();
    throw error;
  }
}

Shell.page('results', {
  title: 'Results',
  show(place, parameters, first) {
    if (!first) return ResultsList.show(place);
    return parameters.get('with') ? ResultsTwo.show(place, first, parameters.get('with')) : one(place, first);
  },
  keys: [
    ['Space', 'choose a run to compare'],
    [
      'c', 'compare the two',
      () => {
        const button = document.querySelector('[data-do="compare"]');
        if (button && !button.disabled) button.click();
      }
    ],
    [
      '/', 'filter the list',
      () => {
        const box = document.querySelector('[data-do="filter"]');
        if (box) box.focus();
      }
    ]
  ]
});
