// SPDX-License-Identifier: Apache-2.0
// Addresses of cells: REPORT#cell=VARIANT/CASE/START opens one.

export const to = (cell) => '#cell=' + String(cell.id).split('/').map(encodeURIComponent).join('/');

// What an address asks for: {cell}; {unknown: text} if the report has no such cell; null if it asks for none.
export function asked(data, hash) {
  const text = (/^#cell=(.+)$/.exec(hash) || [])[1];
  if (!text) return null;
  let plain = text;
  try {
    plain = decodeURIComponent(text);
  } catch (error) { /* typed by hand, with a bare percent sign */
  }
  const cell = data.byId.get(plain) || data.byId.get(text);
  return cell ? {cell} : {unknown: plain};
}

// So that the address in the browser's bar is the cell's. Some browsers refuse it to pages from disk, which does no
// harm.
export function name(address) {
  try {
    history.replaceState(null, '', address);
  } catch (error) { /* no link then */
  }
}

export const unname = () => name(location.pathname + location.search);
