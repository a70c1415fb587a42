// SPDX-License-Identifier: Apache-2.0
// Paints bones over an X-ray image. Layers come from the server: {bone, u_px, v_px, step_px, columns, rows, bytes}, or
// {bone, points: Float32Array of u, v} for an outline.

export class PlacePaint {
  // A pixel of the canvas is a square of `step_px` pixels of the X-ray.
  constructor(canvas, width, height, step_px) {
    Object.assign(this, {canvas, width, height, step_px, layers: new Map(), last: null});
    canvas.width = width;
    canvas.height = height;
    this.context = canvas.getContext('2d', {alpha: false});
    this.image = this.context.createImageData(width, height);
    this.out = new Uint32Array(this.image.data.buffer);
    this.show(new Uint8Array(width * height));
  }

  // An image of this size in 8 bit.
  show(grey) {
    this.grey = grey;
    this.base = this.base || new Uint32Array(grey.length);
    for (let i = 0; i < grey.length; ++i) this.base[i] = 0xff000000 | grey[i] * 0x010101;
  }

  static greyColour(value) {
    return (0xff000000 | value << 16 | value << 8 | value) >>> 0;
  }

  // Columns and rows of the canvas that a layer covers, the ends left out.
  covered(layer) {
    const middle = (this.step_px - 1) / 2, at = (value) => (value - middle) / this.step_px;
    const half = layer.step_px / this.step_px / 2;
    const clip = (value, most) => Math.max(0, Math.min(most, value));
    return {
      left: clip(Math.round(at(layer.u_px) + 0.5 - half), this.width),
      top: clip(Math.round(at(layer.v_px) + 0.5 - half), this.height),
      right: clip(Math.round(at(layer.u_px + layer.step_px * (layer.columns - 1)) + 0.5 + half), this.width),
      bottom: clip(Math.round(at(layer.v_px + layer.step_px * (layer.rows - 1)) + 0.5 + half), this.height)
    };
  }

  // style: {mode, strength (0 to 1), wipe (0 to 1), colours: {BONE: [r, g, b]}}
  paint(style) {
    this.out.set(this.base);
    for (const [bone, layer] of this.layers) {
      if (layer.points)
        this.points(layer, style.colours[bone]);
      else if (layer.columns > 0 && layer.rows > 0)
        this.layer(layer, style, style.colours[bone]);
    }
    this.context.putImageData(this.image, 0, 0);
  }

  layer(layer, style, [r, g, b]) {
    const {left, top, right, bottom} = this.covered(layer), {out, grey, width} = this;
    const ratio = this.step_px / layer.step_px, middle = (this.step_px - 1) / 2;
    const beginU = (middle - layer.u_px) / layer.step_px, beginV = (middle - layer.v_px) / layer.step_px;
    const weights = new Uint16Array(256).map((_, t) => Math.round(256 * Math.min(1, style.strength * 2 * t / 255)));
    const isCompared = style.mode === 'wipe' || style.mode === 'checkerboard';
    const line = style.wipe * width, square = Math.max(8, width >> 3);
    for (let y = top; y < bottom; ++y) {
      const row = Math.min(layer.rows - 1, Math.max(0, Math.round(y * ratio + beginV))) * layer.columns;
      for (let x = left; x < right; ++x) {
        const column = Math.min(layer.columns - 1, Math.max(0, Math.round(x * ratio + beginU)));
        const value = layer.bytes[row + column], at = y * width + x;
        if (value === 0) continue;
        if (isCompared) {
          const isBone = style.mode === 'wipe' ? x >= line : ((x / square | 0) + (y / square | 0)) & 1;
          if (isBone) out[at] = PlacePaint.greyColour(255 - value);
          continue;
        }
        const weight = weights[value], rest = 256 - weight, under = grey[at];
        out[at] = (0xff000000 | (under * rest + b * weight) >> 8 << 16 | (under * rest + g * weight) >> 8 << 8 |
                   (under * rest + r * weight) >> 8) >>>
            0;
      }
    }
  }

  points({points}, [r, g, b]) {
    const colour = (0xff000000 | b << 16 | g << 8 | r) >>> 0, middle = (this.step_px - 1) / 2;
    for (let i = 0; i < points.length; i += 2) {
      const x = Math.round((points[i] - middle) / this.step_px),
            y = Math.round((points[i + 1] - middle) / this.step_px);
      for (const [column, row] of [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]])
        if (column >= 0 && row >= 0 && column < this.width && row < this.height)
          this.out[row * this.width + column] = colour;
    }
  }
}
