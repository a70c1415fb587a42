# SPDX-License-Identifier: Apache-2.0
"""The store of results as a person meets it: where it is, what it refuses to touch, and that waiting is no failure."""
import os
import re
import stat
import subprocess
import time

from harness import MARROW, TEST_PLUGINS
from harness.program import Case, another_run_makes_all, main, marrow, wait_until

NUMBER = "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 3}}\noutputs: {number: c}\n"
WRONG_NUMBERS = ("abc", "inf", "nan", "-5", "0,5", "1e12", "")


class Cache(Case):
    def setUp(self):
        super().setUp()
        self.cache = self.scratch / "cache"
        self.pipeline = self.write("p.yaml", NUMBER)
        self.runs = 0

    def marrow(self, *arguments, **environment):
        return marrow(
            *arguments,
            plugins=[TEST_PLUGINS],
            cwd=self.scratch,
            extra_environment={"MARROW_CACHE": str(self.cache), **environment}
        )

    def run_pipeline(self, **environment):
        self.runs += 1
        return self.marrow("run", self.pipeline, "--out", self.scratch / ("out-%d" % self.runs), **environment)

    def kept(self):
        """How many results are kept."""
        result = self.marrow("cache", "info")
        self.assertEqual(result.returncode, 0, result.stderr)
        return int(re.search(r"^all +(\d+)", result.stdout, re.M).group(1))

    def files(self, folder):
        return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))

    def test_gc_takes_no_number_for_another(self):
        self.assertEqual(self.run_pipeline().returncode, 0)
        for wrong in WRONG_NUMBERS:
            result = self.marrow("cache", "gc", "--keep-gb=" + wrong)
            self.assertEqual(result.returncode, 2, wrong)
            if wrong:
                self.assertIn(
                    "--keep-gb is '%s', but must be a number of gigabytes from 0 to 1000000; nothing is removed"
                    % wrong,
                    result.stderr,
                )
            self.assertEqual(self.kept(), 1, wrong)
        self.assertIn("0 results removed", self.marrow("cache", "gc", "--keep-gb", "1e6").stdout)
        self.assertIn("1 results removed", self.marrow("cache", "gc", "--keep-gb", "0").stdout)

    def test_why_tells_of_one_key(self):
        for value in range(9):
            self.assertEqual(
                self.marrow("run", self.pipeline, "--out", "of-%d" % value, "--set", "c.value=%d" % value).returncode, 0
            )
        text = self.marrow("cache", "why", "")
        self.assertEqual((text.returncode, text.stdout), (2, ""))
        self.assertIn(
            "a word after 'why' is empty, and nothing has an empty name; a variable may have no value", text.stderr
        )
        entries = sorted(
            path.name for path in self.cache.rglob("*") if len(path.name) == 32 and path.parent.name == path.name[:2]
        )
        keys = set(entries)
        for entry in entries:
            told = self.marrow("cache", "why", entry)
            self.assertEqual(told.returncode, 0, told.stderr)
            self.assertTrue(told.stdout.startswith(entry + ": test.constant"), told.stdout)
            keys.update(re.findall(r"^  output (\w+)$", told.stdout, re.M))
        self.assertEqual(len(keys), 18)
        digit = max(
            "0123456789abcdef", key=lambda one: sum(key.startswith(one) for key in keys)
        )  # of 18 keys, some share one
        several = sorted(key for key in keys if key.startswith(digit))
        told = self.marrow("cache", "why", digit)
        self.assertEqual((told.returncode, told.stdout), (2, ""))
        self.assertEqual(
            told.stderr,
            "marrow: error: %d keys begin with '%s'; give more digits of one of them:\n" % (len(several), digit)
            + "".join("  %s\n" % key for key in several[:5])
            + ("  ...\n" if len(several) > 5 else ""),
        )
        damaged = next(self.cache.rglob(entries[0]))
        damaged.write_bytes(damaged.read_bytes()[:-1])
        told = self.marrow("cache", "why", entries[0])
        self.assertEqual((told.returncode, told.stdout), (2, ""))
        self.assertEqual(
            told.stderr,
            "marrow: error: the result %s is damaged or of another version; the next run that needs it makes it again\n"
            % entries[0],
        )

    def test_what_is_mounted_in_the_store_is_left(self):
        self.assertEqual(self.run_pipeline().returncode, 0)
        inner = self.cache / "cases" / ("0" * 32) / "outputs"
        inner.mkdir(parents=True)
        (inner.parent / "content.txt").write_text("made by marrow\n")
        (self.scratch / "precious").mkdir()
        self.write("precious/data", "mine")
        script = 'mount --bind "$1" "$2" && "$3" cache gc --keep-gb 0'
        command = ["unshare", "-m", "sh", "-c", script, "sh", self.scratch / "precious", inner, MARROW]
        if subprocess.run(["unshare", "-m", "true"], capture_output=True).returncode != 0:
            self.skipTest("only root can mount")
        result = subprocess.run(
            list(map(str, command)), capture_output=True, text=True, env={**os.environ, "MARROW_CACHE": str(self.cache)}
        )
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn(
            "%s is left, because something is mounted there; unmount that first" % inner.parent, result.stderr
        )
        self.assertEqual((self.scratch / "precious" / "data").read_text(), "mine")
        self.assertTrue(inner.is_dir())
        self.assertIn("1 results removed", result.stdout, "all else is")

    def test_what_is_left_because_its_age_is_unknown_is_said(self):
        self.assertEqual(self.run_pipeline().returncode, 0)
        left = self.cache / "cases" / ("0" * 32 + ".tmp-alpha.0123456789abcdef.00000001.000000000001-0")
        left.parent.mkdir(exist_ok=True)
        left.mkdir()  # a process of another host left it
        two_days_ago = time.time() - 2 * 86400
        os.utime(left, (two_days_ago, two_days_ago))
        # ages are counted from the time of a new file, and no byte can be written, as on a full disk
        command = ["sh", "-c", 'ulimit -f 0; exec "$1" cache gc --keep-gb 1', "sh", str(MARROW)]
        environment = {**os.environ, "MARROW_CACHE": str(self.cache)}
        result = subprocess.run(command, capture_output=True, text=True, env=environment)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("%s is left, because its age is unknown: no file can be written beside it" % left, result.stderr)
        self.assertTrue(left.exists())
        result = self.marrow("cache", "gc", "--keep-gb", "1")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertFalse(left.exists())
        self.assertEqual(self.kept(), 1)

    def test_a_wrong_limit_is_said_and_removes_nothing(self):
        for wrong in WRONG_NUMBERS[:-1]:
            (self.cache / "tidied").unlink(missing_ok=True)
            result = self.run_pipeline(MARROW_CACHE_GB=wrong)
            self.assertEqual(result.returncode, 0)
            self.assertIn("MARROW_CACHE_GB is '%s', but must be a number of gigabytes" % wrong, result.stderr)
            self.assertEqual(self.kept(), 1, wrong)

    def test_a_folder_of_other_things_is_left_alone(self):
        for name in ("photos.tmp-0/a.jpg", "0123456789abcdef0123456789abcdef/letter.txt", "note"):
            (self.cache / name).parent.mkdir(parents=True, exist_ok=True)
            (self.cache / name).write_text("mine")
        before = self.files(self.cache)
        sentence = (
            "the folder %s holds other things and is no store of marrow; set MARROW_CACHE to a new or empty folder"
            % self.cache
        )
        result = self.run_pipeline()
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(result.stderr.count("results are not kept: " + sentence), 1, result.stderr)
        self.assertIn(sentence, (self.scratch / "out-1" / "log.txt").read_text())
        for command in (["gc", "--keep-gb", "0"], ["info"], ["why", "0"]):
            result = self.marrow("cache", *command)
            self.assertEqual(result.returncode, 2, command)
            self.assertIn(sentence, result.stderr)
        self.assertIn(sentence, self.marrow("plan", self.pipeline).stderr)
        self.assertEqual(self.files(self.cache), before)

    def test_empty_variables_count_as_not_set(self):
        result = self.run_pipeline(MARROW_CACHE="", XDG_CACHE_HOME="", HOME=str(self.scratch / "home"))
        self.assertEqual(result.returncode, 0, result.stderr)
        store = self.scratch / "home" / ".cache" / "marrow" / "store"
        self.assertIn("marrow-store", os.listdir(store))
        self.assertEqual(sorted(os.listdir(self.scratch)), ["home", "out-1", "p.yaml"])
        for path in [store, *store.rglob("*")]:
            self.assertEqual(stat.S_IMODE(path.stat().st_mode), 0o700 if path.is_dir() else 0o600, path)

    def test_looking_makes_no_store(self):
        for command in (["cache", "info"], ["cache", "gc"], ["plan", self.pipeline]):
            self.assertEqual(self.marrow(*command).returncode, 0)
        self.assertFalse(self.cache.exists())

    def test_waiting_for_another_run_is_said_and_is_no_failure(self):
        self.assertEqual(self.run_pipeline().returncode, 0)
        self.assertIn("1 results removed", self.marrow("cache", "gc", "--keep-gb", "0").stdout)
        out, said = self.scratch / "waits", "c: waits for another run that is making the same result"
        with another_run_makes_all(self.cache):
            environment = dict(os.environ, MARROW_PLUGIN_PATH=str(TEST_PLUGINS), MARROW_CACHE=str(self.cache))
            process = subprocess.Popen(
                [str(MARROW), "run", str(self.pipeline), "--out", str(out)],
                env=environment,
                text=True,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
            )
            self.addCleanup(process.kill)
            log = out / "log.txt"
            wait_until(
                lambda: process.poll() is not None or log.exists() and said in log.read_text(),
                "it does not say that it waits",
            )
            self.assertIsNone(process.poll(), "it does not wait")
        self.assertEqual(process.wait(timeout=120), 0)
        lines = [" ".join(line.split()) for line in process.stderr.read().splitlines()]
        self.assertEqual(
            lines[:2],
            ["c waits for another run that is making the same result", "c goes on after waiting for another run"],
        )
        self.assertIn(said, (out / "log.txt").read_text())


if __name__ == "__main__":
    main()
