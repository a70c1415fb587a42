// SPDX-License-Identifier: Apache-2.0
// Elements, controls and numbers. Text from the data reaches the page only as text nodes or attributes, never as
// markup.

const SVG = 'http://www.w3.org/2000/svg';  // names the XML namespace, nothing is fetched

function fill(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes || {})) {
    if (value === null || value === undefined || value === false) continue;
    if (typeof value === 'function')
      node.addEventListener(name.slice(2), value);
    else if (name === 'style')
      node.style.cssText = value;  // as an attribute, the policy of a page may forbid it
    else
      node.setAttribute(name, value === true ? '' : value);
  }
  node.append(...children.flat(2).filter((child) => child !== null && child !== undefined && child !== false));
  return node;
}

export const el = (tag, attributes, ...children) => fill(document.createElement(tag), attributes, children);
export const svg = (tag, attributes, ...children) => fill(document.createElementNS(SVG, tag), attributes, children);

// A number with about three figures, the same number of decimals within a decade.
export function number(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (size !== 0 && (size < 0.0005 || size >= 1e7)) return value.toExponential(1).replace('-', '−');
  const decimals = size >= 100 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : 3;
  const text = value.toFixed(decimals).replace('-', '−');
  return size >= 10000 ? text.replace(/\B(?=(\d{3})+$)/g, '\u202f') : text;
}

// A share in percent; one that is neither 0 nor 1 is never shown as 0 % or 100 %.
export function percent(share, decimals) {
  if (!Number.isFinite(share)) return '–';
  const is_between = share > 0 && share < 1, text = (digits) => (100 * share).toFixed(digits);
  const hides = (digits) => is_between && [0, 100].includes(Number(text(digits)));
  let digits = decimals || 0;
  while (hides(digits) && digits < 14) ++digits;
  return (hides(digits) ? (100 * share).toExponential(1) : text(digits)) + ' %';
}
export const probability = (p) => (!Number.isFinite(p) ? '–' : p < 0.0001 ? '< 0.0001' : p.toFixed(p < 0.01 ? 4 : 3));
export const withUnit = (value, unit) => number(value) + (unit && Number.isFinite(value) ? '\u00a0' + unit : '');

// A control below its label.
export const labelled = (label, control) => el('label', {class: 'field'}, el('span', {}, label), control);

// A drop-down with a label; options: [[value, text], ...] or [[group, [[value, text], ...]], ...].
export function select(label, options, chosen, changed) {
  const option = ([value, text]) => el('option', {value, selected: String(value) === String(chosen)}, text);
  const items = options.map(
      (item) => (Array.isArray(item[1]) ? el('optgroup', {label: item[0]}, item[1].map(option)) : option(item)));
  const box = el('select', {onchange: () => changed(box.value)}, items), field = labelled(label, box);
  field.box = box;
  return field;
}

// A row of buttons. One of them is pressed.
export function choice(label, options, chosen, changed) {
  const buttons = options.map(
      ([value, text]) =>
          el('button', {
            type: 'button',
            'data-value': value,
            'aria-pressed': String(value === chosen),
            onclick: () => {
              group.choose(value);
              changed(value);
            }
          },
             text));
  const group = el('span', {class: 'choice', role: 'group', 'aria-label': label}, buttons);
  group.choose = (value) =>
      buttons.forEach((button) => button.setAttribute('aria-pressed', String(button.dataset.value === value)));
  return el('span', {class: 'field'}, el('span', {}, label), group);
}

export function checkbox(label, checked, changed) {
  const box = el('input', {type: 'checkbox', checked, onchange: () => changed(box.checked)});
  return el('label', {class: 'field check'}, box, el('span', {}, label));
}

export function slider(label, value, changed) {
  const box =
      el('input',
         {type: 'range', min: 0, max: 100, value: Math.round(100 * value), oninput: () => changed(box.value / 100)});
  return labelled(label, box);
}

// A row of a table: its name and cells. `attributes` are those of each cell.
export const row = (name, cells, attributes) =>
    el('tr', {}, el('th', {scope: 'row'}, name), cells.map((cell) => el('td', attributes, cell)));

