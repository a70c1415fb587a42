#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Does the interface that plugins are built with differ from the one that is kept for this minor version?

    abi_test.py            compare
    abi_test.py --store    keep today's: after the version's minor number was raised

Compared are the types (abidiff, by the debugging information of interface.cpp) and the functions that the library
exports. Added functions are no difference. Skipped where abidiff (package abigail-tools) is missing.
"""
import json
import lzma
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

from harness import BUILD, SOURCE

FOLDER = SOURCE / "tests" / "framework" / "abi"
VERSION = re.search(r"project\(marrow VERSION (\d+\.\d+)", (SOURCE / "CMakeLists.txt").read_text()).group(1)
TYPES, FUNCTIONS = FOLDER / ("types-%s.abi.xz" % VERSION), FOLDER / ("functions-%s.txt" % VERSION)
CURE = (
    "plugins built before this change do not fit any more: raise the minor number of the version in CMakeLists.txt, "
    "say so in CHANGELOG.md, and run PYTHONPATH=tests tests/framework/abi/abi_test.py --store"
)


def compile_command():
    for command in json.loads((BUILD / "compile_commands.json").read_text()):
        if command["file"].endswith("framework/plugin_headers.cpp"):
            return command["command"].split()
    raise SystemExit("compile_commands.json does not have plugin_headers.cpp")


def types_of(headers, folder):
    """The description of all types in interface.cpp, as abidw writes it, of the headers in this folder."""
    own = "-I%s" % (SOURCE / "framework")
    words = ["-I%s" % headers if word == own else word for word in compile_command()]
    flags = [word for word in words[1:] if re.match(r"-(I|D|std|f)|/usr", word) or word == "-isystem"]
    library = folder / "interface.so"
    subprocess.run(
        [words[0], *flags, "-g", "-O0", "-fPIC", "-shared", "-fvisibility=default", "-femit-class-debug-always"]
        + [str(FOLDER / "interface.cpp"), "-o", str(library)],
        check=True,
    )
    description = folder / "interface.abi"
    subprocess.run(
        ["abidw", "--no-show-locs", "--no-comp-dir-path", "--no-corpus-path", "--headers-dir", str(headers)]
        + ["--drop-private-types", "--out-file", str(description), str(library)],
        check=True,
    )
    description.write_text(description.read_text().replace(str(SOURCE) + "/", ""))
    return description


def exported():
    """The functions that the library exports and the installed headers declare, but for templates, which come and go
    with the compiler."""
    headers = SOURCE / "framework" / "marrow"
    texts = [path.read_text() for path in headers.rglob("*.hpp")]
    texts = [text for text in texts if "namespace MARROW_EXPORT marrow {" in text]  # not what only tests call
    declared = set(re.findall(r"(~?\w+)\(", "\n".join(texts)))
    library = next((BUILD / "lib").glob("libmarrow.so.*.*"))
    nm = ["nm", "-D", "-C", "--defined-only", str(library)]
    lines = subprocess.run(nm, capture_output=True, text=True, check=True).stdout.splitlines()
    functions = {
        line.split(" ", 2)[2].replace("[abi:cxx11]", "") for line in lines if re.match(r"\S+ T marrow::", line)
    }
    names = {name: name.split("(")[0] for name in functions}
    return sorted(n for n, name in names.items() if "<" not in name and name.split("::")[-1] in declared)


def difference(before, now):
    """What abidiff says of two descriptions; empty where there is nothing."""
    found = subprocess.run(["abidiff", str(before), str(now)], capture_output=True, text=True)
    if found.returncode & 3:
        raise SystemExit("abidiff failed: " + found.stderr)
    return found.stdout if found.returncode & 12 else ""


class Abi(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="marrow-abi-"))

    def tearDown(self):
        shutil.rmtree(self.folder)

    def test_types_are_those_of_this_version(self):
        kept = self.folder / "kept.abi"
        kept.write_bytes(lzma.decompress(TYPES.read_bytes()))
        found = difference(kept, types_of(SOURCE / "framework", self.folder))
        self.assertEqual(found, "", CURE)

    def test_functions_are_those_of_this_version(self):
        gone = sorted(set(FUNCTIONS.read_text().splitlines()) - set(exported()))
        self.assertEqual(gone, [], CURE)

    def test_a_new_virtual_function_is_found(self):
        headers = self.folder / "include"
        shutil.copytree(SOURCE / "framework", headers)
        functions = headers / "marrow" / "domain" / "functions.hpp"
        text = functions.read_text()
        self.assertIn("  virtual ~Cost();\n", text)
        functions.write_text(
            text.replace("  virtual ~Cost();\n", "  virtual ~Cost();\n  virtual int number() const;\n")
        )
        (self.folder / "changed").mkdir()
        changed = types_of(headers, self.folder / "changed")
        found = difference(types_of(SOURCE / "framework", self.folder), changed)
        self.assertIn("virtual int marrow::Cost::number() const", found)


def store():
    with tempfile.TemporaryDirectory() as folder:
        description = types_of(SOURCE / "framework", pathlib.Path(folder))
        TYPES.write_bytes(lzma.compress(description.read_bytes(), preset=9))
    FUNCTIONS.write_text("\n".join(exported()) + "\n")
    print("kept: %s and %s" % (TYPES.name, FUNCTIONS.name))


if __name__ == "__main__":
    if not all(shutil.which(program) for program in ("abidw", "abidiff", "nm")):
        print("abidiff is missing: apt-get install abigail-tools")
        sys.exit(77)
    if "--store" in sys.argv:
        store()
    else:
        unittest.main(verbosity=2)
