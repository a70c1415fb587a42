// SPDX-License-Identifier: Apache-2.0
// What surrounds all pages: the bar, notices, jobs, dialogs and keys. The address names the page and what it shows:
// #case=cases/7&view=lateral
import {button, el, startTooltip, valueTable} from '../../report/page/dom.js';
import {startTheme} from '../../report/page/theme.js';

import * as Ask from './server.js';

const pages = new Map();  // name: {title, show(place, parameters), keys, leave(), inBar, of}
let current = null;
let present_case = '';  // the case that was shown last; it goes along to the other pages

// Adds a page. show(place, parameters, first) fills the element `place`; `first` is what follows the page's name in
// the address. A page that is not in the bar (inBar: false) may belong to one that is (of). `keys`: [[key, what it
// does, action]], where key is as in KeyboardEvent.key, with 'Ctrl+' in front.
export function page(name, description) {
  pages.set(name, description);
}

function parsed(hash) {
  const parameters = new URLSearchParams(hash.replace(/^#/, ''));
  const [name, first] = [...parameters.entries()][0] || ['home', ''];
  const wanted = name === 'case' && !first ? 'cases' : name;  // without a name, the page that lists them
  return {name: pages.has(wanted) ? wanted : 'home', first, parameters};
}

export const addressOf = (name, first, more) =>
    '#' + new URLSearchParams([[name, first || ''], ...Object.entries(more || {})]).toString().replaceAll('%2F', '/');

// Opens a page, or the present page with another address.
export function go(name, first, more) {
  location.hash = addressOf(name, first, more);
}

// The links of the bar, and the name of the case that goes along with them.
function showCase() {
  for (const link of document.querySelectorAll('#pages a'))
    link.href = addressOf(link.dataset.page, ['case', 'place'].includes(link.dataset.page) ? present_case : '');
  const label = document.getElementById('present-case');
  label.hidden = !present_case;
  label.href = addressOf('case', present_case);
  label.textContent = nameOf(present_case);
}

// The case that is worked on, or ''.
export const presentCase = () => present_case;

async function show() {
  const {name, first, parameters} = parsed(location.hash), place = document.getElementById('page');
  if (first && ['case', 'place'].includes(name)) present_case = first;
  if (current && current.leave) current.leave();
  current = pages.get(name);
  document.title = (first ? first + ' · ' : '') + current.title + ' · marrow';
  for (const link of document.querySelectorAll('#pages a'))
    if (link.dataset.page === (current.of || name))
      link.setAttribute('aria-current', 'page');
    else
      link.removeAttribute('aria-current');
  showCase();
  const loading = el('p', {class: 'loading note', role: 'status'}, 'Loading …');
  const inside = el('div', {class: 'page page-' + name}, loading);
  place.replaceChildren(inside);
  place.dataset.page = name;
  delete document.documentElement.dataset.ready;
  try {
    await current.show(inside, parameters, first);
  } catch (error) {
    inside.append(el('p', {class: 'fault', role: 'alert'}, error.message));
    if (!(error instanceof Ask.Refused)) console.error(error);
  }
  loading.remove();
  document.documentElement.dataset.ready = name;
}

// The name of a path in the opened folder.
export const nameOf = (path) => (path && path !== '.' ? path : '(this folder)');

export const folderOf = (path) => path.split('/').slice(0, -1).join('/');

// `name`, or if it is taken the first free one of name-2, name-3, ...; `between` may be another sign than the hyphen.
export function freeName(name, taken, between = '-') {
  let free = name;
  for (let number = 2; taken.includes(free); ++number) free = name + between + number;
  return free;
}

// Links to a page for these paths, or a note if there are none.
export const links = (name, paths, none) =>
    (paths.length ? el('ul', {class: 'files'},
                       paths.map((path) => el('li', {}, el('a', {href: addressOf(name, path)}, nameOf(path))))) :
                    el('p', {class: 'note'}, none));

// Buttons to undo and redo: act(way) gets 'undo' or 'redo'. update(undo, redo) gets what each would change, or null.
export function undoButtons(act) {
  const undo = button('Undo', () => act('undo'), {'data-do': 'undo'});
  const redo = button('Redo', () => act('redo'), {'data-do': 'redo'});
  const set = (box, what) => {
    box.disabled = what === null;
    box.title = what ? box.textContent + ': ' + what : 'There is nothing to ' + box.dataset.do;
  };
  return {
    boxes: [undo, redo],
    update(to_undo, to_redo) {
      set(undo, to_undo);
      set(redo, to_redo);
    }
  };
}

// A line above the page. kind: 'fault' stays until it is closed, others go after some seconds.
export function notice(text, kind) {
  const line =
      el('p', {class: 'notice ' + (kind || ''), role: kind === 'fault' ? 'alert' : null}, text,
         button('Close', () => line.remove()));
  document.getElementById('notices').append(line);
  if (kind !== 'fault') setTimeout(() => line.remove(), 6000);
  return line;
}

// Calls an async action and shows what goes wrong. Resolves to its value, or to undefined.
export async function guarded(action) {
  try {
    return await action();
  } catch (error) {
    if (error.name === 'AbortError') return undefined;
    notice(error.message, 'fault');
    if (!(error instanceof Ask.Refused)) console.error(error);
    return undefined;
  }
}

// Shows the progress of a job and a button that stops it. Events tell the progress of one node; told(event) may return
// that of the whole job, from 0 to 1. Resolves to the job's result; rejects as Ask.follow().
export async function follow(title, job, told) {
  const bar = el('progress', {'aria-label': title, max: 1}), text = el('span', {class: 'job-text'});
  const line =
      el('p', {class: 'notice job'}, el('strong', {}, title), ' ', bar, ' ', text,
         button('Stop', () => guarded(() => Ask.stop(job)), {'data-stop': job}));
  document.getElementById('notices').append(line);
  try {
    return await Ask.follow(job, (event) => {
      const share = told && told(event);
      if (Number.isFinite(share))
        bar.value = share;
      else if (event.event === 'progress')
        bar.value = event.fraction;
      if (['started', 'progress', 'message', 'warning'].includes(event.event))
        text.textContent = [event.node, event.item, event.text].filter(Boolean).join(' ');
    });
  } finally {
    line.remove();
  }
}

// A modal dialog. fill(close) returns its content. Resolves to the value that is passed to close(), or to undefined if
// the user leaves it.
export function dialog(title, fill) {
  const box = document.getElementById('dialog');
  return new Promise((resolve) => {
    let value;
    const close = (given) => {
      value = given;
      box.close();
    };
    box.setAttribute('aria-label', title);
    box.replaceChildren(
        el('div', {class: 'dialog-head'}, el('h2', {tabindex: -1}, title), button('Close', () => close())),
        fill(close));
    box.addEventListener('close', () => resolve(value), {once: true});
    box.showModal();
  });
}

// Asks a question, `content`. yes and no: [text, more attributes] of the buttons. Resolves to whether it is answered
// by yes.
export const sure = async (title, content, yes, no) => Boolean(await dialog(
    title,
    (close) =>
        el('div', {}, content,
           el('div', {class: 'toolbar'}, button(yes[0], () => close(true), yes[1]),
              button(no[0], () => close(false), no[1])))));

// Lets the user choose a file or a folder of the opened folder. accepts(name) says which files may be chosen; with
// `folders`, the folder that is shown may be chosen, too. Resolves to its relative path, or undefined.
export const choose = (title, {accepts = () => true, folders = false, at = ''} = {}) => dialog(title, (close) => {
  const place = el('div', {class: 'chooser'});
  const open = (path) => guarded(async () => {
    const {folders: names, files, path: here} = await Ask.json('api/listing', {path});
    const below = (name) => (here ? here + '/' : '') + name;
    place.replaceChildren(
        el('p', {class: 'note'}, here || '(the folder that is open)',
           folders && button('Choose this folder', () => close(here), {'data-choose': here || '.'})),
        el('ul', {class: 'files'}, here !== '' && el('li', {}, button('.. up', () => open(folderOf(here)))),
           names.map((name) => el('li', {}, button(name + '/', () => open(below(name)), {'data-open': below(name)}))),
           files.filter((file) => accepts(file.name))
               .map(
                   (file) =>
                       el('li', {}, button(file.name, () => close(below(file.name)), {'data-choose': below(file.name)}),
                          el('small', {}, ' ' + size(file.bytes))))));
  });
  open(at);
  return place;
});

const size = (bytes) =>
    (bytes < 1e4     ? bytes + ' B' :
         bytes < 1e6 ? Math.round(bytes / 1e3) + ' kB' :
                       (bytes / 1e6).toFixed(1) + ' MB');

const GENERAL_KEYS = [
  ['Alt+↓ and Alt+↑', 'the next and the previous section'], ['Ctrl+s', 'save'], ['Alt+1 … Alt+9', 'a page'],
  ['?', 'this list'], ['Esc', 'close a dialog']
];

// Moves the focus to the next (1) or the previous (-1) section of the page.
function jump(by) {
  const sections = [...document.querySelectorAll('#page section')].filter((one) => one.checkVisibility());
  if (!sections.length) return;
  const inside = sections.findLastIndex((one) => one.contains(document.activeElement));
  const to =
      sections[(inside < 0 ? (by > 0 ? 0 : sections.length - 1) : inside + by + sections.length) % sections.length];
  if (!to.hasAttribute('tabindex')) to.setAttribute('tabindex', -1);
  to.focus({preventScroll: true});
  to.scrollIntoView({block: 'start'});
}

// Ctrl+s on a page without an action of its own for it: its button that saves, if it has one.
function save() {
  const button = document.querySelector('#page [data-do="save"]:not(:disabled)');
  if (button)
    button.click();
  else
    notice('There is nothing to save: each change is kept at once.');
}

function showKeys() {
  const keys = [...((current && current.keys) || []), ...GENERAL_KEYS];
  return dialog('Keys of this page', () => valueTable(keys.map(([key, does]) => [el('kbd', {}, key), does])));
}

function pressed(event) {
  const types = event.target.matches &&
      event.target.matches('input:not([type="range"],[type="checkbox"]), textarea, select, [contenteditable="true"]');
  if (document.getElementById('dialog').open) return;
  const name = (event.ctrlKey || event.metaKey ? 'Ctrl+' : '') + (event.altKey ? 'Alt+' : '') +
      (event.shiftKey && event.key.length > 1 ? 'Shift+' : '') + event.key;
  if (event.altKey && /^[1-9]$/.test(event.key)) {
    const link = document.querySelectorAll('#pages a')[Number(event.key) - 1];
    if (link) link.click();
    event.preventDefault();
    return;
  }
  if (event.target.matches && event.target.matches('input[type="range"]') && /^(Arrow|Page|Home|End)/.test(event.key))
    return;  // they move the slider
  const button = event.target.closest && event.target.closest('a, button, summary, [role="button"]');
  if (button && /^( |Enter)$/.test(event.key)) return;  // they press it
  if (types && !event.ctrlKey && !event.metaKey) return;
  if (types && !event.target.matches('select') && /^Ctrl\+[zyZ]$/.test(name)) return;  // the field's own undo
  if (name === '?') return void showKeys();
  if (event.altKey && /^Arrow(Up|Down)$/.test(event.key) && !event.target.matches('select')) {
    event.preventDefault();
    return void jump(event.key === 'ArrowDown' ? 1 : -1);
  }
  const found = ((current && current.keys) || []).find(([key, , action]) => action && key.split(' or ').includes(name));
  if (!found && name !== 'Ctrl+s') return;
  event.preventDefault();
  if (found)
    found[2](event);
  else
    save();
}

export function start() {
  startTheme();
  startTooltip();
  document.getElementById('keys').addEventListener('click', showKeys);
  document.addEventListener('keydown', pressed);
  document.getElementById('pages').append(
      ...[...pages]
          .filter(([, one]) => one.inBar !== false)
          .map(([name, one]) => el('a', {href: '#' + name, 'data-page': name}, one.title)));
  addEventListener('hashchange', show);
  show();
}
