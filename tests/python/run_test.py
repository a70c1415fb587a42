# SPDX-License-Identifier: Apache-2.0
"""Pipelines from Python: results as those of the program, settings, folders, progress, tables of comparisons, Ctrl-C
and threads."""
import io
import json
import os
import signal
import subprocess
import sys
import threading
import time

import numpy
import yaml
from harness.given_cases import GivenCase
from harness.package import FEMUR, Case, PackageCase, interrupt, main, marrow, program, small_case


class Run(PackageCase):
    def test_values_are_those_of_the_program(self):
        result = self.pipeline.run(only=["pose", "errors", "edges"], keep=False)
        only = ["--only", "pose", "--only", "errors", "--no-cache"]
        program("run", FEMUR, "case=%s" % self.folder, "--out", self.scratch / "run", *only)
        written = yaml.safe_load((self.scratch / "run/outputs/pose/distal.yaml").read_text())
        self.assertEqual(result["pose"]["distal"].matrix.tolist(), written["matrix"])
        metrics = json.loads((self.scratch / "run/outputs/errors/distal/final.json").read_text())["metrics"]
        final = result["errors"]["distal"]["final"]
        self.assertEqual(dict(final.values), {metric["name"]: metric["value"] for metric in metrics})
        self.assertLess(final["mtre_mm"], 2)
        self.assertEqual(list(result), ["verdict", "pose", "errors", "edges"], "no pose comes without its verdict")
        self.assertEqual(result["edges"].axis, "view")
        self.assertEqual(list(result["edges"]), ["frontal", "lateral"])

    def test_a_pose_that_nobody_judges_is_told(self):
        (self.scratch / "p.yaml").write_text(
            "marrow-pose: 1\ntarget: world\nsource: ct\nrotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
            "translation_mm: [0, 0, 7]\n"
        )
        (self.scratch / "read.yaml").write_text(
            "marrow: 1\nnodes:\n  found: {uses: read.pose, with: {path: p.yaml}}\noutputs: {found: found}\n"
        )
        result = marrow.Pipeline(self.scratch / "read.yaml").run(keep=False)
        told = "nobody judges the output 'found': this pipeline has no verdict on that pose"
        self.assertEqual(result.warnings, [told])

    def test_an_option_is_changed(self):
        before = self.pipeline.run(only=["edges"])
        after = self.pipeline.set("edges.uses", "edges.canny").set("edges.noise_high", 8).run(only=["edges"])
        self.assertEqual(self.pipeline.nodes["edges"], "edges.canny")
        self.assertIn("high: 8", self.pipeline.resolved())
        self.assertNotEqual(len(before["edges"]["lateral"]), len(after["edges"]["lateral"]))
        self.assertIn(
            "node 'edges': the options written for edges.adaptive_relaxation are not used by edges.canny",
            self.pipeline.notes,
        )

    def test_the_second_run_reads_back_what_is_kept(self):
        self.pipeline.set("edges.low", 49)
        first, second = self.pipeline.run(only=["edges"]), self.pipeline.run(only=["edges"])
        self.assertEqual((first.nodes["edges"].calls, first.nodes["edges"].cached), (2, 0))
        self.assertEqual((second.nodes["edges"].calls, second.nodes["edges"].cached), (0, 2))
        self.assertTrue(numpy.array_equal(first["edges"]["frontal"].pixels, second["edges"]["frontal"].pixels))
        self.assertEqual(self.pipeline.run(only=["edges"], keep=False).nodes["edges"].calls, 2)

    def test_a_folder_is_written_as_by_the_program(self):
        result = self.pipeline.run(only=["edges"], folder=self.scratch / "out", keep=False)
        log = (self.scratch / "out" / "log.txt").read_text()
        self.assertRegex(log, r"\[info\] edges \(lateral\): \d+\.\d{3} s\n")
        self.assertEqual(result.folder, self.scratch / "out")
        record = json.loads((self.scratch / "out" / "run.json").read_text())
        self.assertEqual(record["inputs"]["case"], str(self.folder))
        self.assertTrue(result.files["edges"])
        self.assertTrue(all(file.is_file() for file in result.files["edges"]))
        for place in [self.scratch / "out", *result.files["edges"]]:
            self.assertEqual(result.recipe, program("recipe", place))
        with self.assertRaisesRegex(marrow.Error, "not empty"):
            self.pipeline.run(only=["edges"], folder=self.scratch / "out")
        self.assertIsNone(self.pipeline.run(only=["edges"]).folder)

    def test_progress_is_told(self):
        told = []
        self.pipeline.run(only=["edges"], keep=False, progress=told.append)
        self.assertEqual({event["node"] for event in told}, {"case", "edges"})
        self.assertEqual({event["item"] for event in told if event["node"] == "edges"}, {"frontal", "lateral"})
        self.assertIn("finished", {event["event"] for event in told})
        from marrow.progress import Printer

        shown = io.StringIO()
        self.pipeline.run(only=["edges"], keep=False, progress=Printer(shown))
        self.assertRegex(shown.getvalue(), r"edges \(lateral\): \d+\.\d{3} s\n")

    def test_what_progress_raises_stops_the_run(self):
        def stop(event):
            raise LookupError("enough")

        with self.assertRaisesRegex(LookupError, "enough"):
            self.pipeline.run(keep=False, progress=stop)

    def test_values_of_memory_take_the_place_of_nodes(self):
        expected = self.pipeline.run(only=["pose", "edges"], keep=False)
        unread = marrow.Pipeline(FEMUR, case=None)
        read = marrow.read.case(path=self.folder)
        result = unread.run(given={"case": read}, only=["pose", "edges"], keep=False)
        self.assertEqual(result["pose"]["distal"].matrix.tolist(), expected["pose"]["distal"].matrix.tolist())
        self.assertNotIn("case", result.nodes)
        self.assertIsNone(result.recipe, "no file makes the values again")

        camera = read.views["lateral"].camera
        pixels = numpy.array(read.views["lateral"].image.array)
        views = {"lateral": marrow.View(pixels, camera, name="lateral")}
        result = unread.run(given={"case": {"views": views}}, only=["edges"])
        self.assertEqual(list(result["edges"]), ["lateral"])
        self.assertTrue(numpy.array_equal(result["edges"]["lateral"].pixels, expected["edges"]["lateral"].pixels))

        result = unread.run(given={"edges": expected["edges"], "case": read}, only=["shaft"])
        self.assertNotIn("edges", result.nodes)
        self.assertEqual(list(result["shaft"]), ["frontal", "lateral"])
        for given, text in (
            ({"cas": read}, "given: the pipeline has no node 'cas'; did you mean 'case'?"),
            ({"case": read.ct}, "given 'case': the node has several outputs; give a dictionary of them"),
            ({"case": {"vievs": views}}, "given 'case': the node has no output 'vievs'; did you mean 'views'?"),
            ({"case": {"ct": read.views}}, "given 'case.ct': expected volume, got view"),
            ({"case": {"views": views["lateral"]}}, "given 'case.views': expected a list over view, got one item"),
            ({"edges": 5}, "given 'edges.edges': expected edge_map, got int"),
        ):
            self.refuses((text.replace("?", r"\?"), lambda: unread.run(given=given, only=["edges"])))

    def test_a_random_run_depends_on_its_seed_only(self):
        text = "marrow: 1\nnodes: {a: {uses: test.draw}}\noutputs: {number: a}\n"
        pipeline = marrow.Pipeline(self.write("draw.yaml", text))

        def number(seed):
            return pipeline.run(seed=seed, keep=False)["number"]["value"]

        self.assertEqual(number(1), number(1))
        self.assertNotEqual(number(1), number(2))

    def test_relative_paths_start_at_the_working_folder(self):
        os.chdir(self.folder.parent)
        self.assertEqual(len(marrow.Pipeline(FEMUR, case="case").run(only=["edges"])["edges"]), 2)


