# SPDX-License-Identifier: Apache-2.0
"""marrow watch: it builds, runs and shows again what is out of date, and keeps the last good result."""
import json
import os
import pathlib
import signal
import subprocess

from harness import BUILD, MARROW, SOURCE, TEST_PLUGINS
from harness.program import Case, main, marrow, wait_until

from harness import browser

PIPELINE = "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: %s}}\noutputs: {c: c}\n"
PLUGIN = """#include <marrow/plugin.hpp>
namespace {
marrow::Metrics count() { return {{{"count", %s, ""}}}; }
}  // namespace
MARROW_PLUGIN(plugin) { plugin.node("evaluate.count", count).summary("a number").out("metrics", "the number"); }
"""
BUILD_FILE = """cmake_minimum_required(VERSION 3.25)
project(counting CXX)
find_package(marrow REQUIRED)
marrow_add_plugin(counting counting.cpp)
"""


class Watch(Case):
    def setUp(self):
        super().setUp()
        self.process = None

    def tearDown(self):
        if self.process and self.process.poll() is None:
            self.process.kill()
        if self.process:
            self.process.wait()
            self.log.close()
        super().tearDown()

    def start(self, *arguments):
        self.log = open(self.scratch / "watch.log", "w+")
        self.process = subprocess.Popen(
            [MARROW, "watch", *map(str, arguments)],
            cwd=self.scratch,
            stdout=self.log,
            stderr=self.log,
            env={**os.environ, "MARROW_PLUGIN_PATH": str(TEST_PLUGINS)},
        )

    def state(self, folder):
        """What the page shows, or nothing as long as there is no page."""
        path = self.scratch / folder / "state.js"
        return json.loads(path.read_text().strip()[len("marrowState(") : -1]) if path.exists() else {}

    def wait(self, folder, report, fault=""):
        """Until it has nothing to do, shows this report and this fault (or a part of it)."""

        def is_there():
            self.assertIsNone(self.process.poll(), pathlib.Path(self.log.name).read_text())
            state = self.state(folder)
            return (
                state.get("report") == report
                and not state["doing"]
                and bool(state["fault"]) == bool(fault)
                and fault in state["fault"]
            )

        # A plugin may have to be built first.
        wait_until(is_there, "%s, %r: %s" % (report, fault, self.state(folder)), 600)

    def test_data(self):
        pose = (SOURCE / "pipelines/wrist/radius-0002.pose.yaml").read_text()
        data = self.write("pose.yaml", pose)
        self.start(
            self.write("p.yaml", "marrow: 1\nnodes: {p: {uses: read.pose, with: {path: pose.yaml}}}\noutputs: {p: p}\n")
        )
        self.wait("runs/p-watch", "run-1/report.html")
        data.write_text("marrow-pose: 1\n")
        self.wait("runs/p-watch", "run-1/report.html", "pose.yaml")
        data.write_text(pose)
        self.wait("runs/p-watch", "run-2/report.html")

    def test_pipeline(self):
        path = self.write("p.yaml", PIPELINE % 3)
        self.start(path)
        self.wait("runs/p-watch", "run-1/report.html")
        path.write_text(PIPELINE % "{")
        self.wait("runs/p-watch", "run-1/report.html", "p.yaml:3:")
        self.assertIn("the run failed (exit code 2)", self.state("runs/p-watch")["fault"])
        self.assertTrue((self.scratch / "runs/p-watch/run-1/report.html").exists(), "the last good result stays")
        path.write_text(PIPELINE % 4)
        self.wait("runs/p-watch", "run-2/report.html")
        # the old one is removed only when the page knows the new one
        wait_until(lambda: not (self.scratch / "runs/p-watch/run-1").exists(), "the old result stays")
        self.process.send_signal(signal.SIGINT)
        self.assertEqual(self.process.wait(200), 130)
        said = (self.scratch / "watch.log").read_text()
        self.assertIn("stopped by Ctrl-C; the last good result is in runs/p-watch/run-2", said)

    def test_the_open_page_shows_the_new_result(self):
        if browser.missing():
            self.skipTest(browser.missing())
        path = self.write("p.yaml", PIPELINE % 3)
        self.start(path, "--out", "shown")
        self.wait("shown", "run-1/report.html")
        page = browser.Browser()
        self.addCleanup(page.close)
        driver = page.driver
        driver.get((self.scratch / "shown/index.html").as_uri())
        report = lambda: driver.execute_script("return document.querySelector('iframe').src")
        text = lambda name: driver.execute_script("return document.querySelector(arguments[0]).textContent", name)
        wait_until(lambda: report().endswith("run-1/report.html"), "the first result")
        path.write_text(PIPELINE % "{")
        wait_until(lambda: "p.yaml:3:" in text("#fault"), "the fault is shown")
        self.assertIn("below is the last good result", text("#bar"))
        self.assertTrue(report().endswith("run-1/report.html"))
        path.write_text(PIPELINE % 4)
        wait_until(lambda: report().endswith("run-2/report.html"), "the second result")
        wait_until(lambda: text("#fault") == "", "the fault is gone")
        self.assertIn("up to date since", text("#bar"))

    def test_sources_of_a_plugin(self):
        (self.scratch / "plugin").mkdir()
        source = self.write("plugin/counting.cpp", PLUGIN % 1)
        self.write("plugin/CMakeLists.txt", BUILD_FILE)
        configure = ["cmake", "-S", "plugin", "-B", "build", "-G", "Ninja", "-Dmarrow_DIR=%s" % BUILD]
        subprocess.run(configure, cwd=self.scratch, check=True, stdout=subprocess.DEVNULL)
        path = self.write("p.yaml", "marrow: 1\nnodes: {c: {uses: evaluate.count}}\noutputs: {c: c}\n")
        self.start(path, "--build", "build", "--out", "w")
        self.wait("w", "run-1/report.html")
        source.write_text(PLUGIN % "nothing")
        self.wait("w", "run-1/report.html", "counting.cpp:3:")
        self.assertIn("build failed", self.state("w")["fault"])
        source.write_text(PLUGIN % 2)
        self.wait("w", "run-2/report.html")
        metrics = json.loads((self.scratch / "w/run-2/outputs/c.json").read_text())["metrics"]
        self.assertEqual(metrics[0]["value"], 2)

    def test_what_it_refuses(self):
        path = self.write("p.yaml", PIPELINE % 3)
        refused = marrow("watch", path, "--build", self.scratch, cwd=self.scratch)
        self.assertEqual(refused.returncode, 2)
        self.assertIn("it is no build folder of CMake, as it has no CMakeCache.txt; make it by", refused.stderr)
        self.write("precious", "")
        refused = marrow("watch", path, "--out", self.scratch, cwd=self.scratch)
        self.assertEqual(refused.returncode, 2)
        self.assertIn("it is there already, and not from marrow watch; name another folder with --out", refused.stderr)
        self.assertTrue((self.scratch / "precious").exists())


if __name__ == "__main__":
    main()
