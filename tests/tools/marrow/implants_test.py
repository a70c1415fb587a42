# SPDX-License-Identifier: Apache-2.0
"""Implants by their pipelines: simulated ones, and real ones where their images are on this machine."""
import shutil
import unittest

import yaml

from harness import SOURCE
from harness.cases import metrics
from harness.program import Case, main

PIPELINES = SOURCE / "pipelines" / "implant"
REAL = SOURCE / "../shared/data/implants/biplane"


class Implants(Case):
    def run_pipeline(self, name, *arguments):
        result = self.marrow("run", PIPELINES / name, *arguments, "--out", "out", "--quiet")
        self.assertIn(result.returncode, (0, 3), result.stderr)  # 3: the verdict is not that it is trusted
        return self.scratch / "out/outputs"

    def test_a_simulated_part_is_found(self):
        outputs = self.run_pipeline("simulated-implant.yaml", "--set", "made.model.resolution_mm=1.5")
        errors = metrics(outputs / "errors.json")
        self.assertLess(errors["rotation_deg"], 1)
        self.assertLess(errors["translation_mm"], 1.5)

    @unittest.skipUnless(REAL.is_dir(), "the real data are not on this machine")
    def test_a_real_part_is_followed_and_what_all_frames_share_is_said(self):
        for number in (1, 2):
            (self.scratch / ("cam%d" % number)).mkdir()
            for frame in range(3):  # the same moment three times: whatever it shows is common to all frames
                shutil.copy(REAL / ("cam%d/080.tif" % number), self.scratch / ("cam%d/%d.tif" % (number, frame)))
        reference = REAL / "poses/femur-080.pose.yaml"
        inputs = {
            "surface": REAL / "femur0.stl",
            "start": reference,
            "images": self.scratch / "cam1",
            "second_images": self.scratch / "cam2",
            "camera": REAL / "Camcal1.txt",
            "second_camera": REAL / "Camcal2.txt",
        }
        outputs = self.run_pipeline("sequence.yaml", *("%s=%s" % pair for pair in inputs.items()))
        common = metrics(outputs / "common.json")
        self.assertEqual(common["frames"], 3)
        self.assertLess(abs(common["common_first_across_px"]), 1)
        self.assertIn("all 3 frames have in common: ", (outputs.parent / "log.txt").read_text())
        expert = yaml.safe_load(reference.read_text())["matrix"]
        for file in sorted((outputs / "pose").glob("*.yaml")):
            found = yaml.safe_load(file.read_text())["matrix"]
            self.assertLess(max(abs(found[i][3] - expert[i][3]) for i in range(3)), 2, file)


if __name__ == "__main__":
    main()
