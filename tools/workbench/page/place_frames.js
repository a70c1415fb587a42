// SPDX-License-Identifier: Apache-2.0
// The images of a sequence's frames. They are read in blocks: the wanted one, then the next one ahead of time. The
// blocks that were used last stay in memory, up to a limit.
import * as Ask from './server.js';

export class PlaceFrames {
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
