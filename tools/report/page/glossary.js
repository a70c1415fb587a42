// SPDX-License-Identifier: Apache-2.0
// What the words of a report mean. The texts are those of docs/glossary.md, a page of the documents.
import text from '../../../docs/glossary.md';

import {el} from './dom.js';

const plain = (word) => word.toLowerCase().replaceAll('_', ' ');

// Each item of a list that begins with names in bold: - **name**, **other name**: meaning
function entries() {
  const found = new Map();
  for (const part of text.split(/\n(?=- |\n|#)/)) {
    const [, names, meaning] = /^- (\*\*.+?\*\*): (.+)$/.exec(part.trim().replace(/\s+/g, ' ')) || [];
    for (const [, name] of (names || '').matchAll(/\*\*(.+?)\*\*/g)) found.set(plain(name), meaning);
  }
  return found;
}

const ENTRIES = entries();
const PHRASES = new RegExp(
    '(' +
        [...ENTRIES.keys()]
            .filter((name) => name.includes(' '))
            .sort((a, b) => b.length - a.length)
            .map((name) => name.replace(/[^\w ]/g, '\\$&'))
            .join('|') +
        ')',
    'i');

// The meaning of a word, such as the name of a figure with or without its unit; undefined if it is not explained.
export function meaning(word) {
  const name = plain(word);
  const plainly = (text) => ENTRIES.get(text) ?? ENTRIES.get(text.replace(/ (mm|deg|px|percent)$/, ''));
  if (plainly(name)) return plainly(name);
  const [first, ...rest] = name.split(' '), general = rest.length ? plainly(rest.join(' ')) : undefined;
  return general && 'In “' + first + '” alone: ' + general;
}

// The word, with its meaning to point at.
export function term(word) {
  const tip = meaning(word);
  return tip ? el('span', {class: 'term', tabindex: 0, 'data-tip': tip}, word) : word;
}

// A sentence in which phrases of several words have their meanings.
export const explained = (sentence) => sentence.split(PHRASES).map((part, i) => (i % 2 ? term(part) : part));
