// SPDX-License-Identifier: Apache-2.0
// A sequence on the page "Place": the frame that is shown, the keyframes of the bones, and their tracking. All of it is
// kept in the draft as `sequence`: {views: {VIEW: {images, pattern}}, frame_rate_hz, keyframes: {BONE: {FRAME: {pose,
// used}}}, tracked: the folder with the tracked poses}. PlaceBetween says what `used` means.
import * as PlaceBetween from './place_between.js';
import {PlaceFrames} from './place_frames.js';
import {PlaceTimeline} from './place_timeline.js';
import * as Ask from './server.js';
import * as Shell from './shell.js';

export class PlaceSequence {
  constructor(page) {
    Object.assign(this, {page, frame: 1, wanted: 1, frames: 0, tracked: {}, arriving: Promise.resolve(), opened: null});
    this.timeline = new PlaceTimeline(this);
  }

  get kept() {
    return this.page.draft.document.sequence || null;
  }
  get isOn() {
    return Boolean(this.kept && this.images);
  }
  keyframes(bone) {
    return ((this.kept && this.kept.keyframes) || {})[bone] || {};
  }
  // [[frame, names of the bones with a keyframe there]], sorted
  allKeyframes() {
    const found = new Map();
    for (const {name} of this.page.about.bones)
      for (const frame of Object.keys(this.keyframes(name)))
        found.set(Number(frame), [...(found.get(Number(frame)) || []), name]);
    return [...found].sort((a, b) => a[0] - b[0]);
  }

  // Called after each change of the draft, also by undo and redo. Resolves when everything is loaded.
  update(isKeeping) {
    return this.updated = this.refresh(isKeeping);
  }

  async refresh(isKeeping) {
    const kept = this.kept, sources = kept && JSON.stringify(kept.views);
    const folder = (kept && kept.tracked) || null;
    if (folder !== this.trackedFolder) await this.loadTracked(folder);
    if (sources !== this.opened) await this.reopen(kept, sources);
    this.timeline.update();
    const changed = this.changedFrames();
    if (!isKeeping && changed.length && !changed.includes(this.wanted)) await this.go(changed[0]);
  }

  // The frames whose keyframes changed since the last call, so that the page shows what "undo" changed.
  changedFrames() {
    const now = new Map();
    for (const {name} of this.page.about.bones)
      for (const [frame, {pose}] of Object.entries(this.keyframes(name)))
        now.set(Number(frame), (now.get(Number(frame)) || '') + name + JSON.stringify(pose));
    const before = this.seen || now;
    this.seen = now;
    const all = [...new Set([...before.keys(), ...now.keys()])].sort((a, b) => a - b);
    return all.filter((frame) => before.get(frame) !== now.get(frame) && frame <= this.frames);
  }

  async reopen(kept, sources) {
    this.opened = sources;
    if (this.images) this.images.stop();
    this.images = null;
    if (!kept) return this.page.sequenceChanged();
    await Shell.guarded(async () => {
      const {path, views} = this.page;
      const {job} = await Ask.post('api/place/sequence', {case: path, views: kept.views});
      const {frames} = await Shell.follow('Opening the sequence', job);
      if (!this.page.isOpen || this.opened !== sources) return;
      Object.assign(this, {frames, images: new PlaceFrames(path, views, kept.views, frames)});
      this.frame = this.wanted = Math.min(this.frame, frames);
    });
    if (!this.page.isOpen) return;
    this.page.sequenceChanged();
    if (this.images) {
      this.timeline.update();
      await this.arriving;  // a frame of the previous sequence
      await this.go(this.frame);
    }
  }

  async loadTracked(folder) {
    this.trackedFolder = folder;
    Object.assign(this, {tracked: {}, verdicts: null});
    if (!folder) return;
    await Shell.guarded(async () => {
      const poses = await Ask.json('api/place/tracked', {case: this.page.path, folder});
      if (this.trackedFolder === folder) this.tracked = poses;
    });
  }

  // {pose, is} of a bone in a frame.
  at(bone, frame) {
    const found = PlaceBetween.at(frame, this.frames, bone, this.keyframes(bone.name), this.tracked[bone.name]);
    return found || {pose: this.page.startOf(bone), is: 'the start'};
  }
  poses(frame = this.frame) {
    return Object.fromEntries(this.page.about.bones.map((bone) => [bone.name, this.at(bone, frame).pose]));
  }

  // Shows a frame: the slider moves at once; images and bones follow together when they have arrived.
  go(frame) {
    if (!this.isOn) return this.arriving;
    this.wanted = Math.max(1, Math.min(this.frames, frame));
    this.timeline.moved();
    if (!this.isArriving) this.arriving = this.arrive();
    return this.arriving;
  }

