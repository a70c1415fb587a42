# SPDX-License-Identifier: Apache-2.0
"""A pose that nobody judged is never silent: a part of a pipeline gives the verdicts of its poses, too."""
import re

from harness.program import Case, main

POSE = """marrow-pose: 1
target: world
source: ct
rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
translation_mm: [0, 0, %d]
covariance:
  - [%g, 0, 0, 0, 0, 0]
  - [0, %g, 0, 0, 0, 0]
  - [0, 0, %g, 0, 0, 0]
  - [0, 0, 0, 0.01, 0, 0]
  - [0, 0, 0, 0, 0.01, 0]
  - [0, 0, 0, 0, 0, 0.01]
"""
PIPELINE = """marrow: 1
nodes:
  bone: {uses: read.mesh, with: {path: box.stl}}
  found: {uses: read.pose, with: {path: found.yaml}}
  stages: {uses: deviations.calibrated, in: {stages: [found], model: bone}}
  other: {uses: read.pose, with: {path: other.yaml}}
  verdict: {uses: verdict.predicted, in: {pose: found, model: bone}}
outputs: {pose: stages.pose, found: found, other: other, bone: bone, verdict: verdict}
"""


def box_stl():
    """An ASCII STL of 20 x 20 x 100 mm."""
    corner = lambda index: [(-10, 10)[index & 1], (-10, 10)[index >> 1 & 1], (-50, 50)[index >> 2]]
    triangles = [(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4)]
    triangles += [(2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)]
    facet = lambda three: "facet normal 0 0 0\nouter loop\n%sendloop\nendfacet\n" % "".join(
        "vertex %g %g %g\n" % tuple(corner(one)) for one in three
    )
    return "solid box\n" + "".join(map(facet, triangles)) + "endsolid box\n"


class OnlyVerdicts(Case):
    def setUp(self):
        super().setUp()
        self.write("box.stl", box_stl())
        self.write("p.yaml", PIPELINE)
        # A radian about the long axis: nearly all errors are above 5 degrees.
        self.write("found.yaml", POSE % (700, 1e-6, 1e-6, 1))
        self.write("other.yaml", POSE % (710, 1e-6, 1e-6, 1e-6))

    def only(self, name, code):
        result = self.expect(code, "run", "p.yaml", "--no-cache", "--out", name, "--only", name)
        return result, self.json(name + "/run.json").get("verdicts")

    def test_a_part_of_a_pipeline_ends_as_the_whole(self):
        whole = self.expect(3, "run", "p.yaml", "--no-cache", "--out", "whole")
        self.assertEqual(re.findall("nobody judges the output '(.*)':", whole.stderr), ["other"])
        for name in ("found", "pose"):  # the second one has other deviations, and is judged by where it comes from
            result, verdicts = self.only(name, code=3)
            self.assertIn("\nverdict: WRONG (failure", result.stdout)
            self.assertEqual([one["output"] for one in verdicts], ["verdict"])
            self.assertNotIn("nobody judges", result.stderr)
            made = [path.name for path in (self.scratch / name / "outputs").iterdir()]
            self.assertEqual(sorted(made), sorted([name + ".yaml", "verdict.yaml"]))

    def test_a_pose_without_a_verdict_is_told(self):
        result, verdicts = self.only("other", code=0)
        self.assertIsNone(verdicts)
        note = "nobody judges the output 'other'"
        self.assertIn("marrow: note: %s: this pipeline has no verdict on that pose\n" % note, result.stderr)
        self.assertIn(note, self.read("other/log.txt"))
        self.assertNotIn("WRONG", result.stdout)

    def test_what_needs_no_pose_needs_no_verdict(self):
        result, verdicts = self.only("bone", code=0)
        self.assertIsNone(verdicts)
        self.assertNotIn("nobody judges", result.stderr)


if __name__ == "__main__":
    main()
