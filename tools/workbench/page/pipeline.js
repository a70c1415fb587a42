// SPDX-License-Identifier: Apache-2.0
// The page "Pipeline": the graph, the text and the form of a node beside each other, its outputs, and runs.
import * as Dom from '../../report/page/dom.js';
import {el} from '../../report/page/dom.js';
import * as Graph from '../../report/page/graph.js';

import * as PipelineList from './pipeline_list.js';
import * as PipelineNode from './pipeline_node.js';
import {PipelineText} from './pipeline_text.js';
import {follow, GraphView, inputField, mark, nameAsSeen} from './pipeline_view.js';
import * as Ask from './server.js';
import * as Shell from './shell.js';

let page = null;  // what is shown now

class Page {
  constructor(place, file, parameters) {
    Object.assign(this, {file, state: null, chosen: null, plan: null, lookCount: 0, planCount: 0, graph: null});
    this.inputs = Object.fromEntries(
        [...parameters].filter(([key]) => key.startsWith('in.')).map(([key, value]) => [key.slice(3), value]));
    this.text = new PipelineText((text) => this.save(text));
    this.view = new GraphView();
    this.build(place);
  }

  leave() {
    clearTimeout(this.timer);
    this.text.dispose();
    this.view.dispose();
  }

  build(place) {
    const button = (text, action, name) => Dom.button(text, action, {'data-do': name});
    this.changes = Shell.undoButtons((way) => this.step(way));
    this.status = el('span', {class: 'note', role: 'status', 'data-do': 'status'});
    this.run = button('Run what is stale', () => this.start(), 'run');
    this.noGraph = el('p', {class: 'note'}, 'The graph is drawn when the file has no faults.');
    this.graphBox = el('div', {class: 'graph-place'}, this.view.element, this.noGraph);
    this.picker = el('div', {class: 'toolbar'});
    this.inputTitle = el('summary', {}, 'Inputs');
    this.inputBox = el('div', {class: 'form'});
    this.formBox = el('div', {class: 'form'});
    this.outputBox = el('div', {class: 'outputs', 'aria-live': 'polite'});
    this.commands = el('div', {});
    this.result = el('div', {'aria-live': 'polite'});
    const panel = (title, name, ...content) =>
        el('section', {class: 'panel pipeline-' + name, 'aria-label': title}, el('h2', {}, title), content);
    this.inputs_part = el('details', {class: 'pipeline-inputs'}, this.inputTitle, this.inputBox);
    place.append(
        el('div', {class: 'page-head'}, el('h1', {}, this.file),
           el('div', {class: 'toolbar'}, this.run, this.changes.boxes, this.status)),
        this.inputs_part, this.result,
        el('div', {class: 'pipeline-grid'}, panel('Graph', 'graph', this.graphBox, this.picker),
           panel('Node', 'node', this.formBox), panel('Text', 'text', this.text.element),
           panel('What the node makes', 'output', this.outputBox), panel('Commands', 'commands', this.commands)));
  }

  // Takes over the first state, with the inputs of the last visit and the case that is worked on.
  async load(state) {
    const present = Shell.presentCase() ? {case: Shell.presentCase()} : {};
    const known = new Set(state.inputs.map((one) => one.name));
    for (const [name, value] of Object.entries({...state.kept_inputs, ...present}))
      if (known.has(name) && this.inputs[name] === undefined) this.inputs[name] = value;
    this.take(state);
    this.inputs_part.open = this.missing().length > 0;
    await this.refreshPlan();
  }

  take(state) {
    const before = this.state;
    this.state = state;
    this.text.set(state.text, state.faults, state.faults_text);
    this.changes.update(state.undo, state.redo);
    if (state.graph) this.draw(state.graph);
    this.graphBox.classList.toggle('outdated', !state.graph);
    this.view.element.hidden = !this.graph;
    this.noGraph.hidden = Boolean(this.graph);
    if (JSON.stringify(before && before.inputs) !== JSON.stringify(state.inputs)) this.showInputs();
    this.showPicker();
    this.showForm();
  }

