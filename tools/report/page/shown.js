// SPDX-License-Identifier: Apache-2.0
// What the page shows now. Tests look at it as globalThis.marrow.
export const shown = globalThis.marrow = {
  player: null,  // of a sequence
  scene: null,   // the 3D view
  table: null    // of all cells
};
