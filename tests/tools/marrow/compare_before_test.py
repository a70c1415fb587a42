# SPDX-License-Identifier: Apache-2.0
"""What can be known before a comparison runs is said before any cell runs, or after the first ones."""
import re
import statistics

from compare_cases import Compared
from harness import TEST_PLUGINS
from harness.given_cases import GivenCase
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


# A dry run says which differences the cases show, and how many cases a difference takes.
NORMAL = statistics.NormalDist()
PLAIN = [1 + 0.1 * i for i in range(8)]
DIFFERENCES = [0.1, 0.3, 0.2, 0.4, 0.2, 0.1, 0.3, 0.2]
SPREAD = statistics.stdev(DIFFERENCES)  # 0.1035
OTHERS = [one + more for one, more in zip(PLAIN, DIFFERENCES)]
DRY = ["compare", "e.yaml", "--out", "out", "--dry-run"]


class Needed(GivenCase):
    def test_what_the_cases_show_and_how_many_others_take(self):
        self.write_cases({name: ["%.3f mm" % value for value in ones] for name, ones in (("a", PLAIN), ("b", OTHERS))})
        self.experiment(["a", "b"])
        self.assertIn(
            "which differences these cases show is known when three cases are done with two variants\n"
            "a difference of 0.1 in figures.err: how many cases it takes is known when three cases are done with two"
            " variants\n",
            self.printed(*DRY, "--difference", "0.1"),
        )
        first = self.expect(0, "compare", "e.yaml", "--out", "out").stderr.splitlines()[0]
        self.assertEqual(first, "  0 of 16 cells", "before the first cell ends")
        said = self.printed(*DRY, "--difference", "0.05", "--difference", "figures.err=0.2")
        self.assertIn(
            "differences that 8 cases show with a probability of about 80 %, by the cells that are done:\n", said
        )
        found = re.search(r"  figures.err: (\S+) mm; differences scatter by 0.1 mm over 8 cases, b against a\n", said)
        self.assertIsNotNone(found, said)
        # Eight cases must all agree, so it is Phi(d / spread)^8 = 0.8; 1000 experiments know that to a few percent.
        self.assertAlmostEqual(float(found[1]), SPREAD * NORMAL.inv_cdf(0.8 ** (1 / 8)), delta=0.012)
        # 0.483 spreads: Noether's formula (J Am Stat Assoc 1987) says 58 cases
        takes = re.search(
            r"a difference of 0.05 mm in figures.err takes about (\d+) cases, \S+ s of work in all\n", said
        )
        self.assertLess(abs(int(takes[1]) - 58), 12, said)
        takes = re.search(r"a difference of 0.2 mm in figures.err takes about (\d+) cases, ", said)
        self.assertIn(int(takes[1]), range(6, 13), said)

    def test_what_is_no_difference(self):
        self.write_cases({"a": ["1 mm"], "b": ["2 mm"]})
        self.experiment(["a", "b"])
        said = "--difference: '%s' is no difference; write an amount above 0 in the figure's unit"
        unknown = "--difference: the experiment has no figure 'figures.er'; did you mean 'figures.err'?"
        wants_dry = "--difference says how many cases a difference takes, without running any; add --dry-run"
        self.refusals(
            (unknown, *DRY, "--difference", "figures.er=0.1"),
            *((said % text, *DRY, "--difference", text) for text in ("much", "0", "-1", "figures.err=", "nan")),
            (wants_dry, "compare", "e.yaml", "--difference", "1"),
        )


# What a pipeline says and nothing uses is named; and whom a plan compares with.
UNUSED = """marrow: 1
inputs: {case: {type: path, default: p.yaml}}
nodes:
  shared: {uses: test.work, with: {value: 0.02, path: $case}}
  n: {uses: test.constant, in: {a: shared}}
  m: {uses: test.misbehave, in: {a: n}}
outputs: {number: m}
"""
NOTE = (
    "node 'n': the wire to 'a' is not used: "
    "test.constant does not have this input, only other nodes of the kind test do"
)


class Unused(Compared):
    pipeline = UNUSED

    def test_check_and_the_run_say_which_wire_is_unused(self):
        self.assertIn("  note: %s\n" % NOTE, self.expect(0, "check", "p.yaml").stdout)
        said = self.expect(0, "run", "p.yaml", "--out", "out")
        self.assertEqual(said.stderr.count("marrow: note: %s\n" % NOTE), 1)
        self.assertEqual(self.read("out/log.txt").count("note: " + NOTE), 1)
        self.assertNotIn("note: node 'n'", self.expect(0, "check", "p.yaml", "--set", "n.uses=test.add").stdout)

    def test_an_experiment_says_once_what_no_variant_uses(self):
        self.experiment("e", "{%s}" % ", ".join("v%d: {m.value: %d}" % (i, i) for i in range(20)))
        said = self.expect(0, "compare", "e.yaml", "--dry-run")
        self.assertEqual(said.stderr.count("marrow: note: %s\n" % NOTE), 1)
        self.experiment("e", "{a: {m.value: 1}, b: {n.uses: test.add}}")
        said = self.expect(0, "compare", "e.yaml", "--out", "out")
        self.assertNotIn(NOTE, said.stderr, "one variant needs it")
        self.assertNotIn("note: node", said.stderr)

    def test_a_plan_compares_with_the_nearest_result_that_is_kept(self):
        """By hand: the first run differs from what is planned in one option, the last one in two."""
        values = lambda value, word: ["p.yaml", "--set", "n.value=%d" % value, "--set", "n.word=" + word]
        self.expect(0, "run", *values(1, "one"), "--out", "first")
        self.expect(0, "run", *values(2, "two"), "--out", "last")
        plan = self.expect(0, "plan", *values(1, "three")).stdout
        self.assertRegex(plan, r"\nn +test\.constant +runs: option 'word' is three, was one\n")
        plan = self.expect(0, "plan", *values(2, "three")).stdout
        self.assertRegex(plan, r"\nn +test\.constant +runs: option 'word' is three, was two\n")


