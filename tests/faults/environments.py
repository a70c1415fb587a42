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
        self, *arguments, user=None, limits=(), closed=(), streams=None, without=(), cwd=None, wrapper=(), **variables
    ):
        """The program in a child that has become what it should be; without a store unless one is named."""
        if user and not self.is_reached_by_others:
            self.skipTest("the program lies where other users cannot reach it")
        environment = self.program.environment_of(self.folder, **variables)
        for name in without:
            environment.pop(name, None)

        def become():
            for which, most in limits:
                resource.setrlimit(which, (most, most))
            if user:
                os.setgroups([])
                os.setgid(user)
                os.setuid(user)
            for descriptor in closed:
                os.close(descriptor)

        streams = streams or {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        return subprocess.run(
            [*wrapper, str(self.program.marrow), *map(str, arguments)],
            env=environment,
            cwd=cwd or self.folder,
            preexec_fn=become,
            text=True,
            errors="replace",
            timeout=400,
            stdin=subprocess.DEVNULL,
            **streams
        )

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

    @needs_root
    def test_an_ordinary_user(self):
        home, out = self.owned("home", USER), self.owned("work", USER) / "out"
        result = self.marrow(*self.run_subject.arguments(out), user=USER, HOME=str(home), without=["MARROW_CACHE"])
        self.assert_passes(result, out)
        self.assertTrue((home / ".cache" / "marrow").is_dir())
        again = self.marrow(
            *self.run_subject.arguments(out.parent / "again"), user=USER, HOME=str(home), without=["MARROW_CACHE"]
        )
        self.assert_passes(again, out.parent / "again")
        self.assertIn("cached", again.stdout)

    @needs_root
    def test_without_home(self):
        before, work = pathlib.Path("/tmp/.cache/marrow").exists(), self.owned("work", USER)
        result = self.marrow(
            *self.run_subject.arguments(work / "out"), user=USER, without=["HOME", "MARROW_CACHE", "XDG_CACHE_HOME"]
        )
        self.assert_passes(result, work / "out")
        self.assertEqual(
            pathlib.Path("/tmp/.cache/marrow").exists(), before, "/tmp is for all: what lies there may be anyone's"
        )
        self.assertRegex(result.stderr, r"(?m)^marrow: .*not kept.*home")

    def test_empty_variables(self):
        for names in [[name] for name in VARIABLES] + [VARIABLES]:
            with self.subTest(names):
                work = self.folder / "-".join(names)
                work.mkdir()
                result = self.marrow(
                    *self.run_subject.arguments(work / "out"), cwd=work, **{name: "" for name in names}
                )
                self.assert_passes(result, work / "out")
                self.assertEqual([path.name for path in work.iterdir()], ["out"], "only the folder that was asked for")
                listed = self.marrow("list", cwd=work, **{name: "" for name in names})
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
                out = work / str(most)
                self.wait_for_end_of_all(USER)
                result = self.marrow(
                    *self.run_subject.arguments(out, threads=16),
                    user=USER,
                    limits=[(resource.RLIMIT_NPROC, most)],
                    MARROW_CACHE=str(work / ("store-%d" % most))
                )
                self.assert_passes_or_says_so(result, out)
                self.wait_for_end_of_all(USER)
                compared = work / ("compare-%d" % most)
                result = self.marrow(
                    *self.compare_subject.arguments(compared, more=["--quiet"]),
                    user=USER,
                    limits=[(resource.RLIMIT_NPROC, most)],
                    MARROW_CACHE=str(work / ("compare-store-%d" % most))
                )
                self.assert_compared_or_says_so(result, compared)

    def assert_compared_or_says_so(self, result, out):
        if result.returncode != 0:
            self.assert_sentence(result)
        self.assertEqual(self.compare_subject.complaints_of(out, result.returncode == 0, False), [], self.said(result))

    def limited(self, which, amounts):
        for most in sample(amounts, 4):
            with self.subTest(most):
                out = self.folder / ("out-%d" % most)
                result = self.marrow(
                    *self.run_subject.arguments(out),
                    limits=[(which, most)],
                    MARROW_CACHE=str(self.folder / ("store-%d" % most))
                )
                self.assert_passes_or_says_so(result, out)
                compared = self.folder / ("compare-%d" % most)
                result = self.marrow(
                    *self.compare_subject.arguments(compared, more=["--quiet"]),
                    limits=[(which, most)],
                    MARROW_CACHE=str(self.folder / ("compare-store-%d" % most))
                )
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
                result = self.marrow(*self.run_subject.arguments(out), closed=closed)
                self.assert_passes(result, out)
                compared = self.folder / ("compare" + out.name)
                result = self.marrow(*self.compare_subject.arguments(compared), closed=closed)
                self.assertEqual(result.returncode, 0, self.said(result))
                self.assertEqual(self.compare_subject.complaints_of(compared, True, True), [])

    def test_full_streams(self):
        with open("/dev/full", "w") as full:
            out = self.folder / "out"
            self.assert_passes(
                self.marrow(*self.run_subject.arguments(out), streams={"stdout": subprocess.PIPE, "stderr": full}), out
            )
            result = self.marrow("list", "--json", streams={"stdout": full, "stderr": subprocess.PIPE})
            self.assert_sentence(result, [1])
            self.assertIn("could not be written", result.stderr)

    def test_output_that_nobody_reads(self):
        reader, writer = os.pipe()
        os.close(reader)
        with open(writer, "w") as closed:
            self.assert_passes(
                self.marrow(
                    *self.run_subject.arguments(self.folder / "out"), streams={"stdout": closed, "stderr": closed}
                ),
                self.folder / "out",
            )

    @needs_root
    def test_read_only_folders(self):
        work, read_only = self.owned("work", USER), self.owned("read-only", USER, 0o555)
        result = self.marrow(
            *self.run_subject.arguments(None), user=USER, cwd=read_only, MARROW_CACHE=str(work / "store")
        )
        self.assert_sentence(result)
        self.assertIn("cannot make the output folder", result.stderr)
        result = self.marrow(
            *self.run_subject.arguments(work / "out"), user=USER, cwd=read_only, MARROW_CACHE=str(read_only / "store")
        )
        self.assert_passes(result, work / "out")
        self.assertIn("kept", result.stderr)
        result = self.marrow(
            *self.compare_subject.arguments(None), user=USER, cwd=read_only, MARROW_CACHE=str(work / "store")
        )
        self.assert_sentence(result)

    def test_a_working_folder_that_is_gone(self):
        gone = self.folder / "gone"
        gone.mkdir()
        result = self.marrow(
            *self.run_subject.arguments(self.folder / "out"),
            wrapper=["sh", "-c", 'rmdir "%s"; exec "$0" "$@"' % gone],
            cwd=gone
        )
        self.assert_passes_or_says_so(result, self.folder / "out")

    def test_a_name_that_is_too_long(self):
        result = self.marrow(*self.run_subject.arguments(self.folder / ("x" * 300)))
        self.assert_sentence(result)

    @unittest.skipUnless(can_mount(), "small disks cannot be mounted here")
    def test_full_disk(self):
        wrapper = [
            "unshare",
            "-m",
            "sh",
            "-c",
            (
                'mount -t tmpfs -o "$0" tmpfs full && cp -r full-before/. full/ && "$@"; code=$?; cp -r full after;'
                " exit $code"
            ),
        ]
        for options in ("size=4k", "size=16k", "size=28k", "size=40k", "nr_inodes=6", "nr_inodes=20"):
            for what in ("out", "store", "compare"):
                with self.subTest(options=options, what=what):
                    work = self.folder / (options + what)
                    (work / "full").mkdir(parents=True)
                    (work / "full-before").mkdir()
                    full, store = work / "full", work / "store"
                    if what == "store":
                        result = self.marrow(
                            *self.run_subject.arguments(work / "out"),
                            wrapper=[*wrapper, options],
                            cwd=work,
                            MARROW_CACHE=str(full / "store")
                        )
                        self.assert_passes(result, work / "out")
                    elif what == "out":
                        result = self.marrow(
                            *self.run_subject.arguments(full / "out"),
                            wrapper=[*wrapper, options],
                            cwd=work,
                            MARROW_CACHE=str(store)
                        )
                        self.assert_passes_or_says_so(result, work / "after" / "out")
                    else:
                        result = self.marrow(
                            *self.compare_subject.arguments(full / "out", more=["--quiet"]),
                            wrapper=[*wrapper, options],
                            cwd=work,
                            MARROW_CACHE=str(store)
                        )
                        self.assert_compared_or_says_so(result, work / "after" / "out")

    @needs_root
    def test_two_users_of_one_store(self):
        """What another user can write is not to be trusted, and what he cannot is of no use to him: he does without."""
        store = self.owned("store", USER, 0o777)
        for user in (USER, OTHER_USER, USER):
            work = self.owned("work-%d-%d" % (user, len(list(self.folder.iterdir()))), user)
            result = self.marrow(*self.run_subject.arguments(work / "out"), user=user, MARROW_CACHE=str(store))
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
        tried = (
            subprocess.run(["test", "-x", str(program.marrow)], preexec_fn=lambda: os.setuid(USER))
            if os.getuid() == 0
            else None
        )
        Environments.is_reached_by_others = tried is not None and tried.returncode == 0
        Run(program).reference()
        Compare(program).reference()
        loaded = unittest.defaultTestLoader.loadTestsFromTestCase(Environments)
        chosen = unittest.TestSuite(
            test for test in loaded if not options.tests or any(name in test.id() for name in options.tests)
        )
        return 0 if unittest.TextTestRunner(verbosity=2).run(chosen).wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
