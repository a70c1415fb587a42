# SPDX-License-Identifier: Apache-2.0
"""Errors in Python: all faults at once, each with its place, its node and what to do."""
import os
import shutil
import unittest.mock

import yaml
from harness.package import FEMUR, PackageCase, main, marrow

FAULTY = """marrow: 1
nodes:
  a: {uses: test.constant, with: {valu: 1}}
  b:
    uses: test.add
    in: {a: a, b: c}
  d: {uses: test.constant, with: {count: -1}}
outputs: {sum: b}
"""
FAILING = """marrow: 1
nodes:
  a: {uses: test.constant, with: {value: 5}}
  b: {uses: test.fail_above, in: {a: a}, with: {value: 1}}
  c: {uses: test.add, in: {a: a, b: a}}
outputs: {failed: b, sum: c}
"""


class Errors(PackageCase):
    def test_all_faults_come_at_once_with_their_places(self):
        file = self.write("faulty.yaml", FAULTY)
        error = self.fault_of(lambda: marrow.Pipeline(file))
        places = [(fault.line, fault.column, fault.node, fault.port, fault.option) for fault in error.faults]
        self.assertEqual(places, [(3, 35, "a", None, "valu"), (6, 16, "b", "b", None), (7, 35, "d", None, "count")])
        self.assertEqual(error.faults[0].message, "'test.constant' has no option 'valu'")
        self.assertEqual(error.faults[0].hint, "did you mean 'value'?")
        self.assertEqual(error.faults[1].message, "there is no node 'c'")
        self.assertIn("-1 is below the least allowed, 0", error.faults[2].message)
        self.assertEqual((error.file, error.line, error.column), (str(file), 3, 35))
        self.assertEqual((error.node, error.option, error.hint), ("a", "valu", "did you mean 'value'?"))
        self.assertIn("%s:3:35: error: 'test.constant' has no option 'valu'" % file, str(error))
        self.assertIn("\n  hint: did you mean 'value'?", str(error))

    def test_a_file_stored_by_another_system(self):
        lines = FAULTY.replace("\n", "\r")
        for number, stored in enumerate(
            (b"\xef\xbb\xbf" + FAULTY.encode(), lines.encode(), FAULTY.encode("utf-16"), lines.encode("utf-16"))
        ):
            file = self.scratch / ("stored-%d.yaml" % number)
            file.write_bytes(stored)
            error = self.fault_of(lambda: marrow.Pipeline(file))
            self.assertEqual([(fault.line, fault.column) for fault in error.faults], [(3, 35), (6, 16), (7, 35)])
            self.assertIn("  a: {uses: test.constant, with: {valu: 1}}\n", str(error))

    def test_a_file_that_is_not_there_or_no_yaml(self):
        with self.assertRaisesRegex(marrow.PipelineError, "nowhere.yaml"):
            marrow.Pipeline(self.scratch / "nowhere.yaml")
        error = self.fault_of(lambda: marrow.Pipeline(self.write("open.yaml", "marrow: 1\nnodes: {a: [\n")))
        self.assertEqual(error.line, 2)
        self.assertIsNone(error.node)

    def test_inputs(self):
        error = self.fault_of(lambda: marrow.Pipeline(FEMUR))
        self.assertEqual(error.faults[0].message, "input 'case' has no value")
        self.assertEqual(error.hint, "give it as  case=VALUE")
        of = lambda **inputs: lambda: marrow.Pipeline(FEMUR, **inputs)
        hint = "the pipeline has no input 'cas'\n  hint: did you mean 'case'?"
        self.refuses((hint, of(case=".", cas=".")), kind=marrow.PipelineError)
        self.refuses(("case: expected a bool, number, text, path, or a list of these, got 'dict'", of(case={})))

    def test_a_wrong_change_changes_nothing(self):
        pipeline = marrow.Pipeline(FEMUR, case=".")
        before = pipeline.resolved()
        error = self.fault_of(lambda: pipeline.set("edges.hihg", 80))
        self.assertEqual((error.file, error.node, error.option), ("set(edges.hihg)", "edges", "hihg"))
        self.assertEqual(error.hint, "did you mean 'high'?")
        with self.assertRaisesRegex(marrow.PipelineError, 'expected a number, got the quoted text "much"'):
            pipeline.set("edges.high", "much")
        with self.assertRaisesRegex(marrow.PipelineError, "there is no node 'cas'") as caught:
            pipeline.set("edges.in.view", "cas.views")
        self.assertEqual((caught.exception.node, caught.exception.port), ("edges", "view"))
        self.assertEqual(pipeline.resolved(), before)

    def test_a_text_stays_what_it_is(self):
        for text in ("a #b", "&a b", "! b", "~", "null", "[a", '"a', "- a", "a: b", " a ", "a\nb", "größe"):
            self.assertEqual(self.path_after("case.path", text), os.path.join(os.getcwd(), text))
        with self.assertRaisesRegex(marrow.Error, "case.path: expected a bool, number, text, path, .* got 'NoneType'"):
            marrow.Pipeline(FEMUR, case=".").set("case.path", None)

    def path_after(self, key, text):
        resolved = yaml.safe_load(marrow.Pipeline(FEMUR, case=".").set(key, text).resolved())
        return resolved["nodes"]["case"]["with"]["path"]

    def test_changes_that_must_fit_each_other_are_made_together(self):
        pipeline = marrow.Pipeline(FEMUR, case=".")
        with self.assertRaisesRegex(marrow.PipelineError, "low"):
            pipeline.set("edges.low", 90)
        pipeline.set({"edges.low": 90, "edges.high": 95})
        self.assertIn("low: 90", pipeline.resolved())

    def test_a_node_that_fails(self):
        pipeline = marrow.Pipeline(self.write("failing.yaml", FAILING))
        error = self.fault_of(pipeline.run, marrow.RunError)
        self.assertEqual((error.node, error.line, error.column), ("b", 4, 3))
        self.assertRegex(str(error), r"^node 'b' \(test.fail_above\) failed: ")
        self.assertEqual(error.result.nodes["c"].status, "done")
        self.assertIsNone(error.result["failed"])
        self.assertIsNotNone(error.result["sum"])

    def test_wrong_names_and_settings(self):
        result = self.pipeline.run(only=["edges"])
        self.refuses(
            ("the pipeline has no output 'poes'; did you mean 'pose'?", lambda: self.pipeline.run(only=["poes"])),
            ("threads: expected a whole number from 0 to 1024, got -1", lambda: self.pipeline.run(threads=-1)),
        )
        self.refuses(
            ("no output 'edge'; there are edges", lambda: result["edge"]),
            ("no view 'oblique'; there are frontal, lateral", lambda: result["edges"]["oblique"]),
            kind=KeyError,
        )

    def test_a_folder_that_the_run_reads_is_refused(self):
        run = lambda **more: self.pipeline.run(only=["edges"], **more)
        self.addCleanup(shutil.rmtree, self.folder / "store", ignore_errors=True)
        self.refuses(("choose another with folder=", lambda: run(folder=self.folder / "out")))
        with unittest.mock.patch.dict(os.environ, MARROW_CACHE=str(self.folder / "store")):
            self.refuses(("set MARROW_CACHE to another folder, or give keep=False", run))
            self.assertEqual(len(run(keep=False)["edges"]), 2)

    def test_a_store_that_cannot_be_used_is_a_warning(self):
        other = self.scratch / "others"
        other.mkdir()
        (other / "letter.txt").write_text("of somebody")
        with unittest.mock.patch.dict(os.environ, MARROW_CACHE=str(other)):
            result = self.pipeline.run(only=["edges"])
        self.assertRegex(result.warnings[0], "^results are not kept: ")


if __name__ == "__main__":
    main()
