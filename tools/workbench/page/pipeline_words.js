// SPDX-License-Identifier: Apache-2.0
// What may stand at a place of a pipeline's text: names of nodes, of their options and ports, and values.

const KEYS_OF_FILE = ['marrow', 'name', 'help', 'extends', 'inputs', 'nodes', 'outputs', 'set'];
const KEYS_OF_NODE = ['uses', 'in', 'with', 'may_fail', 'set', 'repeat', 'over', 'carry', 'at_most', 'until'];

const indentOf = (line) => line.search(/\S|$/);
const isBlank = (line) => /^\s*(#|$)/.test(line);

// The lines of a block: from a line to the last one that is indented more.
export function blockFrom(lines, first) {
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
export function wordsAt(lines, line, column, catalogue) {
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