  draw(graph) {
    const focused = document.activeElement && document.activeElement.dataset && document.activeElement.dataset.node;
    this.graph = Graph.draw(graph, (node) => this.choose(node.id)).querySelector('svg');
    this.graph.querySelectorAll('[data-node]').forEach(nameAsSeen);
    this.view.element.hidden = false;
    this.view.set(this.graph);
    this.markChosen();
    const again =
        focused && [...this.graph.querySelectorAll('[data-node]')].find((one) => one.dataset.node === focused);
    if (again) again.focus({preventScroll: true});
  }

  markChosen() {
    if (!this.graph) return;
    for (const one of this.graph.querySelectorAll('[data-node]')) {
      one.classList.toggle('chosen', one.dataset.node === this.chosen);
      one.setAttribute('aria-pressed', String(one.dataset.node === this.chosen));
    }
  }

  showPicker() {
    const ids = Object.keys(this.state.nodes);
    this.picker.replaceChildren(Dom.select(
        'Node',
        [['', 'choose a node'], ...ids.map((id) => [id, id + ' (' + (this.state.nodes[id].uses || 'body') + ')'])],
        this.chosen || '', (id) => this.choose(id || null)));
  }

  choose(id) {
    this.chosen = id;
    this.markChosen();
    this.showInText();
    this.showPicker();
    this.showForm();
    this.look();
  }

  // Marks the node's text, and moves the graph to its box.
  showInText() {
    const node = this.state.nodes[this.chosen];
    this.text.showNode(node && !node.file ? node.line : null);
    const box = this.graph && this.graph.querySelector('[data-node="' + CSS.escape(this.chosen || '') + '"]');
    if (box) this.view.reveal(box);
  }

  // The chosen node; null for a node of a body, which this file does not have.
  known() {
    return this.chosen && this.state.nodes[this.chosen] ? this.chosen : null;
  }

  showForm() {
    const id = this.known();
    if (id) {
      const focused = document.activeElement && this.formBox.contains(document.activeElement) && document.activeElement;
      const key = focused &&
          ['option', 'wire', 'default', 'use'].map((name) => [name, focused.dataset[name]]).find(([, value]) => value);
      this.formBox.replaceChildren(
          PipelineNode.form(this.state, id, (change) => this.edit(change), (line) => this.text.goTo(line)));
      const again = key &&
          this.formBox.querySelector(
              '[data-' + (key[0] === 'default' ? 'option' : key[0]) + '="' + CSS.escape(key[1]) + '"]');
      if (again) again.focus({preventScroll: true});
      return;
    }
    this.showNoForm();
  }

  // For no node, or for a node of a body: the body's own file has that.
  showNoForm() {
    const [id] = (this.chosen || '').split('/'), outer = this.state.nodes[id];
    if (!outer)
      return this.formBox.replaceChildren(
          el('p', {class: 'note'}, 'Choose a node in the graph or in the list below it.'));
    const folder = this.file.split('/').slice(0, -1), name = outer.body.endsWith('.yaml') && outer.body;
    return this.formBox.replaceChildren(
        el('p', {}, this.chosen + ' is a node of the body of ' + id + '. ',
           name ? el('a', {href: Shell.addressOf('pipeline', [...folder, name].join('/'))}, 'Open ' + name) :
                  'Change it in the text.'));
  }

  // The heading lists the given inputs, because the list below may be folded away.
  countInputs() {
    const count = this.state.inputs.length;
    const given =
        this.state.inputs.filter((one) => this.inputs[one.name]).map((one) => one.name + '=' + this.inputs[one.name]);
    this.inputTitle.textContent = !count ? 'Inputs: none' : 'Inputs' + (given.length ? ': ' + given.join(', ') : '');
  }

  showInputs() {
    const changed = (name, value) => {
      this.inputs[name] = value;
      if (value === '') delete this.inputs[name];
      const more = Object.fromEntries(Object.entries(this.inputs).map(([key, text]) => ['in.' + key, text]));
      history.replaceState(null, '', Shell.addressOf('pipeline', this.file, more));
      this.countInputs();
      this.refreshPlan().then(() => this.look());
    };
    this.countInputs();
    this.inputBox.replaceChildren(
        ...(this.state.inputs.length ?
                this.state.inputs.map((one) => inputField(one, this.inputs[one.name] || '', changed)) :
                [el('p', {class: 'note'}, 'This pipeline has no inputs.')]));
  }

