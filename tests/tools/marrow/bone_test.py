# SPDX-License-Identifier: Apache-2.0
"""pipelines/bone/bone.yaml on a small simulated vertebra: each way to a start alone, none, and one to four views."""
import shutil

import yaml

from harness import SOURCE
from harness.cases import copy_case, metrics, sets, simulate
from harness.program import Case, main

BONE = SOURCE / "pipelines" / "bone" / "bone.yaml"
VIEWS = ["frontal", "lateral", "left", "right"]
SMALL = ["bone.resolution_mm=1.6", "ct.spacing_mm=[1.2, 1.2, 1.2]", "cameras.width_px=256", "cameras.height_px=256"]
SMALL += ["cameras.pixel_mm=1.0", "cameras.names=[%s]" % ", ".join(VIEWS), "cameras.alpha_deg=[0, 0, 0, 0]"]
SMALL += ["cameras.beta_deg=[0, 90, 45, 135]"]


def shifted(truth):
    """3 mm beside the truth along each axis of the world."""
    start = {"target": truth["target"], "source": truth["source"], "matrix": [list(row) for row in truth["matrix"]]}
    for row in start["matrix"][:3]:
        row[3] += 3
    return start


class Bone(Case):
    has_own_store = False

    @classmethod
    def setUpClass(cls):
        cls.shared = cls.shared_folder()
        cls.case = cls.made("made")
        cls.landmarks = cls.shared / "made" / "outputs" / "landmarks" / "bone.yaml"

    @classmethod
    def made(cls, name, *arguments):
        return simulate(cls.shared / name, *arguments, *sets(SMALL), pipeline="simulate/simulate-vertebra.yaml")

    def copy(self, views=VIEWS[:2], start=None, landmarks=False, case=None):
        def change(case):
            case["views"] = [view for view in case["views"] if view["name"] in views]
            if start:
                case["fragments"]["bone"]["start"] = start(case["fragments"]["bone"]["truth"])

        shutil.rmtree(self.scratch / "case", ignore_errors=True)
        to = copy_case(case or self.case, self.scratch / "case", change)
        if landmarks:
            shutil.copy(self.landmarks, to / "landmarks.yaml")

    def registered(self, limit_mm, *arguments):
        """The run on the copied case, whose error is below the limit."""
        shutil.rmtree(self.scratch / "run", ignore_errors=True)
        result = self.expect(0, "run", BONE, "case=case", "--out", "run", *arguments)
        self.assertLess(metrics(self.scratch / "run/outputs/errors/bone/final.json")["mtre_mm"], limit_mm)
        return result

    def test_each_way_alone(self):
        self.copy(start=shifted)
        by_hand = self.registered(1).stderr
        self.assertIn("node 'marks' (read.landmarks) failed", by_hand)
        self.assertIn(
            "node 'by_search/search' (initial.global_search) for bone failed: it has no poses to try", by_hand
        )
        self.copy(landmarks=True)
        self.assertIn("node 'placed' (initial.manual) for bone failed: there is no start", self.registered(1).stderr)
        self.copy()
        self.registered(1, "search_poses=2000")

    def test_the_search_alone(self):
        self.copy()
        self.expect(0, "run", BONE.with_name("search.yaml"), "case=case", "poses=2000", "--out", "search")
        for output, figure in (("errors", "mtre_mm"), ("in_image", "mpd_mm")):
            self.assertLess(metrics(self.scratch / "search/outputs" / output / "bone.json")[figure], 2)

    def test_all_ways_with_one_to_four_views(self):
        for count, limit_mm in ((1, 8), (3, 1), (4, 1)):
            with self.subTest(views=count):
                self.copy(VIEWS[:count], shifted, True)
                self.registered(limit_mm)

    def test_a_bone_that_is_given_by_labels_or_by_a_surface_without_ct(self):
        # The limits are twice what was measured: 0.042 mm by labels of 1.5 mm, 0.082 mm by the contour alone
        for given_by, limit_mm in (("labels", 0.1), ("surfaces", 0.2)):
            with self.subTest(given_by=given_by):
                self.copy(VIEWS, landmarks=True, case=self.made(given_by, "given_by=" + given_by))
                told = self.registered(limit_mm).stdout
                self.assertTrue((self.scratch / "run/outputs/verdict/bone.yaml").is_file())
                has_no_projector = "grey_cost" in told and "there is no 'projector'" in told
                self.assertEqual(has_no_projector, given_by == "surfaces")

    def test_without_any_way_it_says_what_to_do(self):
        self.copy()
        said = [
            "there is no start; give the approximate placement of the fragment",
            "it has no poses to try; give their number",
            "no way led to a start: none of the inputs first, second, third and fourth is there; see why the nodes that"
            " they are wired to gave none",
        ]
        self.refused(said, "run", BONE, "case=case", "--out", "run", status=1)

    def test_landmarks_are_written_as_they_are_read(self):
        fragments = yaml.safe_load(self.landmarks.read_text())["fragments"]
        self.assertEqual(list(fragments), ["bone"])
        self.assertEqual(list(fragments["bone"]), ["points", "seen", "tracked"])
        self.assertEqual(list(fragments["bone"]["seen"]), VIEWS)


if __name__ == "__main__":
    main()
