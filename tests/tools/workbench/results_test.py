#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The page "Results": runs and comparisons in a list, their reports, and two runs compared."""
import json
import shutil
import subprocess
import unittest
import urllib.parse

import bench
from bench import MARROW, BenchTest, PageTest
from pipeline_test import PIPELINE


class ResultsBench(BenchTest):
    """Two runs of one pipeline, made once and copied for each test."""

    made = None

    @classmethod
    def make(cls):
        if cls.made is None:
            ResultsBench.made = bench.pathlib.Path(bench.tempfile.mkdtemp(prefix="marrow-results-"))
            unittest.addModuleCleanup(shutil.rmtree, ResultsBench.made)
            (cls.made / "small.yaml").write_text(PIPELINE)
            for name, high in (("first", 5), ("second", 9)):
                subprocess.run(
                    [MARROW, "run", "small.yaml", "level=0.4", "--set", "edges.noise_high=%d" % high]
                    + ["--out", "runs/" + name, "--quiet", "--no-cache"],
                    cwd=cls.made,
                    check=True,
                )

    def setUp(self):
        super().setUp()
        self.make()
        shutil.copytree(self.made, self.folder, dirs_exist_ok=True)

    def address(self, path, **parameters):
        return path + "?" + urllib.parse.urlencode(parameters)


