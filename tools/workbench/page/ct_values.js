// SPDX-License-Identifier: Apache-2.0
// The values of a CT at points, for example at seeds.
const MOST_KEPT = 500, BONE_HU = 150;

// The values come slice by slice, and each is asked for once. changed() is called when one has arrived.
export class CtValues {
  constructor(state, changed) {
    Object.assign(this, {state, changed, known: new Map(), asked: new Set()});
  }

  // The largest value at a point and at its neighbours in the axial slice, in HU: segmentation looks around a seed,
  // too. Undefined until it has arrived.
  at(point_mm) {
    const {ct} = this.state;
    if (!ct) return undefined;
    const key = ct.name + ' ' + point_mm.join(' ');
    if (!this.known.has(key)) this.ask(key, point_mm);
    return this.known.get(key);
  }

  async ask(key, point_mm) {
    if (this.asked.has(key)) return;
    this.asked.add(key);
    const {ct} = this.state, [i, j, k] = this.state.indexOf(point_mm), [columns, rows, slices] = ct.size;
    try {
      if (k < 0 || k >= slices) return;
      const values = await this.state.slice(2, k), near = [];
      for (let v = Math.max(0, j - 1); values && v <= Math.min(rows - 1, j + 1); ++v)
        for (let u = Math.max(0, i - 1); u <= Math.min(columns - 1, i + 1); ++u) near.push(values[v * columns + u]);
      if (!near.length) return;
      this.known.set(key, Math.max(...near));
      if (this.known.size > MOST_KEPT) this.known.delete(this.known.keys().next().value);
      this.changed();
    } catch (error) { /* the slices say what is wrong */
    } finally {
      this.asked.delete(key);
    }
  }
}

// Why there is no bone where this value is; '' if there may be.
export function noBone(value_hu) {
  if (value_hu === null || value_hu === undefined || value_hu >= BONE_HU) return '';
  return `${value_hu} HU is ${value_hu < -300 ? 'air' : 'not bone'}`;
}
export const ofBone = `bone has more than ${BONE_HU} HU`;
