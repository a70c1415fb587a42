# SPDX-License-Identifier: Apache-2.0
"""The store that hosts share as a person meets it: results come from it, its faults are notes, and it is tidied up only
when somebody asks for it."""
import re

from harness.program import Case, main

SLOW = """marrow: 1
nodes:
  work: {uses: test.work, with: {value: 1.1}}
  c: {uses: test.constant, with: {value: 3}}
  sum: {uses: test.add, in: {a: work, b: c}}
outputs: {number: sum}
"""
QUICK = "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 3}}\noutputs: {number: c}\n"


class SharedCache(Case):
    has_own_store = False  # but one for each host

    def setUp(self):
        super().setUp()
        self.shared = self.scratch / "shared"
        self.shared.mkdir(mode=0o700)
        self.write("p.yaml", SLOW)
        self.runs = 0

    def marrow(self, *arguments, host="one", shared=None, **environment):
        environment = {"MARROW_CACHE": str(self.scratch / host), **environment}
        if shared is not False:
            environment["MARROW_SHARED_CACHE"] = str(shared or self.shared)
        return super().marrow(*arguments, extra_environment=environment)

    def run_on(self, host, *more, **environment):
        """What the nodes of a run on a host did: how many calls were made, and how many results were read back."""
        self.runs += 1
        out = "out-%d" % self.runs
        self.stderr = self.expect(0, "run", "p.yaml", "--out", out, *more, host=host, **environment).stderr
        self.number = self.read(out + "/outputs/number.json")
        return {name: (node["calls"], node["cached"]) for name, node in self.nodes(out).items()}

    def results(self, **which):
        """How many results each of the stores holds."""
        info = self.printed("cache", "info", **which)
        return [int(count) for count in re.findall(r"^all +(\d+)", info, re.M)]

    def test_what_one_host_has_made_the_other_reads(self):
        made = self.run_on("one")
        number = self.number
        self.assertEqual(made["work"], (1, 0))
        read = self.run_on("two")
        self.assertEqual((read["work"], read["c"]), ((0, 1), (1, 0)), "one second is the least that is shared")
        self.assertEqual(self.number, number)
        self.assertEqual(self.results(host="two"), [3, 1])
        self.assertEqual(self.results(host="two", shared=False), [3])
        key = next(path.name for path in self.shared.glob("??/*"))
        self.assertIn("test.work", self.printed("cache", "why", key, host="two"))
        why = self.marrow("cache", "why", "0" * 32, host="two")
        self.assertIn("or the shared one %s, holds no result with a key" % self.shared, why.stderr)

    def test_the_option_names_the_folder(self):
        self.run_on("one", "--shared-cache", self.shared, shared=False)
        self.assertEqual(self.results(), [3, 1])
        plan = self.expect(0, "plan", "p.yaml", "--shared-cache", self.shared, host="two", shared=False)
        self.assertRegex(plan.stdout, r"work +test.work +cached")
        self.assertEqual(plan.stderr, "")

    def test_faults_are_notes(self):
        self.write("letters/letter.txt", "")
        self.write("p.yaml", QUICK)
        letters = self.scratch / "letters"
        said = "the folder %s holds other things and is no shared store of marrow" % letters
        self.run_on("one", shared=letters)
        self.assertEqual(self.stderr.count(said), 1, self.stderr)
        self.assertIn("the shared store is not used", self.stderr)
        plan = self.expect(0, "plan", "p.yaml", shared=letters).stderr
        self.assertEqual(plan.count("marrow: note: the shared store is not used: " + said), 1, plan)
        self.refused(said, "cache", "info", shared=letters)

    def test_a_pipeline_does_not_read_the_folder(self):
        self.write("q.yaml", QUICK.replace("value: 3", "value: 3, path: %s" % self.scratch))
        run = ["run", "q.yaml", "--out", "/tmp/marrow-no-such-run"]
        said = self.expect(2, *run, MARROW_CACHE="/tmp/marrow-none").stderr
        self.assertRegex(said, "the shared store of results .* lies in .*set MARROW_SHARED_CACHE to another folder")

    def test_only_people_tidy_it_up(self):
        self.run_on("one")
        self.run_on("two", MARROW_CACHE_GB="0")
        self.assertEqual(self.results(host="two"), [0, 1], "a run tidies up its own host's store only")
        self.assertIn("3 results removed", self.printed("cache", "gc", "--keep-gb", 0))
        self.assertEqual(self.results(), [0, 1])
        self.assertIn("1 results removed", self.printed("cache", "gc", "--shared", "--keep-gb", 0))
        self.assertEqual(self.results(), [0, 0])
        said = "there is no shared store: MARROW_SHARED_CACHE is not set; nothing is removed"
        self.refused(said, "cache", "gc", "--shared", shared=False)


if __name__ == "__main__":
    main()
