// SPDX-License-Identifier: Apache-2.0
// A case on the page "Place": moves its bones, keeps their poses, and has them judged and registered.
import * as Dom from '../../report/page/dom.js';

import {CaseDraft} from './draft.js';
import * as Geometry from './geometry.js';
import {angleAbout, PlaceControls, roll, rollAngle, shiftInDepth, shiftInView, turnInView} from './place_controls.js';
import {PlaceSequence} from './place_sequence.js';
import {PlaceSteps} from './place_steps.js';
import {PlaceView} from './place_view.js';
import * as Ask from './server.js';
import * as Shell from './shell.js';

export class PlacedCase extends PlaceControls {
  constructor(path) {
    super();
    Object.assign(this, {
      path,
      isOpen: true,
      mode: 'blend',
      strength: 0.6,
      wipe: 0.5,
      step: 1,
      placed: {},
      keyMoves: null,
      costsBusy: false,
      costsWanted: false,
      timings: []
    });
    this.steps = new PlaceSteps(path, (step) => this.goTo(step));
    this.sequence = new PlaceSequence(this);
  }

  async open(place) {
    const {job} = await Ask.post('api/place/open', {case: this.path});
    const [about, draft] = await Promise.all([Shell.follow('Opening the case', job), CaseDraft.open(this.path)]);
    if (!this.isOpen) return;
    Object.assign(this, {about, draft, pipeline: (about.pipelines[0] || {}).file});
    this.moving = new Set(about.bones.map((bone) => bone.name));
    this.placed = this.kept() || Object.fromEntries(about.bones.map((bone) => [bone.name, bone.start]));
    this.views = await Promise.all(about.views.map((view) => PlaceView.make(view, this.forViews())));
    if (!this.isOpen) return;
    this.active = this.views[0];
    this.fill(place);
    if (!this.steps.restore(this.placed, about.bones.map((bone) => bone.name)))
      this.steps.add(
          this.kept() && !draft.is_saved ? 'begin: the draft' : 'begin: ' + about.bones[0].start_is, this.placed);
    this.steps.views = about.views.map((view) => view.name);
    draft.addEventListener('change', () => this.draftChanged());
    await this.draftChanged();
    if (!this.isOpen) return;
    await this.redraw();
    this.views[0].canvas.focus({preventScroll: true});
    this.askCosts(true);
    this.pause();
  }

  forViews() {
    return {
      casePath: this.path,
      style: () => this,
      poses: () => ({...this.placed}),
      drag: (drag) => this.drag(drag),
      dragEnded: (drag) => this.dragEnded(drag),
      wheel: (view, notches) =>
          this.byKeys(view, 'move in depth', ({middle}) => shiftInDepth(view.camera, middle, notches * this.step)),
      chosen: (view) => (this.active = view),
      painted: (view, since) => this.painted(view, since),
      failed: (error) => this.failed(error)
    };
  }

  // The poses in the draft, if it has one for each bone; in a sequence, those of the frame that is shown.
  kept() {
    if (this.sequence.isOn) return this.sequence.poses();
    const fragments = this.draft.document.fragments || {};
    const starts = this.about.bones.map((bone) => [bone.name, (fragments[bone.name] || {}).start]);
    return starts.every(([, start]) => start) ? Object.fromEntries(starts) : null;
  }

  startOf(bone) {
    return ((this.draft.document.fragments || {})[bone.name] || {}).start || bone.start;
  }

  bones() {
    return this.about.bones.filter((bone) => this.moving.has(bone.name));
  }

  // The moved bones; all bones if all are locked.
  watched() {
    return this.bones().length ? this.bones() : this.about.bones;
  }

  // The common middle of the moved bones, and the long axis of the first.
  hold(poses) {
    const bones = this.watched(), middles = bones.map((bone) => Geometry.moved(poses[bone.name], bone.middle_mm));
    const middle = Geometry.times(middles.reduce(Geometry.plus, [0, 0, 0]), 1 / bones.length);
    return {middle, axis: Geometry.turned(poses[bones[0].name], bones[0].long_axis)};
  }

  // Moves the bones that are not locked from these poses.
  move(from, motion, isMoving) {
    const changed =
        Object.fromEntries(this.bones().map((bone) => [bone.name, Geometry.multiply(motion, from[bone.name])]));
    Object.assign(this.placed, changed);
    for (const view of this.views) view.want(changed, isMoving);
    this.askCosts();
    this.stopVerdict();
  }

