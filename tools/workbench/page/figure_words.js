// SPDX-License-Identifier: Apache-2.0
// Figures of merit in words, which of them say most, and when two of them count as the same.
import * as Dom from '../../report/page/dom.js';
import {el} from '../../report/page/dom.js';
import * as Glossary from '../../report/page/glossary.js';

// The figures that say most about a pose, the first one most of all.
const MOST_SAID = [
  'mtre', 'rotation', 'translation', 'axial', 'along', 'rms', 'max', 'gap', 'angulation', 'shortening', 'predicted max',
  'dice', 'matched percent', 'distance'
];
const LESS_IS_BETTER = ['mtre', 'rotation', 'translation', 'rms', 'max', 'gap'];
const WORDS = {
  mtre: 'mTRE'
};

// "rotation" for rotation_deg: the unit stands behind the value.
const plain = (name) => name.replace(/_(mm|deg|px)$/, '').replaceAll('_', ' ').toLowerCase();
const inWords = (name) => WORDS[plain(name)] || plain(name);
export const isLessBetter = (name) => LESS_IS_BETTER.includes(plain(name));

// Small for figures that say much.
export function rank(name) {
  const place = MOST_SAID.indexOf(plain(name));
  return place < 0 ? MOST_SAID.length : place;
}

const unitText = (unit) => (unit === 'deg' ? '°' : unit ? '\u00a0' + unit : '');
export const withUnit = (value, unit) => Dom.number(value) + (Number.isFinite(value) ? unitText(unit) : '');

// The word with its meaning to point at.
export function term(name) {
  const word = inWords(name), tip = Glossary.meaning(name);
  return tip ? el('span', {class: 'term', tabindex: 0, 'data-tip': tip}, word) : word;
}

// Two values count as the same if they differ by less than this. `limit`: in mm, degrees or px; of others, the share of
// the larger value.
export const limitOf = (one, limit) =>
    (['mm', 'deg', 'px'].includes(one.unit) ? limit : limit * Math.max(Math.abs(one.before), Math.abs(one.now)));

// The figures of a run's row, [{name, unit, value, column}], those that say most first. Of several columns, such as the
// stages of a registration, it takes the last.
export function ofRun(tables) {
  const all = [];
  for (const table of tables || [])
    for (const one of table.rows) {
      const last = one.values.findLastIndex((value) => Number.isFinite(value));
      if (last >= 0)
        all.push({
          name: one.name,
          unit: one.unit,
          value: one.values[last],
          column: table.columns.length > 1 ? table.columns[last] : ''
        });
    }
  return all.sort((a, b) => rank(a.name) - rank(b.name));
}
