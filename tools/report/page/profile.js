// SPDX-License-Identifier: Apache-2.0
// Where the time of a run went: a flame graph with a row for each thread, how busy the threads were, and a table of the
// steps that took longest. A click on a bar shows its time alone.
import * as Dom from './dom.js';
import {button, el, number, percent, svg, withUnit} from './dom.js';
import * as Plots from './plots.js';

const HEIGHT = 16, GAP = 1, TITLE = 22, BUSY = 40;  // px
const LEAST = 0.7;                                  // px: narrower neighbours of a lane are drawn as one
const STEPS = 15;                                   // of the table

const seconds = (us) => withUnit(us / 1e6, 's');

// How deep each bar lies within the others of its row. The bars are in the order of their beginnings.
function lanesOf(bars) {
  const open = [], lanes = [];
  for (const bar of bars) {
    while (open.length && open[open.length - 1].end <= bar.begin + 1e-6) open.pop();
    (lanes[open.length] = lanes[open.length] || []).push(bar);
    open.push(bar);
  }
  return lanes;
}

// The bars by row and lane, each {begin, end, thread, name}.
function rowsOf(profile) {
  const rows = profile.rows.map((title) => ({title, bars: []}));
  for (const [row, name, begin, length, thread] of profile.bars)
    rows[row].bars.push({begin, end: begin + length, thread, name: profile.names[name]});
  return rows.map(({title, bars}) => ({title, lanes: lanesOf(bars)}))
      .sort((a, b) => a.title.localeCompare(b.title, 'en', {numeric: true}));
}

// What of a lane is visible: single bars, and {begin, end, count} in the place of many narrow ones.
function visible(lane, from, to, least) {
  const shown = [];
  for (const bar of lane) {
    if (bar.end <= from || bar.begin >= to) continue;
    const last = shown[shown.length - 1], is_narrow = bar.end - bar.begin < least;
    if (is_narrow && last && last.count && bar.begin - last.end < least) {
      last.end = bar.end;
      ++last.count;
    } else {
      shown.push(is_narrow ? {begin: bar.begin, end: bar.end, count: 1, first: bar} : bar);
    }
  }
  return shown.map((one) => (one.count === 1 ? one.first : one));
}

const KINDS = Object.freeze({cached: 'its result was kept', store: 'the store of results', pass: 'a pass of its body'});

function tipOf(bar) {
  if (bar.count) return bar.count + ' short calls\nwithin ' + seconds(bar.end - bar.begin);
  const kind = KINDS[bar.name.kind];
  return bar.name.title + '\n' + seconds(bar.end - bar.begin) + (kind ? ', ' + kind : '') +
      (bar.thread >= 0 ? '\nprocessor time of this thread ' + seconds(bar.thread) : '');
}

// Draws part of the run. `zoom` is called with the times of a bar that is clicked.
function draw(profile, rows, colours, [from, to], width, zoom) {
  const heights = rows.map((row) => TITLE + row.lanes.length * (HEIGHT + GAP));
  const height = BUSY + TITLE + heights.reduce((sum, one) => sum + one, 0) + 46;
  const {root, x} = Plots.frame({
    width,
    height,
    label: 'flame graph of the run',
    x: {domain: [from / 1e6, to / 1e6], title: 'time since the start (s)'}
  });
  const at = (us) => x(Math.min(Math.max(us, from), to) / 1e6), least = LEAST * (to - from) / width;
  let top = drawBusy(profile, root, at, from, to);
  rows.forEach((row, i) => {
    root.append(svg('text', {class: 'title', x: 8, y: top + 15}, row.title));
    row.lanes.forEach((lane, depth) => {
      for (const bar of visible(lane, from, to, least)) {
        const left = at(bar.begin), wide = Math.max(LEAST, at(bar.end) - left);
        const y = top + TITLE + depth * (HEIGHT + GAP);
        const fill = bar.count ? 'var(--strong-line)' : colours.get(bar.name.node);
        root.append(svg('rect', {
          class: 'span ' + (bar.count ? 'many' : bar.name.kind),
          x: left.toFixed(1),
          y,
          width: wide.toFixed(1),
          height: HEIGHT,
          fill,
          'data-tip': tipOf(bar),
          onclick: () => zoom([bar.begin, bar.end])
        }));
        if (!bar.count && wide > 40)
          root.append(
              svg('text', {class: 'span-name', x: left + 4, y: y + 12}, shortened(bar.name.title, (wide - 8) / 6.6)));
      }
    });
    top += heights[i];
  });
  return root;
}

