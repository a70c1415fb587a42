# SPDX-License-Identifier: Apache-2.0
"""Outputs that no file can hold: what `check` and `run` say about them, and pipelines that only the program runs."""
from harness import SOURCE
from harness.program import Case, main

PIPELINE = """marrow: 1
%snodes:
  optimizer: {uses: optimizer.nelder_mead}
  camera: {uses: read.camera, with: {path: camera.yaml}}
outputs:
  search: optimizer
  camera: camera
"""
CAMERA = """marrow-camera: 1
width_px: 6
height_px: 4
intrinsics: [[10, 0, 2.5], [0, 10, 1.5], [0, 0, 1]]
camera_from_world:
  {target: camera, source: world, rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], translation_mm: [0, 0, 600]}
"""
ONLY_INSIDE = PIPELINE % "only_inside: true\n"


class OnlyInside(Case):
    def setUp(self):
        super().setUp()
        self.write("camera.yaml", CAMERA)

    def test_a_function_is_no_output_of_a_command(self):
        message = "output 'search' is a function (optimizer), which no file can hold"
        hint = "leave it out; or, if no command runs the pipeline but only the program itself, say  only_inside: true"
        for command in ("check", "run"):
            self.faults((PIPELINE % "", 6, 3, message, hint), command=[command])

    def test_a_pipeline_that_only_the_program_runs_may_have_it(self):
        self.write("p.yaml", ONLY_INSIDE)
        checked = self.expect(0, "check", "p.yaml")
        note = "  note: no command runs it, but the program itself (only_inside): no file need hold its outputs\n"
        self.assertEqual((checked.stdout, checked.stderr), ("p.yaml: good; 2 nodes, 2 outputs\n" + note, ""))
        ran = self.marrow("run", "p.yaml")
        self.assertNotEqual(ran.returncode, 0)
        self.assertIn(
            "p.yaml: output 'search' is a function, which no file can hold; the program itself runs this pipeline "
            "(only_inside): name other outputs with --only",
            ran.stderr,
        )
        self.assertFalse((self.scratch / "runs").exists())
        self.expect(0, "run", "p.yaml", "--only", "camera")
        self.assertTrue((self.scratch / "runs" / "p" / "outputs" / "camera.yaml").exists())

    def test_it_is_a_truth_value(self):
        self.write("p.yaml", PIPELINE % "only_inside: perhaps\n")
        self.refused("p.yaml:2:1: error: only_inside", "check", "p.yaml")

    def test_all_pipelines_of_the_workbench_are_good(self):
        files = sorted((SOURCE / "pipelines" / "workbench").glob("*.yaml"))
        self.assertIn("place.yaml", [file.name for file in files])
        for file in files:
            self.assertEqual(self.expect(0, "check", file).stderr, "", file)


if __name__ == "__main__":
    main()
