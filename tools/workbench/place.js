// SPDX-License-Identifier: Apache-2.0
// The page "Place": bones are placed by hand over the X-rays, and registered from there. Poses are kept as `start` of
// the case's draft.
'use strict';

const PlacePage = (() => {
  const {el} = Dom;
  const COLOURS = [[255, 138, 31], [64, 196, 255], [150, 230, 90], [255, 110, 200]];
  const MODES = [
    ['blend', 'Blend'], ['wipe', 'Wipe'], ['checkerboard', 'Checkerboard'], ['edges', 'Edges'], ['outline', 'Outline']
  ];
  let page = null;  // of the case that is shown; a new object for each

  const radians = (angle_deg) => angle_deg * Math.PI / 180;

  class Page {
    constructor(path) {
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
      this.steps = new PlaceSteps((step) => this.goTo(step));
    }

    async open(place) {
      const {job} = await Ask.post('api/place/open', {case: this.path});
      const [about, draft] =
          await Promise.all([Shell.follow('Opening the case', job), CaseDraft.open(this.path)]);
      if (!this.isOpen) return;
      Object.assign(this, {about, draft, pipeline: (about.pipelines[0] || {}).file});
      this.moving = new Set(about.bones.map((bone) => bone.name));
      this.placed = this.kept() || Object.fromEntries(about.bones.map((bone) => [bone.name, bone.start]));
      this.views = await Promise.all(about.views.map((view) => PlaceView.make(view, this.forViews())));
      if (!this.isOpen) return;
      this.active = this.views[0];
      this.fill(place);
      this.steps.add(this.kept() && !draft.is_saved ? 'begin: the draft' : 'begin: ' + about.bones[0].start_is, this.placed);
      draft.addEventListener('change', () => this.draftChanged());
      this.draftChanged();
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
        wheel: (view, notches) => this.byKeys(view, 'move in depth', ({middle}) => PlaceMotion.shiftInDepth(
            view.camera, middle, notches * this.step)),
        chosen: (view) => (this.active = view),
        painted: (view, since) => this.painted(view, since),
        failed: (error) => this.failed(error)
      };
    }

    get colours() {
      return Object.fromEntries(this.about.bones.map((bone, i) => [bone.name, COLOURS[i % COLOURS.length]]));
    }

    // The poses in the draft, if it has one for each bone.
    kept() {
      const fragments = this.draft.document.fragments || {};
      const starts = this.about.bones.map((bone) => [bone.name, (fragments[bone.name] || {}).start]);
      return starts.every(([, start]) => start) ? Object.fromEntries(starts) : null;
    }

    bones() {
      return this.about.bones.filter((bone) => this.moving.has(bone.name));
    }

    // The bones to look at when all are locked.
    watched() {
      return this.bones().length ? this.bones() : this.about.bones;
    }

    // Where the bones are that are moved: the middle of all, and the long axis of the first.
    hold(poses) {
      const bones = this.watched(), middles = bones.map((bone) => Geometry.moved(poses[bone.name], bone.middle_mm));
      const middle = Geometry.times(middles.reduce(Geometry.plus, [0, 0, 0]), 1 / bones.length);
      return {middle, axis: Geometry.turned(poses[bones[0].name], bones[0].long_axis)};
    }

    // Moves the bones that are not locked from these poses.
    move(from, motion, isMoving) {
      const changed = Object.fromEntries(this.bones().map((bone) => [bone.name, Geometry.multiply(motion, from[bone.name])]));
      Object.assign(this.placed, changed);
      for (const view of this.views) view.want(changed, isMoving);
      this.askCosts();
      this.stopVerdict();
    }

    drag(drag) {
      if (!this.bones().length) return;
      const {camera} = drag.view, {middle, axis} = this.hold(drag.poses), {from, to, kind} = drag;
      if (kind === 'turn') drag.turned += PlaceMotion.angleAbout(camera, middle, drag.previous, to);
      const motion = kind === 'shift' ? PlaceMotion.shiftInView(camera, middle, from, to) :
          kind === 'roll' ? PlaceMotion.roll(axis, middle, PlaceMotion.rollAngle(camera, axis, middle, from, to)) :
                            PlaceMotion.turnInView(camera, middle, drag.turned);
      drag.moved = true;
      this.move(drag.poses, motion, true);
    }

    dragEnded(drag) {
      if (!drag.moved) return;
      for (const view of this.views) view.want(this.placed, false);
      this.keep(drag.kind === 'shift' ? 'move' : drag.kind === 'roll' ? 'turn about the long axis of' : 'turn');
    }

    // A key or a notch of the wheel. What follows within a moment belongs to the same step.
    byKeys(view, what, motionOf) {
      if (!view || !this.bones().length) return;
      this.move(this.placed, motionOf({...this.hold(this.placed), camera: view.camera}), false);
      clearTimeout(this.keyMoves);
      this.keyMoves = setTimeout(() => this.keep(what), 500);
    }

    // Keeps the present poses as a step. Those of all bones are kept, because a case has all starts or none.
    async keep(what) {
      clearTimeout(this.keyMoves);
      this.keyMoves = null;
      await this.keepPoses(what + ' ' + this.bones().map((bone) => bone.name).join(' and '), {});
    }

    async keepPoses(text, more) {
      const poses = structuredClone(this.placed);
      const step = this.steps.add(text, poses, more);
      this.isKeeping = true;
      await this.draft.change(text, (document) => {
        document.fragments = document.fragments || {};
        for (const [bone, pose] of Object.entries(poses))
          document.fragments[bone] = {...(document.fragments[bone] || {}), start: pose};
      });
      this.isKeeping = false;
      this.askCosts(step);
      if (!more.verdicts) this.pause();
    }

    async goTo(step) {
      this.show(step.poses);
      await this.keepPoses('back to: ' + step.what.replace(/^(back to: )+/, ''), {
        costs: step.costs,
        verdicts: step.verdicts,
        deviations: step.deviations
      });
    }

    show(poses) {
      Object.assign(this.placed, structuredClone(poses));
      for (const view of this.views) view.want(poses, false);
    }

    async draftChanged() {
      this.updateBar();
      if (this.isKeeping) return;
      const kept = this.kept() || (this.steps.steps[0] || {}).poses;
      if (!kept || JSON.stringify(kept) === JSON.stringify(this.placed)) return;
      this.show(kept);
      const step = this.steps.find(kept);
      this.steps.showVerdict(step && step.verdicts);
      this.askCosts();
      this.pause();
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

    // A case that the server has forgotten is opened again.
    failed(error) {
      if (!this.isOpen || error.name === 'AbortError') return;
      Shell.notice(error.message, 'fault');
    }

    // Costs of the present poses, at most one request at a time. `step`: the step to note them at.
    async askCosts(step) {
      if (step) this.costsFor = step;
      this.costsWanted = true;
      if (this.costsBusy) return;
      this.costsBusy = true;
      try {
        while (this.costsWanted && this.isOpen) {
          this.costsWanted = false;
          const noted = this.costsFor === true ? this.steps.steps[0] : this.costsFor;
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

    // The present pose is judged when nothing has moved for a while.
    pause() {
      this.stopVerdict();
      if (!this.judges) return;
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
        this.steps.showVerdict(null, 'is being judged ...');
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
          el('p', {class: 'note'}, 'The same on the command line, in the folder that is open:'), Dom.command(command));
    }

    // A registration from the present poses.
    async fromHere() {
      if (this.isRegistering) return;
      if (this.keyMoves) await this.keep('move');
      this.stopVerdict();
      const name = this.about.pipelines.find((one) => one.file === this.pipeline).name;
      this.isRegistering = true;
      this.updateBar();
      await Shell.guarded(async () => {
        const {job, command} = await Ask.post(
            'api/place/register', {case: this.path, pipeline: this.pipeline, poses: this.placed});
        this.showCommand(command);
        const result = await Shell.follow('Registration by ' + name, job);
        if (!this.isOpen) return;
        const found = Object.entries(result.poses).filter(([bone]) => this.moving.has(bone));
        this.show(Object.fromEntries(found.map(([bone, pose]) => [bone, pose.matrix])));
        const deviations = Object.fromEntries(found.map(([bone, pose]) => [bone, pose.deviations]));
        const verdicts = Object.keys(result.verdicts).length ? result.verdicts : undefined;
        await this.keepPoses('register ' + found.map(([bone]) => bone).join(' and ') + ' by ' + name, {verdicts, deviations});
        if (verdicts) this.steps.showVerdict(verdicts);
        for (const [bone, pose] of found)
          for (const warning of pose.warnings) Shell.notice(bone + ': ' + warning);
      });
      this.isRegistering = false;
      if (this.isOpen) this.updateBar();
    }

    updateBar() {
      if (!this.bar) return;
      const {undo, redo, from, state} = this.bar, {draft} = this;
      undo.disabled = draft.state_undo === null;
      redo.disabled = draft.state_redo === null;
      undo.title = draft.state_undo ? 'Undo: ' + draft.state_undo : 'There is nothing to undo';
      redo.title = draft.state_redo ? 'Redo: ' + draft.state_redo : 'There is nothing to redo';
      from.disabled = Boolean(this.isRegistering) || !this.pipeline;
      state.textContent = draft.is_saved ? 'saved' : 'kept as a draft';
    }

    restyle(change) {
      Object.assign(this, change);
      for (const view of this.views) view.draw();
    }

    fill(place) {
      this.commandPlace = el('div', {class: 'place-command'});
      this.bar = {
        undo: Dom.button('Undo', () => this.draft.undo(), {'data-do': 'undo'}),
        redo: Dom.button('Redo', () => this.draft.redo(), {'data-do': 'redo'}),
        from: Dom.button('From here', () => this.fromHere(), {'data-do': 'register', class: 'primary'}),
        state: el('span', {class: 'note', role: 'status'})
      };
      place.append(
          el('div', {class: 'page-head'}, el('h1', {}, this.path || '(this folder)'),
             el('div', {class: 'toolbar'}, this.bar.undo, this.bar.redo, this.bar.state),
             el('div', {class: 'toolbar'}, this.pipelineChoice(), this.bar.from)),
          this.tools(),
          el('div', {class: 'place-work'},
             el('div', {class: 'place-views'}, this.views.map((view) => view.element)),
             el('aside', {class: 'place-side', 'aria-label': 'The present poses'},
                el('section', {'aria-label': 'Costs'}, el('h2', {}, 'Costs'), this.steps.costTable),
                el('section', {'aria-label': 'Verdict'}, el('h2', {}, 'Verdict'), this.judgeBox(), this.steps.verdict),
                el('section', {'aria-label': 'Steps'}, el('h2', {}, 'Steps'), this.steps.list), this.commandPlace)));
      this.steps.showVerdict(null);
      this.updateBar();
    }

    pipelineChoice() {
      const options = this.about.pipelines.map((one) => [one.file, one.name]);
      const help = () => (this.about.pipelines.find((one) => one.file === this.pipeline) || {help: ''}).help;
      const field = Dom.select('register by', options, this.pipeline, (file) => {
        this.pipeline = file;
        field.title = help();
      });
      field.title = help();
      return field;
    }

    judgeBox() {
      this.judges = true;
      return Dom.checkbox('judge each pose after a pause', true, (judges) => {
        this.judges = judges;
        this.pause();
      });
    }

    tools() {
      const strength = Dom.slider('strength', this.strength, (value) => this.restyle({strength: value}));
      const wipe = Dom.slider('line', this.wipe, (value) => this.restyle({wipe: value}));
      const shown = () => {
        strength.hidden = !['blend', 'edges'].includes(this.mode);
        wipe.hidden = this.mode !== 'wipe';
      };
      this.modes = Dom.choice('show', MODES, this.mode, (mode) => {
        this.mode = mode;
        shown();
        this.redraw();
      });
      shown();
      this.stepChoice = Dom.choice(
          'step of keys (mm, °)', [['0.1', '0.1'], ['0.5', '0.5'], ['1', '1'], ['5', '5']], String(this.step),
          (step) => (this.step = Number(step)));
      this.zoomChoice =
          Dom.choice('zoom', [['1', '1'], ['2', '2'], ['4', '4']], '1', (factor) => this.zoom(Number(factor)));
      const bones = this.about.bones.length > 1 && el('fieldset', {class: 'place-bones'}, el('legend', {}, 'moved'),
                                                        this.about.bones.map((bone) => this.boneBox(bone)));
      return el('div', {class: 'toolbar place-tools'}, this.modes, strength, wipe, this.zoomChoice, this.stepChoice, bones);
    }

    zoom(factor) {
      const {middle} = this.hold(this.placed);
      for (const view of this.views) view.zoom(factor, Geometry.pixel(view.camera, middle) || [0, 0]);
    }

    boneBox(bone) {
      const box = Dom.checkbox(bone.name, true, (isMoved) => {
        this.moving[isMoved ? 'add' : 'delete'](bone.name);
        this.askCosts();
      });
      const [r, g, b] = this.colours[bone.name];
      box.prepend(el('span', {class: 'swatch', style: `background: rgb(${r} ${g} ${b})`, 'aria-hidden': 'true'}));
      return box;
    }

    leave() {
      if (this.keyMoves) this.keep('move');
      this.stopVerdict();
      this.isOpen = false;
    }
  }

  const inView = (what, motion) => () => page && page.active && page.byKeys(page.active, what, motion);
  const shift = (u, v) => inView('move', ({camera}) => Geometry.shift(
      Geometry.times(PlaceMotion.direction(camera, [u, v, 0]), page.step)));
  const depth = (sign) => inView('move in depth', ({camera, middle}) =>
      PlaceMotion.shiftInDepth(camera, middle, sign * page.step));
  const turn = (sign) => inView('turn', ({camera, middle}) =>
      PlaceMotion.turnInView(camera, middle, radians(sign * page.step)));
  const roll = (sign) => inView('turn about the long axis of', ({middle, axis}) =>
      PlaceMotion.roll(axis, middle, radians(sign * page.step)));
  const tip = (sign) => inView('tip', ({camera, middle, axis}) =>
      PlaceMotion.tip(camera, axis, middle, radians(sign * page.step)));

  function nextView() {
    if (!page || !page.views) return;
    const at = page.views.indexOf(page.active);
    page.views[(at + 1) % page.views.length].canvas.focus();
  }
  function nextStep(by) {
    if (!page || !page.stepChoice) return;
    const steps = ['0.1', '0.5', '1', '5'];
    const step = steps[Math.max(0, Math.min(3, steps.indexOf(String(page.step)) + by))];
    page.stepChoice.querySelector(`[data-value="${step}"]`).click();
  }
  function nextZoom() {
    if (!page || !page.zoomChoice) return;
    const now = page.zoomChoice.querySelector('[aria-pressed="true"]').dataset.value;
    page.zoomChoice.querySelector(`[data-value="${{1: 2, 2: 4, 4: 1}[now]}"]`).click();
  }
  function nextMode() {
    if (!page || !page.modes) return;
    const at = MODES.findIndex(([mode]) => mode === page.mode);
    page.modes.querySelector(`[data-value="${MODES[(at + 1) % MODES.length][0]}"]`).click();
  }

  Shell.page('place', {
    title: 'Place',
    async show(place, parameters, first) {
      if (!first) return choose(place);
      page = new Page(first === '.' ? '' : first);
      await page.open(place);
    },
    leave() {
      if (page) page.leave();
      page = null;
    },
    keys: [
      ['ArrowLeft', 'move left in the view', shift(-1, 0)], ['ArrowRight', 'move right', shift(1, 0)],
      ['ArrowUp', 'move up', shift(0, -1)], ['ArrowDown', 'move down', shift(0, 1)],
      ['q or Q', 'turn left in the view', turn(-1)], ['e or E', 'turn right in the view', turn(1)],
      ['a or A', 'turn about the long axis', roll(1)], ['d or D', 'the same, the other way', roll(-1)],
      ['w or W', 'move away from the X-ray source', depth(1)], ['s or S', 'move towards it', depth(-1)],
      ['r or R', 'tip the upper end away', tip(1)], ['f or F', 'tip it towards the source', tip(-1)],
      ['v', 'the next view', nextView], ['m', 'show the bone in another way', nextMode],
      ['z', 'zoom in to the bone, and out', nextZoom], ['+', 'larger steps', () => nextStep(1)], ['-', 'smaller steps', () => nextStep(-1)],
      ['Enter', 'register from here', (event) => page && page.bar && event.target.matches('canvas') && page.fromHere()],
      ['Ctrl+z', 'undo', () => page && page.draft && page.draft.undo()],
      ['Ctrl+y or Ctrl+Z', 'redo', () => page && page.draft && page.draft.redo()],
      ['drag', 'move in the view; with Shift or the right button: turn; with Alt: turn about the long axis'],
      ['Ctrl+wheel', 'move in depth'], ['one finger', 'move'], ['two fingers', 'turn']
    ]
  });

  // Without a case: a list of those in the folder.
  async function choose(place) {
    const {cases} = await Ask.json('api/folder');
    place.append(
        el('h1', {}, 'Place'), el('p', {}, 'Choose a case. Its bones are placed over its X-rays by hand.'),
        cases.length ?
            el('ul', {class: 'files'},
               cases.map((path) => el('li', {}, el('a', {href: Shell.addressOf('place', path || '.')}, path || '(this folder)')))) :
            el('p', {class: 'note'}, 'There is no case yet.'));
  }

  return {
    // For measurements and tests: the page that is open.
    current: () => page
  };
})();
