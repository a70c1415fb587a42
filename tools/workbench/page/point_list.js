// SPDX-License-Identifier: Apache-2.0
// Points of a CT as a list that works with keys alone, and fields for their names.
import {button, el, form, labelled} from '../../report/page/dom.js';

import * as Shell from './shell.js';

// Colours that stand out on grey pictures, and that colour-blind readers can tell apart.
const COLOURS = ['#56b4e9', '#e69f00', '#2fd6a5', '#f08ac0', '#f0e442', '#ff8a4c', '#b9b0ff'];
export const colour = (i) => COLOURS[i % COLOURS.length];

const words = (point_mm) => point_mm.map((value) => value.toFixed(1)).join(', ');
export const rounded = (point_mm) => point_mm.map((value) => Math.round(1000 * value) / 1000);

// One point: buttons that go to it, move it to the crosshair and remove it. `what` names it for screen readers.
export const row = (state, what, point_mm, {moveTo, remove}, more) =>
    el('li', {class: 'point'},
       button(
           words(point_mm) + ' mm', () => state.goTo(point_mm),
           {class: 'link', 'aria-label': words(point_mm) + ' mm, go to ' + what}),
       button(
           'Move here', () => moveTo([...state.cursor_mm]),
           {'aria-label': 'Move here, to the crosshair: ' + what, title: 'to the crosshair'}),
       button('Remove', remove, {'aria-label': 'Remove ' + what}), more);

// A field for a name with a button. taken() lists the names that are in use.
export function nameField(label, text, taken, chosen) {
  const told = el('p', {class: 'fault', role: 'alert'});
  const box = el('input', {type: 'text', maxlength: 100, oninput: () => (told.textContent = '')});
  const take = () => {
    const name = box.value.trim();
    told.textContent = faultOf(name, taken());
    if (told.textContent) return;
    box.value = '';
    chosen(name);
  };
  const field = form({class: 'toolbar'}, take, labelled(label, box), el('button', {type: 'submit'}, text), told);
  field.box = box;
  return field;
}

function faultOf(name, taken) {
  if (!name) return 'Give a name.';
  if (taken.includes(name)) return 'The name "' + name + '" is taken; choose another one.';
  return '';
}

// Asks for another name. Resolves to it, or to undefined.
export const rename = (title, name, taken) => Shell.dialog(title, (close) => {
  const field = nameField('name', 'Rename', () => taken, close);
  field.box.value = name;
  return field;
});

// Returns a function that fills a list again if its content, what(), has changed. The focus stays.
export function renewed(list, what, rows) {
  const nameOf = (one) => one.dataset.tool || one.getAttribute('aria-label');
  let shown = '';
  return () => {
    const now = JSON.stringify(what());
    if (now === shown) return;
    shown = now;
    const focused = list.contains(document.activeElement) && nameOf(document.activeElement);
    list.replaceChildren(...rows());
    const again = focused && [...list.querySelectorAll('button, input, select')].find((one) => nameOf(one) === focused);
    if (again) again.focus({preventScroll: true});
  };
}

// A button that switches a tool on. Pressing it again switches the tool off.
export function toggle(state, key, text, tool) {
  const is_on = Boolean(state.tool && state.tool.key === key);
  return button(text, () => state.setTool(is_on ? null : tool), {'aria-pressed': String(is_on), 'data-tool': key});
}
