// SPDX-License-Identifier: Apache-2.0
// Addresses of cells: REPORT#cell=VARIANT/CASE/START opens one.

export const to = (cell) => '#cell=' + String(cell.id).split('/').map(encodeURIComponent).join('/');

// The folder of a cell, beside the page.
export const toFolder = (folder) => folder.split('/').map(encodeURIComponent).join('/') + '/';

// What an address asks for: {cell}, {unknown: text} if the report has no such cell, or null if it names none.
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

// Puts the cell into the address in the browser's bar. Some browsers refuse this to pages from disk; that does no harm.
export function name(address) {
  try {
    history.replaceState(null, '', address);
  } catch (error) { /* no link then */
  }
}

export const unname = () => name(location.pathname + location.search);