# Options of a cost that the levels of a search replace are named where a pipeline gives them.
PIPELINE_OF_REPLACED = """marrow: 1
inputs: {case: {type: path, default: case}}
nodes:
  number:  {uses: test.constant}
  case:    {uses: read.case, with: {path: $case}}
  bone:    {uses: segment.level_set, in: {volume: case.ct, seeds: case.seeds}}
  model:   {uses: mesh.marching_cubes, in: {field: bone}}
  edges:   {uses: edges.canny, in: {view: case.views}}
  outline: {uses: project.silhouette, in: {model: model}}
  cost:
    uses: similarity.contour_distance
    in: {projector: outline, views: case.views, edges: edges}
    with: {scale_px: 2,
      reach_px: 9}
  both:    {uses: similarity.with_prior, in: {cost: cost, prior: case.start, found: case.start}}
  newton:  {uses: optimizer.bobyqa}
  pose:
    uses: register.multiresolution
    in: {cost: both, optimizer: newton, start: case.start}
    with: {reach_px: [5, 4, 3]}
  shape:   {uses: evaluate.landscape, in: {cost: cost, pose: pose.pose}}
outputs: {number: number}
"""
REACH = (
    "node 'cost': the option 'reach_px' (p.yaml:14) does not count in node 'pose': "
    "'reach_px' (p.yaml:20) of that node takes its place"
)


class Replaced(Compared):
    pipeline = PIPELINE_OF_REPLACED

    def notes(self, *arguments):
        said = self.expect(0, "check", "p.yaml", *arguments).stdout
        return [line[len("  note: ") :] for line in said.splitlines() if "does not count" in line]

    def test_it_is_said_with_the_lines_of_both(self):
        """The cost reaches the search through another cost. The node that only evaluates it replaces nothing."""
        self.assertEqual(self.notes(), [REACH])
        said = self.expect(0, "run", "p.yaml", "--out", "out")
        self.assertEqual(said.stderr.count("marrow: note: %s\n" % REACH), 1)
        self.assertEqual((self.scratch / "out" / "log.txt").read_text().count("note: " + REACH), 1)
        self.write(
            "e.yaml",
            "experiment: 1\npipeline: p.yaml\ncases: {folders: [cases/*]}\n"
            "metrics: [number.value]\nvariants: {a: {}, b: {number.value: 5}}\n",
        )
        said = self.expect(0, "compare", "e.yaml", "--dry-run")
        told = said.stderr.replace("%s/" % self.scratch, "")
        self.assertEqual(told.count("marrow: note: %s\n" % REACH), 1)

    def test_a_default_replaces_too(self):
        self.write("p.yaml", PIPELINE_OF_REPLACED.replace("    with: {reach_px: [5, 4, 3]}\n", ""))
        self.assertEqual(
            self.notes(),
            [
                "node 'cost': the option 'reach_px' (p.yaml:14) does not count in node 'pose': "
                "'reach_px' (its default) of that node takes its place"
            ],
        )

    def test_nothing_is_said_of_what_counts(self):
        """By the declaration: an empty pixel_step leaves that of the cost, and scale_px has no level."""
        self.write("p.yaml", PIPELINE_OF_REPLACED.replace("      reach_px: 9}", "      }"))
        self.assertEqual(self.notes(), [])
        grey = [
            "--set",
            "cost.uses=similarity.mutual_information",
            "--set",
            "outline.uses=project.joseph",
            "--set",
            "outline.in.volume=case.ct",
            "--set",
            "outline.in.field=bone",
            "--set",
            "cost.pixel_step=3",
        ]
        said = self.notes(*grey)
        self.assertEqual(said, [])
        grey += ["--set", "pose.pixel_step=[4,2,1]"]
        said = self.notes(*grey)
        self.assertEqual(len(said), 1)
        self.assertRegex(said[0], "^node 'cost': the option 'pixel_step' .* does not count in node 'pose'")

    def test_only_the_cost_of_an_input_may_be_meant(self):
        """register.sequence has levels of its own for each of its two costs."""
        two = PIPELINE_OF_REPLACED.replace("register.multiresolution", "register.sequence")
        two = two.replace("{cost: both, optimizer", "{cost: cost, finer_cost: finer, optimizer")
        two = two.replace(
            "  both:  ",
            "  finer:   {uses: similarity.drr_edges, in: {projector: drr, views: case.views, "
            "edges: edges, field: bone}, with: {pixel_step: 3}}\n"
            "  drr:     {uses: project.joseph, in: {volume: case.ct, field: bone}}\n  both:  ",
        )
        two = two.replace("      reach_px: 9}", "      }")
        self.write("p.yaml", two)
        self.assertEqual(
            self.notes(),
            [
                "node 'finer': the option 'pixel_step' (p.yaml:15) does not count in node 'pose': "
                "'finer_pixel_step' (its default) of that node takes its place"
            ],
        )

    def test_the_options_say_what_they_replace(self):
        told = "takes the place of 'reach_px', 'reach_mm' of the functions that reach this node"
        self.assertIn(told, self.expect(0, "inspect", "register.multiresolution").stdout)


if __name__ == "__main__":
    main()
