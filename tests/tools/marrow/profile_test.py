# SPDX-License-Identifier: Apache-2.0
"""marrow run --profile: a bar for each call, on its thread, within what called it."""
import collections
import json
import os
import unittest

from harness.program import Case, main

SUM = """marrow: 1
nodes:
  before: {uses: test.constant, with: {value: 1}}
  item: {uses: test.constant, with: {value: 2}}
  sum: {uses: test.add, in: {a: before, b: item}}
outputs: {sum: sum}
"""
PIPELINE = """marrow: 1
inputs: {file: {type: path, default: ""}}
nodes:
  l: {uses: test.letters}
  r: {repeat: sum.yaml, over: letter, in: {item: l}, carry: {before: sum}}
outputs: {sums: r.sum}
"""
READS = """marrow: 1
nodes:
  camera: {uses: read.camera, with: {path: camera.yaml}}
outputs: {camera: camera}
"""


def rows_of(trace):
    """The bars of each row, by its name, in the order of their beginnings."""
    names = {event["tid"]: event["args"]["name"] for event in trace["traceEvents"] if event["name"] == "thread_name"}
    rows = collections.defaultdict(list)
    for event in trace["traceEvents"]:
        if event["ph"] == "X":
            rows[names[event["tid"]]].append(event)
    for bars in rows.values():
        bars.sort(key=lambda bar: (bar["ts"], -bar["dur"]))
    return rows


class ProfileTest(Case):
    def setUp(self):
        super().setUp()
        self.write("sum.yaml", SUM)
        self.write("p.yaml", PIPELINE)

    def profile(self, out, *arguments):
        ran = self.marrow("run", "p.yaml", "--out", out, "--profile", out + ".json", *arguments)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        return json.loads((self.scratch / (out + ".json")).read_text())

    def check_nesting(self, trace):
        """No bar leaves the one in which it begins; the own times of a row's bars are those of its sums."""
        own = collections.Counter()
        for bars in rows_of(trace).values():
            around = []
            for bar in bars:
                while around and around[-1]["ts"] + around[-1]["dur"] <= bar["ts"] + 1e-6:
                    around.pop()
                if around:
                    self.assertLessEqual(bar["ts"] + bar["dur"], around[-1]["ts"] + around[-1]["dur"] + 1e-3)
                    own[around[-1]["cat"], around[-1]["args"]["node"]] -= bar["dur"]
                own[bar["cat"], bar["args"]["node"]] += bar["dur"]
                around.append(bar)
        for one in trace["marrow"]["sums"]:
            if one["kind"] != "pass":
                self.assertAlmostEqual(one["own_us"], own[one["kind"], one["node"]], delta=0.1, msg=one)

    def test_a_bar_for_each_call_and_each_pass(self):
        trace = self.profile("a")
        self.check_nesting(trace)
        rows = rows_of(trace)
        self.assertEqual(
            [bar["name"] for bar in rows["passes of r"]], ["r", "r (x)", "r (y)", "r (z)"], "the whole, and each pass"
        )
        calls = [bar for bars in rows.values() for bar in bars if bar["cat"] == "node"]
        self.assertEqual(
            sorted(bar["name"] for bar in calls if bar["args"]["node"] == "r/sum"),
            ["r/sum (x)", "r/sum (y)", "r/sum (z)"],
        )
        self.assertIn("writes the outputs", [bar["name"] for bar in rows["main thread"]])
        for bar in calls:
            self.assertGreaterEqual(bar["tdur"], 0)
            self.assertLess(bar["ts"] + bar["dur"], trace["marrow"]["us"] + 1)

    def test_kept_results_are_marked(self):
        self.profile("a")
        trace = self.profile("b")
        kinds = {event["name"]: event["cat"] for event in trace["traceEvents"] if event["ph"] == "X"}
        self.assertEqual(kinds["r/sum (y)"], "cached")
        self.assertEqual(
            [event for event in trace["traceEvents"] if event.get("cat") == "node"], [], "nothing was called"
        )

    def test_the_results_are_the_same(self):
        self.profile("a", "--no-cache")
        self.assertEqual(self.marrow("run", "p.yaml", "--out", "b", "--no-cache", "-q").returncode, 0)
        self.assertEqual(self.marrow("diff", "a", "b").returncode, 0)
        self.assertFalse((self.scratch / "b" / "profile.json").exists())

    def test_the_page_draws_it(self):
        self.profile("a")
        self.assertEqual(self.marrow("show", "a").returncode, 0)
        profile = self.page_data("a/report.html")["profile"]
        self.assertIn("passes of r", profile["rows"])
        self.assertIn({"title": "r (y)", "kind": "pass", "node": "r"}, profile["names"])
        self.assertEqual(profile["left_out"], 0)

    def test_a_damaged_profile_is_not_drawn(self):
        self.profile("a")
        for text in ("{", "[]", '{"traceEvents": [{"ph": "X"}]}'):
            (self.scratch / "a" / "profile.json").write_text(text)
            ran = self.marrow("show", "a")
            self.assertEqual(ran.returncode, 0)
            self.assertIn(
                "marrow: warning: a/profile.json is not shown: it is not what 'marrow run --profile' wrote", ran.stderr
            )
            self.assertNotIn("profile", self.page_data("a/report.html"))

    def refused(self, pipeline, file, *arguments):
        ran = self.marrow("run", pipeline, "--out", "out", "--profile", file, *arguments)
        self.assertEqual(ran.returncode, 2, ran.stderr)
        self.assertFalse((self.scratch / "out").exists(), "nothing runs")
        return ran.stderr.replace(str(self.scratch), "HERE")

    def test_a_place_where_it_cannot_be_written(self):
        (self.scratch / "folder").mkdir()
        self.assertIn(
            "error: cannot write the profile folder: this is a folder; name a file in it, such as folder/profile.json",
            self.refused("p.yaml", "folder"),
        )
        self.assertIn(
            "error: cannot write the profile no/p.json: there is no folder no; make it, or name another file",
            self.refused("p.yaml", "no/p.json"),
        )
        self.assertIn(
            "error: cannot write the profile sum.yaml/p.json: sum.yaml is no folder; name another file",
            self.refused("p.yaml", "sum.yaml/p.json"),
        )
        self.write("camera.yaml", "marrow-camera: 1\n")
        self.write("reads.yaml", READS)
        self.assertIn(
            "error: cannot write the profile camera.yaml: node 'camera' reads this file; name another",
            self.refused("reads.yaml", "camera.yaml"),
        )
        self.assertIn("--profile excludes --dry-run", self.refused("p.yaml", "p.json", "-n"))

    @unittest.skipIf(os.geteuid() == 0, "root may write everywhere")
    def test_a_folder_that_is_read_only(self):
        (self.scratch / "folder").mkdir(mode=0o500)
        self.assertIn(
            "error: cannot write the profile folder/p.json: nothing can be written to folder (Permission denied); "
            "name another file",
            self.refused("p.yaml", "folder/p.json"),
        )

    def test_a_full_disk_costs_only_the_profile(self):
        ran = self.marrow("run", "p.yaml", "--out", "a", "--profile", "/dev/full")
        self.assertEqual(ran.returncode, 1)
        self.assertIn("marrow: error: the profile: cannot write /dev/full: the disk is full", ran.stderr)
        self.assertTrue((self.scratch / "a" / "run.json").exists())


if __name__ == "__main__":
    main()
