# SPDX-License-Identifier: Apache-2.0
"""Who may include whom: docs/architecture.md names the layers, this holds them apart."""
import pathlib
import re
import unittest

from harness import SOURCE

INCLUDE = re.compile(r'^\s*#\s*include\s*["<]([^">]+)[">]', re.M)
# What a layer may include besides itself. A plugin may also include its own folder, a topic those named in TOPICS.
LAYERS = {
    "domain": {"domain"},
    "runtime": {"domain", "runtime"},
    "testing": {"domain", "runtime"},
    "compare": {"domain", "runtime", "compare"},
    "toolbox": {"domain", "runtime"},
    "plugins": {"domain", "runtime", "toolbox"},
    "tools": {"domain", "runtime", "compare", "toolbox", "tools"},
    "python": {"domain", "runtime", "compare", "python"},
}
TOPICS = {
    "analytic": {"image"},
    "calibration": {"files"},
    "draw": {"image"},
    "exchange": {"files"},
    "match": {"image"},
    "phantom": {"calibration", "files"},
    "shaft": {"image"},
    "track": {"files"},
}


def folder_of(path):
    """(layer, topic or kind) of a file, given by its path from the source folder."""
    parts = path.parts
    if {"template", "templates"} & set(parts):  # what a new node or kind begins with
        return ("tests", "")
    if parts[:3] == ("framework", "include", "marrow"):
        parts = ("framework",) + (parts[3:] if len(parts) > 4 else ("runtime",))
    if parts[0] == "framework":
        return (parts[1], parts[2] if parts[1] == "toolbox" else "")
    return ("plugins", parts[1]) if parts[0] == "plugins" else (parts[0], "")


def included(path, name):
    """The file of this project that an include names, or None."""
    for base in (path.parent, pathlib.Path("framework/include"), pathlib.Path("."), pathlib.Path("framework")):
        candidate = pathlib.Path(base, name)
        if (SOURCE / candidate).is_file():
            return pathlib.Path((SOURCE / candidate).resolve()).relative_to(SOURCE.resolve())
    return None


def fault(path, other):
    """Why the first may not include the second, or None."""
    (layer, part), (other_layer, other_part) = folder_of(path), folder_of(other)
    if layer not in LAYERS or (layer, part) == (other_layer, other_part):
        return None
    if layer == other_layer == "toolbox":
        return None if other_part in TOPICS.get(part, ()) else "topic %s does not build on %s" % (part, other_part)
    if layer == other_layer == "plugins":
        return "a node of the kind %s may not use files of the kind %s: share them in the toolbox" % (part, other_part)
    return None if other_layer in LAYERS[layer] else "%s may not include %s" % (layer, other_layer)


class Layers(unittest.TestCase):
    def test_each_layer_includes_only_what_lies_below(self):
        faults, seen = [], 0
        for pattern in ("framework", "plugins", "tools", "python"):
            for file in sorted((SOURCE / pattern).rglob("*.?pp")):
                path = file.relative_to(SOURCE)
                for name in INCLUDE.findall(file.read_text()):
                    other = included(path, name)
                    seen += other is not None
                    why = other and fault(path, other)
                    if why:
                        faults.append("%s includes %s: %s" % (path, other, why))
        self.assertGreater(seen, 1000)
        self.assertEqual(faults, [])

    def test_what_is_wrong_is_found(self):
        path = pathlib.Path
        self.assertIn("share them", fault(path("plugins/camera/a.cpp"), path("plugins/read/b.hpp")))
        self.assertIn("may not include compare", fault(path("plugins/camera/a.cpp"), path("framework/compare/b.hpp")))
        self.assertIn("may not include runtime", fault(path("framework/domain/a.cpp"), path("framework/runtime/b.hpp")))
        self.assertIn(
            "does not build on",
            fault(path("framework/toolbox/files/a.cpp"), path("framework/include/marrow/toolbox/image/b.hpp")),
        )
        self.assertIn(
            "may not include toolbox",
            fault(path("python/bindings/a.cpp"), path("framework/include/marrow/toolbox/image/b.hpp")),
        )
        self.assertIsNone(fault(path("framework/toolbox/files/a.cpp"), path("framework/toolbox/files/b.hpp")))
        self.assertIsNone(fault(path("plugins/camera/a.cpp"), path("framework/marrow/plugin.hpp")))


if __name__ == "__main__":
    unittest.main()
