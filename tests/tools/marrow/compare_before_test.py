# SPDX-License-Identifier: Apache-2.0
"""What can be known before a comparison runs is said before any cell runs, or after the first ones."""
from harness import TEST_PLUGINS
from harness.program import Case, main, marrow

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


class Before(Case):
    plugins = [TEST_PLUGINS, TEST_PLUGINS.parent / "figure_plugins"]

    def setUp(self):
        super().setUp()
        self.write("p.yaml", PIPELINE)
        self.cases({"one": "distal proximal", "two": "proximal distal"})

    def cases(self, names):
        for name, fragments in names.items():
            (self.scratch / "cases" / name).mkdir(parents=True, exist_ok=True)
            self.write("cases/%s/fragments.txt" % name, fragments)

    def compare(self, code, figure, *arguments, variants="{a: {}, b: {}}", cases="{folders: [cases/*]}"):
        text = "experiment: 1\npipeline: p.yaml\ncases: %s\nvariants: %s\nmetrics:\n  - %s\ntimed_cells: 0\n"
        file = self.write("e.yaml", text % (cases, variants, figure))
        result = self.marrow("compare", file, "--out", self.scratch / "out", *arguments)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result

    def cells(self):
        return sorted(str(path.parent.relative_to(self.scratch / "out" / "cells")) for path in self.rows())

    def rows(self):
        return (self.scratch / "out" / "cells").rglob("cell.json")

    def refused(self, message, figure, *arguments, **more):
        """By both commands, at the line of the figure, and no cell runs. Returns the lines after those of progress."""
        for command in (("--dry-run",), ()):
            with self.subTest(command=command):
                told = self.compare(2, figure, *command, *arguments, **more).stderr
                said = [line for line in told.splitlines() if not line.startswith("  looking at case ")]
                self.assertEqual(said[0], "%s:6:5: error: %s" % (self.scratch / "e.yaml", message))
                self.assertEqual(self.cells(), [])
        return said

    def test_a_figure_that_no_output_can_have(self):
        told = self.refused("output 'each' (test.declared) has no figure 'mtre_m'", "each.distal.mtre_m")
        self.assertEqual(
            told[1:], ["    - each.distal.mtre_m", "      ^", "  hint: did you mean 'mtre_mm'?", "1 error"]
        )

    def test_an_item_that_no_case_has(self):
        told = self.refused(
            "'each.dital.mtre_mm': there is no fragment 'dital' in the cases 'one' and 'two'", "each.dital.mtre_mm"
        )
        self.assertIn("  hint: did you mean 'distal'?", told)

    def test_one_of_several_lists_may_be_absent(self):
        self.refused(
            "'errors.dital.mtre_mm': there is no fragment 'dital' in the cases 'one' and 'two'", "errors.dital.mtre_mm"
        )

    def test_one_case(self):
        self.refused(
            "'each.femur.mtre_mm': there is no fragment 'femur' in case 'one'",
            "each.femur.mtre_mm",
            cases="{folders: [cases/one]}",
        )

    def test_only_the_nodes_that_name_the_items_run(self):
        self.compare(0, "each.distal.mtre_mm", "--dry-run")
        listed = marrow("cache", "info", extra_environment={"MARROW_CACHE": str(self.scratch / "cache")}).stdout
        self.assertIn("test.fragments", listed)
        self.assertNotIn("test.declared", listed)

    def test_cases_may_differ(self):
        self.cases({"one": "distal"})
        told = self.compare(0, "each.proximal.mtre_mm")
        self.assertIn("there are distal along 'fragment', name one of them", told.stdout)
        self.assertEqual(self.cells(), ["a/one/0", "a/two/0", "b/one/0", "b/two/0"])

    def test_if_nothing_can_be_learned_the_comparison_runs(self):
        for fragments, why in (("fail", "node 'f' (test.fragments) failed: the file says so"), ("crash", "Aborted")):
            with self.subTest(fragments=fragments):
                self.cases({"one": fragments})
                for command in (("--dry-run",), ()):
                    told = self.compare(0, "each.dital.mtre_mm", *command).stderr
                    self.assertRegex(told, "note: whether there are the items that figures name is not checked: .*")
                    self.assertIn(why, told)
                self.assertEqual(len(self.cells()), 4)

    def test_a_case_that_is_not_made_yet(self):
        self.write("s.yaml", "marrow: 1\nnodes:\n  c: {uses: test.constant}\noutputs: {case: c}\n")
        told = self.compare(
            0, "each.dital.mtre_mm", "--dry-run", "--no-cache", cases="{simulate: {pipeline: s.yaml, seeds: [1]}}"
        )
        self.assertIn("is not checked: case 'seed-1' is not made yet", told.stderr)
        self.assertFalse((self.scratch / "out").exists())

    def test_what_is_not_declared_ends_after_the_first_cells(self):
        self.cases({"c%d" % i: "distal other%d" % i for i in range(6)})
        for figure, message in (
            ("free.distal.mtre_m", "'free.distal.mtre_m': there is no figure 'mtre_m'; did you mean 'mtre_mm'?"),
            (
                "staged.distal.finl.mtre_mm",
                "'staged.distal.finl.mtre_mm': there are start, final along 'stage', name one of them",
            ),
        ):
            with self.subTest(figure=figure):
                told = self.compare(2, figure, "--jobs", "1", "--quiet").stderr
                self.assertEqual(
                    told,
                    "marrow: error: %s; this is so in the first cells of all variants, so the others were not run; "
                    "name another figure in %s\n" % (message, self.scratch / "e.yaml"),
                )
                self.assertEqual(self.cells(), ["a/c0/0", "a/c1/0", "b/c0/0"])

    def test_without_a_truth_the_figures_that_there_can_be_are_named(self):
        told = self.compare(2, "errors.distal.mtre_mm", "--jobs", "1", "--quiet").stderr
        self.assertEqual(
            told,
            "marrow: error: 'errors.distal.mtre_mm' was not made: its case has no truth, or an item is absent; without "
            "a truth this pipeline gives each.FRAGMENT.mtre_mm, each.FRAGMENT.*.median_px, free.FRAGMENT.*, "
            "staged.FRAGMENT.STAGE.mtre_mm, staged.FRAGMENT.STAGE.*.median_px, errors.FRAGMENT.mtre_mm; this is so in "
            "the first cells of all variants, so the others were not run; name another figure in %s\n"
            % (self.scratch / "e.yaml"),
        )
        self.assertEqual(self.cells(), ["a/one/0", "a/two/0", "b/one/0"])

    def test_a_figure_that_one_variant_has(self):
        self.compare(0, "free.distal.extra", variants="{a: {free.also: extra}, b: {}}")
        self.assertEqual(self.cells(), ["a/one/0", "a/two/0", "b/one/0", "b/two/0"])

    def test_how_many_cases_it_takes(self):
        # 10 * 2 / 2^8 = 0.078 and 10 * 2 / 2^9 = 0.039: Holm's p of the smallest of ten, where all cases agree.
        self.cases({"c%d" % i: "distal other%d" % i for i in range(6)})
        variants = "{%s}" % ", ".join("v%d: {}" % v for v in range(11))
        told = self.compare(0, "each.distal.mtre_mm", "--dry-run", variants=variants)
        self.assertIn("10 comparisons with the baseline, for which a difference takes at least 9 cases\n", told.stdout)
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
