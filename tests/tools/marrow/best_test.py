# SPDX-License-Identifier: Apache-2.0
"""pipelines/femur/femur-best.yaml on a small simulated femur with an old plate: with right and with wrong cameras."""
import json

from harness.cases import metrics, simulate
from harness import SOURCE
from harness.program import Case, main, marrow

PIPELINES = SOURCE / "pipelines"
SMALL = ["bone.resolution_mm=1.6", "cameras.width_px=256", "cameras.height_px=256", "cameras.pixel_mm=1.172"]
OFF = "knee fat folds vessels pin cable clamp table lag collimator saturation eight_bit".split()


def sets(texts):
    return [part for text in texts for part in ("--set", text)]


class Best(Case):
    @classmethod
    def setUpClass(cls):
        cls.shared = cls.shared_folder()
        cls.cases = {}
        for level in ("off", "usual"):
            cls.cases[level] = simulate(
                cls.shared / level,
                *["%s=off" % name for name in OFF],
                "camera_faults=%s" % level,
                *sets(SMALL),
                pipeline="simulate/simulate-clutter.yaml",
            )

    def registered(self, level, *arguments, codes=(0,)):
        result = marrow(
            "run",
            PIPELINES / "femur/femur-best.yaml",
            "case=%s" % self.cases[level],
            "--out",
            self.scratch / level,
            *arguments,
        )
        self.assertIn(result.returncode, codes, result.stdout + result.stderr)
        return result, self.scratch / level / "outputs"

    def test_right_cameras_stay(self):
        # Pixels of 1.2 mm make the 5 px that the cameras may share so large that no pose could be trusted.
        known = sets(
            [
                "corrected.turn_deg=0.05",
                "corrected.shift_mm=0.1",
                "corrected.focal_percent=0.1",
                "corrected.centre_px=0.1",
            ]
        )
        result, outputs = self.registered("off", "--no-cache", *known)
        self.assertLess(metrics(outputs / "errors" / "distal.json")["mtre_mm"], 1)
        self.assertIn("show long metal, and are bridged", result.stdout + result.stderr)
        self.assertIn("node 'marks' (read.landmarks) failed", result.stderr)
        for view in ("frontal", "lateral"):
            self.assertLess(abs(metrics(outputs / "cameras" / (view + ".json"))["shift_v_mm"]), 0.3)

    def test_cameras_that_are_off_are_said_to_be(self):
        # The 5 px may also make the verdict `wrong`, which ends with 3.
        _, outputs = self.registered("usual", codes=(0, 3))
        errors = metrics(outputs / "errors" / "distal.json")
        self.assertLess(errors["mtre_mm"], 5)
        self.assertGreater(errors["predicted_along_mm"], 0.3)
        run = json.loads((self.scratch / "usual" / "run.json").read_text())
        self.assertEqual([verdict["judgement"] == "trusted" for verdict in run["verdicts"]], [False])


if __name__ == "__main__":
    main()
