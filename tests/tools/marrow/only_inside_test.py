#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Outputs that no file can hold: what `check` and `run` say about them, and pipelines that only the program runs."""
import pathlib
import subprocess
import tempfile
import unittest

from harness import BUILD, SOURCE

PIPELINE = """marrow: 1
%snodes:
  optimizer: {uses: optimizer.nelder_mead}
  camera: {uses: read.camera, with: {path: %s}}
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


class OnlyInsideTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        (self.folder / "camera.yaml").write_text(CAMERA)

    def marrow(self, *arguments):
        return subprocess.run(
            [BUILD / "bin" / "marrow", *arguments], capture_output=True, text=True, cwd=self.folder, timeout=300
        )

    def write(self, line):
        (self.folder / "p.yaml").write_text(PIPELINE % (line, self.folder / "camera.yaml"))

    def test_a_function_is_no_output_of_a_command(self):
        self.write("")
        for command in ("check", "run"):
            ran = self.marrow(command, "p.yaml")
            self.assertEqual(ran.returncode, 2)
            self.assertIn(
                "p.yaml:6:3: error: output 'search' is a function (optimizer), which no file can hold", ran.stderr
            )
            self.assertIn(
                "hint: leave it out; or, if no command runs the pipeline but only the program itself, say  "
                "only_inside: true",
                ran.stderr,
            )

    def test_a_pipeline_that_only_the_program_runs_may_have_it(self):
        self.write("only_inside: true\n")
        ran = self.marrow("check", "p.yaml")
        self.assertEqual((ran.returncode, ran.stderr), (0, ""))
        self.assertEqual(
            ran.stdout,
            "p.yaml: good; 2 nodes, 2 outputs\n"
            "  note: no command runs it, but the program itself (only_inside): no file need hold its outputs\n",
        )
        ran = self.marrow("run", "p.yaml")
        self.assertNotEqual(ran.returncode, 0)
        self.assertIn(
            "p.yaml: output 'search' is a function, which no file can hold; the program itself runs this pipeline "
            "(only_inside): name other outputs with --only",
            ran.stderr,
        )
        self.assertFalse((self.folder / "runs").exists())
        ran = self.marrow("run", "p.yaml", "--only", "camera", "--no-cache")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertTrue((self.folder / "runs" / "p" / "outputs" / "camera.yaml").exists())

    def test_it_is_a_truth_value(self):
        self.write("only_inside: perhaps\n")
        ran = self.marrow("check", "p.yaml")
        self.assertEqual(ran.returncode, 2)
        self.assertIn("p.yaml:2:1: error: only_inside", ran.stderr)

    def test_all_pipelines_of_the_workbench_are_good(self):
        files = sorted((SOURCE / "pipelines" / "workbench").glob("*.yaml"))
        self.assertIn("place.yaml", [file.name for file in files])
        for file in files:
            ran = self.marrow("check", file)
            self.assertEqual((ran.returncode, ran.stderr), (0, ""), file)


if __name__ == "__main__":
    unittest.main(verbosity=2)
