// SPDX-License-Identifier: Apache-2.0
// The CT of the open case, and what its panels share: the crosshair, the window, the tool of a click, and the drawings
// over the slices. Events: 'ct' (another CT, or a fault), 'slice' (the values of a slice have arrived), 'lost' (what
// stands for the CT is no longer in the server's memory), 'view' (anything else).
import {StateOfDraft} from './draft.js';
import * as Ask from './server.js';
import * as SliceGeometry from './slice_geometry.js';

export class CtState extends StateOfDraft {
  constructor(draft) {
    super(draft);
    Object.assign(this, {
      ct: null,         // as about_ct() of the server describes it, or null
      stands_in: null,  // the same for a case without a CT: air on the grid of its labels
      read: 'null',     // the document's `ct` that was read
      cursor_mm: [0, 0, 0],
      window: {level: 400, width: 1800},
      // {key, hint, says(value_hu), place(point_mm)} or null: a click moves the crosshair. says(): for the pointer
      tool: null,
      marks: new Map(),    // name: () => [{key, point_mm, colour, label, moveTo(point_mm), remove()}]
      overlay: null,       // {slice(ct, axis, index) => {key, places, colours} or null}: mixed with the values
      pointed() {},        // gets what is under the pointer: {view, index, value_hu} or null
      contours: new Map()  // name: {lines(axis, slice, later) => [{colour, ends}]}; ends: i, j, k of both ends of each
                           // line; later() is called when there is more
    });
  }

  // Reads the CT that the document names, unless it is read already.
  async follow(isAgain) {
    const wanted = JSON.stringify(this.draft.document.ct);
    if (wanted === this.read && !isAgain) return;
    this.read = wanted;
    Object.assign(this, {isReading: wanted !== 'null', fault: ''});
    if (wanted === 'null') return this.show(this.stands_in);
    this.tell('ct');
    const {value: ct, fault} = await this.opened('Reading the CT', 'api/ct/open', {ct: JSON.parse(wanted)});
    if (this.read !== wanted) return;  // another CT was chosen in the meantime
    Object.assign(this, {fault, isReading: false});
    this.show(ct, isAgain);
  }

  // The crosshair goes to the middle of another CT.
  show(ct, isAgain) {
    const is_other = !isAgain && ct && !(this.ct && this.ct.name === ct.name);
    this.ct = ct;
    if (is_other) this.cursor_mm = SliceGeometry.point(ct, ct.size.map((n) => Math.floor(n / 2)));
    this.tell('ct');
  }
  // Shows this in place of a CT while the case has none. `ct` may be null.
  standIn(ct) {
    this.stands_in = ct || null;
    if (!this.draft.document.ct) this.show(this.stands_in);
  }

  // The values of a slice: int16 in HU, in the order of the server's slice_of().
  async slice(axis, index, signal) {
    const name = this.ct.name;
    try {
      return new Int16Array((await Ask.bytes('api/ct/slice', {ct: name, axis, index}, signal)).bytes);
    } catch (error) {
      if (error.status !== 409) throw error;
      if (this.ct && this.ct.name === name && !this.isReading) {
        if (!this.draft.document.ct) this.tell('lost');
        await this.follow(true);
      }
      return null;
    }
  }

  cursorIndex() {
    return SliceGeometry.index(this.ct, this.cursor_mm);
  }
  // The nearest voxel.
  indexOf(point_mm) {
    return SliceGeometry.index(this.ct, point_mm).map(Math.round);
  }
  sliceAt(axis) {
    return Math.max(0, Math.min(this.ct.size[axis] - 1, Math.round(this.cursorIndex()[axis])));
  }
  // The crosshair stays inside the CT.
  moveCursor(index) {
    const inside = index.map((value, k) => Math.max(0, Math.min(this.ct.size[k] - 1, value)));
    this.cursor_mm = SliceGeometry.point(this.ct, inside);
    this.tell('view');
  }
  goTo(point_mm) {
    if (this.ct) this.moveCursor(SliceGeometry.index(this.ct, point_mm));
  }
  setWindow(level, width) {
    this.window = {level: Math.round(level), width: Math.max(1, Math.round(width))};
    this.tell('view');
  }
  setTool(tool) {
    this.tool = tool;
    this.tell('view');
  }
  allMarks() {
    return [...this.marks.values()].flatMap((list) => list());
  }
}
