# SPDX-License-Identifier: Apache-2.0
"""The store of results as a person meets it: where it is, what it refuses to touch, and that waiting is no failure."""
import os
import re
import stat
import subprocess
import time

from harness import MARROW
from harness.program import Case, another_run_makes_all, main, wait_until

NUMBER = "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 3}}\noutputs: {number: c}\n"
WRONG_NUMBERS = ("abc", "inf", "nan", "-5", "0,5", "1e12", "")


class Cache(Case):
    def setUp(self):
        super().setUp()
        self.cache = self.scratch / "cache"
        self.write("p.yaml", NUMBER)
        self.runs = 0

    def run_pipeline(self, *arguments, **variables):
        """What is said of it."""
        self.runs += 1
        out = "out-%d" % self.runs
        return self.expect(0, "run", "p.yaml", "--out", out, *arguments, extra_environment=variables).stderr

    def kept(self):
        """How many results are kept."""
        return int(re.search(r"^all +(\d+)", self.printed("cache", "info"), re.M).group(1))

    def collected(self, *command):
        """`marrow cache gc` that another program starts."""
        environment = {**os.environ, "MARROW_CACHE": str(self.cache)}
        return subprocess.run(list(map(str, command)), capture_output=True, text=True, env=environment)

    def test_a_wrong_limit_is_said_and_removes_nothing(self):
        self.run_pipeline()
        for wrong in WRONG_NUMBERS:
            must = "is '%s', but must be a number of gigabytes" % wrong if wrong else ""
            said = "--keep-gb %s from 0 to 1000000; nothing is removed" % must if wrong else ""
            self.refused(said, "cache", "gc", "--keep-gb=" + wrong)
            self.assertEqual(self.kept(), 1, wrong)
            if wrong:
                (self.cache / "tidied").unlink(missing_ok=True)
                self.assertIn("MARROW_CACHE_GB " + must, self.run_pipeline(MARROW_CACHE_GB=wrong))
                self.assertEqual(self.kept(), 1, wrong)
        self.assertIn("0 results removed", self.printed("cache", "gc", "--keep-gb", "1e6"))
        self.assertIn("1 results removed", self.printed("cache", "gc", "--keep-gb", "0"))

    def refused_why(self, key, said):
        result = self.expect(2, "cache", "why", key)
        self.assertEqual((result.stdout, result.stderr), ("", said))

    def test_why_tells_of_one_key(self):
        for value in range(9):
            self.run_pipeline("--set", "c.value=%d" % value)
        text = self.expect(2, "cache", "why", "")
        self.assertEqual(text.stdout, "")
        said = "a word after 'why' is empty, and nothing has an empty name; a variable may have no value"
        self.assertIn(said, text.stderr)
        names = [path.name for path in self.cache.rglob("*") if path.parent.name == path.name[:2]]
        entries = sorted(name for name in names if len(name) == 32)
        keys = set(entries)
        for entry in entries:
            told = self.printed("cache", "why", entry)
            self.assertTrue(told.startswith(entry + ": test.constant"), told)
            keys.update(re.findall(r"^  output (\w+)$", told, re.M))
        self.assertEqual(len(keys), 18)  # so some share a digit
        digit = max("0123456789abcdef", key=lambda one: sum(key.startswith(one) for key in keys))
        several = sorted(key for key in keys if key.startswith(digit))
        self.refused_why(
            digit,
            "marrow: error: %d keys begin with '%s'; give more digits of one of them:\n" % (len(several), digit)
            + "".join("  %s\n" % key for key in several[:5])
            + ("  ...\n" if len(several) > 5 else ""),
        )
        damaged = next(self.cache.rglob(entries[0]))
        damaged.write_bytes(damaged.read_bytes()[:-1])
        self.refused_why(
            entries[0],
            "marrow: error: the result %s is damaged or of another version; the next run that needs it makes it again\n"
            % entries[0],
        )

    def test_what_is_mounted_in_the_store_is_left(self):
        self.run_pipeline()
        inner = self.cache / "cases" / ("0" * 32) / "outputs"
        inner.mkdir(parents=True)
        (inner.parent / "content.txt").write_text("made by marrow\n")
        self.write("precious/data", "mine")
        if subprocess.run(["unshare", "-m", "true"], capture_output=True).returncode != 0:
            self.skipTest("only root can mount")
        script = 'mount --bind "$1" "$2" && "$3" cache gc --keep-gb 0'
        result = self.collected("unshare", "-m", "sh", "-c", script, "sh", self.scratch / "precious", inner, MARROW)
        self.assertEqual(result.returncode, 2, result.stderr)
        said = "%s is left, because something is mounted there; unmount that first" % inner.parent
        self.assertIn(said, result.stderr)
        self.assertEqual(self.read("precious/data"), "mine")
        self.assertTrue(inner.is_dir())
        self.assertIn("1 results removed", result.stdout, "all else is")

    def test_what_is_left_because_its_age_is_unknown_is_said(self):
        self.run_pipeline()
        left = self.cache / "cases" / ("0" * 32 + ".tmp-alpha.0123456789abcdef.00000001.000000000001-0")
        left.parent.mkdir(exist_ok=True)
        left.mkdir()  # a process of another host left it
        two_days_ago = time.time() - 2 * 86400
        os.utime(left, (two_days_ago, two_days_ago))
        # ages are counted from the time of a new file, and no byte can be written, as on a full disk
        result = self.collected("sh", "-c", 'ulimit -f 0; exec "$1" cache gc --keep-gb 1', "sh", MARROW)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("%s is left, because its age is unknown: no file can be written beside it" % left, result.stderr)
        self.assertTrue(left.exists())
        self.assertEqual(self.expect(0, "cache", "gc", "--keep-gb", "1").stderr, "")
        self.assertFalse(left.exists())
        self.assertEqual(self.kept(), 1)

    def test_a_folder_of_other_things_is_left_alone(self):
        for name in ("photos.tmp-0/a.jpg", "0123456789abcdef0123456789abcdef/letter.txt", "note"):
            self.write("cache/" + name, "mine")
        before = sorted(self.cache.rglob("*"))
        sentence = (
            "the folder %s holds other things and is no store of marrow; set MARROW_CACHE to a new or empty folder"
            % self.cache
        )
        told = self.run_pipeline()
        self.assertEqual(told.count("results are not kept: " + sentence), 1, told)
        self.assertIn(sentence, self.read("out-1/log.txt"))
        for command in (["gc", "--keep-gb", "0"], ["info"], ["why", "0"]):
            self.refused(sentence, "cache", *command)
        self.assertIn(sentence, self.marrow("plan", "p.yaml").stderr)
        self.assertEqual(sorted(self.cache.rglob("*")), before)

    def test_empty_variables_count_as_not_set(self):
        self.run_pipeline(MARROW_CACHE="", XDG_CACHE_HOME="", HOME=str(self.scratch / "home"))
        store = self.scratch / "home" / ".cache" / "marrow" / "store"
        self.assertIn("marrow-store", os.listdir(store))
        self.assertEqual(sorted(os.listdir(self.scratch)), ["home", "out-1", "p.yaml"])
        for path in [store, *store.rglob("*")]:
            self.assertEqual(stat.S_IMODE(path.stat().st_mode), 0o700 if path.is_dir() else 0o600, path)

    def test_looking_makes_no_store(self):
        for command in (["cache", "info"], ["cache", "gc"], ["plan", "p.yaml"]):
            self.expect(0, *command)
        self.assertFalse(self.cache.exists())

    def test_waiting_for_another_run_is_said_and_is_no_failure(self):
        self.run_pipeline()
        self.assertIn("1 results removed", self.printed("cache", "gc", "--keep-gb", "0"))
        log, said = self.scratch / "waits" / "log.txt", "c: waits for another run that is making the same result"
        with another_run_makes_all(self.cache):
            process = self.start("run", "p.yaml", "--out", "waits", stdout=subprocess.DEVNULL)
            is_said = lambda: process.poll() is not None or log.exists() and said in log.read_text()
            wait_until(is_said, "it does not say that it waits")
            self.assertIsNone(process.poll(), "it does not wait")
        _, told = process.communicate(timeout=120)
        self.assertEqual(process.returncode, 0)
        self.assertEqual(
            [" ".join(line.split()) for line in told.splitlines()][:2],
            ["c waits for another run that is making the same result", "c goes on after waiting for another run"],
        )
        self.assertIn(said, log.read_text())


if __name__ == "__main__":
    main()
