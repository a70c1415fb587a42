// SPDX-License-Identifier: Apache-2.0
// A sequence on the page "Place": the frame that is shown, the keyframes of the bones, and their tracking. All of it is
// kept in the draft as `sequence`: {views: {VIEW: {images, pattern}}, frame_rate_hz, keyframes: {BONE: {FRAME: {pose,
// used}}}, tracked: the folder with the tracked poses}. `used` is explained at at().
import {minus, moved, plus, times} from './geometry.js';
import {PlaceTimeline} from './place_timeline.js';
import * as Ask from './server.js';
import * as Shell from './shell.js';

// [x, y, z, w] of a motion's rotation, by its largest component.
function quaternion(m) {
  const squares = [
    1 + m[0][0] - m[1][1] - m[2][2], 1 - m[0][0] + m[1][1] - m[2][2], 1 - m[0][0] - m[1][1] + m[2][2],
    1 + m[0][0] + m[1][1] + m[2][2]
  ];
  const at = squares.indexOf(Math.max(...squares)), [x, y, z, w] = [
    [squares[0], m[1][0] + m[0][1], m[0][2] + m[2][0], m[2][1] - m[1][2]],
    [m[1][0] + m[0][1], squares[1], m[2][1] + m[1][2], m[0][2] - m[2][0]],
    [m[0][2] + m[2][0], m[2][1] + m[1][2], squares[2], m[1][0] - m[0][1]],
    [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1], squares[3]]
  ][at];
  const length = Math.hypot(x, y, z, w);
  return [x, y, z, w].map((value) => value / length);
}

function rotationOf([x, y, z, w]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]
  ];
}

// Slerp: the shorter way, at constant speed.
function slerp(a, b, share) {
  let cosine = a.reduce((sum, value, i) => sum + value * b[i], 0);
  const sign = cosine < 0 ? -1 : 1;
  cosine = Math.min(1, Math.abs(cosine));
  const angle = Math.acos(cosine), sine = Math.sin(angle);
  const [from, to] =
      sine < 1e-9 ? [1 - share, share] : [Math.sin((1 - share) * angle) / sine, Math.sin(share * angle) / sine];
  const mixed = a.map((value, i) => from * value + to * sign * b[i]), length = Math.hypot(...mixed);
  return mixed.map((value) => value / length);
}

// Interpolates the rotation by slerp, and the middle of the bone on a straight line. share 0: the first pose, 1: the
// second.
export function between(first, second, share, middle_mm) {
  const rotation = rotationOf(slerp(quaternion(first), quaternion(second), share));
  const begin = moved(first, middle_mm), end = moved(second, middle_mm);
  const middle = plus(begin, times(minus(end, begin), share));
  const shift = minus(middle, rotation.map((row) => row.reduce((sum, value, i) => sum + value * middle_mm[i], 0)));
  return [...rotation.map((row, i) => [...row, shift[i]]), [0, 0, 0, 1]];
}

// What is known in the frame itself: {pose, is}, or null.
function known(frame, keyframes, tracked) {
  const keyframe = keyframes[frame], found = (tracked || [])[frame - 1];
  if (keyframe && !(keyframe.used && found)) return {pose: keyframe.pose, is: 'keyframe'};
  if (found) return {pose: found, is: keyframe ? 'tracked from the keyframe' : 'tracked'};
  return null;
}

// The pose of a bone in a frame, from keyframes {FRAME: {pose, used}}, where `used` says that the tracking used the
// keyframe, and from `tracked`: the poses from frame 1 on, with null where the bone was lost. Returns {pose, is}; null
// if nothing is known in any frame.
function at(frame, frames, bone, keyframes, tracked) {
  const here = known(frame, keyframes, tracked);
  if (here) return here;
  let before = frame - 1, after = frame + 1, one = null, other = null;
  while (before >= 1 && !(one = known(before, keyframes, tracked))) --before;
  while (after <= frames && !(other = known(after, keyframes, tracked))) ++after;
  const lost = tracked ? 'lost; ' : '';
  if (one && other)
    return {
      pose: between(one.pose, other.pose, (frame - before) / (after - before), bone.middle_mm),
      is: lost + `between frames ${before} and ${after}`
    };
  if (one || other) return {pose: (one || other).pose, is: lost + `as in frame ${one ? before : after}`};
  return null;
}

// The images of a sequence's frames. They are read in blocks: the wanted one, then the next one ahead of time. The
// blocks that were used last stay in memory, up to a limit.
class PlaceFrames {
  // views: [{name, step_px}]; sources: {VIEW: {images, pattern}}
  constructor(casePath, views, sources, frames) {
    Object.assign(this, {casePath, views, sources, frames, blocks: new Map(), stopped: new AbortController()});
  }

  // The images of a frame, {VIEW: Uint16Array}.
  async get(frame) {
    const block = this.blockOf(frame), at = frame - 1 - block * PlaceFrames.BLOCK;
    const images = await this.load(block);
    return Object.fromEntries(
        Object.entries(images).map(([name, {bytes, size}]) => [name, new Uint16Array(bytes, at * size, size / 2)]));
  }

  blockOf(frame) {
    return Math.floor((frame - 1) / PlaceFrames.BLOCK);
  }

  // Reads the block behind the nearer end of the present one.
  ahead(frame) {
    const block = this.blockOf(frame), at = frame - 1 - block * PlaceFrames.BLOCK;
    const next = at >= PlaceFrames.BLOCK / 2 ? block + 1 : block - 1;
    if (next >= 0 && next * PlaceFrames.BLOCK < this.frames) this.load(next).catch(() => {});
  }

  // A block that failed is requested again the next time.
  load(block) {
    const held = this.blocks.get(block) || {};
    this.blocks.delete(block);
    this.blocks.set(block, held);  // the last one was used last
    if (!held.loading) {
      held.loading = this.read(block);
      held.loading.then((images) => {
        held.bytes = Object.values(images).reduce((sum, one) => sum + one.bytes.byteLength, 0);
        this.forget(block);
      }, () => this.blocks.delete(block));
    }
    return held.loading;
  }

  async read(block) {
    const first = block * PlaceFrames.BLOCK + 1, last = Math.min(this.frames, first + PlaceFrames.BLOCK - 1);
    const images = await Promise.all(this.views.map(async ({name, step_px}) => {
      const {bytes, about} = await Ask.bytes(
          'api/place/frames', {case: this.casePath, view: name, ...this.sources[name], first, last, step_px},
          this.stopped.signal);
      return [name, {bytes, size: about.bytes}];
    }));
    return Object.fromEntries(images);
  }

  // Forgets the blocks that were not used for the longest time. `block` stays.
  forget(block) {
    let bytes = [...this.blocks.values()].reduce((sum, one) => sum + (one.bytes || 0), 0);
    for (const [one, held] of [...this.blocks]) {
      if (bytes <= PlaceFrames.MOST_BYTES) return;
      if (one === block || !held.bytes) continue;
      this.blocks.delete(one);
      bytes -= held.bytes;
    }
  }

  stop() {
    this.stopped.abort();
    this.blocks.clear();
  }
}
PlaceFrames.BLOCK = 8;
PlaceFrames.MOST_BYTES = 200e6;

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
    const found = at(frame, this.frames, bone, this.keyframes(bone.name), this.tracked[bone.name]);
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
      const found = at(1, this.frames, bone, this.keyframes(bone.name), null);
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
