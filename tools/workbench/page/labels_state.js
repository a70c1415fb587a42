// SPDX-License-Identifier: Apache-2.0
// The label map of the open case, and its slices. Events: 'labels' (another map, or a fault), 'slice' (a slice has
// arrived).
import {StateOfDraft} from './draft.js';
import * as Ask from './server.js';
import * as Shell from './shell.js';

const MOST_SLICES = 64;

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