class RequestTest(ResultsBench):
    def setUp(self):
        super().setUp()
        self.server = self.open()
        self.server.enter()

    def error(self, answer):
        self.assertEqual(answer[0], 400, answer[2])
        return json.loads(answer[2])["error"]

    def test_the_list_has_all_runs_and_comparisons_the_newest_first(self):
        (self.folder / "compared").mkdir()
        (self.folder / "compared" / "comparison.json").write_text(
            json.dumps({"experiment": "edges", "comparisons": [{"sentence": "canny, mTRE: 0.12 mm worse"}]})
        )
        (self.folder / "runs" / "broken").mkdir()
        (self.folder / "runs" / "broken" / "run.json").write_text("{")
        metrics = self.folder / "runs" / "first" / "outputs" / "errors.json"
        metrics.write_text(json.dumps({"metrics": [{"name": "mtre", "unit": "mm", "value": 1.5}]}))
        record = json.loads((self.folder / "runs" / "first" / "run.json").read_text())
        record["outputs"].append({"name": "errors", "files": ["outputs/errors.json"]})
        record["verdicts"] = [
            {"output": "verdict", "item": "", "judgement": "doubtful", "failure_probability": None, "reasons": ["why"]}
            | {"remedies": []}
        ]
        (self.folder / "runs" / "first" / "run.json").write_text(json.dumps(record))
        rows = self.server.json("GET", "/api/results")["results"]
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
        self.assertEqual(
            known["runs/second"]["changes"], [{"what": "edges.noise_high", "before": "5", "now": "9"}], "options only"
        )

    def test_what_differs_is_what_marrow_diff_says(self):
        answer = self.server.json("GET", "/api/results/diff?first=runs/first&second=runs/second")
        said = subprocess.run(
            [MARROW, "diff", self.folder / "runs/first", self.folder / "runs/second", "--json"],
            capture_output=True,
            text=True,
        )
        self.assertEqual(answer["findings"], json.loads(said.stdout))
        self.assertEqual(answer["findings"]["first"]["node"], "edges")
        self.assertEqual(answer["command"], "cd %s && marrow diff runs/first runs/second" % self.folder)
        self.assertIn("outputs/edges/frontal.png", answer["pictures"])
        self.assertIn(
            "has no run.json", self.error(self.server.ask("GET", "/api/results/diff?first=runs/first&second=runs"))
        )

    def test_a_report_is_made_and_reaches_nothing(self):
        answer = self.server.json("POST", "/api/results/report", {"folder": "runs/first"})
        self.assertEqual(answer["command"], "cd %s && marrow show runs/first" % self.folder)
        self.assertTrue((self.folder / "runs" / "first" / "report.html").exists())
        status, headers, page = self.server.ask("GET", "/results/report.html?folder=runs/first")
        self.assertEqual((status, headers["Content-Type"]), (200, "text/html; charset=utf-8"))
        policies = headers.get_all("Content-Security-Policy")
        self.assertEqual(len(policies), 1, "another one would forbid the report's own script")
        self.assertTrue(policies[0].startswith("sandbox allow-scripts; default-src 'none'; "))
        self.assertNotIn("allow-same-origin", policies[0])
        self.assertNotIn("connect-src", policies[0])
        self.assertEqual(page, (self.folder / "runs" / "first" / "report.html").read_bytes())
        _, headers, _ = self.server.ask("GET", "/results/report.html?folder=runs/first&download=1")
        self.assertEqual(headers["Content-Disposition"], 'attachment; filename="first.html"')

    def test_a_comparison_without_a_report_says_how_to_make_it(self):
        (self.folder / "comparison.json").write_text("{}")
        self.assertEqual(
            self.error(self.server.ask("POST", "/api/results/report", {"folder": ""})),
            "this comparison has no report.html; continue it by: marrow compare",
        )

    def test_only_pictures_of_the_run_are_given(self):
        picture = self.address("/results/picture.png", folder="runs/first", name="outputs/edges/frontal.png")
        status, headers, content = self.server.ask("GET", picture)
        self.assertEqual((status, headers["Content-Type"]), (200, "image/png"))
        self.assertEqual(content, (self.folder / "runs/first/outputs/edges/frontal.png").read_bytes())
        for folder, name in (("runs/first", "run.json"), ("runs/first", "../../small.yaml"), ("runs/first", "/x.png")):
            answer = self.server.ask("GET", self.address("/results/picture.png", folder=folder, name=name))
            self.assertEqual(self.error(answer), "the run has no picture '%s'" % name)
        (self.scratch / "x.png").write_bytes(b"secret")
        (self.folder / "runs" / "first" / "link.png").symlink_to(self.scratch / "x.png")
        answer = self.server.ask("GET", self.address("/results/picture.png", folder="runs/first", name="link.png"))
        self.assertEqual(answer[0], 400)
        for path in ("/results/report.html", "/api/results/diff"):
            answer = self.server.ask("GET", self.address(path, folder="..", first="..", second=".."))
            self.assertIn("leads out of the folder that is open", self.error(answer))

    def test_only_parts_of_a_report_are_given(self):
        name = "0123456789abcdef.js"
        folder = self.folder / "compared" / "report"
        folder.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text('Parts.take("%s",\n{}\n);\n' % name)
        status, headers, content = self.server.ask(
            "GET", self.address("/results/part.txt", folder="compared", file=name)
        )
        self.assertEqual((status, headers["Content-Type"]), (200, "text/plain; charset=utf-8"))
        self.assertEqual(content, (folder / name).read_bytes())
        (folder / "notes.js").write_text("mine")
        (self.scratch / "secret.js").write_text("secret")
        (folder / "fedcba9876543210.js").symlink_to(self.scratch / "secret.js")
        for other in ("notes.js", "../comparison.json", "fedcba9876543210.js", "0123456789abcdee.js"):
            answer = self.server.ask("GET", self.address("/results/part.txt", folder="compared", file=other))
            self.assertEqual(self.error(answer), "the report has no part '%s'" % other)

    def test_a_report_that_leads_elsewhere_is_not_given(self):
        (self.scratch / "secret.html").write_text("secret")
        (self.folder / "runs" / "first" / "report.html").symlink_to(self.scratch / "secret.html")
        answer = self.server.ask("GET", "/results/report.html?folder=runs/first")
        self.assertIn("is a link to a file outside of the folder", self.error(answer))


