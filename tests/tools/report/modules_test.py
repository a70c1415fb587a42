#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The modules of the pages: each is reached, none imports itself by way of others, each export has a reader, each
import is used, and no file uses a global but the browser's."""
import re
import shutil
import subprocess
import sys
import unittest

from harness.modules import TOOLS

ENTRIES = [TOOLS / "report" / "page" / "main.js", TOOLS / "workbench" / "page" / "main.js"]
BROWSER = set(
    """
    AbortController Array Blob Boolean CSS Date Error Event EventTarget Float32Array Float64Array Image ImageData
    Infinity Int16Array Int32Array IntersectionObserver Intl JSON Map Math NaN Number Object OffscreenCanvas Promise
    RegExp ResizeObserver Set String URL URLSearchParams Uint16Array Uint32Array Uint8Array Uint8ClampedArray WeakMap
    addEventListener atob cancelAnimationFrame clearInterval clearTimeout console decodeURIComponent devicePixelRatio
    document encodeURIComponent fetch getComputedStyle getSelection globalThis history innerHeight innerWidth
    localStorage location matchMedia navigator parent parseFloat parseInt performance removeEventListener
    requestAnimationFrame sessionStorage setInterval setTimeout structuredClone undefined window
    """.split()
)
KEYWORDS = set(
    """
    arguments async await break case catch class const continue default delete do else export extends false finally for
    from function get if import in instanceof let new null of return set static super switch this throw true try typeof
    var void while yield
    """.split()
)
NAME = r"[A-Za-z_$][\w$]*"
IMPORT = re.compile(r"import (?:(?P<names>\{[^}]*\}|\* as %s|text) from )?'(?P<path>[^']+)';\n" % NAME)


def members(text, space, target):
    return {(target, name) for name in re.findall(r"\b%s\.(%s)" % (re.escape(space), NAME), text)}


def read_by_tests():
    """What tests call by modules() of modules.py."""
    texts = [path.read_text() for path in TOOLS.parent.glob("tests/**/*.py")]
    spaces = [(text, re.findall(r'(\w+)="((?:report|workbench)/page/\w+\.js)"', text)) for text in texts]
    return set().union(*(members(text, name, TOOLS / path) for text, found in spaces for name, path in found))


class Module:
    def __init__(self, path):
        self.path, text = path, path.read_text()
        self.named, self.spaces, self.imports = [], {}, []
        for found in IMPORT.finditer(text):
            if not found["path"].startswith(".") or found["path"].endswith(".md"):  # a library, or a text
                continue
            target = (path.parent / found["path"]).resolve()
            self.imports.append(target)
            names = re.findall(NAME, found["names"] or "")
            if "*" in (found["names"] or ""):
                self.spaces[names[-1]] = target
            else:
                self.named += [(target, name) for name in names]
        self.body = IMPORT.sub("", text)
        self.code = re.sub(r"^ *//.*$", "", self.body, flags=re.M)
        self.exports = re.findall(r"^export (?:async )?(?:const|let|class|function) (%s)" % NAME, text, re.M)
        self.reads = set(self.named).union(*(members(self.code, *item) for item in self.spaces.items()))

    def globals(self):
        """esbuild replaces a word where it is a global, and leaves those that the file declares or imports."""
        words = set(re.findall(NAME, self.body)) - KEYWORDS
        command = ["esbuild", str(self.path), *("--define:%s=global_%s" % (word, word) for word in words)]
        text = subprocess.run(command, capture_output=True, encoding="utf-8", check=True).stdout
        return set(re.findall(r"\bglobal_(%s)" % NAME, text))


class ModulesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.modules = {path: Module(path) for entry in ENTRIES for path in sorted(entry.parent.glob("*.js"))}

    def test_none_imports_itself_and_each_is_reached(self):
        done, reached = set(), set()

        def visit(path, way):
            self.assertNotIn(path, way, "a circle of imports")
            reached.add(path)
            if path in done:
                return
            for target in self.modules[path].imports:
                visit(target, way + [path])
            done.add(path)

        for entry in ENTRIES:
            visit(entry, [])
        self.assertEqual(set(self.modules) - reached, set(), "imported by nobody")

    def test_each_export_has_a_reader(self):
        read = read_by_tests().union(*(module.reads for module in self.modules.values()))
        exports = {(path, name) for path, module in self.modules.items() for name in module.exports}
        self.assertEqual(exports - read, set(), "exported for nobody")
        self.assertEqual(read - exports, set(), "not exported")

    def test_each_import_is_used(self):
        for module in self.modules.values():
            for name in [name for _, name in module.named] + list(module.spaces):
                self.assertRegex(module.code, r"\b%s\b" % re.escape(name), "unused in %s" % module.path)

    def test_no_global_but_the_browsers(self):
        for module in self.modules.values():
            with self.subTest(module.path.name):
                self.assertEqual(module.globals() - BROWSER, set())

    def test_what_the_pages_give_to_others(self):
        """Files beside a report call Parts.take; tests look at what is shown."""
        given = [name for module in self.modules.values() for name in re.findall(r"globalThis\.(\w+)", module.body)]
        self.assertEqual(sorted(given), ["Parts", "marrow", "marrow", "marrow"])


if __name__ == "__main__":
    if not shutil.which("esbuild"):
        print("skipped: missing Debian package: esbuild")
        sys.exit(77)
    unittest.main(verbosity=2)
