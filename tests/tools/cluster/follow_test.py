# SPDX-License-Identifier: Apache-2.0
"""What `--wait` does when the cluster forgets jobs, takes ended tasks for running or does not answer. Programs with the
names of Slurm's stand for the cluster: sbatch runs an array at once, and a job that gathers only when it is told."""
import os
import signal

from cluster_cases import VARIANTS, Cluster, main, wait_until

CELLS = 2 * VARIANTS
SILENCE_s = 8  # longer than one question takes on a busy machine, which must end before
PROGRAM = """#!/usr/bin/python3
import os, pathlib, subprocess, sys

here = pathlib.Path(__file__).resolve().parent
name, words = pathlib.Path(sys.argv[0]).name, sys.argv[1:]
with open(here / "asked", "a") as stream:
    print(name, *words, file=stream)
said = here / (name + ".says")
if said.exists():
    print(said.read_text().split("\\n", 1)[1], end="")
    sys.exit(int(said.read_text().split("\\n")[0]))
if name == "sbatch":
    number = len(list(here.glob("job-*"))) + 1
    (here / ("job-%d" % number)).write_text("\\n".join(words))
    print(number)
    array = [word for word in words if word.startswith("--array=0-")]
    if array:
        for i in range(int(array[0][len("--array=0-"):]) + 1):
            environment = {**os.environ, "SLURM_ARRAY_TASK_ID": str(i), "SLURM_CPUS_PER_TASK": "2"}
            subprocess.run(["sh", *words[-2:]], env=environment, stdout=sys.stderr)
if name == "scancel" and "_" in words[-1]:  # a task: what waits for it goes on
    gather = (here / "job-2").read_text().split("\\n")[-1]
    sys.exit(subprocess.run(["sh", gather], stdout=sys.stderr).returncode)
"""


class Follow(Cluster):
    def setUp(self):
        super().setUp()
        self.programs = self.scratch / "programs"
        for name in ("sbatch", "squeue", "scancel", "sacct"):
            self.write("programs/" + name, PROGRAM).chmod(0o755)
        self.environment["PATH"] = str(self.programs) + ":" + os.environ["PATH"]
        self.profile = self.write("profile.yaml", "marrow-cluster: 1\nsilence_s: %d\nask_every_s: 1\n" % SILENCE_s)
        self.out = self.scratch / "out"
        self.file = self.experiment(cases=2)

    def says(self, program, code, text):
        said = self.write("programs/%s.new" % program, "%d\n%s" % (code, text))
        said.rename(said.with_suffix(".says"))

    def asked(self, start):
        return [line for line in self.read("programs/asked").split("\n") if line.startswith(start)]

    def wait(self, code):
        return self.compare("out", "--on", "slurm", "--profile", self.profile, "--wait", "--quiet", code=code)

    def plan_name(self):
        return self.plan("out").stem

    def test_a_task_that_has_ended_and_is_taken_for_running(self):
        self.says("squeue", 0, "1_1 RUNNING None\n2 PENDING Dependency\n")
        said = self.wait(0)
        self.assertIn("the cluster takes task 1_1 for running, but its rows are there; it is ended", said.stderr)
        self.assertEqual(self.asked("scancel"), ["scancel --name=marrow-%s 1_1" % self.plan_name()])
        said = self.compare("out", "--status").stdout
        self.assertIn("{0} of {0} cells in 2 of 2 chunks".format(CELLS), said)
        self.assertTrue((self.out / "report.html").exists())
        self.compare("local", "--quiet", MARROW_CACHE=str(self.scratch / "another"))
        self.expect_same("out", "local")

    def test_jobs_that_are_forgotten(self):
        self.says("squeue", 0, "")
        said = self.wait(2).stderr
        self.assertIn("the job that gathers, 2, ended without a report; see %s/log/2.txt" % self.out, said)
        self.assertIn("the same command goes on from here", said)
        # the output of a cluster that knows none of the numbers
        self.says("squeue", 1, "slurm_load_jobs error: Invalid job id specified\n")
        self.assertIn("no cell is left", self.compare("out", "--on", "slurm").stdout)
        # jobs of others that got the numbers are not asked for
        names = "--name=marrow-{0},marrow-gather-{0}".format(self.plan_name())
        self.assertTrue(all(names in line for line in self.asked("squeue")))

    def test_no_answer(self):
        fault = "slurm_load_jobs error: Unable to contact slurm controller (connect failure)"
        self.says("squeue", 1, fault + "\n")
        said = self.wait(2).stderr
        asked = "the cluster does not answer (%s); it is asked again for %d s" % (fault, SILENCE_s)
        self.assertEqual(said.count(asked), 1)
        self.assertIn("the cluster has not answered for %d s (%s)" % (SILENCE_s, fault), said)
        self.assertIn("--gather makes tables and report of it", said)
        self.assertEqual(self.asked("scancel"), [])  # what goes on without an answer is not ended
        said = self.compare("out", "--on", "slurm", code=2).stderr
        self.assertIn("the cluster does not say whether what was submitted from %s has ended: " % self.out, said)
        self.says("scancel", 1, fault + "\n")
        said = self.compare("out", "--cancel", code=2).stderr
        self.assertIn("scancel failed (exit code 1): " + fault, said)
        said = self.compare("out", "--gather", "--quiet").stdout
        self.assertIn("%d were there already" % CELLS, said)

    def test_ctrl_c_while_the_cluster_does_not_answer(self):
        self.write("programs/squeue", "#!/bin/sh\ntouch %s\nexec sleep 1000\n" % (self.scratch / "asks"))
        process = self.start("compare", self.file, "--out", self.out, "--on", "slurm", "--wait")
        wait_until((self.scratch / "asks").exists, "squeue was not started")
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=300)[1]
        self.assertEqual(process.returncode, 130, said)
        self.assertIn("its tasks were cancelled; the same command goes on from here", said)
        names = ["scancel --name=marrow-%s%s" % (what, self.plan_name()) for what in ("gather-", "")]
        self.assertEqual(self.asked("scancel"), names)
        self.assertEqual(len(list((self.out / "rows").glob("*.jsonl"))), 2)


if __name__ == "__main__":
    main()
