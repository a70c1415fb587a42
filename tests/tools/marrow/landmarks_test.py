# SPDX-License-Identifier: Apache-2.0
"""Poses from landmarks, markers and surfaces: the pipelines as they are shipped, and files as a person writes them."""
import json

import yaml

from harness import SOURCE
from harness.cases import metrics
from harness.program import Case, main

PIPELINES = SOURCE / "pipelines"
CORNERS = {"c0": [0, 0, 0], "c1": [40, 0, 0], "c2": [0, 60, 0], "c3": [0, 0, 90]}
SHIFT = [1, 2, 3]
MOVED = {name: [a + b for a, b in zip(corner, SHIFT)] for name, corner in CORNERS.items()}
PIPELINE = """marrow: 1
nodes:
  model: {uses: read.mesh, with: {path: model.stl}}
  landmarks: {uses: read.landmarks, with: {path: l.yaml}}
  pose: {uses: initial.fiducials, in: {model: model, landmarks: landmarks}}
outputs: {pose: pose}
"""


def stl(corners):
    """A tetrahedron."""
    facet = "facet normal 0 0 0\nouter loop\n%sendloop\nendfacet\n"
    vertices = ["vertex %g %g %g\n" % tuple(corner) for corner in corners.values()]
    faces = ([0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3])
    return "solid a\n%sendsolid\n" % "".join(facet % "".join(vertices[i] for i in face) for face in faces)


class Landmarks(Case):
    def test_landmarks_are_a_start_that_the_outline_refines(self):
        pipeline = PIPELINES / "femur" / "landmarks.yaml"
        self.expect(0, "run", pipeline, "--out", "out", "--quiet", "--set", "bone.resolution_mm=2")
        names = ("seen_errors", "tracked_errors", "errors/final", "at_landmarks", "projection", "reprojection")
        start, tracked, final, mtre, mpd, mrpd = (
            metrics(self.scratch / ("out/outputs/%s.json" % name)) for name in names
        )
        print(
            "mTRE %.2f mm by what is seen (largest deviation predicted %.2f mm), %.2f mm by what is tracked, %.2f mm"
            " refined, %.2f mm at the landmarks"
            % (start["mtre_mm"], start["predicted_max_mm"], tracked["mtre_mm"], final["mtre_mm"], mtre["mtre_mm"])
        )
        print("mPD %.2f px, mRPD %.2f mm" % (mpd["mpd_px"], mrpd["mrpd_mm"]))
        self.assertLess(start["mtre_mm"], 3)
        self.assertLess(start["translation_mm"], 4 * start["predicted_max_mm"])
        self.assertLess(tracked["mtre_mm"], 1)
        self.assertLess(final["mtre_mm"], min(1, start["mtre_mm"]))
        self.assertLess(mtre["mtre_mm"], 1.5)
        self.assertLess(mrpd["mrpd_mm"], final["mtre_mm"] + 1e-9)
        self.assertAlmostEqual(mpd["mpd_detector_mm"], 0.586 * mpd["mpd_px"], delta=1e-6 * mpd["mpd_px"])

    def test_files_of_landmarks_and_surfaces(self):
        """A tetrahedron that is shifted, and its corners as markers that were tracked there."""
        self.write("model.stl", stl(CORNERS))
        self.write("target.stl", stl(MOVED))
        bone = {"points": CORNERS, "tracked": MOVED}
        self.write("l.yaml", json.dumps({"marrow-landmarks": 1, "fragments": {"bone": bone}}))
        self.write("p.yaml", PIPELINE)
        self.expect(0, "run", "p.yaml", "--out", "tracked", "--quiet")
        files = ["model=model.stl", "target=target.stl"]
        self.expect(0, "run", PIPELINES / "bone" / "surfaces.yaml", *files, "--out", "surfaces", "--quiet")
        for file, tolerance in (("tracked/outputs/pose/bone.yaml", 1e-9), ("surfaces/outputs/pose.yaml", 0.1)):
            pose = yaml.safe_load(self.read(file))
            for row, exact in zip(pose["matrix"], ([1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3])):
                for value, wanted in zip(row, exact):
                    self.assertAlmostEqual(value, wanted, delta=tolerance, msg=file)


if __name__ == "__main__":
    main()
