// SPDX-License-Identifier: Apache-2.0
// A table of any number of rows. Only visible rows are drawn, so that thousands are sorted and filtered at once. Screen
// readers are told how many rows there are, and which are visible. The arrow keys move from row to row.
import {button, el} from './dom.js';
import * as Glossary from './glossary.js';

const MORE = 4;  // further rows that are drawn above and below the visible ones, so that scrolling shows no gap

// The places of the items, sorted by key(item), a text or a number: ascending, or descending if `down`. Items with
// equal keys keep their order. Items without a key always come last.
export function order(items, key, down) {
  const keys = items.map(key), collator = new Intl.Collator(undefined, {numeric: true});
  const texts = [...new Set(keys.filter((one) => typeof one === 'string'))].sort(collator.compare);
  const ranks = new Map(texts.map((text, i) => [text, i]));
  const sizes = Float64Array.from(keys, (one) => {
    const size = typeof one === 'string' && one !== '' ? ranks.get(one) : one;
    return Number.isFinite(size) ? (down ? -size : size) : Infinity;
  });
  return Uint32Array.from(keys.keys()).sort((a, b) => sizes[a] - sizes[b] || a - b);
}

// The head of a column that sorts when it is pressed.
export const sortHead = (column, pressed, attributes) => el(
    'th',
    {scope: 'col', class: column.number ? 'number' : null, 'data-tip': Glossary.meaning(column.title), ...attributes},
    button(
        [column.title, column.unit && el('small', {}, ' ' + column.unit)].filter(Boolean), pressed, {class: 'sort'}));

// Tells by which of these heads the rows are sorted.
export const markSorted = (heads, sorted, down) => heads.forEach(
    (head, i) => head.setAttribute(
        'aria-sort',
        sorted !== i ? 'none' :
            down     ? 'descending' :
                       'ascending'));

// columns: [{title, unit, number (bool), width (in digits), cell(item)}]; the first cell of a row holds its button.
export class Table {
  constructor(label, columns, {attributes, sort, open}) {
    Object.assign(this, {columns, attributes, open, items: [], drawn: new Map(), current: 0});
    this.heads = columns.map((column, i) => sortHead(column, () => sort(i)));
    this.body = el('tbody', {
      onclick: (event) => this.click(event),
      onfocusin: (event) => this.makeCurrent(this.numberOf(event.target.closest('tr')))
    });
    this.table =
        el('table', {class: 'sortable cells'},
           el('colgroup', {}, columns.map((column) => el('col', {style: 'width: ' + (column.width + 2) + 'ch'}))),
           el('thead', {}, el('tr', {'aria-rowindex': 1}, this.heads)), this.body);
    this.table.style.width = columns.reduce((sum, column) => sum + column.width + 2, 0) + 'ch';
    this.space = el('div', {class: 'space'}, this.table);
    this.element =
        el('div', {
          class: 'scroll rows',
          tabindex: 0,
          role: 'region',
          'aria-label': label,
          onkeydown: (event) => this.key(event),
          onscroll: () => this.draw()
        },
           this.space);
    this.row_px = Math.round(2.25 * parseFloat(getComputedStyle(document.documentElement).fontSize));
    this.element.style.setProperty('--row', this.row_px + 'px');
    new ResizeObserver(() => this.draw()).observe(this.element);
  }

  // Draws these items from the first one on. `sorted`: the number of the sorted column.
  show(items, sorted, down) {
    this.items = items;
    this.current = 0;
    markSorted(this.heads, sorted, down);
    this.table.setAttribute('aria-rowcount', items.length + 1);
    this.drawn.clear();
    this.body.replaceChildren();
    this.element.scrollTop = 0;
    this.draw();
  }

  // The numbers of the rows that are seen: from the first to before the last.
  seen() {
    const top = this.element.scrollTop, height = this.element.clientHeight || 15 * this.row_px;
    return [Math.floor(top / this.row_px), Math.ceil((top + height) / this.row_px)];
  }

  draw() {
    const [first, last] = this.seen(), from = Math.max(0, Math.min(first, this.items.length) - MORE),
                  to = Math.min(this.items.length, last + MORE);
    // First the height of all rows: a box that is shorter for a moment would scroll back.
    this.space.style.height = this.heads[0].offsetHeight + this.items.length * this.row_px + 'px';
    this.space.style.paddingTop = from * this.row_px + 'px';
    for (const [i, row] of this.drawn) {
      if (i >= from && i < to) continue;
      if (row.contains(document.activeElement)) this.element.focus({preventScroll: true});
      row.remove();
      this.drawn.delete(i);
    }
    let next = null;
    for (let i = to - 1; i >= from; --i) {
      if (!this.drawn.has(i)) this.drawn.set(i, this.body.insertBefore(this.row(i), next));
      next = this.drawn.get(i);
    }
  }

  // The Tab key reaches only one button of all rows; the arrow keys go on from there.
  row(i) {
    const item = this.items[i];
    const row =
        el('tr', {'aria-rowindex': i + 2, ...this.attributes(item)},
           this.columns.map((column) => el('td', {class: column.number ? 'number' : null}, column.cell(item))));
    const button = row.querySelector('button');
    if (button) button.tabIndex = i === this.current ? 0 : -1;
    return row;
  }

  numberOf(row) {
    return Number(row.getAttribute('aria-rowindex')) - 2;
  }

  buttonOf(i) {
    return this.drawn.has(i) ? this.drawn.get(i).querySelector('button') : null;
  }

  makeCurrent(i) {
    const before = this.buttonOf(this.current), now = this.buttonOf(i);
    this.current = i;
    if (before) before.tabIndex = -1;
    if (now) now.tabIndex = 0;
  }

  click(event) {
    const row = event.target.closest('tr');
    if (row && !event.target.closest('button') && !String(getSelection())) this.open(this.items[this.numberOf(row)]);
  }

  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || !this.items.length) return;
    const [first, last] = this.seen(), page = Math.max(1, last - first - 2), inside = this.body.contains(event.target);
    const begin = this.current >= first && this.current < last ? this.current : first;  // where a row gets the focus
    const steps = {ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page}, last_row = this.items.length - 1;
    const wanted = event.key === 'Home' ? 0 :
        event.key === 'End'             ? last_row :
        event.key in steps              ? (inside ? this.current + steps[event.key] : begin) :
                                          undefined;
    if (wanted === undefined || event.target.closest('thead')) return;
    event.preventDefault();
    this.go(Math.max(0, Math.min(last_row, wanted)));
  }

  // Shows the row of this number below the heading, and gives its button the focus.
  go(i) {
    const head = this.heads[0].offsetHeight, top = i * this.row_px, box = this.element;
    if (top < box.scrollTop) box.scrollTop = top;
    const most = top + head + this.row_px - box.clientHeight;
    if (most > box.scrollTop) box.scrollTop = most;
    this.draw();
    this.makeCurrent(i);
    if (this.buttonOf(i)) this.buttonOf(i).focus({preventScroll: true});
  }
}
