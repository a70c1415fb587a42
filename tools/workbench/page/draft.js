// SPDX-License-Identifier: Apache-2.0
// A case that is being made, as the server keeps it. drafts.hpp says what its document holds. Events: 'change'.
import * as Ask from './server.js';
import * as Shell from './shell.js';

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
export class StateOfDraft extends EventTarget {
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
