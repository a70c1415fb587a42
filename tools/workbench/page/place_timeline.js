// SPDX-License-Identifier: Apache-2.0
// The controls of a sequence on the page "Place": the places of its frames, the slider with keyframes and tracked
// poses, and the list of keyframes.
import * as Dom from '../../report/page/dom.js';
import {el, svg} from '../../report/page/dom.js';

import * as Shell from './shell.js';

export class PlaceTimeline {
  constructor(sequence) {
    this.sequence = sequence;
    this.setup = el('section', {class: 'place-setup', 'aria-label': 'Where the frames are', hidden: true});
    this.slider = el('input', {
      type: 'range',
      min: 1,
      max: 1,
      step: 1,
      'aria-label': 'Frame',
      oninput: () => sequence.go(Number(this.slider.value))
    });
    this.text = el('p', {class: 'place-frame'});
    this.rows = el('div', {class: 'place-marks'});
    this.list = el('ol', {class: 'place-keyframes'});
    this.element = el('section', {class: 'place-sequence', 'aria-label': 'Sequence', hidden: true});
  }

  get page() {
    return this.sequence.page;
  }

  toggle(button) {
    this.setup.hidden = !this.setup.hidden;
    button.setAttribute('aria-expanded', String(!this.setup.hidden));
    if (this.setup.hidden) return;
    this.fillSetup();
    this.setup.querySelector('input').focus();
  }

  fillSetup() {
    const {page, sequence} = this, {kept} = sequence;
    const fields = page.views.map(({name}) => this.viewFields(name, ((kept || {}).views || {})[name] || {}));
    const rate =
        el('input', {type: 'number', min: 0.001, step: 'any', value: (kept || {}).frame_rate_hz || 30, name: 'rate'});
    const apply = async () => {
      const views = Object.fromEntries(fields.map((one) => [one.name, one.value()]));
      const frame_rate_hz = Number(rate.value);
      if (!(frame_rate_hz > 0)) return Shell.notice('The frame rate must be a number above 0', 'fault');
      const is_kept = await page.draft.change('the sequence', (document) => {
        const before = document.sequence || {};
        document.sequence = {keyframes: {}, ...before, views, frame_rate_hz};
        // Poses that were tracked in other images do not fit these images.
        const isAsBefore = ([name, {images, pattern}]) => {
          const one = (before.views || {})[name] || {};
          return one.images === images && one.pattern === pattern;
        };
        if (!Object.entries(views).every(isAsBefore)) delete document.sequence.tracked;
      });
      await sequence.updated;
      if (is_kept && sequence.isOn) this.close();
    };
    const remove = async () => {
      await page.draft.change('remove the sequence', (document) => delete document.sequence);
      this.close();
    };
    this.setup.replaceChildren(
        el('h2', {}, 'Sequence'),
        el('p', {class: 'note'},
           'For each view a folder with an image for each frame, or a file with several frames. All views show the ' +
               'same moments.'),
        ...fields.map((one) => one.element), Dom.labelled('frames a second', rate),
        el('div', {class: 'toolbar'}, Dom.button('Show the sequence', apply, {class: 'primary', 'data-do': 'sequence'}),
           kept && Dom.button('Remove the sequence', remove, {'data-do': 'remove-sequence'}),
           Dom.button('Close', () => this.close())));
  }

  close() {
    if (this.setup.hidden) return;
    this.page.bar.sequence.click();
    this.page.bar.sequence.focus();
  }

  viewFields(name, given) {
    const images = el('input', {type: 'text', value: given.images || '', 'data-images': name});
    const pattern = el('input', {type: 'text', value: given.pattern || '', 'data-pattern': name, placeholder: '*.png'});
    const choose = async () => {
      const path = await Shell.choose('Frames of ' + name, {folders: true});
      if (path !== undefined) images.value = path;
    };
    return {
      name,
      value: () => ({images: images.value.trim(), pattern: pattern.value.trim()}),
      element:
          el('fieldset', {}, el('legend', {}, name), Dom.labelled('folder or file', images),
             Dom.button('Choose', choose, {'aria-label': 'Choose the frames of ' + name}),
             Dom.labelled('pattern of the file names', pattern))
    };
  }

