# SPDX-License-Identifier: Apache-2.0
"""Every figure of several shipped pipelines that can be recomputed is what numpy and scipy find."""

from recomputing import counts, recompute_all, run  # it finds the modules below
from harness.cases import SMALL, simulate
from harness.program import Case, main, marrow

NAIL = ["bone.resolution_mm=2", "implant.resolution_mm=1", "nail_searched.poses=2000"]
LEG = ["femur.resolution_mm=2", "ct.spacing_mm=[1.2, 1.2, 1.5]"]
# Of segmentations and surfaces that are close, and of two poses: no shipped pipeline compares these.
COMPARED = """marrow: 1
inputs:
  case: {type: path, help: case}
nodes:
  case:      {uses: read.case, with: {path: $case}}
  field:     {uses: segment.threshold, in: {volume: case.ct, seeds: case.seeds}, with: {threshold_hu: 250}}
  other:     {uses: segment.threshold, in: {volume: case.ct, seeds: case.seeds}, with: {threshold_hu: 500}}
  model:     {uses: mesh.marching_cubes, in: {field: field}}
  reference: {uses: mesh.marching_cubes, in: {field: other}}
  light:     {uses: mesh.simplify, in: {mesh: model}, with: {triangles: 3000}}
  light_reference: {uses: mesh.simplify, in: {mesh: reference}, with: {triangles: 3000}}
  start:     {uses: initial.manual, in: {model: light}, with: {rotation_deg: [1, 2, 3], translation_mm: [1, 2, 3]}}
  dice:      {uses: evaluate.dice, in: {field: field, reference: other}}
  distance:  {uses: evaluate.surface_distance, in: {mesh: light, reference: light_reference}}
  mtre:      {uses: evaluate.mtre, in: {pose: start, truth: case.truth, model: light}}
outputs: {dice: dice, distance: distance, mtre: mtre}
"""


def sets(texts):
    return [part for text in texts for part in ("--set", text)]


class Pipelines(Case):
    @classmethod
    def setUpClass(cls):
        cls.shared = cls.shared_folder()
        cls.case = simulate(cls.shared / "made", *SMALL)

    def check(self, folder, least, unknown=()):
        """All recomputed figures agree, there are so many of them, and the others are those that are named."""
        code, said = recompute_all(folder)
        print(said.splitlines()[-1])
        self.assertEqual(code, 0, said)
        self.assertGreaterEqual(counts(said)[0], least, said)
        others = {line.split(": ")[1].split("/")[0] for line in said.splitlines() if line.startswith("not recomputed")}
        self.assertEqual(others, set(unknown), said)

    def test_the_contour(self):
        unknown = ("verdict.verdict", "shaft.lines")
        whole = simulate(self.scratch / "made", *SMALL[:2])  # of the CT that other tests use, the ends are missing
        self.check(run(self.scratch / "run", "femur/femur.yaml", "case=%s" % whole), 70, unknown)

    def test_grey_values(self):
        out = run(self.scratch / "run", "femur/femur-intensity.yaml", "case=%s" % self.case)
        self.check(out, 60, ["verdict.verdict"])

    def test_landmarks_and_distances_in_images(self):
        self.check(run(self.scratch / "run", "femur/landmarks.yaml"), 120, ["verdict.verdict"])

    def test_markers_and_their_prior(self):
        self.check(run(self.scratch / "run", "femur/markers.yaml"), 100)

    def test_borders_of_the_shaft(self):
        self.check(run(self.scratch / "run", "femur/shaft-lines.yaml"), 54)

    def test_bones_that_are_followed(self):
        out = run(self.scratch / "run", "track/track-knee.yaml", "frames=4", *sets(LEG))
        self.check(out, 400)

    def test_both_fragments_and_their_reduction(self):
        views = ["cameras.height_px=1200", "case.register=[proximal, distal]"]
        made = self.scratch / "made"
        case = simulate(made, "isocentre_from_distal_end_mm=225", *SMALL[:2], *sets(views))
        out = run(self.scratch / "run", "femur/femur-reduction.yaml", "case=%s" % case, "side=left")
        self.check(out, 150, ["verdict.verdict"])

    def test_a_nail_and_the_plan_for_its_holes(self):
        only = [word for name in ("plan", "verdict", "implant", "locking", "nail_errors") for word in ("--only", name)]
        self.check(run(self.scratch / "run", "guidance/nailing.yaml", *sets(NAIL), *only), 60, ["locking.verdict"])

    def test_a_calibration(self):
        out = run(self.scratch / "run", "calibration/calibrate.yaml")
        self.check(out, 18, ["calibration.metrics", "calibration.view_metrics"])

    def test_segmentations_and_surfaces(self):
        out = self.scratch / "run"
        pipeline = self.write("compared.yaml", COMPARED)
        ended = marrow("run", pipeline, "case=%s" % self.case, "--out", out, "--quiet")
        self.assertEqual(ended.returncode, 0, ended.stderr)
        self.check(out, 12)


if __name__ == "__main__":
    main()
