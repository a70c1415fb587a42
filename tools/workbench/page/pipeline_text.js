// SPDX-License-Identifier: Apache-2.0
// The text of a pipeline with line numbers. Lines with faults are marked, and the faults are listed below.
import {button, el} from '../../report/page/dom.js';

// saved(text) is called for Ctrl+S and the button. Returns {element, set(text, faults, faultsText), isChanged(),
// goTo(line)}.
export function make(saved) {
  let kept = '';
  const gutter = el('pre', {class: 'gutter', 'aria-hidden': 'true'});
  const box = el('textarea', {
    class: 'code',
    spellcheck: 'false',
    autocomplete: 'off',
    wrap: 'off',
    'aria-label': 'Text of the pipeline',
    'data-do': 'text'
  });
  const save = button('Save the text', () => saved(box.value), {'data-do': 'save'});
  const discard = button('Discard the edit', () => set(kept, faults, faultsText), {'data-do': 'discard'});
  const list = el('div', {class: 'faults', 'aria-live': 'polite'});
  let faults = [], faultsText = '';

  const scroll = () => (gutter.scrollTop = box.scrollTop);
  function number() {
    const count = box.value.split('\n').length, bad = new Map(faults.map((one) => [one.line, one.message]));
    gutter.replaceChildren(...Array.from(
        {length: count},
        (_, i) =>
            el('span', {class: bad.has(i + 1) && 'bad', title: bad.get(i + 1)},
               (bad.has(i + 1) ? '● ' : '') + (i + 1) + '\n')));
    scroll();
  }
  function mark() {
    const is = box.value !== kept;
    save.disabled = discard.disabled = !is;
    box.classList.toggle('changed', is);
  }
  box.addEventListener('scroll', scroll);
  box.addEventListener('input', () => {
    number();
    mark();
  });

  function goTo(line) {
    const before = box.value.split('\n').slice(0, line - 1).join('\n').length + (line > 1 ? 1 : 0);
    const end = box.value.indexOf('\n', before);
    box.focus({preventScroll: true});
    box.setSelectionRange(before, end < 0 ? box.value.length : end);
    const height = parseFloat(getComputedStyle(box).lineHeight) || 18;
    box.scrollTop = Math.max(0, (line - 1) * height - box.clientHeight / 3);
    box.scrollLeft = 0;
  }

  function set(text, given, words) {
    const at = [box.scrollTop, box.selectionStart, box.selectionEnd];
    kept = text.replaceAll('\r\n', '\n');  // as a textarea holds it
    [faults, faultsText] = [given, words];
    if (box.value !== kept) {
      box.value = kept;
      box.setSelectionRange(at[1], at[2]);
    }
    box.scrollTop = at[0];
    number();
    mark();
    list.replaceChildren(
        ...(faults.length ?
                [
                  el('p', {class: 'fault'}, faults.length + (faults.length === 1 ? ' fault' : ' faults')),
                  el('ul', {class: 'files'},
                     faults.slice(0, 50).map(
                         (one) =>
                             el('li', {},
                                button(
                                    (one.line ? 'line ' + one.line + ': ' : '') + one.message,
                                    () => one.line && goTo(one.line), {class: 'link', 'data-fault': one.line}),
                                one.hint && el('small', {class: 'option'}, one.hint)))),
                  el('details', {}, el('summary', {}, 'As the command line says it'),
                     el('pre', {class: 'reason', tabindex: 0}, faultsText))
                ] :
                []));
  }

  const element =
      el('div', {class: 'text-of-pipeline'}, el('div', {class: 'code-box'}, gutter, box),
         el('div', {class: 'toolbar'}, save, discard), list);
  return {element, set, goTo, isChanged: () => box.value !== kept, text: () => box.value};
}
