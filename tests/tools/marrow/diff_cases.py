# SPDX-License-Identifier: Apache-2.0
"""What the tests of comparing and repeating runs share: pipelines, and runs of them into folders."""
import json

from harness import BUILD, TEST_PLUGINS
from harness.program import Case, marrow

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
    def setUp(self):
        super().setUp()
        self.plugins = [TEST_PLUGINS]
        self.environment = {}

    def marrow(self, *arguments, **more):
        return marrow(
            *arguments, plugins=self.plugins, extra_environment=self.environment, **{"cwd": self.scratch, **more}
        )

    def run_into(self, name, text, *arguments, code=0):
        result = self.marrow("run", self.write("p.yaml", text), "--out", name, "--quiet", *arguments)
        self.assertEqual(result.returncode, code, result.stderr)

    def diff(self, code, *arguments):
        result = self.marrow("diff", *arguments)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        self.assertEqual(result.stderr, "")
        return result.stdout

    def expect(self, code, text):
        """That the difference of the runs a and b is told in these words."""
        self.assertEqual(self.diff(code, "a", "b"), "first run (was): a\nsecond run (is): b\n\n" + text)

    def use_version(self, version, extra=b""):
        """A plugin that is built again under its old name. `extra` bytes at its end only give it another build id."""
        folder = self.scratch / "plugins"
        folder.mkdir(exist_ok=True)
        (folder / "marrow_versions.so").unlink(missing_ok=True)
        (folder / "marrow_versions.so").write_bytes(
            (VERSIONS / ("marrow_test_versions_%d.so" % version)).read_bytes() + extra
        )
        self.plugins = [folder, TEST_PLUGINS]

    def build_ids(self, a="a", b="b"):
        ids = [json.loads((self.scratch / name / "run.json").read_text())["plugins"] for name in (a, b)]
        return [next(plugin["build_id"][:8] for plugin in one if plugin["file"] == "marrow_versions.so") for one in ids]
