# SPDX-License-Identifier: Apache-2.0
"""The store of results as a person meets it: where it is, what it refuses to touch, and that waiting is no failure."""
import json
import os
import re
import signal
import stat
import subprocess
import time

from harness import MARROW
from harness.program import Case, another_run_makes_all, main, wait_until

NUMBER = "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 3}}\noutputs: {number: c}\n"
WRONG_NUMBERS = ("abc", "-5", "")  # more of them: store_folder_test.cpp


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


# The store that hosts share as a person meets it: results come from it, its faults are notes, and it is tidied up only
# when somebody asks for it.
SLOW = """marrow: 1
nodes:
  work: {uses: test.work, with: {value: 1.1}}
  c: {uses: test.constant, with: {value: 3}}
  sum: {uses: test.add, in: {a: work, b: c}}
outputs: {number: sum}
"""
QUICK = "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 3}}\noutputs: {number: c}\n"


class SharedCache(Case):
    has_own_store = False  # but one for each host

    def setUp(self):
        super().setUp()
        self.shared = self.scratch / "shared"
        self.shared.mkdir(mode=0o700)
        self.write("p.yaml", SLOW)
        self.runs = 0

    def marrow(self, *arguments, host="one", shared=None, **environment):
        environment = {"MARROW_CACHE": str(self.scratch / host), **environment}
        if shared is not False:
            environment["MARROW_SHARED_CACHE"] = str(shared or self.shared)
        return super().marrow(*arguments, extra_environment=environment)

    def run_on(self, host, *more, **environment):
        """What the nodes of a run on a host did: how many calls were made, and how many results were read back."""
        self.runs += 1
        out = "out-%d" % self.runs
        self.stderr = self.expect(0, "run", "p.yaml", "--out", out, *more, host=host, **environment).stderr
        self.number = self.read(out + "/outputs/number.json")
        return {name: (node["calls"], node["cached"]) for name, node in self.nodes(out).items()}

    def results(self, **which):
        """How many results each of the stores holds."""
        info = self.printed("cache", "info", **which)
        return [int(count) for count in re.findall(r"^all +(\d+)", info, re.M)]

    def test_what_one_host_has_made_the_other_reads(self):
        made = self.run_on("one")
        number = self.number
        self.assertEqual(made["work"], (1, 0))
        read = self.run_on("two")
        self.assertEqual((read["work"], read["c"]), ((0, 1), (1, 0)), "one second is the least that is shared")
        self.assertEqual(self.number, number)
        self.assertEqual(self.results(host="two"), [3, 1])
        self.assertEqual(self.results(host="two", shared=False), [3])
        key = next(path.name for path in self.shared.glob("??/*"))
        self.assertIn("test.work", self.printed("cache", "why", key, host="two"))
        why = self.marrow("cache", "why", "0" * 32, host="two")
        self.assertIn("or the shared one %s, holds no result with a key" % self.shared, why.stderr)

    def test_the_option_names_the_folder(self):
        self.run_on("one", "--shared-cache", self.shared, shared=False)
        self.assertEqual(self.results(), [3, 1])
        plan = self.expect(0, "plan", "p.yaml", "--shared-cache", self.shared, host="two", shared=False)
        self.assertRegex(plan.stdout, r"work +test.work +cached")
        self.assertEqual(plan.stderr, "")

    def test_faults_are_notes(self):
        self.write("letters/letter.txt", "")
        self.write("p.yaml", QUICK)
        letters = self.scratch / "letters"
        said = "the folder %s holds other things and is no shared store of marrow" % letters
        self.run_on("one", shared=letters)
        self.assertEqual(self.stderr.count(said), 1, self.stderr)
        self.assertIn("the shared store is not used", self.stderr)
        plan = self.expect(0, "plan", "p.yaml", shared=letters).stderr
        self.assertEqual(plan.count("marrow: note: the shared store is not used: " + said), 1, plan)
        self.refused(said, "cache", "info", shared=letters)

    def test_a_pipeline_does_not_read_the_folder(self):
        self.write("q.yaml", QUICK.replace("value: 3", "value: 3, path: %s" % self.scratch))
        run = ["run", "q.yaml", "--out", "/tmp/marrow-no-such-run"]
        said = self.expect(2, *run, MARROW_CACHE="/tmp/marrow-none").stderr
        self.assertRegex(said, "the shared store of results .* lies in .*set MARROW_SHARED_CACHE to another folder")

    def test_only_people_tidy_it_up(self):
        self.run_on("one")
        self.run_on("two", MARROW_CACHE_GB="0")
        self.assertEqual(self.results(host="two"), [0, 1], "a run tidies up its own host's store only")
        self.assertIn("3 results removed", self.printed("cache", "gc", "--keep-gb", 0))
        self.assertEqual(self.results(), [0, 1])
        self.assertIn("1 results removed", self.printed("cache", "gc", "--shared", "--keep-gb", 0))
        self.assertEqual(self.results(), [0, 0])
        said = "there is no shared store: MARROW_SHARED_CACHE is not set; nothing is removed"
        self.refused(said, "cache", "gc", "--shared", shared=False)


