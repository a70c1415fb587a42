# SPDX-License-Identifier: Apache-2.0
"""What the tests of comparing and repeating runs share: pipelines, and runs of them into folders."""
from harness import BUILD, TEST_PLUGINS
from harness.program import Case

VERSIONS = BUILD / "tests" / "plugin_versions"
CHAIN = """marrow: 1
nodes:
  draw: {uses: test.draw}
  first: {uses: test.constant, with: {value: 3, word: one}}
  other: {uses: test.constant, with: {value: 4}}
  sum: {uses: test.add, in: {a: first, b: other}}
  drawn: {uses: test.add, in: {a: sum, b: draw}}
outputs: {sum: sum, drawn: drawn}
"""


class Runs(Case):
    has_own_store = False

    def setUp(self):
        super().setUp()
        self.plugins = [TEST_PLUGINS]
        self.environment = {}

    def run_into(self, name, text, *arguments, code=0):
        self.expect(code, "run", self.write("p.yaml", text), "--out", name, "--quiet", *arguments)

    def diff(self, code, *arguments):
        result = self.expect(code, "diff", *arguments)
        self.assertEqual(result.stderr, "")
        return result.stdout

    def expect_diff(self, code, text):
        """That the difference of the runs a and b is told in these words."""
        self.assertEqual(self.diff(code, "a", "b"), "first run (was): a\nsecond run (is): b\n\n" + text)

    def run_both(self, first, second, *arguments, status=0):
        """Runs of two texts into a and b; the second has these arguments, and ends with this status."""
        self.run_into("a", first)
        self.run_into("b", second, *arguments, code=status)

    def diff_of(self, code, *texts, **more):
        self.run_both(*texts, **more)
        return self.diff(code, "a", "b")

    def expect_diff_of(self, code, text, *texts, **more):
        self.run_both(*texts, **more)
        self.expect_diff(code, text)

    def use_version(self, version, extra=b""):
        """A plugin that is built again under its old name. `extra` bytes at its end only give it another build id."""
        (self.scratch / "plugins" / "marrow_versions.so").unlink(missing_ok=True)
        library = VERSIONS / ("marrow_test_versions_%d.so" % version)
        self.write("plugins/marrow_versions.so", library.read_bytes() + extra)
        self.plugins = [self.scratch / "plugins", TEST_PLUGINS]

    def build_ids(self, a="a", b="b"):
        ids = [self.json(name + "/run.json")["plugins"] for name in (a, b)]
        return [next(plugin["build_id"][:8] for plugin in one if plugin["file"] == "marrow_versions.so") for one in ids]
