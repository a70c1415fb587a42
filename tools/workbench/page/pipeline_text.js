// SPDX-License-Identifier: Apache-2.0
// The text of a pipeline in CodeMirror: coloured, with completion, each fault at its line, and the faults listed below.
import './editor_notices.js';
import 'codemirror/mode/yaml/yaml.js';
import 'codemirror/addon/lint/lint.js';
import 'codemirror/addon/hint/show-hint.js';
import 'codemirror/addon/edit/matchbrackets.js';

import CodeMirror from 'codemirror/lib/codemirror.js';

import {button, el} from '../../report/page/dom.js';

import * as Words from './pipeline_words.js';
import * as Ask from './server.js';

const CONTEXT_LINES = 3;  // shown above a line that is scrolled to

let catalogue = null;  // of the nodes; asked for once

// What CodeMirror shows for completion at the cursor.
async function hints(editor) {
  catalogue = catalogue || await Ask.json('api/pipeline/words');
  const {line, ch} = editor.getCursor(), lines = editor.getValue().split('\n');
  const typed = /[\w.$-]*$/.exec(lines[line].slice(0, ch))[0];
  const list =
      Words.wordsAt(lines, line, ch, catalogue)
          .filter((one) => one.text.startsWith(typed) && one.text !== typed)
          .map(
              ({text, about}) =>
                  ({text, render: (place) => place.append(text.trim(), el('small', {}, about ? '  ' + about : ''))}));
  return {list, from: CodeMirror.Pos(line, ch - typed.length), to: CodeMirror.Pos(line, ch)};
}

function faultList(faults, words, goTo) {
  if (!faults.length) return [];
  return [
    el('p', {class: 'fault'}, faults.length + (faults.length === 1 ? ' fault' : ' faults')),
    el('ul', {class: 'files'},
       faults.slice(0, 50).map(
           (one) =>
               el('li', {},
                  button(
                      (one.line ? 'line ' + one.line + ': ' : '') + one.message, () => one.line && goTo(one.line),
                      {class: 'link', 'data-fault': one.line}),
                  one.hint && el('small', {class: 'option'}, one.hint)))),
    el('details', {}, el('summary', {}, 'As the command line says it'),
       el('pre', {class: 'reason', tabindex: 0}, words))
  ];
}

export class PipelineText {
  // saved(text) is called for Ctrl+S and the button.
  constructor(saved) {
    Object.assign(this, {kept: '', faults: [], marked: []});
    this.save = button('Save the text', () => saved(this.text()), {'data-do': 'save'});
    this.discard = button('Discard the edit', () => this.put(this.kept), {'data-do': 'discard'});
    this.list = el('div', {class: 'faults', 'aria-live': 'polite'});
    const box = el('div', {class: 'code-box', 'data-do': 'text'});
    this.editor = CodeMirror(box, {
      mode: 'yaml',
      lineNumbers: true,
      inputStyle: 'contenteditable',  // screen readers and fingers reach the text itself
      matchBrackets: true,
      screenReaderLabel: 'Text of the pipeline',
      gutters: ['CodeMirror-lint-markers', 'CodeMirror-linenumbers'],
      lint: {getAnnotations: () => this.annotations(), lintOnChange: false},
      hintOptions: {hint: hints, completeSingle: false},
      // Tab leads on to the next control, as everywhere on the page.
      extraKeys: {Tab: false, 'Shift-Tab': false, 'Ctrl-Space': 'autocomplete'}
    });
    for (const bar of box.querySelectorAll('.CodeMirror-vscrollbar, .CodeMirror-hscrollbar'))
      bar.setAttribute('aria-hidden', 'true');  // they have no name, and keys scroll the text itself
    const field = this.editor.getInputField();
    field.setAttribute('role', 'textbox');
    field.setAttribute('aria-multiline', 'true');
    this.editor.on('change', () => this.mark());
    this.editor.on('inputRead', (_, {text}) => {
      if (/^[\w.]$/.test(text[0]) && /\buses:\s*[\w.]+$/.test(this.lineToCursor())) this.editor.showHint();
    });
    this.element =
        el('div', {class: 'text-of-pipeline'}, box,
           el('div', {class: 'toolbar'}, this.save, this.discard, el('small', {}, 'Ctrl+Space completes')), this.list);
    this.observer = new ResizeObserver(() => this.editor.refresh());
    this.observer.observe(box);
  }

  dispose() {
    this.observer.disconnect();
    this.editor.closeHint();
  }

  text() {
    return this.editor.getValue();
  }
  isChanged() {
    return this.text() !== this.kept;
  }
  lineToCursor() {
    const {line, ch} = this.editor.getCursor();
    return this.editor.getLine(line).slice(0, ch);
  }

  // The faults of the saved text; those of a text that is being edited are not known.
  annotations() {
    return this.faults.filter((one) => one.line).map((one) => {
      const line = one.line - 1, length = (this.editor.getLine(line) || '').length;
      return {
        message: one.message + (one.hint ? '\n' + one.hint : ''),
        severity: 'error',
        from: CodeMirror.Pos(line, Math.min(Math.max(0, one.column - 1), length)),
        to: CodeMirror.Pos(line, length)
      };
    });
  }

  mark() {
    const is = this.isChanged();
    this.save.disabled = this.discard.disabled = !is;
    this.editor.getWrapperElement().classList.toggle('changed', is);
  }

  // Replaces the text as an edit, with the cursor and the view where they were.
  put(text) {
    const at = this.editor.getCursor(), {left, top} = this.editor.getScrollInfo();
    this.editor.setValue(text);
    this.editor.setCursor(at, null, {scroll: false});
    this.editor.scrollTo(left, top);
    this.mark();
  }

  // Takes over the saved text and its faults.
  set(text, faults, words) {
    this.kept = text.replaceAll('\r\n', '\n');  // as the editor gives it back
    this.faults = faults;
    if (this.isChanged()) {
      this.put(this.kept);
      this.editor.clearHistory();
    }
    this.mark();
    this.editor.performLint();
    this.list.replaceChildren(...faultList(faults, words, (line) => this.goTo(line)));
  }

  // Scrolls a line (from 1) to near the top.
  scrollTo(line) {
    const top = this.editor.charCoords({line: Math.max(0, line - 1 - CONTEXT_LINES), ch: 0}, 'local').top;
    this.editor.scrollTo(0, top);
  }

  // Chooses the text of a line, and gives it the focus.
  goTo(line) {
    this.editor.focus();
    this.editor.setSelection(
        {line: line - 1, ch: 0}, {line: line - 1, ch: (this.editor.getLine(line - 1) || '').length}, {scroll: false});
    this.scrollTo(line);
  }

  // Marks the text of the node that begins in a line, and scrolls there. Null: none is marked.
  showNode(line) {
    for (const one of this.marked) this.editor.removeLineClass(one, 'background', 'chosen-node');
    this.marked = [];
    if (!line) return;
    const {first, last} = Words.blockFrom(this.text().split('\n'), line - 1);
    for (let at = first; at <= last; ++at) this.marked.push(this.editor.addLineClass(at, 'background', 'chosen-node'));
    this.scrollTo(line);
  }
}
