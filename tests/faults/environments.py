#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Poor surroundings: another user, no home, empty variables, tight limits, closed streams, read-only and full disks.
Each run passes with the right bytes, or says in a sentence what is wrong and ends with another code than 0."""
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
import unittest

from starting import SKIPPED, arguments_parser, program_of, sample
from harness.processes import has_processes
from subjects import Compare, Run, bytes_below

USER = 50000 + 2 * (os.getpid() % 5000)  # of no account and no other process, nor of this program elsewhere
OTHER_USER = USER + 1
LOADER = "error while loading shared libraries"  # the system's own words, before the program begins
ERROR = re.compile(r"^(?:marrow: error: |\S+: error: )\S.{8,}$", re.MULTILINE)
VARIABLES = ["MARROW_CACHE", "XDG_CACHE_HOME", "HOME", "MARROW_PLUGIN_PATH", "MARROW_CACHE_GB", "TMPDIR", "PATH"]
needs_root = unittest.skipIf(os.getuid() != 0, "only root can become another user or mount a small disk")


def can_mount():
    return os.getuid() == 0 and subprocess.run(["unshare", "-m", "true"], capture_output=True).returncode == 0


class Environments(unittest.TestCase):
    program = None
    is_reached_by_others = False

    def setUp(self):
        self.folder = self.program.scratch / self.id().rpartition(".")[2]
        self.folder.mkdir()
        self.folder.chmod(0o777)
        self.run_subject, self.compare_subject = Run(self.program), Compare(self.program)

    def tearDown(self):
        shutil.rmtree(self.folder, ignore_errors=True)

    def owned(self, name, user, mode=0o755):
        folder = self.folder / name
        folder.mkdir()
        os.chown(folder, user, user)
        folder.chmod(mode)
        return folder

    def marrow(
        self,
        *arguments,
        user=None,
        limit=None,
        closed=(),
        without=(),
        cwd=None,
        wrapper=(),
        out=None,
        err=None,
        **variables
    ):
        """The program in a child that has become what it should be; without a store unless one is named."""
        if user and not self.is_reached_by_others:
            self.skipTest("the program lies where other users cannot reach it")
        environment = self.program.environment_of(
            self.folder, **{name: str(value) for name, value in variables.items()}
        )
        for name in without:
            environment.pop(name, None)

        def become():
            if limit:
                resource.setrlimit(limit[0], (limit[1], limit[1]))
            if user:
                os.setgroups([])
                os.setgid(user)
                os.setuid(user)
            for descriptor in closed:
                os.close(descriptor)

        how = {"env": environment, "cwd": cwd or self.folder, "preexec_fn": become, "stdin": subprocess.DEVNULL}
        how.update(stdout=out or subprocess.PIPE, stderr=err or subprocess.PIPE)
        command = [*wrapper, str(self.program.marrow), *map(str, arguments)]
        return subprocess.run(command, text=True, errors="replace", timeout=400, **how)

    def run_in(self, folder, threads=None, **how):
        """A run; its results are to be in the folder, or in its default one."""
        more = {"threads": threads} if threads else {}
        return self.marrow(*self.run_subject.arguments(folder, **more), **how)

    def compare_in(self, folder, more=("--quiet",), **how):
        return self.marrow(*self.compare_subject.arguments(folder, more=more), **how)

    def said(self, result):
        return "code %d: %s" % (result.returncode, result.stderr)

    def assert_sentence(self, result, code=(1, 2)):
        """A few sentences at most, none twice, and no word of a crash."""
        self.assertIn(result.returncode, code, self.said(result))
        sentences = ERROR.findall(result.stderr)
        self.assertTrue(1 <= len(sentences) <= 6, self.said(result))
        self.assertEqual(len(sentences), len(set(sentences)), self.said(result))
        self.assertNotIn("terminate called", result.stderr)

    def assert_passes(self, result, out):
        self.assertEqual(result.returncode, 0, self.said(result))
        self.assertEqual(self.run_subject.complaints_of(out, True), [])

    def assert_passes_or_says_so(self, result, out):
        if result.returncode == 127 and LOADER in result.stderr:
            return
        if result.returncode == 0:
            return self.assert_passes(result, out)
        self.assert_sentence(result)
        self.assertEqual(self.run_subject.complaints_of(out, False), [])

    def assert_compared_or_says_so(self, result, out):
        if result.returncode != 0:
            self.assert_sentence(result)
        self.assertEqual(self.compare_subject.complaints_of(out, result.returncode == 0, False), [], self.said(result))

    @needs_root
    def test_an_ordinary_user(self):
        home, work = self.owned("home", USER), self.owned("work", USER)
        how = {"user": USER, "HOME": home, "without": ["MARROW_CACHE"]}
        self.assert_passes(self.run_in(work / "out", **how), work / "out")
        self.assertTrue((home / ".cache" / "marrow").is_dir())
        again = self.run_in(work / "again", **how)
        self.assert_passes(again, work / "again")
        self.assertIn("cached", again.stdout)

    @needs_root
    def test_without_home(self):
        for_all = pathlib.Path("/tmp/.cache/marrow")
        before, work = for_all.exists(), self.owned("work", USER)
        result = self.run_in(work / "out", user=USER, without=["HOME", "MARROW_CACHE", "XDG_CACHE_HOME"])
        self.assert_passes(result, work / "out")
        self.assertEqual(for_all.exists(), before, "/tmp is for all: what lies there may be anyone's")
        self.assertRegex(result.stderr, r"(?m)^marrow: .*not kept.*home")

    def test_empty_variables(self):
        for names in [[name] for name in VARIABLES] + [VARIABLES]:
            with self.subTest(names):
                work = self.folder / "-".join(names)
                work.mkdir()
                empty = {name: "" for name in names}
                self.assert_passes(self.run_in(work / "out", cwd=work, **empty), work / "out")
                self.assertEqual([path.name for path in work.iterdir()], ["out"], "only the folder that was asked for")
                listed = self.marrow("list", cwd=work, **empty)
                self.assertEqual(listed.returncode, 0, self.said(listed))

    @staticmethod
    def wait_for_end_of_all(user):
        """What is left of the last program counts for the next one's limit: the system might not even start it."""
        end = time.monotonic() + 120
        while has_processes(user) and time.monotonic() < end:
            time.sleep(0.05)

    @needs_root
    def test_few_processes(self):
        """Threads count as processes: there are fewer than the pool wants."""
        work = self.owned("work", USER)
        for most in (1, 2, 4, 8):
            with self.subTest(most):
                how = {"user": USER, "limit": (resource.RLIMIT_NPROC, most)}
                out, compared = work / str(most), work / ("compare-%d" % most)
                self.wait_for_end_of_all(USER)
                result = self.run_in(out, threads=16, MARROW_CACHE=work / ("store-%d" % most), **how)
                self.assert_passes_or_says_so(result, out)
                self.wait_for_end_of_all(USER)
                result = self.compare_in(compared, MARROW_CACHE=work / ("compare-store-%d" % most), **how)
                self.assert_compared_or_says_so(result, compared)

    def limited(self, which, amounts):
        for most in sample(amounts, 4):
            with self.subTest(most):
                out, compared = self.folder / ("out-%d" % most), self.folder / ("compare-%d" % most)
                store = self.folder / ("store-%d" % most)
                self.assert_passes_or_says_so(self.run_in(out, limit=(which, most), MARROW_CACHE=store), out)
                store = self.folder / ("compare-store-%d" % most)
                result = self.compare_in(compared, limit=(which, most), MARROW_CACHE=store)
                if result.returncode != 127:
                    self.assert_compared_or_says_so(result, compared)

    def test_few_open_files(self):
        self.limited(resource.RLIMIT_NOFILE, [4, 6, 8, 12, 16, 24, 64])

    def test_little_memory(self):
        self.limited(resource.RLIMIT_AS, [megabytes << 20 for megabytes in (30, 60, 100, 150, 200, 300, 500, 1000)])

    def test_small_files(self):
        self.limited(resource.RLIMIT_FSIZE, [0, 1, 100, 500, 2000, 20000])

    def test_closed_streams(self):
        for closed in ([0], [1], [2], [1, 2], [0, 1, 2]):
            with self.subTest(closed):
                out = self.folder / "".join(map(str, closed))
                self.assert_passes(self.run_in(out, closed=closed), out)
                compared = self.folder / ("compare" + out.name)
                result = self.marrow(*self.compare_subject.arguments(compared), closed=closed)
                self.assertEqual(result.returncode, 0, self.said(result))
                self.assertEqual(self.compare_subject.complaints_of(compared, True, True), [])

    def test_full_streams(self):
        with open("/dev/full", "w") as full:
            self.assert_passes(self.run_in(self.folder / "out", err=full), self.folder / "out")
            result = self.marrow("list", "--json", out=full)
            self.assert_sentence(result, [1])
            self.assertIn("could not be written", result.stderr)

    def test_output_that_nobody_reads(self):
        reader, writer = os.pipe()
        os.close(reader)
        with open(writer, "w") as closed:
            self.assert_passes(self.run_in(self.folder / "out", out=closed, err=closed), self.folder / "out")

    @needs_root
    def test_read_only_folders(self):
        work, read_only = self.owned("work", USER), self.owned("read-only", USER, 0o555)
        how = {"user": USER, "cwd": read_only}
        result = self.run_in(None, MARROW_CACHE=work / "store", **how)
        self.assert_sentence(result)
        self.assertIn("cannot make the output folder", result.stderr)
        result = self.run_in(work / "out", MARROW_CACHE=read_only / "store", **how)
        self.assert_passes(result, work / "out")
        self.assertIn("kept", result.stderr)
        self.assert_sentence(self.marrow(*self.compare_subject.arguments(None), MARROW_CACHE=work / "store", **how))

    def test_a_working_folder_that_is_gone(self):
        gone = self.folder / "gone"
        gone.mkdir()
        wrapper = ["sh", "-c", 'rmdir "%s"; exec "$0" "$@"' % gone]
        self.assert_passes_or_says_so(self.run_in(self.folder / "out", wrapper=wrapper, cwd=gone), self.folder / "out")

    def test_a_name_that_is_too_long(self):
        self.assert_sentence(self.run_in(self.folder / ("x" * 300)))

    @unittest.skipUnless(can_mount(), "small disks cannot be mounted here")
    def test_full_disk(self):
        mounted = 'mount -t tmpfs -o "$0" tmpfs full && cp -r full-before/. full/ && "$@"; code=$?; cp -r full after;'
        wrapper = ["unshare", "-m", "sh", "-c", mounted + " exit $code"]
        for options in ("size=4k", "size=16k", "size=28k", "size=40k", "nr_inodes=6", "nr_inodes=20"):
            for what in ("out", "store", "compare"):
                with self.subTest(options=options, what=what):
                    work = self.folder / (options + what)
                    full, after = work / "full", work / "after" / "out"
                    full.mkdir(parents=True)
                    (work / "full-before").mkdir()
                    how = {"wrapper": [*wrapper, options], "cwd": work}
                    if what == "store":
                        self.assert_passes(self.run_in(work / "out", MARROW_CACHE=full / "store", **how), work / "out")
                    elif what == "out":
                        result = self.run_in(full / "out", MARROW_CACHE=work / "store", **how)
                        self.assert_passes_or_says_so(result, after)
                    else:
                        result = self.compare_in(full / "out", MARROW_CACHE=work / "store", **how)
                        self.assert_compared_or_says_so(result, after)

    @needs_root
    def test_two_users_of_one_store(self):
        """What another user can write is not to be trusted, and what he cannot is of no use to him: he does without."""
        store = self.owned("store", USER, 0o777)
        for user in (USER, OTHER_USER, USER):
            work = self.owned("work-%d-%d" % (user, len(list(self.folder.iterdir()))), user)
            result = self.run_in(work / "out", user=user, MARROW_CACHE=store)
            self.assert_passes(result, work / "out")
            if user == OTHER_USER:
                self.assertNotIn("cached", result.stdout)
                self.assertRegex(result.stderr, r"(?m)^marrow: .*store.*")
        owners = {path.stat().st_uid for path in [store, *store.rglob("*")]}
        self.assertEqual(owners, {USER})


def main():
    parser = arguments_parser(__doc__)
    parser.add_argument("tests", nargs="*", help="only these")
    options = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with program_of(options) as program:
        program.scratch.chmod(0o755)
        Environments.program = program
        if os.getuid() == 0:
            tried = subprocess.run(["test", "-x", str(program.marrow)], preexec_fn=lambda: os.setuid(USER))
            Environments.is_reached_by_others = tried.returncode == 0
        Run(program).reference()
        Compare(program).reference()
        loaded = unittest.defaultTestLoader.loadTestsFromTestCase(Environments)
        is_chosen = lambda test: not options.tests or any(name in test.id() for name in options.tests)
        chosen = unittest.TestSuite(filter(is_chosen, loaded))
        return 0 if unittest.TextTestRunner(verbosity=2).run(chosen).wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
