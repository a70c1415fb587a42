# SPDX-License-Identifier: Apache-2.0
"""Poses from landmarks, markers and surfaces: the pipelines as they are shipped, and files as a person writes them."""
import json

import yaml

from harness.cases import metrics
from harness import SOURCE
from harness.program import Case, main, marrow

PIPELINES = SOURCE / "pipelines"


class Landmarks(Case):
    @classmethod
    def setUpClass(cls):
        cls.shared = cls.shared_folder()
        cls.result = marrow(
            "run",
            PIPELINES / "femur" / "landmarks.yaml",
            "--out",
            cls.shared / "run",
            "--quiet",
            "--set",
            "bone.resolution_mm=2",
        )

    def figures(self, *path):
        return metrics(self.shared.joinpath("run", "outputs", *path).with_suffix(".json"))

    def test_landmarks_are_a_start_that_the_outline_refines(self):
        self.assertEqual(self.result.returncode, 0, self.result.stderr)
        start, final = self.figures("seen_errors"), self.figures("errors", "final")
        tracked, mtre, mpd, mrpd = (
            self.figures(name) for name in ("tracked_errors", "at_landmarks", "projection", "reprojection")
        )
        print(
            "mTRE %.2f mm by what is seen (largest deviation predicted %.2f mm), %.2f mm by what is tracked, %.2f mm"
            " refined, %.2f mm at the landmarks; mPD %.2f px, mRPD %.2f mm"
            % (
                start["mtre_mm"],
                start["predicted_max_mm"],
                tracked["mtre_mm"],
                final["mtre_mm"],
                mtre["mtre_mm"],
                mpd["mpd_px"],
                mrpd["mrpd_mm"],
            )
        )
        self.assertLess(start["mtre_mm"], 3)
        self.assertLess(start["translation_mm"], 4 * start["predicted_max_mm"])
        self.assertLess(tracked["mtre_mm"], 1)
        self.assertLess(final["mtre_mm"], min(1, start["mtre_mm"]))
        self.assertLess(mtre["mtre_mm"], 1.5)
        self.assertLess(mrpd["mrpd_mm"], final["mtre_mm"] + 1e-9)
        self.assertAlmostEqual(mpd["mpd_detector_mm"], 0.586 * mpd["mpd_px"], delta=1e-6 * mpd["mpd_px"])

    def test_files_of_landmarks_and_surfaces(self):
        """A tetrahedron shifted by (1, 2, 3), and its corners as markers that were tracked there."""
        corners = [[0, 0, 0], [40, 0, 0], [0, 60, 0], [0, 0, 90]]

        def stl(shift):
            faces = "".join(
                "facet normal 0 0 0\nouter loop\n%sendloop\nendfacet\n"
                % "".join("vertex %g %g %g\n" % tuple(a + b for a, b in zip(corners[i], shift)) for i in face)
                for face in ([0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3])
            )
            return "solid a\n%sendsolid\n" % faces

        self.write("model.stl", stl([0, 0, 0]))
        self.write("target.stl", stl([1, 2, 3]))
        self.write(
            "l.yaml",
            json.dumps(
                {
                    "marrow-landmarks": 1,
                    "fragments": {
                        "bone": {
                            "points": {"c%d" % i: corner for i, corner in enumerate(corners)},
                            "tracked": {
                                "c%d" % i: [a + b for a, b in zip(corner, [1, 2, 3])]
                                for i, corner in enumerate(corners)
                            },
                        }
                    },
                }
            ),
        )
        self.write(
            "p.yaml",
            """marrow: 1
nodes:
  model: {uses: read.mesh, with: {path: model.stl}}
  landmarks: {uses: read.landmarks, with: {path: l.yaml}}
  pose: {uses: initial.fiducials, in: {model: model, landmarks: landmarks}}
outputs: {pose: pose}
""",
        )
        result = marrow("run", self.scratch / "p.yaml", "--out", self.scratch / "tracked", "--quiet")
        self.assertEqual(result.returncode, 0, result.stderr)
        result = marrow(
            "run",
            PIPELINES / "bone" / "surfaces.yaml",
            "model=model.stl",
            "target=target.stl",
            "--out",
            self.scratch / "surfaces",
            "--quiet",
            cwd=self.scratch,
        )
        self.assertEqual(result.returncode, 0, result.stderr)
        for name, file, tolerance in (("tracked", "pose/bone.yaml", 1e-9), ("surfaces", "pose.yaml", 0.1)):
            pose = yaml.safe_load((self.scratch / name / "outputs" / file).read_text())
            for row, exact in zip(pose["matrix"], ([1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3])):
                for value, wanted in zip(row, exact):
                    self.assertAlmostEqual(value, wanted, delta=tolerance, msg=name)


if __name__ == "__main__":
    main()