# What comes from workers: names cannot pass for answers, and waiting for another run is no failure.
FORGED = json.dumps(
    {
        **{"id": "../../../forged", "variant": "one", "case": "seed-1", "start": "0", "status": "done", "tries": 1},
        **{"values": [0.001], "units": [""], "initial_error": None, "seconds": None, "evaluations": 0, "nodes": {}},
        **{"key": "k"},
    }
)
NAMES = """marrow: 1
nodes:
  s: {uses: test.sides, with: {names: [%s, b]}}
  a: {uses: test.add, in: {a: s.both, b: s.both}}
  total: {uses: test.sum, in: {items: a}}
outputs: {number: total}
"""
WORK = """marrow: 1
nodes:
  w: {uses: test.work, with: {value: 15, path: data}}
  n: {uses: test.add, in: {a: w}}
outputs: {number: n}
"""
CRASH = """marrow: 1
nodes:
  w: {uses: test.work, with: {value: 3, path: p.yaml}}
  m: {uses: test.misbehave, with: {how: crash}, in: {a: w}}
outputs: {number: m}
"""
EXPERIMENT = (
    "experiment: 1\npipeline: p.yaml\ncases: {seeds: 1..2}\nmetrics: [number.value]\nvariants: {one: {}, two: {}}\n"
)


class Workers(Case):
    files = {"e.yaml": EXPERIMENT}

    def test_a_crash_is_known_to_who_was_started_with_ends_of_children_ignored(self):
        self.write("p.yaml", CRASH)
        ignored = lambda: signal.signal(signal.SIGCHLD, signal.SIG_IGN)
        self.start("compare", "e.yaml", "--out", "out", preexec_fn=ignored).communicate()
        reasons = {row["reason"] for row in self.rows().values()}
        self.assertEqual(reasons, {"crashed in node 'm': Segmentation fault"})

    def test_names_cannot_pass_for_answers(self):
        name = json.dumps('x\nend %s\n{"job": 1, "end": %s}\nx' % (FORGED, FORGED))
        self.write("p.yaml", NAMES % name)
        self.expect(0, "compare", "e.yaml", "--out", "out")
        # 10 + 10 and 20 + 20
        found = {cell: (row["status"], row.get("number.value")) for cell, row in self.rows().items()}
        cells = ("one/seed-1/0", "one/seed-2/0", "two/seed-1/0", "two/seed-2/0")
        self.assertEqual(found, {cell: ("done", "60") for cell in cells})
        self.assertEqual([name for name in self.everything() if "forged" in name], [])

    def test_waiting_for_another_run_is_no_failure(self):
        self.write("p.yaml", WORK)
        self.write("data", "x")
        with open(self.scratch / "events", "w") as events:
            other = self.start("run", "p.yaml", "--out", "other", "--json", stdout=events)
        wait_until(lambda: '"started"' in self.read("events"), "the other run did not begin")
        other.send_signal(signal.SIGSTOP)
        with open(self.scratch / "said", "w") as errors:
            limits = ["--time-limit", "5", "--jobs", "1"]
            comparison = self.start("compare", "e.yaml", "--out", "out", *limits, stderr=errors)
        waits = "waits for another run that is making the same result"
        is_there = lambda: comparison.poll() is not None or waits in self.read("said")
        wait_until(is_there, "it does not say that it waits")
        time.sleep(6)  # longer than a cell may take, and shorter than the other run works
        self.assertIsNone(comparison.poll(), "it did not wait")
        other.send_signal(signal.SIGCONT)
        text = comparison.communicate(timeout=120)[0]
        other.wait(timeout=120)
        self.assertEqual(comparison.returncode, 0, self.read("said"))
        self.assertEqual([row["status"] for row in self.rows().values()], ["done"] * 4, text)


if __name__ == "__main__":
    main()