class ResultsPageTest(PageTest, ResultsBench):
    def setUp(self):
        super().setUp()
        self.js = self.browser.js

    def show_results(self, more="=", **size):
        self.server = self.open()
        self.show(self.server, "results" + more, **size)
        self.browser.logs()

    def click(self, selector):
        self.js("document.querySelector(arguments[0]).click()", selector)

    def test_two_runs_are_chosen_by_key_and_compared(self):
        self.show_results()
        rows = self.js("return [...document.querySelectorAll('[data-result]')].map((row) => row.dataset.result)")
        self.assertEqual(sorted(rows), ["runs/first", "runs/second"])
        self.assertTrue(self.js("return document.querySelector('[data-do=compare]').disabled"))
        for name in ("first", "second"):
            self.browser.key("SPACE", "[data-result='runs/%s'] input" % name)
        self.browser.key("c", "[data-result='runs/second'] input")
        self.browser.wait("return !!document.querySelector('.says')", 60)
        self.assertEqual(
            self.js("return document.querySelector('.says').textContent"),
            "They begin to differ at the node edges (edges.canny).",
        )
        cells = self.js(
            "const found = document.querySelectorAll('[data-change=\"edges.noise_high\"] > *');"
            "return [...found].map((one) => one.textContent)"
        )
        self.assertEqual(cells, ["edges", "option noise_high", "5", "9", "the first difference"])
        self.browser.wait(
            "const pictures = [...document.querySelectorAll('.wipe img')];"
            "return pictures.length === 2 && pictures.every((one) => one.naturalWidth === 96)"
        )
        self.browser.key("HOME", ".wiped input")
        self.assertEqual(self.js("return document.querySelector('.wipe').style.getPropertyValue('--at')"), "0%")
        self.assertIn("marrow diff runs/first runs/second", self.js("return document.body.textContent"))
        self.assertEqual(self.browser.logs()[0], [])

    def test_the_list_is_sorted_and_filtered(self):
        for name, judgement, mtre in (("first", "wrong", 12.5), ("second", "trusted", 0.25)):
            run = self.folder / "runs" / name
            figures = [{"name": "mtre_mm", "unit": "mm", "value": mtre}]
            (run / "outputs" / "errors.json").write_text(json.dumps({"metrics": figures}))
            record = json.loads((run / "run.json").read_text())
            record["outputs"].append({"name": "errors", "files": ["outputs/errors.json"]})
            verdict = {"output": "verdict", "item": "", "judgement": judgement, "failure_probability": 0.5}
            record["verdicts"] = [verdict | {"reasons": ["why"], "remedies": []}]
            (run / "run.json").write_text(json.dumps(record))
        self.show_results()
        shown = lambda: self.js("return [...document.querySelectorAll('[data-result]')].map((r) => r.dataset.result)")
        self.assertEqual(shown(), ["runs/second", "runs/first"], "the newest first")
        words = self.js("return document.querySelector('[data-result=\"runs/second\"]').closest('tr').innerText")
        for part in ("edges.noise_high 5 \u2192 9", "trusted", "mTRE 0.250\u00a0mm"):
            self.assertIn(part, words)
        head = "[...document.querySelectorAll('.sort')].find((one) => one.textContent === '%s').click()"
        self.js(head % "Verdict" + ";" + head % "Verdict")
        self.assertEqual(shown(), ["runs/first", "runs/second"], "the worst first")
        self.js(head % "Key figures")
        self.assertEqual(shown(), ["runs/second", "runs/first"], "the smallest error first")
        self.find("[data-do=filter]").send_keys("wrong")
        self.assertEqual(shown(), ["runs/first"])
        self.assertEqual(self.js("return document.querySelector('[data-do=count]').textContent"), "1 of 2")
        self.find("[data-do=filter]").send_keys("!")
        self.assertIn("No result passes the filter.", self.js("return document.querySelector('.results').textContent"))

    def test_verdicts_and_the_distance_of_poses_come_first(self):
        for name in ("first", "second"):
            run = self.folder / "runs" / name
            record = json.loads((run / "run.json").read_text())
            verdict = {"output": "verdict", "item": "distal", "judgement": "doubtful", "failure_probability": 0.25}
            record["verdicts"] = [verdict | {"reasons": [name + " reason"], "remedies": []}]
            (run / "run.json").write_text(json.dumps(record))
        self.show_results("=runs/first&with=runs/second")
        cards = self.js("return [...document.querySelectorAll('.card')].map((one) => one.innerText)")
        self.assertEqual(len(cards), 2)
        for card, name in zip(cards, ("first", "second")):
            self.assertIn("runs/" + name, card)
            self.assertIn("DOUBTFUL", card.upper())
            self.assertIn(name + " reason", card)

    def test_how_far_poses_are_apart(self):
        (self.folder / "pose.yaml").write_text(
            "marrow: 1\nnodes:\n  bone: {uses: simulate.femur}\n"
            "  fracture: {uses: simulate.fracture, in: {bone: bone}}\n"
            "  truth: {uses: simulate.truth, in: {phantom: fracture}}\noutputs: {pose: truth.starts}\n"
        )
        for name, turned in (("straight", []), ("turned", ["[0, 0, 2]"]), ("hardly", ["[0, 0, 0.0002]"])):
            options = [word for value in turned for word in ("--set", "fracture.rotation_deg=" + value)]
            subprocess.run(
                [MARROW, "run", "pose.yaml", "--out", "runs/" + name, "--quiet", *options], cwd=self.folder, check=True
            )
        line = "return document.querySelector('.pose-difference').textContent"
        self.show_results("=runs/straight&with=runs/turned")
        self.assertIn("The poses of distal are 2.00° and ", self.js(line))
        self.assertTrue(self.js(line).endswith("mm apart."), self.js(line))
        self.server.close()
        self.show_results("=runs/straight&with=runs/hardly")
        self.assertEqual(self.js(line), "The poses of distal are the same, to less than 0.001° and 0.001 mm.")

    def test_a_report_says_that_it_loads(self):
        self.show_results()
        self.js(
            "new MutationObserver(() => { const says = document.querySelector('.report-box');"
            "if (says) window.said = (window.said || '') + says.textContent; })"
            ".observe(document.getElementById('page'), {childList: true, subtree: true})"
        )
        self.click("[data-result='runs/first'] a")
        self.browser.wait("return !!document.querySelector('iframe.report:not([aria-busy])')", 60)
        self.assertIn("Loading the report", self.js("return window.said"))
        self.assertEqual(self.js("return document.querySelector('.report-box').textContent"), "")

    def test_figures_are_put_side_by_side(self):
        for name, mtre in (("first", 1.5), ("second", 0.25)):
            run = self.folder / "runs" / name
            figures = [{"name": "mtre", "unit": "mm", "value": mtre}, {"name": "size", "unit": "px", "value": 3}]
            (run / "outputs" / "errors.json").write_text(json.dumps({"metrics": figures}))
            record = json.loads((run / "run.json").read_text())
            record["outputs"].append({"name": "errors", "files": ["outputs/errors.json"]})
            (run / "run.json").write_text(json.dumps(record))
        self.show_results("=runs/first&with=runs/second")
        cells = self.js("return [...document.querySelectorAll('[data-figure=mtre] td')].map((one) => one.textContent)")
        self.assertEqual(cells, ["1.50\u00a0mm", "0.250\u00a0mm", "\u22121.25\u00a0mm better"])
        same = "return document.querySelector('[data-do=same-figures] summary').textContent"
        self.assertEqual(self.js(same), "The same in both: 1")
        self.js(
            "const box = document.querySelector('section[aria-label=Figures] select'); box.value = 0.1;"
            "box.dispatchEvent(new Event('change'))"
        )
        self.assertEqual(self.js(same), "The same in both: 1", "1.25 mm is more than 0.1 mm")

    def test_a_report_is_shown_in_the_page_and_its_script_runs(self):
        self.show_results("=runs/first")
        driver = self.browser.driver
        driver.switch_to.frame(driver.find_element("css selector", "iframe.report"))
        try:
            self.browser.wait("return document.documentElement.dataset.ready === 'true'", 60)
            self.assertEqual(self.js("return self.origin"), "null")
            self.assertEqual(self.js("return document.title"), "small · marrow")
        finally:
            driver.switch_to.default_content()
        self.click("#theme")
        driver.switch_to.frame(driver.find_element("css selector", "iframe.report"))
        try:
            self.browser.wait("return document.documentElement.dataset.theme === 'dark'", 30)
        finally:
            driver.switch_to.default_content()
        self.assertIn("marrow show runs/first", self.js("return document.body.textContent"))
        self.assertIn("download=1", self.js("return document.querySelector('[data-do=download]').href"))

    def test_a_hostile_report_reaches_nothing(self):
        (self.folder / "runs" / "first" / "report.html").write_text(
            "<p id=said>waits</p><script>"
            "fetch('/api/folder').then(() => 'reached', () => 'refused')"
            ".then((word) => document.getElementById('said').textContent = word)</script>"
        )
        self.show_results("=runs/first")
        driver = self.browser.driver
        driver.switch_to.frame(driver.find_element("css selector", "iframe.report"))
        try:
            self.browser.wait("return document.getElementById('said').textContent !== 'waits'", 60)
            self.assertEqual(self.js("return document.getElementById('said').textContent"), "refused")
        finally:
            driver.switch_to.default_content()

    def test_no_width_cuts_anything_off(self):
        for width_px in (1440, 1024, 400):
            for more in ("=", "=runs/first&with=runs/second"):
                self.show_results(more, width_px=width_px)
                self.assertTrue(
                    self.js("return document.documentElement.scrollWidth <= innerWidth"), "%s, %d px" % (more, width_px)
                )
                self.server.close()


if __name__ == "__main__":
    bench.main()
