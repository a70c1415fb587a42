# SPDX-License-Identifier: Apache-2.0
"""Lists of named items along an axis, such as the views of a case."""
from typing import Iterator, List, Mapping, TypeVar

_T = TypeVar("_T")


class Items(Mapping[str, _T]):
    """Named items along one axis ("view", "fragment", ...), in their order. items["distal"] is the item of that name.
    An item that could not be made is None."""

    def __init__(self, axis: str, names: List[str], items: List[_T]) -> None:
        self.axis = axis
        self._items = dict(zip(names, items))

    def __getitem__(self, name: str) -> _T:
        if name not in self._items:
            raise KeyError("no %s %r; there are %s" % (self.axis, name, ", ".join(self._items)))
        return self._items[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __repr__(self) -> str:
        return "<marrow.Items over %s: %s>" % (self.axis, ", ".join(self._items))
