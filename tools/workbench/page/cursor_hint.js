// SPDX-License-Identifier: Apache-2.0
// A short text beside the pointer. It is a child of the box in which `place` is given.

export function show(hint, text, [x, y]) {
  hint.hidden = !text;
  if (!text) return;
  hint.textContent = text;
  const {offsetWidth: width, offsetHeight: height, parentElement: box} = hint;
  const left = x + 16 + width > box.clientWidth ? x - 12 - width : x + 16;
  const top = y + 18 + height > box.clientHeight ? y - 10 - height : y + 18;
  hint.style.transform = `translate(${Math.max(0, left)}px, ${Math.max(0, top)}px)`;
}