// A table of names and values.
export const valueTable = (entries) =>
    el('table', {class: 'values'}, el('tbody', {}, entries.map(([name, value]) => row(name, [value]))));

// A table in a box that scrolls. head: titles, as texts or [text, attributes]; it and the caption may be null.
export const table = (attributes, caption, head, rows) =>
    el('div', {class: 'scroll'},
       el('table', attributes, caption && el('caption', {}, caption),
          head && el('thead', {}, el('tr', {}, head.map((title) => {
                       const [text, more] = [title].flat();
                       return el('th', {scope: 'col', ...more}, text);
                     }))),
          el('tbody', {}, rows)));

export const button = (text, pressed, attributes) =>
    el('button', {type: 'button', onclick: pressed, ...attributes}, text);

// A form that calls submitted() instead of leaving the page.
export function form(attributes, submitted, ...children) {
  const onsubmit = (event) => {
    event.preventDefault();
    submitted();
  };
  return el('form', {...attributes, onsubmit}, ...children);
}

// A command for a shell, with a button that copies it. Opened from disk, a page may lack the clipboard's API.
export function command(text) {
  const code = el('code', {}, text);
  const copy = button('Copy', async () => {
    try {
      await navigator.clipboard.writeText(text);
      copy.textContent = 'Copied';
    } catch (error) {
      getSelection().selectAllChildren(code);
      copy.textContent = document.execCommand('copy') ? 'Copied' : 'Selected';
    }
    setTimeout(() => (copy.textContent = 'Copy'), 1500);
  });
  return el('div', {class: 'command'}, el('pre', {tabindex: 0}, code), copy);
}

// Calls moved(percent) with the place of a pointer that is dragged over an element, from its left to its right.
export function dragAcross(element, moved) {
  const follow = (event) => {
    if (!(event.buttons & 1)) return;
    const area = element.getBoundingClientRect();
    moved(Math.max(0, Math.min(100, 100 * (event.clientX - area.left) / area.width)));
  };
  element.addEventListener('pointerdown', (event) => {
    element.setPointerCapture(event.pointerId);
    follow(event);
  });
  element.addEventListener('pointermove', follow);
}

// Saves a text as a file in the browser's folder for downloads.
export function save(text, name, type) {
  const link = el('a', {href: URL.createObjectURL(new Blob([text], {type})), download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

// One word of a POSIX shell's command line; a path is never taken for an option.
export const shellWord = (text) =>
    (/^[\w@%+:,.\/-]+$/.test(text) ? text : '\'' + String(text).replaceAll('\'', '\'\\\'\'') + '\'');
export const shellPath = (path) => shellWord(path.startsWith('-') ? './' + path : path);

// A box that says more about the element under the pointer, if that has data-tip.
export function startTooltip() {
  const box = document.body.appendChild(el('div', {id: 'tooltip', role: 'tooltip', hidden: true}));
  const place = (x, y) => {
    box.style.left = Math.max(8, Math.min(x + 14, innerWidth - box.offsetWidth - 8)) + 'px';
    box.style.top = (y + 18 + box.offsetHeight > innerHeight ? y - box.offsetHeight - 10 : y + 18) + 'px';
  };
  const show = (target, x, y) => {
    const holder = target && target.closest && target.closest('[data-tip]');
    box.hidden = !holder;
    if (!holder) return;
    (holder.closest('dialog') || document.body).append(box);  // a dialog is above everything else
    box.textContent = holder.dataset.tip;
    place(x, y);
  };
  document.addEventListener('pointermove', (event) => show(event.target, event.clientX, event.clientY));
  document.addEventListener('pointerdown', () => (box.hidden = true));
  document.addEventListener('focusin', (event) => {
    const place = event.target.getBoundingClientRect();
    if (event.target.matches(':focus-visible')) show(event.target, place.left, place.bottom - 10);
  });
  document.addEventListener('scroll', () => (box.hidden = true), {passive: true});
}