  // Requests one frame at a time, and next the newest wanted one.
  async arrive() {
    const {page, images} = this;
    this.isArriving = true;
    try {
      if (page.keyMoves) await page.keep('move');
      for (let frame = null; frame !== this.wanted;) {
        frame = this.wanted;
        const shown = await images.get(frame);
        if (images !== this.images || !page.isOpen) return;
        if (frame === this.wanted) this.present(frame, shown);
      }
      images.ahead(this.frame);
    } catch (error) {
      this.wanted = this.frame;
      page.failed(error);
    } finally {
      this.isArriving = false;
      if (this.isOn && page.isOpen) this.timeline.moved();
    }
  }

  present(frame, images) {
    const {page} = this;
    this.frame = frame;
    for (const view of page.views) view.showImage(images[view.name]);
    page.show(this.poses());
  }

  step(by) {
    return this.go(this.wanted + by);
  }
  stepKeyframe(direction) {
    const all = this.allKeyframes().map(([frame]) => frame);
    const next =
        direction > 0 ? all.find((frame) => frame > this.wanted) : all.findLast((frame) => frame < this.wanted);
    return next ? this.go(next) : Promise.resolve();
  }

  // The present poses of the bones that are moved become keyframes of the frame that is shown.
  put(document, frame, poses) {
    const {sequence} = document;
    sequence.keyframes = sequence.keyframes || {};
    for (const {name} of this.page.bones())
      sequence.keyframes[name] = {...sequence.keyframes[name], [frame]: {pose: poses[name]}};
  }
  async set() {
    await this.arriving;
    if (this.isOn && this.page.bones().length) await this.page.keep('keyframe of');
  }
  async remove(frame = this.wanted, names = this.page.bones().map((bone) => bone.name)) {
    const there = names.filter((name) => this.keyframes(name)[frame]);
    if (!there.length) return;
    await this.page.draft.change(`remove the keyframe of ${there.join(' and ')} in frame ${frame}`, (document) => {
      for (const name of there) delete document.sequence.keyframes[name][frame];
    });
  }

  request() {
    const keyframes = Object.fromEntries(this.page.about.bones.map(
        ({name}) => [name, Object.fromEntries(Object.entries(this.keyframes(name)).map(([frame,
                                                                                         {pose}]) => [frame, pose]))]));
    // The poses in the first frame come from the keyframes alone, so that tracking again finds the same poses.
    const starts = Object.fromEntries(this.page.about.bones.map((bone) => {
      const found = PlaceBetween.at(1, this.frames, bone, this.keyframes(bone.name), null);
      return [bone.name, found ? found.pose : this.page.startOf(bone)];
    }));
    const {views, frame_rate_hz} = this.kept;
    return {case: this.page.path, views, frame_rate_hz, frames: this.frames, starts, keyframes};
  }

  // Follows the bones through all frames with the keyframes.
  async track() {
    await this.arriving;
    const {page} = this, asked = this.request(), frames = this.frames;
    const {job, command} = await Ask.post('api/place/track', asked);
    page.showCommand(command);
    // Nodes are called for each frame; their events begin with the frame's number.
    const share = ({node, item}) => ((node || '').includes('/') ? parseInt(item, 10) / frames : undefined);
    const {tracked, poses, verdicts} = await Shell.follow('Tracking', job, share);
    if (!page.isOpen || !this.isOn) return;
    Object.assign(this, {tracked: poses, trackedFolder: tracked, verdicts});
    await page.draft.change('track ' + Object.keys(poses).join(' and '), ({sequence}) => {
      sequence.tracked = tracked;
      for (const [bone, used] of Object.entries(asked.keyframes))
        for (const [frame, pose] of Object.entries(used)) {
          const now = ((sequence.keyframes || {})[bone] || {})[frame];
          if (now && JSON.stringify(now.pose) === JSON.stringify(pose)) now.used = true;
        }
    });
    this.say(poses);
  }

  say(poses) {
    for (const [bone, all] of Object.entries(poses)) {
      const lost = all.flatMap((pose, i) => (pose ? [] : [i + 1]));
      Shell.notice(
          lost.length ?
              `${bone} is lost in ${lost.length} of ${all.length} frames, first in ${lost[0]}: place it there, and ` +
                  'track again' :
              `${bone} was found in all ${all.length} frames`);
    }
  }

  async save() {
    await this.arriving;
    await Shell.guarded(async () => {
      const {folder} = await Ask.post('api/place/keyframes', this.request());
      const {tracked} = this.kept;
      Shell.notice(
          `The keyframes are in ${folder}, a .tra file for each bone` +
          (tracked ? `; the tracked poses are in ${tracked}` : '') + '.');
    });
  }

  leave() {
    if (this.images) this.images.stop();
  }
}
