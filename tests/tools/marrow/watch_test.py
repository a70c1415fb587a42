# SPDX-License-Identifier: Apache-2.0
"""marrow watch: it builds, runs and shows again what is out of date, and keeps the last good result."""
import json
import signal
import subprocess

from harness import BUILD, SOURCE, browser
from harness.program import Case, main, wait_until

PIPELINE = "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: %s}}\noutputs: {c: c}\n"
POSE = "marrow: 1\nnodes: {p: {uses: read.pose, with: {path: pose.yaml}}}\noutputs: {p: p}\n"
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
    def watch(self, *arguments, folder):
        """Watches a pipeline, into this folder."""
        with open(self.scratch / "watch.log", "w") as log:
            self.process = self.start("watch", "p.yaml", *arguments, stdout=log, stderr=log)
        self.folder = folder
        self.expect_report(1)

    def state(self):
        """What the page shows, or nothing as long as there is no page."""
        path = self.scratch / self.folder / "state.js"
        return json.loads(path.read_text().strip()[len("marrowState(") : -1]) if path.exists() else {}

    def expect_report(self, number, fault=""):
        """Waits until it has nothing to do, shows this report and this fault (or a part of it)."""

        def is_there():
            self.assertIsNone(self.process.poll(), self.read("watch.log"))
            state = self.state()
            return (
                state.get("report") == "run-%d/report.html" % number
                and not state["doing"]
                and bool(state["fault"]) == bool(fault)
                and fault in state["fault"]
            )

        # A plugin may have to be built first.
        wait_until(is_there, "report %d, %r: %s" % (number, fault, self.state()), 600)

    def test_data(self):
        pose = (SOURCE / "pipelines/wrist/radius-0002.pose.yaml").read_text()
        self.write("pose.yaml", pose)
        self.write("p.yaml", POSE)
        self.watch(folder="runs/p-watch")
        self.write("pose.yaml", "marrow-pose: 1\n")
        self.expect_report(1, "pose.yaml")
        self.write("pose.yaml", pose)
        self.expect_report(2)

    def test_pipeline_and_open_page(self):
        self.write("p.yaml", PIPELINE % 3)
        self.watch(folder="runs/p-watch")
        runs = self.scratch / "runs/p-watch"
        page = None
        if not browser.missing():
            page = browser.Browser()
            self.addCleanup(page.close)
            page.driver.get((runs / "index.html").as_uri())
        self.shows(page, 1)
        self.write("p.yaml", PIPELINE % "{")
        self.expect_report(1, "p.yaml:3:")
        self.assertIn("the run failed (exit code 2)", self.state()["fault"])
        self.assertTrue((runs / "run-1/report.html").exists(), "the last good result stays")
        self.shows(page, 1, "below is the last good result", "p.yaml:3:")
        self.write("p.yaml", PIPELINE % 4)
        self.expect_report(2)
        # the old one is removed only when the page knows the new one
        wait_until(lambda: not (runs / "run-1").exists(), "the old result stays")
        self.shows(page, 2, "up to date since")
        self.process.send_signal(signal.SIGINT)
        self.assertEqual(self.process.wait(200), 130)
        said = "stopped by Ctrl-C; the last good result is in runs/p-watch/run-2"
        self.assertIn(said, self.read("watch.log"))

    def shows(self, page, number, bar="", fault=""):
        """What the page comes to show, where there is a browser."""
        if page:
            report = lambda: page.driver.execute_script("return document.querySelector('iframe').src")
            text = lambda name: page.driver.execute_script(
                "return document.querySelector(arguments[0]).textContent", name
            )
            wait_until(lambda: report().endswith("run-%d/report.html" % number), "result %d" % number)
            wait_until(lambda: fault in text("#fault") and bool(text("#fault")) == bool(fault), "fault: " + fault)
            self.assertIn(bar, text("#bar"))

    def test_sources_of_a_plugin(self):
        self.write("plugin/counting.cpp", PLUGIN % 1)
        self.write("plugin/CMakeLists.txt", BUILD_FILE)
        configure = ["cmake", "-S", "plugin", "-B", "build", "-G", "Ninja", "-Dmarrow_DIR=%s" % BUILD]
        subprocess.run(configure, cwd=self.scratch, check=True, stdout=subprocess.DEVNULL)
        self.write("p.yaml", "marrow: 1\nnodes: {c: {uses: evaluate.count}}\noutputs: {c: c}\n")
        self.watch("--build", "build", "--out", "w", folder="w")
        self.write("plugin/counting.cpp", PLUGIN % "nothing")
        self.expect_report(1, "counting.cpp:3:")
        self.assertIn("build failed", self.state()["fault"])
        self.write("plugin/counting.cpp", PLUGIN % 2)
        self.expect_report(2)
        self.assertEqual(self.metric("w/run-2/outputs/c.json"), 2)

    def test_what_it_refuses(self):
        self.write("p.yaml", PIPELINE % 3)
        self.write("precious", "")
        for option, said in (
            ("--build", "it is no build folder of CMake, as it has no CMakeCache.txt; make it by"),
            ("--out", "it is there already, and not from marrow watch; name another folder with --out"),
        ):
            self.refused(said, "watch", "p.yaml", option, self.scratch)
        self.assertTrue((self.scratch / "precious").exists())


if __name__ == "__main__":
    main()
