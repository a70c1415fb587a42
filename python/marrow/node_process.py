# SPDX-License-Identifier: Apache-2.0
"""Starts the process that holds the nodes of one Python file (plugin.py): python3 .../marrow/node_process.py FILE

It takes note of every module that is looked for. So it begins before numpy and marrow's package are imported, and
itself imports nothing that the interpreter has not loaded at its start.
"""
import sys

TYPE_CHECKING = False  # typing has it too, but is not imported here
if TYPE_CHECKING:
    from typing import Iterable


class Searches:
    """Notes the folders in which each module was looked for. It finds none itself."""

    def __init__(self) -> None:
        self.places: "dict[str, list[str]]" = {}
        for name in ["sitecustomize", "usercustomize", *sys.modules]:
            self.find_spec(name, getattr(sys.modules.get(name.rpartition(".")[0]), "__path__", None))

    def find_spec(self, name: str, path: "Iterable[object] | None" = None, target: object = None) -> None:
        known = self.places.setdefault(name, [])
        known += [one for one in (sys.path if path is None else path) if isinstance(one, str) and one not in known]


if __name__ == "__main__":
    if not getattr(sys.flags, "safe_path", False):
        del sys.path[0]  # the folder of this file, whose modules are marrow's
    searches = Searches()
    sys.meta_path.insert(0, searches)
    from marrow import plugin  # only now, so that what it looks for is noted

    sys.exit(plugin.main(sys.argv[1:], searches.places))