const shortened = (text, letters) => (text.length <= letters ? text : text.slice(0, Math.max(1, letters - 1)) + '…');

// How many processors were busy, all threads together. Returns where the next row begins.
function drawBusy({busy, us}, root, at, from, to) {
  if (!busy.length) return 12;
  const all = busy.map(([begin, threads], i) => ({
                         begin,
                         end: i + 1 < busy.length ? busy[i + 1][0] : us,
                         value: Object.values(threads).reduce((sum, one) => sum + one, 0)
                       }));
  const most = Math.max(1, ...all.map((one) => one.value)), base = TITLE + BUSY;
  root.append(svg('text', {class: 'title', x: 8, y: 15}, 'processors busy (up to ' + number(most) + ')'));
  for (const one of all) {
    if (one.end <= from || one.begin >= to) continue;
    const tall = (BUSY - 4) * one.value / most, left = at(one.begin);
    root.append(svg('rect', {
      class: 'busy',
      x: left.toFixed(1),
      y: (base - tall).toFixed(1),
      width: Math.max(LEAST, at(one.end) - left).toFixed(1),
      height: tall.toFixed(1),
      'data-tip': number(one.value) + ' processors busy'
    }));
  }
  return base + 4;
}

const nameOf = ({node, what}) => (node && what ? node + ': ' + what : node || what);

function table(profile) {
  const steps = profile.sums.filter((one) => one.kind !== 'pass').sort((a, b) => b.own_us - a.own_us);
  const all = steps.reduce((sum, one) => sum + one.own_us, 0);
  const head = (title, tip) => [title, {class: 'number', 'data-tip': tip}];
  return Dom.table(
      {class: 'figures slowest'}, 'The steps that took longest' + (steps.length > STEPS ? ', of ' + steps.length : ''),
      [
        'Step', head('Calls'), head('Own time', 'Without what it called on the same thread.'),
        head('Share', 'Of the own time of all steps.'),
        head('Processor time', 'Of the thread that made the calls, without what it called.'),
        head('Busy', 'Processors busy meanwhile, whatever ran on them.')
      ],
      steps.slice(0, STEPS).map(
          (one) => Dom.row(
              nameOf(one) + (one.kind === 'cached' ? ' (kept result)' : ''),
              [
                String(one.calls), seconds(one.own_us), percent(one.own_us / all), seconds(one.own_thread_us),
                number(one.process_us / one.us)
              ],
              {class: 'number'})));
}

// The flame graph with its controls, and the table.
export function figure(profile) {
  const rows = rowsOf(profile), nodes = [...new Set(profile.names.map((name) => name.node))];
  const colours = new Map(nodes.map((node, i) => [node, Plots.colour(i)]));
  const whole = [0, profile.us];
  let shown = whole;
  const zoom = (times) => {
    shown = times;
    back.disabled = times === whole;
    place.redraw();
  };
  const back = button('Whole run', () => zoom(whole), {disabled: true});
  const place = Plots.responsive((width) => draw(profile, rows, colours, shown, width, zoom));
  const missing = profile.left_out > 0 &&
      el('p', {class: 'note'}, profile.left_out + ' short calls have no bar here; the table counts them.');
  return [el('div', {class: 'toolbar'}, back), place, missing, table(profile)];
}