  missing() {
    return this.state.inputs.filter((one) => one.default === null && !this.inputs[one.name]);
  }

  showCommands(...commands) {
    this.commands.replaceChildren(...commands.filter(Boolean).map((text) => Dom.command(text)));
  }

  // Asks what a run would do now. Until the answer comes, the page says nothing about stale nodes.
  async refreshPlan() {
    const count = ++this.planCount;
    this.plan = null;
    this.run.disabled = true;
    this.showCommands(this.state.command);
    if (this.state.faults.length) return void (this.status.textContent = 'the file has faults');
    const missing = this.missing();
    if (missing.length)
      return void (
          this.status.textContent = 'give ' + missing.map((one) => one.name).join(', ') + ' to see what is stale');
    this.status.textContent = 'checking what is stale …';
    try {
      const plan = await Ask.post('api/pipeline/plan', {file: this.file, inputs: this.inputs});
      if (count !== this.planCount || this !== page) return;
      this.plan = plan;
      this.run.disabled = !!this.job;
      this.showPlan();
      this.showCommands(plan.run_command, plan.command, this.state.command);
    } catch (error) {
      if (count === this.planCount) this.status.textContent = error.message;
    }
  }

  showPlan() {
    for (const [id, {state, text}] of Object.entries(this.plan.nodes))
      mark(this.graph, id, state, state === 'function' || state === 'not_needed' ? ' ' : '', text);
    const {cached, to_run, may_run, seconds} = this.plan;
    this.status.textContent = to_run + may_run === 0 ?
        'everything is up to date' :
        to_run + ' to run' + (may_run ? ', ' + may_run + ' that may run' : '') + ', ' + cached + ' up to date' +
            (seconds > 0 ? '; the nodes to run took ' + seconds.toFixed(1) + ' s the last time' : '');
  }

  async start() {
    if (this.job || !this.plan) return;
    await Shell.guarded(async () => {
      const {job, command} = await Ask.post('api/pipeline/run', {file: this.file, inputs: this.inputs});
      this.job = job;
      this.run.disabled = true;
      document.documentElement.dataset.run = 'running';
      try {
        const result = await follow('Run ' + this.state.name, job, () => this.graph);
        this.showResult(result, command);
        document.documentElement.dataset.run = result.status;
      } catch (error) {
        document.documentElement.dataset.run = error.status === 499 ? 'stopped' : 'failed';
        if (error.status !== 499) throw error;
        Shell.notice('The run was stopped. What was done is kept in its folder and in the store.');
      } finally {
        this.job = null;
      }
    });
    if (this !== page) return;
    await this.refreshPlan();
    this.look();
  }

  showResult(result, command) {
    const bad = Object.entries(result.nodes).filter(([, one]) => one.status.startsWith('failed'));
    this.result.replaceChildren(
        el('div', {class: 'run-result'},
           el('p', {}, el('strong', {}, result.status === 'done' ? 'Done' : 'Failed'),
              ' in ' + result.seconds.toFixed(1) + ' s: ',
              el('a', {href: Shell.addressOf('results', result.folder), 'data-do': 'result'}, result.folder)),
           result.verdicts.map(
               (one) =>
                   el('p', {}, el('strong', {class: 'judged ' + one.judgement}, one.judgement.toUpperCase()), ' ',
                      [one.item, ...(one.reasons || []).slice(0, 2)].filter(Boolean).join('; '))),
           bad.map(([id, one]) => el('p', {class: 'reason'}, id + ': ' + one.reason)),
           result.faults.filter((text) => !text.includes('not made')).map((text) => el('p', {class: 'reason'}, text)),
           el('details', {}, el('summary', {}, 'The same on the command line'), Dom.command(command))));
    this.inputs_part.open = false;
  }

