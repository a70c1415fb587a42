# SPDX-License-Identifier: Apache-2.0
"""One pipeline file for one view, three views and two fragments, with every node replaced by its siblings."""
import json

import yaml

from harness.cases import (
    FEMUR,
    SMALL,
    contents,
    copy_case,
    matrix_product,
    metrics,
    rotation_vector_deg,
    simulate,
    times,
    transposed,
)
from harness.program import Case, main, marrow
from harness.sample import sample
from harness.shipped import nodes_of


# Coarser images than usual, so that each run takes less time.
COARSE_IMAGES = [
    *["--set", "cameras.width_px=256"],
    *["--set", "cameras.height_px=256"],
    *["--set", "cameras.pixel_mm=1.172"],
]
# It runs, but at this case's coarse voxels it takes part of the other fragment, as the chapter says: the shaft of that
# model is not where the images show it, and the start is refused.
WRONG_HERE = {
    "segment.region_growing",
    "initial.best_of",  # it takes other ways to a pose, none is wired
    "simulate.knee_implant",  # these give one mesh, and not that of each fragment
    "simulate.nail",
}
# They run, but end elsewhere here.
NOT_AS_EXACT = {
    "evaluate.mtre",  # it has other figures
    "optimizer.direct",  # it looks everywhere: a few hundred evaluations in six dimensions are not enough
    "optimizer.grid",
    "similarity.silhouette_overlap",  # it knows where metal is, and of a bone hardly anything
}


