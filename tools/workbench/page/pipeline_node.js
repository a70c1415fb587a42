// SPDX-License-Identifier: Apache-2.0
// The form of a node: its options, its wires, and the nodes that would fit in its place.
import {button, checkbox, el} from '../../report/page/dom.js';

import * as Ask from './server.js';
import * as Shell from './shell.js';

let count = 0;

// A field with a label, a control and a remark below it.
function field(label, control, remark, more) {
  const id = 'field-' + (++count);
  control.id = id;
  control.setAttribute('aria-describedby', id + '-about');
  return el(
      'div', {class: 'form-field'},
      el('label',
         {for: id
         },
         label),
      el('div', {class: 'control'}, control, more || ''), el('p', {class: 'note', id: id + '-about'}, remark));
}

// What holds where this file does not give the option: the value of the file that it extends, or the default.
const unwritten = (option) => option.written ? option.now + ', written in ' + option.written : option.default;

function control(option, written, changed) {
  const attributes = {'data-option': option.name};
  const choices = option.type === 'true/false' ? ['true', 'false'] : option.choices;
  const typed = written !== undefined && choices && !choices.includes(written);  // such as $input
  if (choices && !typed)
    return el(
        'select', {...attributes, onchange: (event) => changed(event.target.value || null)},
        el('option', {value: '', selected: written === undefined},
           option.written ? unwritten(option) : 'default (' + option.default + ')'),
        choices.map((value) => el('option', {value, selected: value === written}, value)));
  return el('input', {
    ...attributes,
    type: 'text',
    value: written === undefined ? '' : written,
    placeholder: option.required && !option.written ? 'required' : unwritten(option),
    onchange: (event) => changed(event.target.value === '' ? null : event.target.value)
  });
}

function optionField(option, written, edit) {
  const changed = (value) => edit({what: 'option', name: option.name, value});
  const given = written !== undefined;
  const about = [
    option.help, option.range,
    option.required    ? 'required' :
        given          ? 'default ' + option.default :
        option.written ? 'written in ' + option.written :
                         'at its default'
  ].filter(Boolean).join('; ');
  return field(
      option.name, control(option, written, changed), about,
      given && !option.required &&
          button(
              'Default', () => changed(null),
              {'data-default': option.name, 'aria-label': 'Reset ' + option.name + ' to its default'}));
}

// The possible sources of a port: outputs of other nodes with its type.
function sources(nodes, id, port) {
  const names = [];
  for (const [other, {info}] of Object.entries(nodes)) {
    if (other === id || !info) continue;
    const fitting = info.outputs.filter((output) => output.type === port.type);
    for (const output of fitting) names.push(info.outputs.length === 1 ? other : other + '.' + output.name);
  }
  return names;
}

function wireField(port, written, nodes, id, edit) {
  const list =
      el('datalist', {id: 'sources-' + (++count)}, sources(nodes, id, port).map((name) => el('option', {value: name})));
  const box = el('input', {
    type: 'text',
    list: list.id,
    value: written === undefined ? '' : written,
    placeholder: port.optional ? 'not wired' : 'required',
    'data-wire': port.name,
    onchange: (event) =>
        edit({what: 'wire', name: port.name, value: event.target.value === '' ? null : event.target.value})
  });
  const type = port.type + (port.axis ? ', a list over ' + port.axis : '');
  return field(port.name, box, [port.help, type].filter(Boolean).join('; '), list);
}

