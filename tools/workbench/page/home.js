// SPDX-License-Identifier: Apache-2.0
// The first page: the contents of the folder.
import {el} from '../../report/page/dom.js';

import * as Ask from './server.js';
import * as Shell from './shell.js';

Shell.page('home', {
  title: 'Folder',
  async show(place) {
    const contents = await Ask.json('api/folder');
    const list = (title, page, paths, none) => el('section', {}, el('h2', {}, title), Shell.links(page, paths, none));
    place.append(
        el('div', {class: 'head'}, el('p', {class: 'kicker'}, 'Folder'), el('h1', {}, contents.folder)),
        contents.is_cut && el('p', {class: 'note'}, 'There are too many files to look at all of them.') || '',
        list('Cases', 'case', contents.cases, 'There is no case yet.'),
        list('Pipelines', 'pipeline', contents.pipelines, 'There is no pipeline here.'),
        list('Runs', 'results', contents.runs, 'There is no run here.'),
        list('Comparisons', 'results', contents.comparisons, 'There is no comparison here.'));
  }
});