  // Shows everything again after a change of keyframes or tracked poses.
  update() {
    const {sequence, page} = this;
    this.element.hidden = !sequence.isOn;
    if (!sequence.isOn) return;
    this.slider.max = sequence.frames;
    this.rows.replaceChildren(...page.about.bones.map((bone) => this.row(bone)));
    const all = sequence.allKeyframes();
    this.list.replaceChildren(...all.map(
        ([frame, bones]) =>
            el('li', {},
               Dom.button(`Frame ${frame}: ${bones.join(', ')}`, () => sequence.go(frame), {'data-frame': frame}),
               Dom.button(
                   'Remove', () => sequence.remove(frame, bones),
                   {'aria-label': `Remove the keyframe in frame ${frame}`, 'data-remove': frame}))));
    if (!all.length)
      this.list.replaceChildren(el('li', {class: 'note'}, 'None yet. A bone that is moved by hand makes one.'));
    if (!this.element.firstChild) this.fill();
    this.moved();
  }

  fill() {
    const {sequence} = this;
    const button = (text, label, action) => Dom.button(text, action, {'aria-label': label, title: label});
    this.element.append(
        el('div', {class: 'toolbar'}, button('◆◀', 'Previous keyframe', () => sequence.stepKeyframe(-1)),
           button('◀', 'Previous frame', () => sequence.step(-1)), button('▶', 'Next frame', () => sequence.step(1)),
           button('▶◆', 'Next keyframe', () => sequence.stepKeyframe(1)),
           Dom.button('Set keyframe', () => sequence.set(), {'data-do': 'set-keyframe'}),
           Dom.button('Remove keyframe', () => sequence.remove(), {'data-do': 'remove-keyframe'}),
           Dom.button('Save as .tra', () => sequence.save(), {'data-do': 'save-tra'})),
        el('div', {class: 'place-slider'}, this.slider, this.rows), this.text,
        el('p', {class: 'note place-legend'}, '◆ keyframe ', el('span', {class: 'tracked', 'aria-hidden': 'true'}),
           ' tracked ', el('span', {class: 'lost', 'aria-hidden': 'true'}), ' lost'));
  }

  // The keyframes and tracked frames of a bone, under the slider. Consecutive frames are one mark.
  row(bone) {
    const {sequence, page} = this, {frames} = sequence, tracked = sequence.tracked[bone.name];
    const at = (frame) => (frames > 1 ? 100 * (frame - 1) / (frames - 1) : 50), half = 50 / Math.max(1, frames - 1);
    const marks = [];
    if (tracked)
      for (let begin = 0; begin < frames;) {
        let end = begin;
        while (end + 1 < frames && Boolean(tracked[end + 1]) === Boolean(tracked[begin])) ++end;
        const left = Math.max(0, at(begin + 1) - half), right = Math.min(100, at(end + 1) + half);
        marks.push(svg('rect', {
          class: tracked[begin] ? 'tracked' : 'lost',
          x: left + '%',
          y: tracked[begin] ? 5 : 3,
          width: right - left + '%',
          height: tracked[begin] ? 4 : 8
        }));
        begin = end + 1;
      }
    for (const frame of Object.keys(sequence.keyframes(bone.name)))
      marks.push(
          svg('svg', {x: at(Number(frame)) + '%', overflow: 'visible'},
              svg('path', {class: 'keyframe', d: 'M0 0 L6 7 L0 14 L-6 7 Z', 'data-keyframe': frame})));
    return el(
        'div', {'data-bone': bone.name}, page.about.bones.length > 1 && el('span', {class: 'note'}, bone.name),
        svg('svg', {height: 14, width: '100%', overflow: 'visible', 'aria-hidden': 'true'}, marks));
  }

  // Shows the frame, and the source of its poses.
  moved() {
    const {sequence, page} = this, frame = sequence.wanted;
    this.slider.value = frame;
    const poses = page.about.bones.map((bone) => {
      const judged = ((sequence.verdicts || {})[bone.name] || [])[frame - 1];
      const {is} = sequence.at(bone, frame);
      return bone.name + ': ' + is + (judged && is.startsWith('tracked') ? ', ' + judged : '');
    });
    const time_s = (frame - 1) / sequence.kept.frame_rate_hz;
    const waits = frame !== sequence.frame ? ' · loading' : '';
    this.text.textContent =
        `Frame ${frame} of ${sequence.frames} · ${time_s.toFixed(3)} s · ${poses.join(' · ')}${waits}`;
    this.slider.setAttribute('aria-valuetext', `${frame} of ${sequence.frames}, ${poses.join(', ')}`);
    for (const button of this.list.querySelectorAll('[data-frame]'))
      button.toggleAttribute('aria-current', Number(button.dataset.frame) === frame);
  }
}
