// SPDX-License-Identifier: Apache-2.0
// The recipes of the page, from <script type="application/json" id="recipes">: for each variant a pipeline file that
// makes its run again. `marrow recipe` reads them too.
import {button, el, save} from './dom.js';

const idOf = (variant) => 'recipe-' + variant;

// [{name, recipe}], in the order of the variants; empty in a page without them.
export function load() {
  const element = document.getElementById('recipes');
  return element ? JSON.parse(element.textContent) : [];
}

// A link that opens the recipe of a variant.
export const link = (data, variant) => data.recipes[variant] &&
    el('a', {
              href: '#' + idOf(variant),
              class: 'recipe',
              onclick: () => (document.getElementById(idOf(variant)).open = true)
                                       },
       'recipe');

function shown(data, {name, recipe}, variant) {
  const title = name ? 'Recipe of ' + name : 'Recipe: a file that makes this run again';
  const file = (name || data.experiment.name || 'run') + '.yaml';
  return el(
      'details', {id: idOf(variant)}, el('summary', {}, title),
      el('p', {}, button('Save as ' + file, () => save(recipe, file.replace(/[\/\\]/g, '_'), 'application/yaml'))),
      el('pre', {class: 'file', tabindex: 0}, recipe));
}

// All of them. Those of a comparison are for its first case and start.
export const all = (data) => [!data.is_run && data.recipes.length > 0 &&
                                  el('p', {class: 'note'},
                                     'Each variant’s recipe runs it on case ' + data.cases[0] + ', start ' +
                                         data.starts[0] + '. The recipe of any other run: marrow recipe ' +
                                         (data.experiment.folder || 'FOLDER') + '/cells/VARIANT/CASE/START'),
                              ...data.recipes.map((one, variant) => shown(data, one, variant))]
                                 .filter(Boolean);