  // Shows the outputs of the chosen node, if they are known.
  async look() {
    const id = this.known(), count = ++this.lookCount;
    PipelineNode.clearOutputs();
    const say = (text) => this.outputBox.replaceChildren(el('p', {class: 'note'}, text));
    if (!id) return say('Choose a node to see what it made.');
    const planned = this.plan && this.plan.nodes[id];
    if (!planned) return say('It is shown when the inputs are given and the file has no faults.');
    if (planned.state !== 'cached' && planned.state !== 'function')
      return say('Not made yet (' + planned.text + '). Run what is stale.');
    say('Reading it back …');
    try {
      const {job} = await Ask.post('api/pipeline/look', {file: this.file, inputs: this.inputs, node: id});
      const outputs = await Ask.follow(job);
      if (count === this.lookCount && this === page)
        this.outputBox.replaceChildren(...PipelineNode.showOutputs(id, outputs));
    } catch (error) {
      if (count === this.lookCount) say(error.message);
    }
  }

  // Sends a request with the present revision, and takes over the state in the answer.
  async after(path, body) {
    try {
      this.take(await Ask.post(path, {file: this.file, revision: this.state.revision, ...body}));
    } catch (error) {
      Shell.notice(error.message, 'fault');
      if (error.status === 409)
        await this.refetch();
      else
        this.showForm();
      return false;
    }
    await this.refreshPlan();
    this.look();
    return true;
  }

  edit(change) {
    if (this.text.isChanged()) {
      Shell.notice('Save or discard the edit of the text first.', 'fault');
      return this.showForm();
    }
    return this.after('api/pipeline/edit', change);
  }
  save(text) {
    const sent = this.state.text.includes('\r\n') ? text.replaceAll('\n', '\r\n') : text;
    return this.after('api/pipeline/text', {text: sent});
  }
  saveEdit() {
    if (this.text.isChanged()) return this.save(this.text.text());
    return Shell.notice('There is nothing to save: the file holds this text.');
  }
  step(way) {
    if (this.state[way] !== null && !this.text.isChanged()) return this.after('api/pipeline/' + way);
    return undefined;
  }

  // Takes over the newest state of the file. A text that is being edited stays.
  async refetch() {
    const state = await Ask.json('api/pipeline', {file: this.file});
    if (this !== page) return;
    if (this.text.isChanged()) {
      Shell.notice(
          'The file was changed elsewhere. Your edit of the text is not saved; copy it, then discard it.', 'fault');
      const mine = this.text.text();
      this.take(state);
      this.text.put(mine);
    } else
      this.take(state);
    await this.refreshPlan();
  }

  // Asks each second whether the file has changed.
  async poll() {
    if (this !== page) return;
    try {
      if (document.visibilityState === 'visible' && this.state) {
        const {revision} = await Ask.json('api/pipeline/revision', {file: this.file});
        if (this === page && revision !== this.state.revision) await this.refetch();
      }
    } catch (error) { /* the user's next request shows it */
    }
    if (this === page) this.timer = setTimeout(() => this.poll(), 1000);
  }
}

Shell.page('pipeline', {
  title: 'Pipeline',
  async show(place, parameters, first) {
    if (!first) return PipelineList.show(place);
    const state = await Ask.json('api/pipeline', {file: first});
    if (!place.isConnected) return undefined;  // another page was opened in the meantime
    const mine = page = new Page(place, first, parameters);
    await mine.load(state);
    if (mine !== page) return undefined;
    mine.look();
    mine.timer = setTimeout(() => mine.poll(), 1000);
    return undefined;
  },
  leave() {
    if (page) page.leave();
    PipelineNode.clearOutputs();
    page = null;
  },
  keys: [
    ['Ctrl+s', 'save the text', () => page && page.saveEdit()],
    ['Ctrl+Enter', 'run what is stale', () => page && page.start()],
    ['Ctrl+z', 'undo', () => page && page.step('undo')], ['Ctrl+y or Ctrl+Z', 'redo', () => page && page.step('redo')],
    ['Tab, Enter', 'go through the nodes of the graph, choose one'], ['drag, Ctrl+wheel', 'move the graph, zoom it'],
    ['Ctrl+Space', 'complete a word of the text']
  ]
});
