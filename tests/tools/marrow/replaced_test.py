# SPDX-License-Identifier: Apache-2.0
"""Options of a cost that the levels of a search replace are named where a pipeline gives them."""
from compare_cases import Compared
from harness.program import main

PIPELINE = """marrow: 1
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
    def setUp(self):
        super().setUp()
        self.write("p.yaml", PIPELINE)

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
        self.write("p.yaml", PIPELINE.replace("    with: {reach_px: [5, 4, 3]}\n", ""))
        self.assertEqual(
            self.notes(),
            [
                "node 'cost': the option 'reach_px' (p.yaml:14) does not count in node 'pose': "
                "'reach_px' (its default) of that node takes its place"
            ],
        )

    def test_nothing_is_said_of_what_counts(self):
        """By the declaration: an empty pixel_step leaves that of the cost, and scale_px has no level."""
        self.write("p.yaml", PIPELINE.replace("      reach_px: 9}", "      }"))
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
        two = PIPELINE.replace("register.multiresolution", "register.sequence")
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
