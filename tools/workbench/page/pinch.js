// SPDX-License-Identifier: Apache-2.0
// Two fingers on a touch screen.

// What the fingers did when one of them moved to `place`. pointers: the places of both by their ids; it gets the new
// place. Returns {factor: how much further apart they are, around: the middle before, by: the way of the middle}.
export function pinched(pointers, moved, place) {
  const before = pointers.get(moved), other = [...pointers].find(([id]) => id !== moved)[1];
  const apart = (at) => Math.hypot(at[0] - other[0], at[1] - other[1]);
  const middle = (at) => at.map((value, i) => (value + other[i]) / 2);
  pointers.set(moved, place);
  return {
    factor: apart(place) / Math.max(1, apart(before)),
    around: middle(before),
    by: place.map((value, i) => (value - before[i]) / 2)
  };
}
