// SPDX-License-Identifier: Apache-2.0
// Arranges pictures in a box so that they are as large as possible. If they would become too small, the box scrolls.
const LEAST_px = 180, GAP_px = 8, CAPTION_px = 24;

// The number of columns that shows `count` pictures largest. aspect: width by height of a picture.
export function columnsFor(count, aspect, width, height) {
  const heightOf = (columns) => {
    const rows = Math.ceil(count / columns);
    return Math.min(
        (height - GAP_px * (rows - 1)) / rows - CAPTION_px, (width - GAP_px * (columns - 1)) / columns / aspect);
  };
  let best = 1;
  for (let columns = 2; columns <= count; ++columns)
    if (heightOf(columns) > heightOf(best)) best = columns;
  if (heightOf(best) >= LEAST_px) return {columns: best, is_scrolled: false};
  return {columns: Math.max(1, Math.min(count, Math.floor(width / LEAST_px))), is_scrolled: true};
}

// Keeps the children of a grid arranged. aspectOf() is asked for the pictures' shape. Returns {update, dispose}.
export function arranged(grid, aspectOf) {
  const update = () => {
    const count = grid.children.length, {clientWidth: width, clientHeight: height} = grid;
    if (!count || !width || !height) return;
    const {columns, is_scrolled} = columnsFor(count, aspectOf(), width, height);
    grid.style.gridTemplateColumns = `repeat(${columns}, minmax(0, 1fr))`;
    grid.style.gridAutoRows =
        is_scrolled ? Math.max(LEAST_px, width / columns / aspectOf() + CAPTION_px) + 'px' : 'minmax(0, 1fr)';
  };
  const observer = new ResizeObserver(update);
  observer.observe(grid);
  return {update, dispose: () => observer.disconnect()};
}
