# SPDX-License-Identifier: Apache-2.0
"""Who may include whom: docs/architecture.md names the layers and the rooms, this holds them apart."""
import pathlib
import re
import unittest

from harness import SOURCE

INCLUDE = re.compile(r'^\s*#\s*include\s*["<]([^">]+)[">]', re.M)
# The rooms of the framework. Each stands only on those before it.
ROOMS = """
    base domain runtime/node runtime/process runtime/plugins runtime/pipeline runtime/store runtime/run compare
""".split()
# The topics of the toolbox on which a topic stands.
TOPICS = {
    "calibration": {"files"},
    "draw": {"image"},
    "exchange": {"distortion", "files", "vtk"},
    "files": {"distortion", "geometry"},
    "match": {"image"},
    "network": {"files", "image"},
    "phantom": {"calibration", "files"},
    "track": {"files"},
}
# A part of tools may include those named here, besides itself.
TOOLS = {"marrow": {"report"}, "report": {"marrow"}, "workbench": {"marrow", "report"}}
HEAVY = re.compile(r"^(yaml-cpp|spdlog|pcl|CGAL|vtk|itk|nlopt)")
# Public headers that need such a library, because their reader gives its values.
NEED_IT = {
    "framework/marrow/base/strict_yaml.hpp",
    "framework/marrow/base/yaml.hpp",
    "plugins/optimizer/library/nlopt_run.hpp",
    "plugins/toolbox/files/yaml_text.hpp",
    "plugins/toolbox/vtk/poly_data.hpp",
}


def listed(text, pattern):
    """Groups of a CMake call that name headers: (what stands before them, the headers)."""
    for before, names in re.findall(pattern, text):
        yield before, re.findall(r"[a-z_0-9]+\.hpp", names)


def public_headers():
    """The paths of all headers that CMake's FILE_SETs list."""
    found = set()
    for file in ("framework/CMakeLists.txt", "framework/marrow/compare/CMakeLists.txt"):
        text = (SOURCE / file).read_text()
        for room, names in listed(text, r"marrow_public_headers\(marrow\w* (\S+) ([^)]*)\)"):
            found |= {pathlib.Path("framework/marrow", room, name) for name in names}
    for file in SOURCE.glob("plugins/*/CMakeLists.txt"):
        text = file.read_text()
        for folder, names in listed(text, r"marrow_add_library\(\w+ FOLDER (\S+)[^)]*?HEADERS ([^)]*)\)"):
            below = folder if folder.startswith("toolbox/") else folder + "/library"
            found |= {pathlib.Path("plugins", below, name) for name in names}
    return found


PUBLIC = public_headers()


def home_of(path):
    """(layer, part): a room of the framework, a topic, a kind or a part of tools. None for what belongs to none."""
    parts = path.parts
    if {"template", "templates"} & set(parts) or path.parts[0] not in ("framework", "plugins", "tools", "python"):
        return None  # what a new node or kind begins with
    if parts[0] == "framework":
        inside = "/".join(parts[2:-1])
        return ("framework", inside) if inside in ROOMS else None  # the others collect headers for plugins and tests
    if parts[:2] == ("plugins", "toolbox"):
        return ("toolbox", parts[2])
    return (parts[0], parts[1])


def included(path, name):
    """The file of this project that an include names, or None."""
    places = [path.parent / name, "framework/" + name, name, "tools/" + name, "tools/marrow/" + name]
    if match := re.fullmatch(r"marrow/(toolbox/.+)", name):
        places.append("plugins/" + match[1])
    if match := re.fullmatch(r"marrow/(\w+)/(\w+\.hpp)", name):
        places.append("plugins/%s/library/%s" % match.groups())
    for place in places:
        if (SOURCE / place).is_file():
            return (SOURCE / place).resolve().relative_to(SOURCE.resolve())
    return None


