# SPDX-License-Identifier: Apache-2.0
"""Pipelines from Python: results as those of the program, settings, folders, progress."""
import io
import json
import os

import numpy
import yaml
from harness.package import FEMUR, PackageCase, main, marrow, program


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
        self.assertEqual(
            result.warnings, ["nobody judges the output 'found': this pipeline has no verdict on that pose"]
        )

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
        pipeline = marrow.Pipeline(
            self.write("draw.yaml", "marrow: 1\nnodes: {a: {uses: test.draw}}\noutputs: {number: a}\n")
        )

        def number(seed):
            return pipeline.run(seed=seed, keep=False)["number"]["value"]

        self.assertEqual(number(1), number(1))
        self.assertNotEqual(number(1), number(2))

    def test_relative_paths_start_at_the_working_folder(self):
        os.chdir(self.folder.parent)
        self.assertEqual(len(marrow.Pipeline(FEMUR, case="case").run(only=["edges"])["edges"]), 2)


if __name__ == "__main__":
    main()