class Tables(GivenCase):
    """They have the numbers of comparison.json, and None for what is not known."""

    def table(self, values, more="", **others):
        self.compare(values, more, **others)
        return marrow.Comparison(self.scratch / "out")

    def test_missing_runs(self):
        # b lacks the figure in four of six cases; the medians are by hand.
        comparison = self.table({"a": ["%d mm" % i for i in range(1, 7)], "b": ["1 mm", "2 mm"] + ["fail"] * 4})
        first, second = comparison.variants
        self.assertEqual([row["unit"] for row in comparison.variants], ["mm", "mm"])
        self.assertEqual([first[key] for key in ("count", "of", "median", "failed", "incomplete")], [6, 6, 3.5, 0, 0])
        self.assertEqual([second[key] for key in ("count", "of", "median", "failed", "incomplete")], [2, 6, 1.5, 0, 4])
        self.assertEqual((first["median_low"], first["median_high"]), (1, 6), "the range of six values")
        self.assertEqual((second["median_low"], second["median_high"]), (None, None), "two cases are too few")
        self.assertEqual([row["success_rate"] for row in comparison.variants], [None, None], "there are no limits")
        self.assertEqual(list(comparison.differences), self.answer()["comparisons"])
        difference = comparison.differences[0]
        self.assertEqual((difference["difference"], difference["fails_more"]), (None, "variant"))
        self.assertEqual((difference["runs_variant_lost"], difference["runs"]), (4, 6))
        self.assertEqual([row["success"] for row in comparison.cells], [None] * 12)

    def test_the_percentile_is_named_after_what_is_better(self):
        values = {"a": ["%d mm" % i for i in range(21)]}
        row = self.table(values).variants[0]
        self.assertEqual((row["p95"], row["p5"]), (19, None))
        metrics = "[{figure: figures.err, better: higher}]"
        row = self.table(values, "success: {figures.err: 9.5}\n", metrics=metrics).variants[0]
        self.assertEqual((row["p95"], row["p5"]), (None, 1))
        self.assertAlmostEqual(row["success_rate"], 11 / 21, 12)

    def test_all_rows_have_the_same_columns(self):
        variants = self.table({"a": ["fail"], "b": ["1 mm"]}).variants
        self.assertEqual(list(variants[0]), list(variants[1]))
        self.assertIsNone(variants[0]["median"])