  drag(drag) {
    if (!this.bones().length) return;
    const {camera} = drag.view, {middle, axis} = this.hold(drag.poses), {from, to, kind} = drag;
    if (kind === 'turn') drag.turned += angleAbout(camera, middle, drag.previous, to);
    const motion = kind === 'shift' ? shiftInView(camera, middle, from, to) :
        kind === 'roll'             ? roll(axis, middle, rollAngle(camera, axis, middle, from, to)) :
                                      turnInView(camera, middle, drag.turned);
    drag.moved = true;
    this.move(drag.poses, motion, true);
  }

  dragEnded(drag) {
    if (!drag.moved) return;
    for (const view of this.views) view.want(this.placed, false);
    this.keep(drag.kind === 'shift' ? 'move' : drag.kind === 'roll' ? 'turn about the long axis of' : 'turn');
  }

  // A key, or a notch of the wheel. Further keys and notches within half a second belong to the same step.
  byKeys(view, what, motionOf) {
    if (!view || !this.bones().length) return;
    this.move(this.placed, motionOf({...this.hold(this.placed), camera: view.camera}), false);
    clearTimeout(this.keyMoves);
    this.keyMoves = setTimeout(() => this.keep(what), 500);
  }

  // Keeps the present poses of all bones as a step, because a case has the starts of all bones or none.
  async keep(what) {
    clearTimeout(this.keyMoves);
    this.keyMoves = null;
    await this.keepPoses(what + ' ' + this.bones().map((bone) => bone.name).join(' and '), {});
  }

  async keepPoses(what, more) {
    const poses = structuredClone(this.placed), {sequence} = this;
    const frame = sequence.isOn ? sequence.frame : null, text = frame ? `frame ${frame}: ${what}` : what;
    const step = this.steps.add(text, poses, {...more, frame});
    this.isKeeping = true;
    await this.draft.change(text, (document) => {
      if (frame) return sequence.put(document, frame, poses);
      document.fragments = document.fragments || {};
      for (const [bone, pose] of Object.entries(poses))
        document.fragments[bone] = {...(document.fragments[bone] || {}), start: pose};
    });
    this.isKeeping = false;
    this.askCosts(step);
    if (!more.verdicts) this.pause();
  }

  // way: 'undo' or 'redo'
  async change(way) {
    if (this.keyMoves) await this.keep('move');
    this.draft.step(way);
  }

  async goTo(step) {
    if (step.frame) await this.sequence.go(step.frame);
    this.show(step.poses);
    await this.keepPoses(
        'back to: ' + step.what.replace(/^(frame \d+: )?(back to: )*/, ''),
        {costs: step.costs, verdicts: step.verdicts, deviations: step.deviations});
  }

  show(poses) {
    Object.assign(this.placed, structuredClone(poses));
    for (const view of this.views) view.want(poses, false);
  }

  async draftChanged() {
    const {isKeeping} = this;
    this.updateBar();
    await this.sequence.update(isKeeping);
    if (isKeeping || !this.isOpen) return;
    const kept = this.kept() || (this.steps.steps[0] || {}).poses;
    if (!kept || JSON.stringify(kept) === JSON.stringify(this.placed)) return;
    this.show(kept);
    const step = this.steps.find(kept);
    this.steps.showVerdict(step && step.verdicts);
    this.askCosts();
    this.pause();
  }

  // A sequence was opened or left. Costs and verdicts exist only for the case's own images.
  sequenceChanged() {
    const {isOn} = this.sequence;
    this.pipelineField.hidden = isOn;
    for (const section of this.ofOneFrame) section.hidden = isOn;
    this.ofSequence.hidden = !isOn;
    this.updateBar();
    this.stopVerdict();
    if (isOn) return;
    for (const view of this.views) view.showImage(view.image);
    this.askCosts();
  }

  async redraw() {
    for (const view of this.views) {
      view.paint.layers.clear();
      view.want(this.placed, false);
    }
  }

  painted(view, since) {
    const took_ms = performance.now() - since;
    this.timings.push([view.name, took_ms]);
    if (this.timings.length > 5000) this.timings.splice(0, 2500);
    view.canvas.dataset.painted = Number(view.canvas.dataset.painted || 0) + 1;
  }

