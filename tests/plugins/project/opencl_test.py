# SPDX-License-Identifier: Apache-2.0
"""project.opencl in place of project.joseph: the pose that is found, and what happens where no device is."""
import os
import signal
import subprocess
import sys
import time
import unittest

from harness import BUILD, MARROW, SOURCE
from harness.cases import SMALL, simulate
from harness.program import Case, main, marrow

PIPELINE = SOURCE / "pipelines" / "femur" / "femur-intensity.yaml"
OPENCL = ["--set", "drr.uses=project.opencl", "--set", "drr.background_hu=50"]
NO_DEVICE = (
    "no device with OpenCL is here; a driver for the graphics card, or Debian's package pocl-opencl-icd, provides one"
)
HIDDEN = {"OCL_ICD_VENDORS": "/nonexistent"}

POSES = """
import sys, numpy, marrow
case = marrow.read.case(path=sys.argv[1])
view = case.views["frontal"]
bone = marrow.segment.level_set(volume=case.ct, seeds=case.seeds)["distal"]
truth = case.truth["distal"].matrix
start = truth.copy()
c, s = numpy.cos(0.015), numpy.sin(0.015)
start[:3, :3] = start[:3, :3] @ [[c, -s, 0], [s, c, 0], [0, 0, 1]]
start[:3, 3] += [0.8, -0.6, 0.7]
optimizer = marrow.optimizer.levenberg_marquardt()
found = []
for project in (marrow.project.joseph, marrow.project.opencl):
    drr = project(volume=case.ct, field=bone, background_hu=50)
    cost = marrow.similarity.patch_gradient_correlation(projector=drr, views=case.views)
    node = dict(cost=cost, finer_cost=cost, optimizer=optimizer, start=marrow.Pose(start))
    found.append(marrow.register.sequence(**node).pose.matrix)
joseph, opencl = found
turn = joseph[:3, :3].T @ opencl[:3, :3]
middle = numpy.append(numpy.zeros(3), 1)
print("turn_deg", numpy.degrees(numpy.linalg.norm(turn - turn.T) / 8 ** 0.5))
print("apart_mm", numpy.linalg.norm(((joseph - opencl) @ middle)[:3]))
print("moved_mm", numpy.linalg.norm(((joseph - start) @ middle)[:3]))
print("off_mm", numpy.linalg.norm(((opencl - truth) @ middle)[:3]))
"""


def has_device():
    return NO_DEVICE not in " ".join(marrow("list", "--fits", PIPELINE, "drr").stdout.split())


class OpenCl(Case):
    @classmethod
    def setUpClass(cls):
        cls.case = simulate(cls.shared_folder() / "simulation", *SMALL)

    def run_poses(self, to, *arguments, **environment):
        result = marrow(
            *["run", PIPELINE, "case=%s" % self.case, "--only", "pose", "--out", self.scratch / to, *arguments],
            extra_environment=environment,
        )
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stderr, (self.scratch / to / "outputs" / "pose" / "distal.yaml").read_text()

    @unittest.skipUnless(has_device(), NO_DEVICE)
    def test_the_same_pose_as_by_joseph(self):
        environment = dict(os.environ, PYTHONPATH=str(BUILD / "python"))
        command = [sys.executable, "-c", POSES, str(self.case)]
        result = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=1200)
        self.assertEqual(result.returncode, 0, result.stderr)
        print(result.stdout)
        figures = {line.split()[0]: float(line.split()[1]) for line in result.stdout.splitlines()}
        self.assertLess(figures["turn_deg"], 0.01)
        self.assertLess(figures["apart_mm"], 0.01)
        self.assertGreater(figures["moved_mm"], 1)
        self.assertLess(figures["off_mm"], 0.1)

    def test_hidden_devices_give_josephs_pose_and_a_warning(self):
        # What another run kept was computed by a device.
        told, pose = self.run_poses("hidden", *OPENCL, "--no-cache", **HIDDEN)
        self.assertIn(NO_DEVICE + "; so the radiographs are computed as by project.joseph", told)
        self.assertEqual(pose, self.run_poses("joseph")[1])

    @unittest.skipUnless(has_device(), NO_DEVICE)
    def test_ctrl_c_ends_a_search(self):
        process = subprocess.Popen(
            [str(MARROW), "run", str(PIPELINE), "case=%s" % self.case, "--out", str(self.scratch / "run"), *OPENCL],
            stderr=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            text=True,
        )
        with process:
            for line in process.stderr:
                if "radiographs are computed by '" in line:
                    break
            time.sleep(1)  # the search begins
            process.send_signal(signal.SIGINT)
            told = process.stderr.read()
        self.assertEqual(process.returncode, 130, told)


if __name__ == "__main__":
    main()
