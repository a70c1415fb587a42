// SPDX-License-Identifier: Apache-2.0
// The panel "Segmentation": the fragments' bone grows from the seeds, and is shown in the slices and in 3D.
'use strict';

(() => {
  const {el} = Dom;
  const METHODS = [['bone', 'by a threshold, as bone.yaml does'], ['femur', 'by a level set, as femur.yaml does']];
  const STAGES = {coarse: 'on a coarse grid; the full one is being computed', full: 'on the grid of the CT'};

  // The outlines of one result, asked for slice by slice.
  function outlines(state, segmentation, colourOf) {
    const known = new Map(), asked = new Set();
    async function ask(key, axis, index, later) {
      asked.add(key);
      try {
        const {bytes, about} = await Ask.bytes('api/segmentation/outlines', {segmentation, axis, index});
        const numbers = new Float32Array(bytes), [low, high] = [0, 1, 2].filter((one) => one !== axis);
        let from = 0;
        known.set(key, about.map(({name, numbers: count}) => {
          const part = numbers.subarray(from, from += count), ends = new Float32Array(count / 2 * 3);
          for (let i = 0; 2 * i < count; ++i) {
            ends[3 * i + axis] = index;
            ends[3 * i + low] = part[2 * i];
            ends[3 * i + high] = part[2 * i + 1];
          }
          return {name, colour: colourOf(name), ends};
        }));
        if (known.size > 300) known.delete(known.keys().next().value);
        later();
      } catch (error) {
        if (error.status !== 409) Shell.notice(error.message, 'fault');
      }
      asked.delete(key);
    }
    return {
      lines(axis, index, later) {
        const key = axis + ' ' + index;
        if (!known.has(key) && asked.size < 3 && !asked.has(key)) ask(key, axis, index, later);
        return known.get(key);
      }
    };
  }

  async function surfaces(segmentation, names, colourOf) {
    const meshes = [];
    for (const fragment of names) {
      const {bytes, about} = await Ask.bytes('api/segmentation/surface', {segmentation, fragment});
      meshes.push({
        vertices: new Float32Array(bytes, 0, 3 * about.vertices),
        triangles: new Uint32Array(bytes, 12 * about.vertices, 3 * about.triangles),
        colour: colourOf(fragment)
      });
    }
    return meshes;
  }

  function make(draft) {
    const state = CtState.of(draft), solid = new SurfaceView('Surfaces of the fragments; arrow keys turn them');
    let method = 'bone', shown_for = '', is_running = false, turn = 0;
    const threshold = el('input', {type: 'number', class: 'short', value: 250, step: 10});
    const field = el('label', {class: 'field'}, el('span', {}, 'threshold, HU'), threshold);
    const how = Dom.select('how', METHODS, method, (value) => {
      method = value;
      field.hidden = value !== 'bone';
    });
    const button = Dom.button('Segment', () => run(), {'data-do': 'segment'});
    const outcome = el('p', {class: 'note', role: 'status', 'data-segmented': ''}), old = el('p', {class: 'note'});
    const command = el('details', {hidden: true}, el('summary', {}, 'The same in a shell, once the case is saved'));
    const colourOf = (name) => PointList.colour(Math.max(0, Object.keys(draft.document.fragments || {}).indexOf(name)));
    solid.element.hidden = true;

    async function take({segmentation, stage, volumes_ml}) {
      const names = Object.keys(volumes_ml), mine = ++turn;
      state.contours.set('segmentation', outlines(state, segmentation, colourOf));
      state.tell('view');
      outcome.textContent = 'Segmented ' + STAGES[stage] + ': ' +
          names.map((name) => name + ' ' + Dom.number(volumes_ml[name]) + ' ml').join(', ');
      outcome.dataset.segmented = stage;
      const meshes = await Shell.guarded(() => surfaces(segmentation, names, colourOf));
      if (!meshes || mine !== turn) return;
      solid.element.hidden = false;
      solid.set(meshes);
    }

    async function run() {
      is_running = true;
      update();
      const fragments = structuredClone(draft.document.fragments || {});
      try {
        const asked = {ct: state.ct.name, fragments, method};
        if (method === 'bone') asked.threshold_hu = Number(threshold.value);
        const {job, pipeline} = await Ask.post('api/segment', asked);
        command.hidden = false;
        command.replaceChildren(
            command.firstChild,
            Dom.command(
                'marrow run ' + Dom.shellPath(pipeline) + ' ' +
                'case=' + Dom.shellWord(draft.path || '.') +
                (method === 'bone' ? ' threshold_hu=' + asked.threshold_hu : '')));
        await Shell.follow('Segmenting', job, (event) => {
          if (event.event === 'grown') take(event);
        });
        shown_for = JSON.stringify([fragments, draft.document.ct]);
      } catch (error) {
        Shell.notice(error.message, 'fault');
        if (error.status === 409) state.follow(true);
      }
      is_running = false;
      update();
    }

    function update() {
      const has_seeds = Object.values(draft.document.fragments || {}).some(({seeds}) => seeds && seeds.length);
      button.disabled = is_running || !state.ct || !has_seeds;
      button.title = has_seeds ? '' : 'Add a fragment and put seeds into its bone first';
      old.textContent = shown_for && shown_for !== JSON.stringify([draft.document.fragments, draft.document.ct]) ?
          'The seeds or the CT have changed since; segment again.' :
          '';
    }
    const renewed = () => {
      if (!state.ct) state.contours.delete('segmentation');
      update();
    };
    state.addEventListener('ct', renewed);
    return {
      element:
          el('div', {class: 'segmentation-panel'}, el('div', {class: 'toolbar'}, how, field, button), outcome, old,
             solid.element, command),
      update,
      dispose() {
        state.removeEventListener('ct', renewed);
        solid.dispose();
      }
    };
  }

  CasePage.panel('Segmentation', 30, make);
})();
