# SPDX-License-Identifier: Apache-2.0
"""pipelines/femur/femur-best.yaml on a small simulated femur with an old plate: with right and with wrong cameras."""
from harness import SOURCE
from harness.cases import metrics, sets, simulate
from harness.program import Case, main

SMALL = ["bone.resolution_mm=1.6", "cameras.width_px=256", "cameras.height_px=256", "cameras.pixel_mm=1.172"]
OFF = "knee fat folds vessels pin cable clamp table lag collimator saturation eight_bit".split()
# Pixels of 1.2 mm make the 5 px that the cameras may share so large that no pose could be trusted.
KNOWN = ["corrected.turn_deg=0.05", "corrected.shift_mm=0.1", "corrected.focal_percent=0.1", "corrected.centre_px=0.1"]


class Best(Case):
    has_own_store = False

    def registered(self, camera_faults, *arguments, statuses=(0,)):
        """The run's result, and its outputs."""
        settings = ["%s=off" % name for name in OFF] + ["camera_faults=" + camera_faults, *sets(SMALL)]
        case = simulate(self.scratch / "made", *settings, pipeline="simulate/simulate-clutter.yaml")
        pipeline = SOURCE / "pipelines/femur/femur-best.yaml"
        result = self.marrow("run", pipeline, "case=%s" % case, "--out", "out", *arguments)
        self.assertIn(result.returncode, statuses, result.stdout + result.stderr)
        return result, self.scratch / "out" / "outputs"

    def test_right_cameras_stay(self):
        result, outputs = self.registered("off", "--no-cache", *sets(KNOWN))
        self.assertLess(metrics(outputs / "errors" / "distal.json")["mtre_mm"], 1)
        self.assertIn("show long metal, and are bridged", result.stdout + result.stderr)
        self.assertIn("node 'marks' (read.landmarks) failed", result.stderr)
        for view in ("frontal", "lateral"):
            self.assertLess(abs(metrics(outputs / "cameras" / (view + ".json"))["shift_v_mm"]), 0.3)

    def test_cameras_that_are_off_are_said_to_be(self):
        # The 5 px may also make the verdict `wrong`, which ends with 3.
        _, outputs = self.registered("usual", statuses=(0, 3))
        errors = metrics(outputs / "errors" / "distal.json")
        self.assertLess(errors["mtre_mm"], 5)
        self.assertGreater(errors["predicted_along_mm"], 0.3)
        verdicts = self.json("out/run.json")["verdicts"]
        self.assertEqual([verdict["judgement"] == "trusted" for verdict in verdicts], [False])


if __name__ == "__main__":
    main()