def fault(path, other):
    """Why the first may not include the second, or None."""
    here, there = home_of(path), home_of(other)
    if here is None or there is None or here == there:
        return None
    if here[0] == there[0] == "framework":
        return "%s may not include %s, which stands on it" % (here[1], there[1]) if above(here, there) else None
    if here[0] == there[0] == "toolbox":
        return None if there[1] in TOPICS.get(here[1], ()) else "topic %s does not build on %s" % (here[1], there[1])
    if here[0] == there[0] == "plugins":
        return "a node of the kind %s may not use files of the kind %s: share them in the toolbox" % (here[1], there[1])
    if here[0] == there[0] == "tools":
        return None if there[1] in TOOLS.get(here[1], ()) else "%s may not include %s" % (here[1], there[1])
    may = {"framework": (), "toolbox": ("framework",), "python": ("framework",)}
    if there[0] not in may.get(here[0], ("framework", "toolbox")):
        return "%s may not include %s" % (here[0], there[0])
    if there[1] == "compare" and here[0] in ("toolbox", "plugins"):
        return "%s may not include compare" % here[0]
    return None if other in PUBLIC else "%s is private" % other


def above(here, there):
    return ROOMS.index(there[1]) > ROOMS.index(here[1])


class Layers(unittest.TestCase):
    def test_each_layer_includes_only_what_lies_below(self):
        faults, seen = [], 0
        for layer in ("framework", "plugins", "tools", "python"):
            for file in sorted((SOURCE / layer).rglob("*.?pp")):
                path = file.relative_to(SOURCE)
                for name in INCLUDE.findall(file.read_text()):
                    other = included(path, name)
                    seen += other is not None
                    why = other and fault(path, other)
                    if why:
                        faults.append("%s includes %s: %s" % (path, other, why))
        self.assertGreater(seen, 2000)
        self.assertEqual(faults, [])

    def test_a_public_header_needs_public_headers_only(self):
        self.assertGreater(len(PUBLIC), 150)
        faults = []
        for path in sorted(PUBLIC):
            for name in INCLUDE.findall((SOURCE / path).read_text()):
                other = included(path, name)
                if other and other not in PUBLIC:
                    faults.append("%s includes %s, which is private" % (path, other))
                if HEAVY.match(name) and str(path) not in NEED_IT:
                    faults.append("%s includes <%s>: only sources may" % (path, name))
        self.assertEqual(faults, [])

    def test_what_is_wrong_is_found(self):
        path = pathlib.Path

        def between(one, other):
            return fault(path(one), path(other))

        self.assertIn("share them", between("plugins/camera/a.cpp", "plugins/read/library/b.hpp"))
        self.assertIn("stands on it", between("framework/marrow/domain/a.cpp", "framework/marrow/runtime/node/b.hpp"))
        self.assertIn(
            "stands on it", between("framework/marrow/runtime/plugins/a.cpp", "framework/marrow/runtime/run/b.hpp")
        )
        self.assertIn("may not include compare", between("plugins/camera/a.cpp", "framework/marrow/compare/cell.hpp"))
        self.assertIn("does not build on", between("plugins/toolbox/files/a.cpp", "plugins/toolbox/image/b.hpp"))
        self.assertIn("may not include plugins", between("plugins/toolbox/files/a.cpp", "plugins/read/b.hpp"))
        self.assertIn("may not include toolbox", between("python/bindings/a.cpp", "plugins/toolbox/image/b.hpp"))
        self.assertIn("is private", between("tools/marrow/a.cpp", "framework/marrow/runtime/store/store_file.hpp"))
        self.assertIn("may not include workbench", between("tools/marrow/a.cpp", "tools/workbench/workbench.hpp"))
        self.assertIsNone(between("plugins/toolbox/files/a.cpp", "plugins/toolbox/files/b.hpp"))
        self.assertIsNone(between("plugins/camera/a.cpp", "framework/marrow/plugin.hpp"))
        self.assertIsNone(between("framework/marrow/runtime/run/a.cpp", "framework/marrow/runtime/store/store.hpp"))


if __name__ == "__main__":
    unittest.main()