LONG = """marrow: 1
nodes:
  a: {uses: test.constant}
  b: {uses: test.work, in: {after: a}, with: {value: %s}}
outputs: {b: b}
"""


class Stopping(Case):
    def test_ctrl_c_stops_a_run_and_no_handler_changes(self):
        pipeline = marrow.Pipeline(self.write("long.yaml", LONG % 300))
        handler = signal.getsignal(signal.SIGINT)
        interrupt(self, lambda: pipeline.run(keep=False))
        self.assertIs(signal.getsignal(signal.SIGINT), handler)
        interrupt(self, lambda: time.sleep(300))  # outside of a run it does what it did before
        short = marrow.Pipeline(self.write("short.yaml", LONG % 0.01))
        self.assertEqual(short.run(keep=False).nodes["b"].status, "done")

    def test_ctrl_c_stops_a_node(self):
        work = marrow.test.work.using()
        interrupt(self, lambda: work(marrow.test.constant(), value=300))

    def test_a_handler_of_ones_own_is_called_and_may_go_on(self):
        seen = []
        timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
        before = signal.signal(signal.SIGINT, lambda number, frame: seen.append(number))
        try:
            timer.start()
            result = marrow.Pipeline(self.write("long.yaml", LONG % 1)).run(keep=False)
            timer.join()  # it may come late
        finally:
            signal.signal(signal.SIGINT, before)
        self.assertEqual(seen, [signal.SIGINT])
        self.assertEqual(result.nodes["b"].status, "done")

    def test_a_process_ends_by_ctrl_c(self):
        file = self.write("long.yaml", LONG % 1000)
        code = "import marrow; print('begun', flush=True); marrow.Pipeline(%r).run(keep=False)" % str(file)
        environment = {**os.environ, "PYTHONPATH": os.path.dirname(os.path.dirname(marrow.__file__))}
        with subprocess.Popen(
            [sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as process:
            self.assertEqual(process.stdout.readline(), "begun\n")
            time.sleep(0.5)
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=300)
        self.assertIn("KeyboardInterrupt", errors)
        self.assertEqual(process.returncode, -signal.SIGINT)

    def test_other_threads_of_python_go_on(self):
        is_begun = threading.Event()

        def count():
            """Ends the run after a hundred steps of its own, of which a run that holds all up would let it do few."""
            is_begun.wait()
            for _ in range(100):
                time.sleep(0.001)
            os.kill(os.getpid(), signal.SIGINT)

        counter = threading.Thread(target=count, daemon=True)
        counter.start()
        begin = lambda event: is_begun.set() if (event["event"], event.get("node")) == ("started", "b") else None
        with self.assertRaises(KeyboardInterrupt):
            marrow.Pipeline(self.write("long.yaml", LONG % 300)).run(keep=False, progress=begin)
        counter.join()

    def test_runs_of_several_threads_at_once(self):
        folder, _ = small_case()
        expected = {
            high: marrow.Pipeline(FEMUR, case=folder)
            .set("edges.high", high)
            .run(only=["edges"])["edges"]["lateral"]
            .pixels
            for high in (80, 85, 90, 95)
        }
        results, faults = {}, []

        def run(high):
            try:
                pipeline = marrow.Pipeline(FEMUR, case=folder).set("edges.high", high)
                for keep in (False, True, False):
                    results[high, len(results)] = pipeline.run(only=["edges"], keep=keep)["edges"]["lateral"].pixels
            except BaseException as fault:  # shown below, in the main thread
                faults.append(fault)

        threads = [threading.Thread(target=run, args=(high,)) for high in expected]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(faults, [])
        self.assertEqual(len(results), 12)
        for (high, _), pixels in results.items():
            self.assertTrue(numpy.array_equal(pixels, expected[high]))


if __name__ == "__main__":
    main()
