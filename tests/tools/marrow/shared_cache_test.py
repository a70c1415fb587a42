# SPDX-License-Identifier: Apache-2.0
"""The store that hosts share as a person meets it: results come from it, its faults are notes, and it is tidied up only
when somebody asks for it."""
import json
import re

from harness import TEST_PLUGINS
from harness.program import Case, main, marrow

SLOW = """marrow: 1
nodes:
  work: {uses: test.work, with: {value: 1.1}}
  c: {uses: test.constant, with: {value: 3}}
  sum: {uses: test.add, in: {a: work, b: c}}
outputs: {number: sum}
"""
QUICK = "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 3}}\noutputs: {number: c}\n"


class SharedCache(Case):
    def setUp(self):
        super().setUp()
        self.shared = self.scratch / "shared"
        self.shared.mkdir(mode=0o700)
        self.pipeline = self.write("p.yaml", SLOW)
        self.runs = 0

    def marrow(self, *arguments, host="one", shared=None, **environment):
        environment = {"MARROW_CACHE": str(self.scratch / host), **environment}
        if shared is not False:
            environment["MARROW_SHARED_CACHE"] = str(shared or self.shared)
        return marrow(*arguments, plugins=[TEST_PLUGINS], cwd=self.scratch, extra_environment=environment)

    def run_on(self, host, *more, **environment):
        """What the nodes of a run on a host did: how many calls were made, and how many results were read back."""
        self.runs += 1
        out = self.scratch / ("out-%d" % self.runs)
        result = self.marrow("run", self.pipeline, "--out", out, *more, host=host, **environment)
        self.assertEqual(result.returncode, 0, result.stderr)
        nodes = {node["id"]: node for node in json.loads((out / "run.json").read_text())["nodes"]}
        self.stderr, self.number = result.stderr, (out / "outputs" / "number.json").read_bytes()
        return {name: (node["calls"], node["cached"]) for name, node in nodes.items()}

    def results(self, **which):
        """How many results each of the stores holds."""
        info = self.marrow("cache", "info", **which)
        self.assertEqual(info.returncode, 0, info.stderr)
        return [int(count) for count in re.findall(r"^all +(\d+)", info.stdout, re.M)]

    def test_what_one_host_has_made_the_other_reads(self):
        made = self.run_on("one")
        number = self.number
        self.assertEqual(made["work"], (1, 0))
        read = self.run_on("two")
        self.assertEqual((read["work"], read["c"]), ((0, 1), (1, 0)), "one second is the least that is shared")
        self.assertEqual(self.number, number)
        self.assertEqual(self.results(host="two"), [3, 1])
        self.assertEqual(self.results(host="two", shared=False), [3])

    def test_the_option_names_the_folder(self):
        self.run_on("one", "--shared-cache", self.shared, shared=False)
        self.assertEqual(self.results(), [3, 1])
        plan = self.marrow("plan", self.pipeline, "--shared-cache", self.shared, host="two", shared=False)
        self.assertRegex(plan.stdout, r"work +test.work +cached")
        self.assertEqual(plan.stderr, "")

    def test_faults_are_notes(self):
        letter = self.scratch / "letters"
        letter.mkdir()
        (letter / "letter.txt").write_text("")
        said = "the folder %s holds other things and is no shared store of marrow" % letter
        self.run_on("one", shared=letter)
        self.assertEqual(self.stderr.count(said), 1, self.stderr)
        self.assertIn("the shared store is not used", self.stderr)
        plan = self.marrow("plan", self.pipeline, shared=letter)
        self.assertEqual(plan.returncode, 0)
        self.assertEqual(plan.stderr.count("marrow: note: the shared store is not used: " + said), 1, plan.stderr)
        info = self.marrow("cache", "info", shared=letter)
        self.assertEqual(info.returncode, 2)
        self.assertIn(said, info.stderr)

    def test_a_pipeline_does_not_read_the_folder(self):
        self.pipeline = self.write("q.yaml", QUICK.replace("value: 3", "value: 3, path: %s" % self.scratch))
        result = self.marrow("run", self.pipeline, "--out", "/tmp/marrow-no-such-run", MARROW_CACHE="/tmp/marrow-none")
        self.assertEqual(result.returncode, 2)
        self.assertRegex(
            result.stderr, "the shared store of results .* lies in .*set MARROW_SHARED_CACHE to another folder"
        )

    def test_only_people_tidy_it_up(self):
        self.run_on("one")
        self.run_on("two", MARROW_CACHE_GB="0")
        self.assertEqual(self.results(host="two"), [0, 1], "a run tidies up its own host's store only")
        self.assertIn("3 results removed", self.marrow("cache", "gc", "--keep-gb", 0).stdout)
        self.assertEqual(self.results(), [0, 1])
        self.assertIn("1 results removed", self.marrow("cache", "gc", "--shared", "--keep-gb", 0).stdout)
        self.assertEqual(self.results(), [0, 0])
        result = self.marrow("cache", "gc", "--shared", shared=False)
        self.assertEqual(result.returncode, 2)
        self.assertIn("there is no shared store: MARROW_SHARED_CACHE is not set; nothing is removed", result.stderr)

    def test_why_looks_there_too(self):
        self.run_on("one")
        key = next(path.name for path in self.shared.glob("??/*"))
        why = self.marrow("cache", "why", key, host="two")
        self.assertEqual(why.returncode, 0, why.stderr)
        self.assertIn("test.work", why.stdout)
        why = self.marrow("cache", "why", "0" * 32, host="two")
        self.assertIn("or the shared one %s, holds no result with a key" % self.shared, why.stderr)


if __name__ == "__main__":
    main()
