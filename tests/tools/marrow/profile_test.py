# SPDX-License-Identifier: Apache-2.0
"""marrow run --profile: a bar for each call, on its thread, within what called it."""
import collections
import os

from harness.program import SharedCase, main

SUM = """marrow: 1
nodes:
  before: {uses: test.constant, with: {value: 1}}
  item: {uses: test.constant, with: {value: 2}}
  sum: {uses: test.add, in: {a: before, b: item}}
outputs: {sum: sum}
"""
PIPELINE = """marrow: 1
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


class ProfileTest(SharedCase):
    def make(self):
        self.write("sum.yaml", SUM)
        self.write("p.yaml", PIPELINE)

        self.write("camera.yaml", "marrow-camera: 1\n")
        self.write("reads.yaml", READS)
        (self.scratch / "folder").mkdir(mode=0o500)
        self.trace = self.profile("a")

    def profile(self, out, *arguments):
        self.expect(0, "run", "p.yaml", "--out", out, "--profile", out + ".json", *arguments)
        return self.json(out + ".json")

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
        self.check_nesting(self.trace)
        rows = rows_of(self.trace)
        passes = [bar["name"] for bar in rows["passes of r"]]
        self.assertEqual(passes, ["r", "r (x)", "r (y)", "r (z)"], "the whole, and each pass")
        calls = [bar for bars in rows.values() for bar in bars if bar["cat"] == "node"]
        sums = sorted(bar["name"] for bar in calls if bar["args"]["node"] == "r/sum")
        self.assertEqual(sums, ["r/sum (x)", "r/sum (y)", "r/sum (z)"])
        self.assertIn("writes the outputs", [bar["name"] for bar in rows["main thread"]])
        for bar in calls:
            self.assertGreaterEqual(bar["tdur"], 0)
            self.assertLess(bar["ts"] + bar["dur"], self.trace["marrow"]["us"] + 1)

    def test_kept_results_are_marked(self):
        trace = self.profile("b")
        kinds = {event["name"]: event["cat"] for event in trace["traceEvents"] if event["ph"] == "X"}
        self.assertEqual(kinds["r/sum (y)"], "cached")
        called = [event for event in trace["traceEvents"] if event.get("cat") == "node"]
        self.assertEqual(called, [], "nothing was called")

    def test_the_results_are_the_same(self):
        self.expect(0, "run", "p.yaml", "--out", "c", "--no-cache", "-q")
        self.expect(0, "diff", "a", "c")
        self.assertFalse((self.scratch / "c" / "profile.json").exists())

    def test_the_page_draws_it_unless_it_is_damaged(self):
        self.expect(0, "show", "a")
        profile = self.page_data("a/report.html")["profile"]
        self.assertIn("passes of r", profile["rows"])
        self.assertIn({"title": "r (y)", "kind": "pass", "node": "r"}, profile["names"])
        self.assertEqual(profile["left_out"], 0)
        for text in ("{", "[]", '{"traceEvents": [{"ph": "X"}]}'):
            self.write("a/profile.json", text)
            said = self.expect(0, "show", "a").stderr
            not_shown = "a/profile.json is not shown: it is not what 'marrow run --profile' wrote"
            self.assertIn("marrow: warning: " + not_shown, said)
            self.assertNotIn("profile", self.page_data("a/report.html"))

    def test_a_place_where_it_cannot_be_written(self):
        cannot = "error: cannot write the profile "
        run = lambda pipeline, file, *more: ["run", pipeline, "--out", "out", "--profile", file, *more]
        self.refusals(
            (
                cannot + "folder: this is a folder; name a file in it, such as folder/profile.json",
                *run("p.yaml", "folder"),
            ),
            (cannot + "no/p.json: there is no folder no; make it, or name another file", *run("p.yaml", "no/p.json")),
            (cannot + "sum.yaml/p.json: sum.yaml is no folder; name another file", *run("p.yaml", "sum.yaml/p.json")),
            (cannot + "camera.yaml: node 'camera' reads this file; name another", *run("reads.yaml", "camera.yaml")),
            ("--profile excludes --dry-run", *run("p.yaml", "p.json", "-n")),
        )
        if os.geteuid() != 0:  # root may write everywhere
            said = "folder/p.json: nothing can be written to folder (Permission denied); name another file"
            self.refused(cannot + said, *run("p.yaml", "folder/p.json"))
        self.assertFalse((self.scratch / "out").exists(), "nothing runs")

    def test_a_full_disk_costs_only_the_profile(self):
        ran = self.expect(1, "run", "p.yaml", "--out", "d", "--profile", "/dev/full")
        self.assertIn("marrow: error: the profile: cannot write /dev/full: the disk is full", ran.stderr)
        self.assertTrue((self.scratch / "d" / "run.json").exists())


if __name__ == "__main__":
    main()
