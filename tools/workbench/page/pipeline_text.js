// SPDX-License-Identifier: Apache-2.0
// The text of a pipeline in CodeMirror: coloured, with completion, each fault at its line, and the faults listed below.
import 'codemirror/mode/yaml/yaml.js';
import 'codemirror/addon/lint/lint.js';
import 'codemirror/addon/hint/show-hint.js';
import 'codemirror/addon/edit/matchbrackets.js';

import CodeMirror from 'codemirror/lib/codemirror.js';

import {button, el} from '../../report/page/dom.js';

import * as Ask from './server.js';

// A page that holds the code of these libraries also holds their notices, as the licences ask. esbuild keeps such
// comments.
/*! In this page as well:

CodeMirror: Copyright (C) 2017 by Marijn Haverbeke and others, under the MIT licence
d3-dispatch, d3-drag, d3-ease, d3-timer, d3-transition, d3-zoom: Copyright 2010-2018 Mike Bostock, under the BSD licence

Both licences: https://opensource.org/license/mit, https://opensource.org/license/bsd-3-clause */

const KEYS_OF_FILE = ['marrow', 'name', 'help', 'extends', 'inputs', 'nodes', 'outputs', 'set'];
const KEYS_OF_NODE = ['uses', 'in', 'with', 'may_fail', 'set', 'repeat', 'over', 'carry', 'at_most', 'until'];

const indentOf = (line) => line.search(/\S|$/);
const isBlank = (line) => /^\s*(#|$)/.test(line);

// The lines of a block: from a line to the last one that is indented more.
function blockFrom(lines, first) {
  let last = first;
  for (let at = first + 1; at < lines.length; ++at) {
    if (isBlank(lines[at])) continue;
    if (indentOf(lines[at]) <= indentOf(lines[first])) break;
    last = at;
  }
  return {first, last};
}

// The node whose text holds a line: {name, first, last, uses}; null outside of nodes.
function nodeAt(lines, line) {
  const section = lines.findIndex((text) => /^nodes:/.test(text));
  if (section < 0 || line <= section) return null;
  const is_end = (text) => /^\S/.test(text) && !isBlank(text);
  if (lines.slice(section + 1, line + 1).some(is_end)) return null;
  const inner = lines.slice(section + 1).find((text) => !isBlank(text));
  if (!inner) return null;
  let first = line;
  while (first > section && (isBlank(lines[first]) || indentOf(lines[first]) !== indentOf(inner))) --first;
  const name = /^\s*([\w-]+):/.exec(lines[first]);
  if (!name || first === section) return null;
  const block = blockFrom(lines, first), last = Math.max(block.last, line);
  const uses = /\buses:\s*([\w.\/-]+)/.exec(lines.slice(first, last + 1).join('\n'));
  return {name: name[1], first, last, uses: uses ? uses[1] : ''};
}

const entry = (text, about) => ({text, about: about || ''});

// What fits before the cursor in `with` or `in` of a node.
function inSection(section, before, info, names) {
  const value = /(?:[{,]|^)\s*([\w-]+):\s*\[?\s*[\w.$-]*$/.exec(before.slice(before.lastIndexOf('\n') + 1).trimStart());
  const own = section === 'with' ? info.options : info.inputs;
  const one = value && own.find((item) => item.name === value[1]);
  if (!one) return own.map((item) => entry(item.name + ': ', item.help));
  if (section === 'in') return names.map((name) => entry(name));
  return (one.choices && one.choices.length ? one.choices :
              one.type === 'true/false'     ? ['true', 'false'] :
                                              [])
      .map((choice) => entry(choice));
}

// [{text, about}] for a place of the text. `catalogue`: as api/pipeline/words gives it.
function wordsAt(lines, line, column, catalogue) {
  const here = lines[line].slice(0, column), node = nodeAt(lines, line);
  if (/\buses:\s*[\w.]*$/.test(here)) return catalogue.map((one) => entry(one.name, one.summary));
  if (!node) return /^\w*$/.test(here) ? KEYS_OF_FILE.map((key) => entry(key + ': ')) : [];
  const before = [...lines.slice(node.first, line), here].join('\n');
  const section = Math.max(before.lastIndexOf('with:'), before.lastIndexOf(' in:'));
  const info = catalogue.find((one) => one.name === node.uses);
  const open = section < 0 ? '' : before.slice(section);
  const is_inside = section >= 0 && (open.includes('{') ? !open.includes('}') : open.includes('\n'));
  if (!is_inside || !info) return KEYS_OF_NODE.map((key) => entry(key + ': '));
  const names = lines.map((_, at) => nodeAt(lines, at)).filter((one) => one && one.name !== node.name);
  return inSection(
      before.startsWith('with:', section) ? 'with' : 'in', before, info, [...new Set(names.map((one) => one.name))]);
}

const CONTEXT_LINES = 3;  // shown above a line that is scrolled to

let catalogue = null;  // of the nodes; asked for once

// What CodeMirror shows for completion at the cursor.
async function hints(editor) {
  catalogue = catalogue || await Ask.json('api/pipeline/words');
  const {line, ch} = editor.getCursor(), lines = editor.getValue().split('\n');
  const typed = /[\w.$-]*$/.exec(lines[line].slice(0, ch))[0];
  const list =
      wordsAt(lines, line, ch, catalogue)
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
    const {first, last} = blockFrom(this.text().split('\n'), line - 1);
    for (let at = first; at <= last; ++at) this.marked.push(this.editor.addLineClass(at, 'background', 'chosen-node'));
    this.scrollTo(line);
  }
}
