#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The page "Results": runs and comparisons in a list, their reports, and two runs compared."""
import contextlib
import json
import pathlib
import shutil
import tempfile
import urllib.parse

from bench import PIPELINE, BenchTest, PageTest
from harness.page import main
from harness.program import marrow


class ResultsBench(BenchTest):
    """Two runs of one pipeline, made once and copied for each test."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.made = pathlib.Path(tempfile.mkdtemp(prefix="marrow-results-"))
        cls.addClassCleanup(shutil.rmtree, cls.made)
        (cls.made / "small.yaml").write_text(PIPELINE)
        for name, high in (("first", 5), ("second", 9)):
            words = ["--set", "edges.noise_high=%d" % high, "--out", "runs/" + name, "--quiet", "--no-cache"]
            assert marrow("run", "small.yaml", "level=0.4", *words, cwd=cls.made).returncode == 0

    def setUp(self):
        super().setUp()
        shutil.copytree(self.made, self.folder, dirs_exist_ok=True)
        self.first = self.folder / "runs" / "first"

    def judge(self, name, judgement, reason="why", probability=None, item=""):
        verdict = {"output": "verdict", "item": item, "judgement": judgement, "failure_probability": probability}
        self.record(name, lambda record: record.update(verdicts=[verdict | {"reasons": [reason], "remedies": []}]))

    def measure(self, name, *figures):
        """Adds figures, (name, unit, value), to a run."""
        metrics = [dict(zip(("name", "unit", "value"), figure)) for figure in figures]
        (self.folder / "runs" / name / "outputs" / "errors.json").write_text(json.dumps({"metrics": metrics}))
        output = {"name": "errors", "files": ["outputs/errors.json"]}
        self.record(name, lambda record: record["outputs"].append(output))

    def record(self, name, change):
        file = self.folder / "runs" / name / "run.json"
        record = json.loads(file.read_text())
        change(record)
        file.write_text(json.dumps(record))


class RequestTest(ResultsBench):
    def setUp(self):
        super().setUp()
        self.enter()

    def address(self, path, **parameters):
        return path + "?" + urllib.parse.urlencode(parameters)

    def test_the_list_has_all_runs_and_comparisons_the_newest_first(self):
        (self.folder / "compared").mkdir()
        compared = {"experiment": "edges", "comparisons": [{"sentence": "canny, mTRE: 0.12 mm worse"}]}
        (self.folder / "compared" / "comparison.json").write_text(json.dumps(compared))
        (self.folder / "runs" / "broken").mkdir()
        (self.folder / "runs" / "broken" / "run.json").write_text("{")
        self.measure("first", ("mtre", "mm", 1.5))
        self.judge("first", "doubtful")
        rows = self.server.get("/api/results")["results"]
        self.assertEqual([row["when"] for row in rows], sorted((row["when"] for row in rows), reverse=True))
        known = {row["folder"]: row for row in rows}
        self.assertEqual(sorted(known), ["compared", "runs/broken", "runs/first", "runs/second"])
        self.assertEqual(known["compared"]["kind"], "comparison")
        self.assertEqual(known["compared"]["sentences"], ["canny, mTRE: 0.12 mm worse"])
        first = known["runs/first"]
        self.assertEqual((first["name"], first["status"], first["has_report"]), ("small", "done", False))
        self.assertEqual(first["verdicts"][0]["judgement"], "doubtful")
        self.assertEqual(first["figures"][0]["rows"], [{"name": "mtre", "unit": "mm", "values": [1.5]}])
        self.assertIn("run it again", known["runs/broken"]["fault"])
        self.assertEqual((first["case"], first["changes"]), ("", None), "the first run has none before it")
        changes = [{"what": "edges.noise_high", "before": "5", "now": "9"}]
        self.assertEqual(known["runs/second"]["changes"], changes, "options only")

    def test_what_differs_is_what_marrow_diff_says(self):
        answer = self.server.get("/api/results/diff?first=runs/first&second=runs/second")
        said = marrow("diff", self.first, self.folder / "runs/second", "--json").stdout
        self.assertEqual(answer["findings"], json.loads(said))
        self.assertEqual(answer["findings"]["first"]["node"], "edges")
        self.assertEqual(answer["command"], "cd %s && marrow diff runs/first runs/second" % self.folder)
        self.assertIn("outputs/edges/frontal.png", answer["pictures"])
        self.assertIn("has no run.json", self.server.fault("/api/results/diff?first=runs/first&second=runs"))

    def test_a_report_is_made_and_reaches_nothing(self):
        answer = self.server.post("/api/results/report", folder="runs/first")
        self.assertEqual(answer["command"], "cd %s && marrow show runs/first" % self.folder)
        status, headers, page = self.server.ask("GET", "/results/report.html?folder=runs/first")
        self.assertEqual((status, headers["Content-Type"]), (200, "text/html; charset=utf-8"))
        policies = headers.get_all("Content-Security-Policy")
        self.assertEqual(len(policies), 1, "another one would forbid the report's own script")
        self.assertTrue(policies[0].startswith("sandbox allow-scripts; default-src 'none'; "))
        self.assertNotIn("allow-same-origin", policies[0])
        self.assertNotIn("connect-src", policies[0])
        self.assertEqual(page, (self.first / "report.html").read_bytes())
        _, headers, _ = self.server.ask("GET", "/results/report.html?folder=runs/first&download=1")
        self.assertEqual(headers["Content-Disposition"], 'attachment; filename="first.html"')
        (self.folder / "comparison.json").write_text("{}")
        told = "this comparison has no report.html; continue it by: marrow compare"
        self.assertEqual(self.server.fault("/api/results/report", {"folder": ""}), told)

    def test_only_pictures_and_parts_of_results_are_given(self):
        picture = {"folder": "runs/first", "name": "outputs/edges/frontal.png"}
        status, headers, content = self.server.ask("GET", self.address("/results/picture.png", **picture))
        self.assertEqual((status, headers["Content-Type"]), (200, "image/png"))
        self.assertEqual(content, (self.first / "outputs/edges/frontal.png").read_bytes())
        for name in ("run.json", "../../small.yaml", "/x.png"):
            fault = self.server.fault(self.address("/results/picture.png", folder="runs/first", name=name))
            self.assertEqual(fault, "the run has no picture '%s'" % name)
        (self.scratch / "secret").write_text("secret")
        (self.first / "link.png").symlink_to(self.scratch / "secret")
        self.server.fault(self.address("/results/picture.png", folder="runs/first", name="link.png"))
        for path in ("/results/report.html", "/api/results/diff"):
            fault = self.server.fault(self.address(path, folder="..", first="..", second=".."))
            self.assertIn("leads out of the folder that is open", fault)
        (self.first / "report.html").symlink_to(self.scratch / "secret")
        fault = self.server.fault("/results/report.html?folder=runs/first")
        self.assertIn("is a link to a file outside of the folder", fault)
        part = "0123456789abcdef.js"
        folder = self.folder / "compared" / "report"
        folder.mkdir(parents=True)
        (folder / part).write_text('Parts.take("%s",\n{}\n);\n' % part)
        given = lambda file: self.address("/results/part.txt", folder="compared", file=file)
        status, headers, content = self.server.ask("GET", given(part))
        self.assertEqual((status, headers["Content-Type"]), (200, "text/plain; charset=utf-8"))
        self.assertEqual(content, (folder / part).read_bytes())
        (folder / "notes.js").write_text("mine")
        (folder / "fedcba9876543210.js").symlink_to(self.scratch / "secret")
        for other in ("notes.js", "../comparison.json", "fedcba9876543210.js", "0123456789abcdee.js"):
            self.assertEqual(self.server.fault(given(other)), "the report has no part '%s'" % other)


class ResultsPageTest(ResultsBench, PageTest):
    def show_results(self, more=""):
        self.show("results=" + more)

    def rows(self):
        return self.all("[data-result]", "one.dataset.result")

    @contextlib.contextmanager
    def report(self):
        """What is asked meanwhile is about the report in its frame."""
        self.driver.switch_to.frame(self.driver.find_element("css selector", "iframe.report"))
        try:
            yield
        finally:
            self.driver.switch_to.default_content()

    def test_two_runs_are_chosen_by_key_and_compared(self):
        self.show_results()
        self.assertEqual(sorted(self.rows()), ["runs/first", "runs/second"])
        self.assertTrue(self.the("[data-do=compare]", "one.disabled"))
        for name in ("first", "second"):
            self.browser.key("SPACE", "[data-result='runs/%s'] input" % name)
        self.browser.key("c", "[data-result='runs/second'] input")
        self.find(".says")
        self.assertEqual(self.text(".says"), "They begin to differ at the node edges (edges.canny).")
        cells = self.texts('[data-change="edges.noise_high"] > *')
        self.assertEqual(cells, ["edges", "option noise_high", "5", "9", "the first difference"])
        self.eventually(lambda: self.all(".wipe img", "one.naturalWidth"), 4 * [96])  # of both views in both runs
        self.browser.key("HOME", ".wiped input")
        self.assertEqual(self.the(".wipe", "one.style.getPropertyValue('--at')"), "0%")
        self.assertIn("marrow diff runs/first runs/second", self.text("body"))
        self.no_faults()

    def test_the_list_is_sorted_and_filtered(self):
        for name, judgement, mtre in (("first", "wrong", 12.5), ("second", "trusted", 0.25)):
            self.measure(name, ("mtre_mm", "mm", mtre))
            self.judge(name, judgement, probability=0.5)
        self.show_results()
        self.assertEqual(self.rows(), ["runs/second", "runs/first"], "the newest first")
        words = self.the("[data-result='runs/second']", "one.closest('tr').innerText")
        for part in ("edges.noise_high 5 \u2192 9", "trusted", "mTRE 0.250\u00a0mm"):
            self.assertIn(part, words)
        sort = lambda name: self.all(".sort", "one.textContent === '%s' && one.click()" % name)
        sort("Verdict")
        sort("Verdict")
        self.assertEqual(self.rows(), ["runs/first", "runs/second"], "the worst first")
        sort("Key figures")
        self.assertEqual(self.rows(), ["runs/second", "runs/first"], "the smallest error first")
        self.find("[data-do=filter]").send_keys("wrong")
        self.assertEqual(self.rows(), ["runs/first"])
        self.assertEqual(self.text("[data-do=count]"), "1 of 2")
        self.find("[data-do=filter]").send_keys("!")
        self.assertIn("No result passes the filter.", self.text(".results"))

    def test_verdicts_come_first_and_figures_are_put_side_by_side(self):
        for name, mtre in (("first", 1.5), ("second", 0.25)):
            self.judge(name, "doubtful", name + " reason", 0.25, "distal")
            self.measure(name, ("mtre", "mm", mtre), ("size", "px", 3))
        self.show_results("runs/first&with=runs/second")
        cards = self.all(".card", "one.innerText")
        self.assertEqual(len(cards), 2)
        for card, name in zip(cards, ("first", "second")):
            for part in ("runs/" + name, name + " reason"):
                self.assertIn(part, card)
            self.assertIn("DOUBTFUL", card.upper())
        cells = self.texts("[data-figure=mtre] td")
        self.assertEqual(cells, ["1.50\u00a0mm", "0.250\u00a0mm", "\u22121.25\u00a0mm better"])
        same = lambda: self.text("[data-do=same-figures] summary")
        self.assertEqual(same(), "The same in both: 1")
        self.set("section[aria-label=Figures] select", 0.1)
        self.assertEqual(same(), "The same in both: 1", "1.25 mm is more than 0.1 mm")

    def test_how_far_poses_are_apart(self):
        (self.folder / "pose.yaml").write_text(
            "marrow: 1\nnodes:\n  bone: {uses: simulate.femur}\n"
            "  fracture: {uses: simulate.fracture, in: {bone: bone}}\n"
            "  truth: {uses: simulate.truth, in: {phantom: fracture}}\noutputs: {pose: truth.starts}\n"
        )
        for name, turned in (("straight", []), ("turned", ["[0, 0, 2]"]), ("hardly", ["[0, 0, 0.0002]"])):
            options = [word for value in turned for word in ("--set", "fracture.rotation_deg=" + value)]
            self.marrow("run", "pose.yaml", "--out", "runs/" + name, "--quiet", *options)
        self.show_results("runs/straight&with=runs/turned")
        line = self.text(".pose-difference")
        self.assertIn("The poses of distal are 2.00° and ", line)
        self.assertTrue(line.endswith("mm apart."), line)
        self.show_results("runs/straight&with=runs/hardly")
        same = "The poses of distal are the same, to less than 0.001° and 0.001 mm."
        self.assertEqual(self.text(".pose-difference"), same)

    def test_a_report_is_shown_in_the_page_and_its_script_runs(self):
        self.show_results()
        self.js(
            "new MutationObserver(() => { const says = document.querySelector('.report-box');"
            "if (says) window.said = (window.said || '') + says.textContent; })"
            ".observe(document.getElementById('page'), {childList: true, subtree: true})"
        )
        self.the("[data-result='runs/first'] a", "one.click()")
        self.find("iframe.report:not([aria-busy])")
        self.assertIn("Loading the report", self.js("return window.said"))
        self.assertEqual(self.text(".report-box"), "")
        with self.report():
            self.wait("document.documentElement.dataset.ready === 'true'")
            self.assertEqual(self.js("return self.origin"), "null")
            self.assertEqual(self.js("return document.title"), "small · marrow")
        self.click("#theme")
        with self.report():
            self.wait("document.documentElement.dataset.theme === 'dark'")
        self.assertIn("marrow show runs/first", self.text("body"))
        self.assertIn("download=1", self.the("[data-do=download]", "one.href"))
        (self.first / "report.html").write_text(
            "<p id=said>waits</p><script>"
            "fetch('/api/folder').then(() => 'reached', () => 'refused')"
            ".then((word) => document.getElementById('said').textContent = word)</script>"
        )
        self.show_results("runs/first")
        with self.report():
            self.wait("document.getElementById('said').textContent !== 'waits'")
            self.assertEqual(self.text("#said"), "refused", "a hostile report reaches nothing")


if __name__ == "__main__":
    main(part=5)
