// SPDX-License-Identifier: Apache-2.0
// Evens out the contrast of an image region by region: each region gets greys by the ranks of its own pixels, with a
// limit so that noise stays small (CLAHE). The reports show X-rays the same way.
const TILES = 8, LIMIT = 3;

// The grey that each grey becomes in one region.
function curveOf(grey, width, {left, top, right, bottom}) {
  const counts = new Float64Array(256), total = (right - left) * (bottom - top);
  for (let v = top; v < bottom; ++v)
    for (let u = left; u < right; ++u) ++counts[grey[v * width + u]];
  const most = LIMIT * total / 256;
  const excess = counts.reduce((sum, count) => sum + Math.max(0, count - most), 0) / 256;
  let below = 0;
  return counts.map((count) => 255 * (below += Math.min(count, most) + excess) / total);
}

// For each place along a side: the two nearest regions and the share of the second.
function neighbours(size) {
  return Array.from({length: size}, (_, at) => {
    const place = Math.max(0, Math.min(TILES - 1, (at + 0.5) * TILES / size - 0.5)), first = Math.floor(place);
    return {first, second: Math.min(TILES - 1, first + 1), share: place - first};
  });
}

export function equalised(grey, width, height) {
  const side = (size, i) => Math.floor(size * i / TILES), curves = [];
  if (width < TILES || height < TILES) return grey;
  for (let row = 0; row < TILES; ++row)
    for (let column = 0; column < TILES; ++column)
      curves.push(curveOf(grey, width, {
        left: side(width, column),
        right: side(width, column + 1),
        top: side(height, row),
        bottom: side(height, row + 1)
      }));
  const across = neighbours(width), shown = new Uint8Array(grey.length);
  neighbours(height).forEach((down, v) => {
    for (let u = 0, at = v * width; u < width; ++u, ++at) {
      const {first, second, share} = across[u], value = grey[at];
      const row = (one) =>
          (1 - share) * curves[TILES * one + first][value] + share * curves[TILES * one + second][value];
      shown[at] = (1 - down.share) * row(down.first) + down.share * row(down.second) + 0.5;
    }
  });
  return shown;
}
