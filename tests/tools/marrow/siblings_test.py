# SPDX-License-Identifier: Apache-2.0
"""One pipeline file for one view, three views and two fragments, with every node replaced by its siblings."""
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
from harness.program import SharedCase, main
from harness.sample import sample
from harness.shipped import nodes_of

# Coarser images than usual, so that each run takes less time.
COARSE_IMAGES = "--set cameras.width_px=256 --set cameras.height_px=256 --set cameras.pixel_mm=1.172".split()
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


# Some of those that fit.
FITS = set(
    """segment.threshold segment.distance_regularised segment.sparse_field mesh.flying_edges mesh.surface_nets
    mesh.poisson mesh.delaunay mesh.smooth edges.canny initial.manual project.silhouette optimizer.bobyqa""".split()
)


class Siblings(SharedCase):
    plugins = []
    has_own_store = False

    def make(self):
        self.case = simulate(self.scratch / "simulated", *SMALL, *COARSE_IMAGES)

    def run_femur(self, case, out, *arguments, outputs=("pose", "errors"), pipeline=FEMUR, codes=(0, 3)):
        """Makes these outputs only: the pictures take longer than the pose."""
        only = [word for output in outputs for word in ("--only", output)]
        result = self.marrow("run", pipeline, "case=%s" % case, "--out", out, "--quiet", *only, *arguments)
        # Here only the errors count, and not what the verdict says of poses by one view or by a coarse segmentation.
        self.assertIn(result.returncode, codes, result.stderr)
        self.assertEqual(self.json(out + "/run.json")["status"], "done")
        return self.scratch / out

    def check_errors(self, out, fragment):
        errors = metrics(out / "outputs" / "errors" / fragment / "final.json")
        print("%s, %s: %.3f deg, %.3f mm" % (out.name, fragment, errors["rotation_deg"], errors["translation_mm"]))
        self.assertLess(errors["rotation_deg"], 1)
        self.assertLess(errors["translation_mm"], 1)

    def test_one_view(self):
        case = copy_case(self.case, self.scratch / "one", lambda description: description["views"].pop())
        out = self.run_femur(case, "one view")
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
        views = ["cameras.names=[a, b, c]", "cameras.alpha_deg=[0, 0, 0]", "cameras.beta_deg=[0, 60, 120]"]
        sets = [word for view in views for word in ("--set", view)]
        case = simulate(self.scratch / "three", *SMALL, *COARSE_IMAGES, *sets)
        self.check_errors(self.run_femur(case, "three views"), "distal")

    def test_both_fragments(self):
        # Tall images, which show condyles and trochanters: the shaft alone is too round to tell its axial rotation.
        case = simulate(
            *(self.scratch / "tall", "level=0.35", "isocentre_from_distal_end_mm=200"),
            *("--set", "cameras.height_px=1024", "--set", "case.register=[distal, proximal]"),
            *("--set", "ct.spacing_mm=[1.2, 1.2, 1.5]"),
        )
        out = self.run_femur(case, "both fragments")
        for fragment in ("distal", "proximal"):
            self.check_errors(out, fragment)

    def test_by_intensity(self):
        out = self.run_femur(self.case, "by intensity", pipeline=FEMUR.parent / "femur-intensity.yaml", codes=(0,))
        self.check_errors(out, "distal")

    def fitting(self, node):
        """The nodes that fit in place of this one, with its wires."""
        return [fit["node"] for fit in self.json_of("list", "--fits", FEMUR, node) if fit["fits"] == "yes"]

    def test_every_node_replaced_by_its_siblings(self):
        trials = [(name, other) for name in nodes_of(FEMUR) for other in self.fitting(name)]
        self.assertLessEqual(FITS, {other for _, other in trials})
        right = [trial for trial in trials if trial[1] not in WRONG_HERE]
        outputs = yaml.safe_load(FEMUR.read_text())["outputs"]
        for name, other in sample(right, 12, key=lambda trial: trial[1].split(".")[0]):
            setting = "%s.uses=%s" % (name, other)
            with self.subTest(setting):
                # The outputs that this node makes, or the part that it is in.
                own = {output for output, source in outputs.items() if source.split(".")[0] == name.split("/")[0]}
                made = sorted({"pose", "errors", *own})
                out = self.run_femur(self.case, setting.replace("/", "-"), "--set", setting, outputs=made)
                if other not in NOT_AS_EXACT:
                    self.check_errors(out, "distal")

    def test_the_truth_changes_no_byte_of_a_pose(self):
        without = lambda description: description["fragments"]["distal"].pop("truth")
        other_case = copy_case(self.case, self.scratch / "without truth", without)
        one, other = self.run_femur(self.case, "with"), self.run_femur(other_case, "without")
        self.assertTrue((one / "outputs" / "errors").exists())
        self.assertFalse((other / "outputs" / "errors").exists())
        poses = contents(one / "outputs" / "pose")
        self.assertEqual(list(poses), ["distal.yaml"])
        self.assertEqual(poses, contents(other / "outputs" / "pose"))


if __name__ == "__main__":
    main()