function fitting(file, node, edit) {
  const place = el('div', {class: 'fits'});
  const find = button(
      'Which nodes fit here?', () => Shell.guarded(async () => {
        place.replaceChildren(el('p', {class: 'note', role: 'status'}, 'Each node is tried in its place …'));
        const fits = await Ask.json('api/pipeline/fits', {file, node});
        const part = (title, verdict, lines) => {
          const some = fits.filter((one) => one.fits === verdict);
          if (!some.length) return null;
          return el(
              verdict === 'yes' ? 'div' : 'details', {}, el(verdict === 'yes' ? 'h4' : 'summary', {}, title),
              el('ul', {class: 'files'},
                 some.map(
                     (one) =>
                         el('li', {},
                            verdict === 'yes' ? button(
                                                    'Use ' + one.node, () => edit({what: 'uses', value: one.node}),
                                                    {'data-use': one.node}) :
                                                el('code', {}, one.node),
                            ' ', el('small', {}, one.summary),
                            lines && one[lines].map((line) => el('small', {class: 'option'}, line))))));
        };
        place.replaceChildren(
            ...[part('These fit', 'yes'), part('These fit when more is wired or given', 'with more', 'missing'),
                part('These do not fit', 'no', 'faults')]
                .filter(Boolean));
        if (!fits.length) place.append(el('p', {class: 'note'}, 'No other node fits here.'));
      }),
      {'data-do': 'fits'});
  return el('div', {}, el('p', {class: 'note'}, 'Another node starts with the defaults of its options.'), find, place);
}

// A node that this file does not write itself: what it is, where it is written, and how this file changes it.
function elsewhere(id, node, head) {
  const change = id.replaceAll('/', '.'), first = node.info && node.info.options[0];
  return el(
      'div', {}, head, el('p', {}, node.info ? node.info.summary : ''),
      el('p', {class: 'note'}, 'Written in ',
         el('a', {href: Shell.addressOf('pipeline', node.file), 'data-do': 'file'}, node.file), ', line ' + node.line,
         node.uses_written ? '; what it uses is written in ' + node.uses_written : '',
         '. To change it in this file only, write  set: {' + change + '.' + (first ? first.name : 'option') + ': …}'),
      node.info && node.info.options.length ?
          el('table', {},
             node.info.options.map(
                 (option) =>
                     el('tr', {}, el('td', {}, option.name), el('td', {}, option.now),
                        el('td', {class: 'note'}, option.written ? 'written in ' + option.written : '')))) :
          '');
}

// The form of node `id` in `state` (api/pipeline). edit(change) asks for a change of the file.
export function form(state, id, edit, goTo) {
  const node = state.nodes[id], own = (change) => edit({node: id, uses: node.uses, ...change});
  const head =
      el('p', {class: 'node-head'}, el('strong', {}, id), ' ', el('code', {}, node.uses || 'repeats ' + node.body), ' ',
         node.file ? '' : button('line ' + node.line, () => goTo(node.line), {class: 'link', 'data-do': 'line'}));
  if (node.file) return elsewhere(id, node, head);
  const info = node.info;
  if (!info) return el('div', {}, head, el('p', {class: 'note'}, 'The form is shown when the file has no faults.'));
  const inputs = info.inputs.map((port) => wireField(port, node.in[port.name], state.nodes, id, own));
  if (node.is_repeated)
    return el(
        'div', {}, head, el('p', {class: 'note'}, 'This node runs a body again and again. Change it in the text.'),
        el('h3', {}, 'Wires'), inputs);
  const given = info.options.filter((option) => option.name in node.with);
  const others = info.options.filter((option) => !(option.name in node.with));
  const fields = (options) => options.map((option) => optionField(option, node.with[option.name], own));
  return el(
      'div', {}, head, el('p', {}, info.summary), el('h3', {}, 'Options'),
      info.options.length ? '' : el('p', {class: 'note'}, 'It has no options.'), fields(given), fields(others),
      info.relations.length ? el('ul', {class: 'note relations'}, info.relations.map((text) => el('li', {}, text))) :
                              '',
      checkbox(
          'may fail without ending the run', node.may_fail,
          (value) => own({what: 'may_fail', value: value ? 'true' : null})),
      el('h3', {}, 'Wires'), inputs.length ? inputs : el('p', {class: 'note'}, 'It has no inputs.'),
      el('h3', {}, 'Another node in its place'), fitting(state.file, id, own));
}
