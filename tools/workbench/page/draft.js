// SPDX-License-Identifier: Apache-2.0
// A case that is being made, as the server keeps it. drafts.hpp says what its document holds. Events: 'change'.
import * as Ask from './server.js';
import * as Shell from './shell.js';
import * as SliceGeometry from './slice_geometry.js';

export class CaseDraft extends EventTarget {
  states = new Map();  // of its files, by their class

  static async open(path) {
    const draft = new CaseDraft();
    draft.take(await Ask.json('api/draft', {case: path}));
    return draft;
  }

  take(state) {
    Object.assign(this, {
      path: state.case,
      revision: state.revision,
      document: state.document,
      state_undo: state.undo,  // what would be undone, or null
      state_redo: state.redo,
      is_saved: state.is_saved
    });
    this.dispatchEvent(new Event('change'));
  }

  // Changes a copy of the document and sends it to the server, one change after the other. "Undo" shows `what`, such as
  // "move landmark tip". Resolves to whether the server kept the change; if not, the page says why.
  change(what, mutate) {
    return this.after(() => {
      const document = structuredClone(this.document);
      mutate(document);
      return Ask.post('api/draft/change', {case: this.path, revision: this.revision, what, document});
    });
  }
  // way: 'undo' or 'redo'
  step(way) {
    return this.after(() => Ask.post('api/draft/' + way, {case: this.path, revision: this.revision}));
  }

  // Sends a request with the newest revision, and takes over the state in the answer.
  after(action) {
    const turn = (this.last || Promise.resolve()).then(async () => {
      try {
        this.take(await action());
        return true;
      } catch (error) {
        Shell.notice(error.message, 'fault');
        if (error.status === 409) this.take(await Ask.json('api/draft', {case: this.path}));
        return false;
      }
    });
    this.last = turn.catch(() => {});
    return turn;
  }
}

// What the panels of a draft share about one of its files, and that is read by a job of the server.
class StateOfDraft extends EventTarget {
  static of(draft) {
    if (!draft.states.has(this)) draft.states.set(this, new this(draft));
    return draft.states.get(this);
  }

  constructor(draft) {
    super();
    Object.assign(this, {draft, fault: '', command: '', isReading: false});
  }

  tell(name) {
    this.dispatchEvent(new Event(name));
  }

  // Resolves to {value, fault}: one of them is null or ''.
  async opened(title, path, body) {
    try {
      const {job, command} = await Ask.post(path, body);
      this.command = command;
      return {value: await Shell.follow(title, job), fault: ''};
    } catch (error) {
      return {value: null, fault: error.message};
    }
  }
}

const MOST_SLICES = 64;

// The CT of the open case, and what its panels share: the crosshair, the window, the tool of a click, and the drawings
// over the slices. Events: 'ct' (another CT, or a fault), 'slice' (the values of a slice have arrived), 'lost' (what
// stands for the CT is no longer in the server's memory), 'view' (anything else).
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

// The label map of the open case, and its slices. Events: 'labels' (another map, or a fault), 'slice' (one has
// arrived).
export class LabelsState extends StateOfDraft {
  constructor(draft) {
    super(draft);
    // `labels`: as about_labels() of the server describes it, or null; `read`: the file and whether there was a CT
    Object.assign(this, {labels: null, read: ''});
    this.forget();
  }

  forget() {
    this.slices = new Map();
    this.asked = new Set();
  }

  // Reads the label map that the document names, unless it is read already. If the case has no CT, the labels have a
  // `ct` that stands for it.
  async follow(isAgain) {
    const {labels: file, ct} = this.draft.document, wanted = file ? JSON.stringify([file, Boolean(ct)]) : '';
    if (wanted === this.read && !isAgain) return;
    Object.assign(this, {read: wanted, isReading: Boolean(file), fault: '', labels: file ? this.labels : null});
    this.forget();
    this.tell('labels');
    if (!file) return;
    const asked = {labels: file, has_ct: Boolean(ct)};
    const {value: labels, fault} = await this.opened('Reading the labels', 'api/labels/open', asked);
    if (this.read !== wanted) return;  // another one was chosen in the meantime
    Object.assign(this, {labels, fault, isReading: false});
    this.forget();
    this.tell('labels');
  }

  // The segments of the voxels in a slice of the CT: 0, or 1 + the index of the segment, in the order of the server's
  // slice_of(). Undefined until they have arrived.
  slice(ct, axis, index) {
    const key = [ct, axis, index].join(' ');
    if (this.labels && !this.isReading && !this.slices.has(key)) this.ask(key, {ct, axis, index});
    return this.slices.get(key);
  }

  async ask(key, slice) {
    if (this.asked.has(key) || this.asked.size >= 3) return;
    const {slices, asked} = this;
    asked.add(key);
    try {
      const {bytes} = await Ask.bytes('api/labels/slice', {labels: this.labels.name, ...slice});
      slices.set(key, new Uint16Array(bytes));
      if (slices.size > MOST_SLICES) slices.delete(slices.keys().next().value);
    } catch (error) {
      if (error.status === 409) {
        if (slices === this.slices && !this.isReading) this.follow(true);
      } else {
        slices.set(key, null);
        Shell.notice(error.message, 'fault');
      }
    }
    asked.delete(key);
    if (slices === this.slices) this.tell('slice');
  }

  // What the list and the fragments call a segment.
  static title({number, name}) {
    return name ? number + ' ' + name : 'label ' + number;
  }
  // The segment that a fragment's `label` means, or undefined.
  segmentOf(label) {
    const segments = this.labels ? this.labels.segments : [], is_number = /^\d+$/.test(String(label));
    return segments.find(
        (one) => one.label !== null && (is_number ? one.number === Number(label) : one.name === label));
  }
}
