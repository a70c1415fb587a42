// SPDX-License-Identifier: Apache-2.0
// What does not fit into the page is beside it, in the folder report/: a file for each case and start, which is loaded
// on demand. A file is named after its content, so a page never shows a file of another report. A file has three lines:
// Parts.take("NAME",  /  the data as JSON  /  );
//
// A page from disk may load scripts, and nothing else. A page in a frame of marrow's workbench may load nothing: the
// workbench, which says so by a message, reads the file for it.
import * as Data from './data.js';
import {button, el} from './dom.js';

const FOLDER = 'report/';
const taken = new Map(), asked = new Map();  // by the name of the file
let giver = null;

// The files call it: the only global that a page needs.
globalThis.Parts = {
  take: (file, content) => taken.set(file, content)
};

function byScript(file) {
  return new Promise((done, failed) => {
    const script = document.createElement('script');
    script.src = FOLDER + file;
    script.onload = () => (taken.has(file) ? done(taken.get(file)) : failed(new Error('it is damaged')));
    script.onerror = () => failed(new Error('it is not there'));
    document.head.append(script);
  });
}

function byMessage(file) {
  return new Promise((done, failed) => {
    asked.set(file, (text) => {
      try {
        done(JSON.parse(text.split('\n')[1]));
      } catch (error) {
        failed(new Error('it cannot be read'));
      }
    });
    giver.postMessage({marrow: 'part', file}, '*');
  });
}

// Adds a part to the data, once. Rejects if the file cannot be loaded; the next call tries again.
export async function load(data, pair) {
  const {part} = pair;
  if (!part) return;
  part.loading = part.loading || (giver ? byMessage : byScript)(part.file);
  part.failed = false;
  try {
    const content = await part.loading;
    taken.delete(part.file);
    if (pair.part) Data.enter(data, content);
    delete pair.part;
  } catch (error) {
    delete part.loading;
    part.failed = true;
    throw error;
  }
}

export const size = (bytes) => (bytes / 1e6).toFixed(bytes < 1e6 ? 2 : 1) + ' MB';

// What is missing, and what to do.
export const missing = (data, pair) => 'Of ' + Data.pairName(data, pair) + ', pictures and curves (' +
    size(pair.part.bytes) + ') are not in this page but in the file ' + FOLDER + pair.part.file +
    ' beside it, which cannot be loaded. ' +
    'Open report.html where the comparison wrote it, or copy the folder report/ along with the page.';

// A placeholder for a picture or curve that is not loaded yet.
export function note(data, pair, load) {
  const {part} = pair;
  if (part.loading) return el('p', {class: 'note'}, 'Being loaded (' + size(part.bytes) + ').');
  return el(
      'div', {}, part.failed && el('p', {class: 'note'}, missing(data, pair)),
      button(part.failed ? 'Try again' : 'Load pictures and curves (' + size(part.bytes) + ')', load));
}

addEventListener('message', ({source, data}) => {
  if (source !== parent || parent === window || !data) return;
  if (data.marrow === 'gives parts') giver = source;
  if (data.marrow === 'part' && asked.has(data.file)) asked.get(data.file)(String(data.text));
});
