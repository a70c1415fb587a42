# SPDX-License-Identifier: Apache-2.0
"""Small pipelines of numbers, and the program run on them in a folder of the test's own."""
from harness import TEST_PLUGINS
from harness.program import Case, marrow

NUMBER = "marrow: 1\n%snodes:\n  c: {uses: test.constant, with: {value: 3}}\noutputs: {number: c}\n"


class Commands(Case):
    def marrow(self, *arguments, **more):
        return marrow(*arguments, plugins=[TEST_PLUGINS], **{"cwd": self.scratch, **more})

    def expect(self, code, *arguments, **more):
        result = self.marrow(*arguments, **more)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result

    def everything(self):
        return sorted(str(path.relative_to(self.scratch)) for path in self.scratch.rglob("*"))