  failed(error) {
    if (!this.isOpen || error.name === 'AbortError') return;
    Shell.notice(error.message, 'fault');
  }

  // Asks for the costs of the present poses, with one request at a time. `step`: the step that gets them.
  async askCosts(step) {
    if (this.sequence.isOn) return;
    if (step) this.costsFor = step;
    this.costsWanted = true;
    if (this.costsBusy) return;
    this.costsBusy = true;
    try {
      while (this.costsWanted && this.isOpen) {
        this.costsWanted = false;
        const noted = this.costsFor === true ? this.steps.current : this.costsFor;
        this.costsFor = null;
        const poses = noted ? noted.poses : this.placed;
        const costs = await Ask.post('api/place/costs', {case: this.path, poses});
        if (noted) noted.costs = costs;
        this.steps.showCosts(costs, (this.bones()[0] || this.about.bones[0]).name);
        if (noted) this.steps.show();
        await new Promise((resolve) => setTimeout(resolve, 250));
      }
    } catch (error) {
      this.failed(error);
    } finally {
      this.costsBusy = false;
    }
  }

  // Asks for a verdict on the present pose when nothing has moved for a while.
  pause() {
    this.stopVerdict();
    if (!this.judges || this.sequence.isOn) return;
    const step = this.steps.current;
    this.verdictTimer = setTimeout(() => this.judge(step), 1500);
  }

  stopVerdict() {
    clearTimeout(this.verdictTimer);
    if (this.verdictJob) Ask.stop(this.verdictJob).catch(() => {});
    this.verdictJob = null;
    if (this.isOpen) this.steps.showVerdict(null);
  }

  async judge(step) {
    try {
      const {job, command} = await Ask.post('api/place/verdict', {case: this.path, poses: step.poses});
      this.verdictJob = job;
      this.steps.showVerdict(null, 'being judged …');
      const result = await Ask.follow(job);
      if (this.verdictJob !== job) return;
      this.verdictJob = null;
      step.verdicts = result.verdicts;
      this.steps.showVerdict(result.verdicts);
      this.steps.show();
      this.showCommand(command);
    } catch (error) {
      if (error.status !== 499) this.failed(error);
    }
  }

  showCommand(command) {
    this.commandPlace.replaceChildren(
        Dom.el('p', {class: 'note'}, 'The same on the command line, in the folder that is open:'),
        Dom.command(command));
  }

  // A registration from the present poses.
  async fromHere() {
    if (this.isRegistering) return;
    if (this.keyMoves) await this.keep('move');
    if (this.sequence.isOn) return this.track();
    this.stopVerdict();
    const name = this.about.pipelines.find((one) => one.file === this.pipeline).name;
    this.isRegistering = true;
    this.updateBar();
    await Shell.guarded(async () => {
      const {job, command} =
          await Ask.post('api/place/register', {case: this.path, pipeline: this.pipeline, poses: this.placed});
      this.showCommand(command);
      const result = await Shell.follow('Registration by ' + name, job);
      if (!this.isOpen) return;
      const found = Object.entries(result.poses).filter(([bone]) => this.moving.has(bone));
      this.show(Object.fromEntries(found.map(([bone, pose]) => [bone, pose.matrix])));
      const deviations = Object.fromEntries(found.map(([bone, pose]) => [bone, pose.deviations]));
      const verdicts = Object.keys(result.verdicts).length ? result.verdicts : undefined;
      await this.keepPoses(
          'register ' + found.map(([bone]) => bone).join(' and ') + ' by ' + name, {verdicts, deviations});
      if (verdicts) this.steps.showVerdict(verdicts);
      for (const [bone, pose] of found)
        for (const warning of pose.warnings) Shell.notice(bone + ': ' + warning);
    });
    this.isRegistering = false;
    if (this.isOpen) this.updateBar();
  }

  // Tracks the bones through a sequence.
  async track() {
    this.isRegistering = true;
    this.updateBar();
    await Shell.guarded(() => this.sequence.track());
    this.isRegistering = false;
    if (this.isOpen) this.updateBar();
  }

  leave() {
    if (this.keyMoves) this.keep('move');
    if (this.tiles) this.tiles.dispose();
    for (const view of this.views || []) view.dispose();
    this.sequence.leave();
    this.stopVerdict();
    this.isOpen = false;
  }
}
