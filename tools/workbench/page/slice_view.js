// SPDX-License-Identifier: Apache-2.0
// One slice of the CT on a canvas, and everything that mouse, touch and keys do in it.
import {el} from '../../report/page/dom.js';

import * as Hint from './cursor_hint.js';
import * as Shell from './shell.js';
import * as SliceGeometry from './slice_geometry.js';
import * as SliceInput from './slice_input.js';
import * as SlicePicture from './slice_picture.js';

export class SliceView {
  constructor(name, state) {
    Object.assign(this, {name, state, slices: new Map(), wanted: null, isAsking: false, drag: null});
    this.canvas = el('canvas', {tabindex: 0, role: 'application', 'data-slice': name});
    this.hint = el('span', {class: 'cursor-hint', 'aria-hidden': 'true', hidden: true});
    this.slider = el('input', {type: 'range', min: 0, step: 1, 'aria-label': name + ' slice'});
    this.number = el('span', {class: 'note'});
    this.element =
        el('figure', {class: 'slice'}, el('div', {class: 'slice-box'}, this.canvas, this.hint),
           el('figcaption', {}, el('strong', {}, name[0].toUpperCase() + name.slice(1)), this.slider, this.number));
    this.slider.addEventListener('input', () => this.goToSlice(Number(this.slider.value)));
    this.picture = document.createElement('canvas');  // the slice, a pixel for each voxel
    this.placed = document.createElement('canvas');   // the same in its place on the screen; kept while only lines move
    this.observer = new ResizeObserver(() => this.resized());
    this.observer.observe(this.canvas);
    this.listen();
  }

  dispose() {
    this.observer.disconnect();
    cancelAnimationFrame(this.frame);
  }

  // Another CT, or none.
  reset() {
    this.slices.clear();
    this.filled = null;  // what the picture holds
    const {ct} = this.state;
    if (!ct) return;
    this.plane = SliceGeometry.planes(ct)[this.name];
    this.slider.max = ct.size[this.plane.across] - 1;
    this.canvas.setAttribute(
        'aria-label',
        this.name + ' slice. Arrow keys move the crosshair, Page Up and Page Down go through the slices.');
    this.view = null;
    this.resized();
  }

  resized() {
    const {clientWidth: width, clientHeight: height} = this.canvas, {ct} = this.state;
    if (!ct || !width || !height) return;
    this.view = this.view ? SliceGeometry.resized(ct, this.plane, this.view, width, height) :
                            SliceGeometry.whole(ct, this.plane, width, height);
    const density = devicePixelRatio || 1;
    this.canvas.width = Math.round(width * density);
    this.canvas.height = Math.round(height * density);
    this.show();
  }

  // Shows what the state says: draws what is loaded, and requests the rest.
  show() {
    const {ct} = this.state;
    if (!ct || !this.view) return;
    this.wanted = this.state.sliceAt(this.plane.across);
    this.slider.value = this.wanted;
    this.number.textContent = (this.wanted + 1) + ' / ' + ct.size[this.plane.across];
    this.ask();
    this.draw();
  }

  draw() {
    cancelAnimationFrame(this.frame);
    this.frame = requestAnimationFrame(() => SlicePicture.draw(this));
  }

  // One request runs at a time, and the newest slice comes next. Afterwards the neighbours are fetched.
  async ask() {
    if (this.isAsking) return;
    this.isAsking = true;
    try {
      for (let index; (index = this.missing()) !== null;) {
        const {name} = this.state.ct, values = await this.state.slice(this.plane.across, index);
        if (!values || !this.state.ct || this.state.ct.name !== name) break;
        this.slices.set(index, values);
        if (this.slices.size > 64) this.slices.delete(this.slices.keys().next().value);
        if (index === this.wanted) {
          this.draw();
          this.state.tell('slice');
        }
      }
    } catch (error) {
      if (error.status !== 0 || !this.isTold) Shell.notice(error.message, 'fault');
      this.isTold = true;
    }
    this.isAsking = false;
  }

  missing() {
    const {ct} = this.state;
    if (!ct) return null;
    for (const step of [0, 1, -1, 2, -2, 3, -3]) {
      const index = this.wanted + step;
      if (index >= 0 && index < ct.size[this.plane.across] && !this.slices.has(index)) return index;
    }
    return null;
  }

  goToSlice(slice) {
    const index = this.state.cursorIndex();
    index[this.plane.across] = slice;
    this.state.moveCursor(index);
  }

  // The index at a place on the canvas, and the value there (null outside).
  at(place) {
    const index = SliceGeometry.indexAt(this.state.ct, this.plane, this.view, place, this.wanted);
    const values = this.slices.get(this.wanted), {ct} = this.state;
    if (!values || !SliceGeometry.isInside(ct, index)) return {index, value_hu: null};
    const [low, high] = [0, 1, 2].filter((axis) => axis !== this.plane.across);
    return {index, value_hu: values[Math.round(index[high]) * ct.size[low] + Math.round(index[low])]};
  }

  placeOf(point_mm) {
    return SliceGeometry.place(this.state.ct, this.plane, this.view, SliceGeometry.index(this.state.ct, point_mm));
  }

  // How many voxels a point is away from this slice.
  distance(point_mm) {
    return Math.abs(SliceGeometry.index(this.state.ct, point_mm)[this.plane.across] - this.wanted);
  }

  // Says at the pointer what a click does there, and what is there.
  tell([x, y], value_hu) {
    const {tool} = this.state, mark = this.markAt([x, y]);
    const text = mark ? 'drag to move ' + mark.label : tool ? tool.says(value_hu) : '';
    Hint.show(this.hint, text, [x, y]);
  }

  markAt([x, y]) {
    const near = this.state.allMarks()
                     .filter((mark) => this.distance(mark.point_mm) <= 1.5)
                     .map((mark) => {
                       const [u, v] = this.placeOf(mark.point_mm);
                       return {mark, away: Math.hypot(u - x, v - y)};
                     })
                     .filter(({away}) => away < 9)
                     .sort((a, b) => a.away - b.away);
    return near.length ? near[0].mark : null;
  }

  zoom(factor, [x, y]) {
    const {ct} = this.state;
    const before = SliceGeometry.indexAt(ct, this.plane, this.view, [x, y], 0);
    const fit = SliceGeometry.whole(ct, this.plane, this.view.width, this.view.height).scale;
    this.view.scale = Math.max(0.5 * fit, Math.min(60 * fit, this.view.scale * factor));
    const after = SliceGeometry.indexAt(ct, this.plane, this.view, [x, y], 0);
    this.view.centre = this.view.centre.map((value, k) => value + before[k] - after[k]);
    this.draw();
  }

  pan(dx, dy) {
    const {ct} = this.state, middle = [this.view.width / 2 - dx, this.view.height / 2 - dy];
    const to = SliceGeometry.indexAt(ct, this.plane, this.view, middle, 0);
    to[this.plane.across] = this.view.centre[this.plane.across];
    this.view.centre = to;
    this.draw();
  }

  fit() {
    this.view = SliceGeometry.whole(this.state.ct, this.plane, this.view.width, this.view.height);
    this.draw();
  }

  listen() {
    SliceInput.listen(this);
  }
}
