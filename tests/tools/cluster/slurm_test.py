# SPDX-License-Identifier: Apache-2.0
"""A comparison on a Slurm cluster of one host, which tools/checks/cluster_test starts: the same figures as on one
machine, also after tasks and the controller were killed."""
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

from cluster_cases import CAN_START_CLUSTER, CASES, IN_A_CLUSTER, VARIANTS, Cluster, is_idle, main, run_in_cluster
from cluster_cases import wait_until

PROFILE = "marrow-cluster: 1\nprocessors: 1\ntries: 3\nask_every_s: 2\n"
ONE_TRY = PROFILE.replace("tries: 3", "tries: 1")
ALL = bool(os.environ.get("MARROW_TEST_ALL"))


def tasks():
    """Processes of tasks that run a chunk of this test's comparison, not of one that runs beside it."""
    found = []
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        if len(words) > 2 and words[1] == b"chunk" and words[2].startswith(bytes(tasks.folder)):
            found.append(int(process.name))
    return found


class OnSlurm(Cluster):
    tables = {}

    def setUp(self):
        super().setUp()
        self.profile = self.write("profile.yaml", PROFILE)
        self.out = tasks.folder = self.scratch / "out"

    def tearDown(self):
        subprocess.run(["scancel", "--user=root"], check=True)
        wait_until(is_idle, "the cluster goes on")
        super().tearDown()

    def submit(self, *arguments, code=0):
        return self.compare("out", "--on", "slurm", "--profile", self.profile, *arguments, code=code)

    def expect_same_as_here(self):
        """The figures are those of this machine alone, which are made once for each experiment."""
        cases = len(list((self.scratch / "cases").iterdir()))
        experiment = (self.scratch / "p.yaml").read_text() + pathlib.Path(self.file).read_text() + str(cases)
        if experiment not in self.tables:
            self.compare("local", "--quiet", "--shown", "0", MARROW_CACHE=str(self.scratch / "another"))
            self.tables[experiment] = self.figures("local"), self.answers("local")
        self.assertEqual((self.figures("out"), self.answers("out")), self.tables[experiment])

    def start_and_wait(self):
        command = ["compare", self.file, "--out", self.out, "--on", "slurm", "--profile", self.profile, "--wait"]
        return self.start(*command, stderr=subprocess.STDOUT)

    def end_of(self, process, code=0):
        said, _ = process.communicate(timeout=600)
        self.assertEqual(process.returncode, code, said)
        return said

    def begin_anew(self):
        shutil.rmtree(self.out)
        shutil.rmtree(self.scratch / "cache")

    def parts_with_rows(self):
        return [part for part in (self.out / "rows").glob("*.part") if part.stat().st_size > 0]

    def daemon(self, *words):
        subprocess.run([os.environ["CLUSTER_FOLDER"] + "/daemon", *words], check=True)

    def only_with_all(self):
        if not ALL and len(sys.argv) < 2:
            self.skipTest("takes a minute; MARROW_TEST_ALL=1, or its name, tries it")

    def test_same_figures(self):
        said = self.submit("--wait").stdout
        self.assertIn("%d cells are left, in %d chunks" % (CASES * VARIANTS, CASES), said)
        self.assertEqual(self.count("out", "done"), CASES * VARIANTS)
        self.expect_same_as_here()
        said = self.compare("out", "--status").stdout
        self.assertIn("{0} of {0} cells in {1} of {1} chunks".format(CASES * VARIANTS, CASES), said)
        self.assertIn("tables and report are made; submitted 1 times", said)
        status = json.loads(self.compare("out", "--status", "--json").stdout)
        self.assertEqual((status["gathered"], status["tries"], status["lost"]), (True, 1, ""))
        self.assertTrue((self.out / "report.html").exists())

    def hold_tasks(self):
        """Holds tasks until two run, and until the controller has saved that: then it loses nothing when it is killed.
        Else it would start tasks again that have ended, which the node refuses as duplicates."""
        held = set()
        saved = pathlib.Path(os.environ["CLUSTER_FOLDER"]) / "state" / "job_state"
        wait_until(lambda: held.update(self.send(signal.SIGSTOP)) or len(held) >= 2, "no two tasks run")
        now = time.time()
        wait_until(lambda: saved.stat().st_mtime > now, "the controller does not save its state")

    @staticmethod
    def send(number):
        """Sends a signal to the tasks."""
        found = tasks()
        for task in found:
            os.kill(task, number)
        return found

    def test_killed_tasks_and_controller(self):
        self.experiment("1.5", cases=10)  # long enough that tasks are left to be held
        process = self.start_and_wait()
        for _ in range(2):
            wait_until(lambda: self.send(signal.SIGKILL), "no task came")
            time.sleep(1)
        self.hold_tasks()
        self.daemon("kill", "slurmctld")
        time.sleep(2)
        self.daemon("start", "slurmctld")
        self.send(signal.SIGCONT)
        self.end_of(process)
        self.expect_same_as_here()
        self.assertRegex(self.compare("out", "--status").stdout, "submitted [23] times")  # the killed tasks' chunks

    def reasons(self):
        """Why cells failed, each reason once."""
        return {row["reason"] for row in self.figures("out").values() if row["status"] == "failed"}

    def expect_reasons(self, words):
        reasons = self.reasons()
        self.assertEqual(len(reasons), 2, reasons)  # of two tasks
        for reason in reasons:
            self.assertIn(words + "; see log/", reason)

    def give_place_away(self, code=0):
        process = self.start_and_wait()
        wait_until(lambda: len(tasks()) == 2, "no two tasks came")
        urgent = ["sbatch", "--quiet", "-p", "urgent", "-c", "2", "-o", "/dev/null", "--wrap", "sleep 1"]
        subprocess.run(urgent, check=True)
        self.end_of(process, code)

    def test_place_given_to_another_job(self):
        self.only_with_all()
        self.experiment("5", cases=2)
        self.profile = self.write("profile.yaml", PROFILE + "partition: cheap\n")
        self.give_place_away()
        self.expect_same_as_here()
        self.assertIn("submitted 2 times", self.compare("out", "--status").stdout)
        self.begin_anew()
        self.profile = self.write("profile.yaml", ONE_TRY + "partition: cheap\n")
        self.give_place_away(code=1)
        self.expect_reasons("the cluster gave its place to another job (PREEMPTED)")

    def test_memory_of_the_cluster(self):
        self.only_with_all()
        if not os.environ.get("CLUSTER_MEMORY"):
            self.skipTest("needs control groups of version 1")
        self.experiment("0.2", more=", memory: {m.how: memory}", cases=2)
        self.profile = self.write("profile.yaml", ONE_TRY + "memory_mb: 300\n")
        self.submit("--wait")  # the system kills the largest process, which runs the cell; the task goes on
        self.assertEqual(self.count("out", "done"), 2 * VARIANTS)
        reason = "crashed in node 'm': Killed, as by a system whose memory, or that of a cluster's job, runs out"
        self.assertEqual(self.reasons(), {reason})
        self.begin_anew()
        process = self.start_and_wait()
        wait_until(lambda: len(self.parts_with_rows()) == 2, "no two tasks came")
        for task in tasks():  # now it kills the task itself, but not its processes that run cells
            pathlib.Path("/proc/%d/oom_score_adj" % task).write_text("1000")
        self.end_of(process, 1)
        self.expect_reasons("it took more memory than the cluster allows (OUT_OF_MEMORY)")
        self.assertEqual(self.count("out", "done"), 2 * VARIANTS)

    def test_ctrl_c_and_again(self):
        self.only_with_all()
        self.experiment("2", cases=10)
        process = self.start_and_wait()
        wait_until(tasks, "no task came")
        time.sleep(3)
        process.send_signal(signal.SIGINT)
        self.assertIn("its tasks were cancelled; the same command goes on from here", self.end_of(process, 130))
        wait_until(lambda: not tasks(), "tasks go on")
        wait_until(is_idle, "the cluster goes on")
        self.submit("--wait")
        self.expect_same_as_here()

    def test_a_full_disk(self):
        self.only_with_all()
        self.experiment(cases=10, variants=20)
        self.out.mkdir()
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=300k", "none", self.out], check=True)
        try:
            said = self.end_of(self.start_and_wait(), 2)
            self.assertRegex(said, "the cluster holds tasks back|ended without a report")
            subprocess.run(["mount", "-o", "remount,size=100m", self.out], check=True)
            self.submit("--wait")
            self.expect_same_as_here()
        finally:
            subprocess.run(["umount", "-l", self.out], check=True)

    def test_a_plugin_that_crashes(self):
        self.only_with_all()
        self.experiment(more=", crash: {m.how: crash}")
        self.submit("--wait")
        self.expect_same_as_here()
        self.assertEqual(self.count("out", "failed"), CASES)

    def test_refused(self):
        self.profile = self.write("profile.yaml", PROFILE + "partition: none\n")
        said = self.submit(code=2).stderr
        self.assertIn("sbatch failed", said)
        self.assertIn("partition", said)
        self.assertFalse((self.out / "slurm.json").exists())
        self.assertTrue(is_idle())

    def test_time_limit_of_the_cluster(self):
        self.only_with_all()
        self.experiment(more=", hang: {m.how: hang}", cases=2)
        self.profile = self.write("profile.yaml", ONE_TRY + "minutes: 1\n")
        self.submit("--wait", code=1)
        self.expect_reasons("the cluster's time limit was reached (TIMEOUT)")
        self.assertEqual(self.count("out", "done"), 2 * VARIANTS)  # the rows that the tasks had made count


if __name__ == "__main__":
    if IN_A_CLUSTER:
        main()
    elif not CAN_START_CLUSTER:
        print("skipped: a Slurm cluster needs root, and the packages slurmctld, slurmd, slurm-client, munge")
        sys.exit(77)
    else:
        sys.exit(run_in_cluster())