class Siblings(Case):
    @classmethod
    def setUpClass(cls):
        cls.shared = cls.shared_folder()
        cls.case = simulate(cls.shared / "simulated", *SMALL, *COARSE_IMAGES)

    def run_femur(self, case, *arguments, out="out", outputs=("pose", "errors")):
        """Makes these outputs only: the pictures take longer than the pose."""
        out = self.scratch / out
        only = [word for output in outputs for word in ("--only", output)]
        result = marrow("run", FEMUR, "case=%s" % case, "--out", out, "--quiet", *only, *arguments)
        # Here only the errors count, and not what the verdict says of poses by one view or by a coarse segmentation.
        self.assertIn(result.returncode, (0, 3), result.stderr)
        self.assertEqual(json.loads((out / "run.json").read_text())["status"], "done")
        return out

    def check_errors(self, out, fragment, what):
        errors = metrics(out / "outputs" / "errors" / fragment / "final.json")
        print("%s, %s: %.3f deg, %.3f mm" % (what, fragment, errors["rotation_deg"], errors["translation_mm"]))
        self.assertLess(errors["rotation_deg"], 1)
        self.assertLess(errors["translation_mm"], 1)

    def test_one_view(self):
        case = copy_case(self.case, self.scratch / "case", lambda description: description["views"].pop())
        out = self.run_femur(case)
        pose = yaml.safe_load((out / "outputs" / "pose" / "distal.yaml").read_text())
        truth = yaml.safe_load((case / "case.yaml").read_text())["fragments"]["distal"]["truth"]["matrix"]
        camera = yaml.safe_load((case / "frontal.camera.yaml").read_text())["camera_from_world"]
        camera, found, true = ([row[:3] for row in matrix[:3]] for matrix in (camera["matrix"], pose["matrix"], truth))
        turn = times(camera, rotation_vector_deg(matrix_product(found, transposed(true))))
        origin = pose["fragment_frame"]["origin_mm"] + [1]
        shift = times(camera, [a - b for a, b in zip(times(pose["matrix"], origin)[:3], times(truth, origin)[:3])])
        frontal, lateral, along = pose["predicted_deviation"]["translation_mm"]
        print(
            "one view, right, down and along the beam: off by %s mm, turned by %s deg"
            % (" ".join("%.3f" % x for x in shift), " ".join("%.3f" % x for x in turn))
        )
        print("   predicted %.3f and %.3f mm in the image, %.3f mm along the beam" % (frontal, along, lateral))
        self.assertLess(max(abs(shift[0]), abs(shift[1])), 0.5)
        self.assertLess(abs(turn[2]), 0.5)
        self.assertGreater(lateral, 2 * max(frontal, along))  # nearly along the beam; the axis is inclined to it
        errors = metrics(out / "outputs" / "errors" / "distal" / "final.json")
        self.assertGreater(errors["predicted_max_mm"], 2 * errors["predicted_along_mm"])

    def test_three_views_60_degrees_apart(self):
        case = simulate(
            self.scratch / "simulated",
            *SMALL,
            *COARSE_IMAGES,
            *["--set", "cameras.names=[a, b, c]"],
            *["--set", "cameras.alpha_deg=[0, 0, 0]"],
            *["--set", "cameras.beta_deg=[0, 60, 120]"],
        )
        self.check_errors(self.run_femur(case), "distal", "three views")

    def test_both_fragments(self):
        # Tall images, which show condyles and trochanters: the shaft alone is too round to tell its axial rotation.
        case = simulate(
            self.scratch / "simulated",
            "level=0.35",
            "isocentre_from_distal_end_mm=200",
            *["--set", "cameras.height_px=1024"],
            *["--set", "case.register=[distal, proximal]"],
            *["--set", "ct.spacing_mm=[1.2, 1.2, 1.5]"],
        )
        out = self.run_femur(case)
        for fragment in ("distal", "proximal"):
            self.check_errors(out, fragment, "both fragments")

    def test_by_intensity(self):
        out = self.scratch / "intensity"
        result = marrow(
            *["run", FEMUR.parent / "femur-intensity.yaml", "case=%s" % self.case, "--out", out, "--quiet"],
            *["--only", "pose", "--only", "errors"],
        )
        self.assertEqual(result.returncode, 0, result.stderr)
        self.check_errors(out, "distal", "by intensity")

    def test_every_node_replaced_by_its_siblings(self):
        trials = [(name, other) for name in nodes_of(FEMUR) for other in fitting(FEMUR, name)]
        self.assertLessEqual(
            {
                "segment.threshold",
                "segment.distance_regularised",
                "segment.sparse_field",
                "mesh.flying_edges",
                "mesh.surface_nets",
                "mesh.poisson",
                "mesh.delaunay",
                "mesh.smooth",
                "edges.canny",
                "initial.manual",
                "project.silhouette",
                "optimizer.bobyqa",
            },
            {other for _, other in trials},
        )
        right = [trial for trial in trials if trial[1] not in WRONG_HERE]
        for name, other in sample(right, 12, key=lambda trial: trial[1].split(".")[0]):
            setting = "%s.uses=%s" % (name, other)
            with self.subTest(setting):
                outputs = {"pose", "errors", *outputs_of(FEMUR, name)}
                out = self.run_femur(self.case, "--set", setting, out=setting, outputs=sorted(outputs))
                if other not in NOT_AS_EXACT:
                    self.check_errors(out, "distal", setting)

    def test_the_truth_changes_no_byte_of_a_pose(self):
        without = copy_case(
            self.case, self.scratch / "case", lambda description: description["fragments"]["distal"].pop("truth")
        )
        one, other = self.run_femur(self.case, out="with"), self.run_femur(without, out="without")
        self.assertTrue((one / "outputs" / "errors").exists())
        self.assertFalse((other / "outputs" / "errors").exists())
        poses = contents(one / "outputs" / "pose")
        self.assertEqual(list(poses), ["distal.yaml"])
        self.assertEqual(poses, contents(other / "outputs" / "pose"))


def outputs_of(pipeline, node):
    """The names of the outputs that this node makes, or the part that it is in."""
    outputs = yaml.safe_load(pipeline.read_text())["outputs"]
    return [name for name, source in outputs.items() if source.split(".")[0] == node.split("/")[0]]


def fitting(pipeline, node):
    """The nodes that fit in place of this one, with its wires."""
    result = marrow("list", "--fits", pipeline, node, "--json")
    assert result.returncode == 0, result.stderr
    return [fit["node"] for fit in json.loads(result.stdout) if fit["fits"] == "yes"]


if __name__ == "__main__":
    main()
