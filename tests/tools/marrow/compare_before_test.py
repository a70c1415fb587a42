# SPDX-License-Identifier: Apache-2.0
"""What can be known before a comparison runs is said before any cell runs, or after the first ones."""
from compare_cases import Compared
from harness import TEST_PLUGINS
from harness.program import main

PIPELINE = """marrow: 1
inputs: {case: {type: path}}
nodes:
  f: {uses: test.fragments, with: {path: $case}}
  each: {uses: test.declared, in: {of: f}}
  free: {uses: test.undeclared, in: {of: f}}
  way: {uses: test.way}
  search: {uses: test.stages, in: {of: f, way: way}}
  staged: {uses: test.declared, in: {of: search}}
  c: {uses: test.case, with: {path: $case}}
  errors: {uses: test.between, in: {start: c.starts, truth: c.truths}}
outputs: {each: each, free: free, staged: staged, errors: errors}
"""
EXPERIMENT = "experiment: 1\npipeline: p.yaml\ncases: %s\nvariants: %s\nmetrics:\n  - %s\ntimed_cells: 0\n"
FIRST = "this is so in the first cells of all variants, so the others were not run; name another figure in %s\n"


class Before(Compared):
    plugins = [TEST_PLUGINS, TEST_PLUGINS.parent / "figure_plugins"]
    pipeline, cases = PIPELINE, ()

    def setUp(self):
        super().setUp()
        self.add_cases({"one": "distal proximal", "two": "proximal distal"})

    def add_cases(self, fragments):
        for name, text in fragments.items():
            self.write("cases/%s/fragments.txt" % name, text)

    def compare(self, status, figure, *arguments, variants="{a: {}, b: {}}", cases="{folders: [cases/*]}"):
        self.write("e.yaml", EXPERIMENT % (cases, variants, figure))
        return super().compare(*arguments, status=status)

    def cells(self):
        cells = self.out / "cells"
        return sorted(str(path.parent.relative_to(cells)) for path in cells.rglob("cell.json"))

    def assert_said_before(self, message, figure, *others, **more):
        """By both commands, at the line of the figure, and no cell runs; and what other lines are said."""
        for command in (("--dry-run",), ()):
            with self.subTest(message, command=command):
                told = self.compare(2, figure, *command, **more).stderr
                said = [line for line in told.splitlines() if not line.startswith("  looking at case ")]
                self.assertEqual(said[0], "%s:6:5: error: %s" % (self.file, message))
                self.assertEqual(self.cells(), [])
                for line in others:
                    self.assertIn(line, said)
        return said

    def test_figures_and_items_that_there_cannot_be(self):
        message = "output 'each' (test.declared) has no figure 'mtre_m'"
        said = self.assert_said_before(message, "each.distal.mtre_m")
        lines = ["    - each.distal.mtre_m", "      ^", "  hint: did you mean 'mtre_mm'?", "1 error"]
        self.assertEqual(said[1:], lines)
        message = "'%s.dital.mtre_mm': there is no fragment 'dital' in the cases 'one' and 'two'"
        self.assert_said_before(message % "each", "each.dital.mtre_mm", "  hint: did you mean 'distal'?")
        self.assert_said_before(message % "errors", "errors.dital.mtre_mm")  # one of several lists may be absent
        message = "'each.femur.mtre_mm': there is no fragment 'femur' in case 'one'"
        self.assert_said_before(message, "each.femur.mtre_mm", cases="{folders: [cases/one]}")

    def test_only_the_nodes_that_name_the_items_run(self):
        self.compare(0, "each.distal.mtre_mm", "--dry-run")
        listed = self.printed("cache", "info")
        self.assertIn("test.fragments", listed)
        self.assertNotIn("test.declared", listed)

    def test_cases_and_variants_may_differ(self):
        every = ["a/one/0", "a/two/0", "b/one/0", "b/two/0"]
        self.compare(0, "free.distal.extra", variants="{a: {free.also: extra}, b: {}}")
        self.assertEqual(self.cells(), every)
        self.add_cases({"one": "distal"})
        told = self.compare(0, "each.proximal.mtre_mm").stdout
        self.assertIn("there are distal along 'fragment', name one of them", told)
        self.assertEqual(self.cells(), every)

    def test_if_nothing_can_be_learned_the_comparison_runs(self):
        for fragments, why in (("fail", "node 'f' (test.fragments) failed: the file says so"), ("crash", "Aborted")):
            with self.subTest(fragments):
                self.add_cases({"one": fragments})
                for command in (("--dry-run",), ()):
                    told = self.compare(0, "each.dital.mtre_mm", *command).stderr
                    self.assertRegex(told, "note: whether there are the items that figures name is not checked: .*")
                    self.assertIn(why, told)
                self.assertEqual(len(self.cells()), 4)

    def test_a_case_that_is_not_made_yet(self):
        self.write("s.yaml", "marrow: 1\nnodes:\n  c: {uses: test.constant}\noutputs: {case: c}\n")
        cases = "{simulate: {pipeline: s.yaml, seeds: [1]}}"
        told = self.compare(0, "each.dital.mtre_mm", "--dry-run", "--no-cache", cases=cases).stderr
        self.assertIn("is not checked: case 'seed-1' is not made yet", told)
        self.assertFalse(self.out.exists())

    def assert_said_after_the_first(self, figure, message, cells):
        told = self.compare(2, figure, "--jobs", "1", "--quiet").stderr
        self.assertEqual(told, "marrow: error: %s; " % message + FIRST % self.file)
        self.assertEqual(self.cells(), cells)

    def test_what_is_not_declared_ends_after_the_first_cells(self):
        self.assert_said_after_the_first(
            "errors.distal.mtre_mm",
            "'errors.distal.mtre_mm' was not made: its case has no truth, or an item is absent; without a truth this "
            "pipeline gives each.FRAGMENT.mtre_mm, each.FRAGMENT.*.median_px, free.FRAGMENT.*, "
            "staged.FRAGMENT.STAGE.mtre_mm, staged.FRAGMENT.STAGE.*.median_px, errors.FRAGMENT.mtre_mm",
            ["a/one/0", "a/two/0", "b/one/0"],
        )
        self.add_cases({"c%d" % i: "distal other%d" % i for i in range(6)})
        for figure, fault in (
            ("free.distal.mtre_m", "there is no figure 'mtre_m'; did you mean 'mtre_mm'?"),
            ("staged.distal.finl.mtre_mm", "there are start, final along 'stage', name one of them"),
        ):
            cells = ["a/c0/0", "a/c1/0", "a/one/0", "a/two/0", "b/c0/0", "b/one/0"]
            self.assert_said_after_the_first(figure, "'%s': %s" % (figure, fault), cells)

    def test_how_many_cases_it_takes(self):
        # 10 * 2 / 2^8 = 0.078 and 10 * 2 / 2^9 = 0.039: Holm's p of the smallest of ten, where all cases agree.
        self.add_cases({"c%d" % i: "distal other%d" % i for i in range(6)})
        variants = "{%s}" % ", ".join("v%d: {}" % v for v in range(11))
        told = self.compare(0, "each.distal.mtre_mm", "--dry-run", variants=variants)
        said = "10 comparisons with the baseline, for which a difference takes at least 9 cases\n"
        self.assertIn(said, told.stdout)
        self.assertIn(
            "marrow: note: 8 cases cannot show a difference among 10 comparisons: even if all go the same way, p stays "
            "above 0.05 after Holm's correction; it takes at least 9\n",
            told.stderr,
        )

    def test_a_picture_that_is_none(self):
        told = self.compare(2, "each.distal.mtre_mm\npictures:\n  - each").stderr
        self.assertIn("e.yaml:8:5: error: output 'each' is metrics, not a picture", told)
        self.assertIn("hint: name an output of a render node", told)


if __name__ == "__main__":
    main()
