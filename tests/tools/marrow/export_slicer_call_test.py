# SPDX-License-Identifier: Apache-2.0
"""A module of marrow export slicer, called with a program in marrow's place: its words, events, codes and faults."""
import json
import pathlib
import shutil

import yaml
from harness import MARROW, SOURCE
from harness.program import main, marrow
from slicer_peer import KINDS, PART, Export, Module

FEMUR = SOURCE / "pipelines" / "femur" / "simulated-femur.yaml"

# Stands for marrow where its code or its output matters: it keeps its words, and writes and says what the test wants.
FAKE = """#!/bin/sh
printf '%%s\\n' "$@" > "%(folder)s/arguments"
env > "%(folder)s/environment"
while [ "$1" != --out ]; do shift; done
mkdir -p "$2"
cp -r "%(folder)s/made" "$2/outputs"
cat "%(folder)s/says"
exit %(code)d
"""


class Called(Export):
    """What the module makes of its words, of marrow's code and of its events, with a program in marrow's place."""

    @classmethod
    def setUpClass(cls):
        cls.made = cls.shared_folder() / "modules"
        assert marrow("export", "slicer", FEMUR, "--out", cls.made).returncode == 0

    def setUp(self):
        super().setUp()
        shutil.copytree(self.made, self.scratch / "modules")
        self.module = Module(self.scratch / "modules" / "simulated_femur", self.scratch)
        self.target = self.scratch / "target.yaml"
        self.makes(0, "errors/distal/first.json", "errors/distal/final.json", "pose/distal.yaml")

    def makes(self, code, *files, events=()):
        """The program writes these files, says these events, and ends with this code."""
        shutil.rmtree(self.scratch / "made", ignore_errors=True)
        (self.scratch / "made").mkdir()
        outputs = {}
        for name in files:
            self.write("made/" + name, name)
            outputs.setdefault(name.split("/")[0], []).append("outputs/" + name)
        lines = [*events, {"event": "ended", "files": outputs}]
        self.write("says", "".join(json.dumps(line) + "\n" for line in lines))
        self.write("fake", FAKE % {"folder": self.scratch, "code": code}).chmod(0o755)

    def given(self):
        """The words that the program was called with."""
        return self.read("arguments").splitlines()

    def call(self, *words, **environment):
        return self.module.called(words, {"MARROW": str(self.scratch / "fake"), **environment})

    def assert_said(self, code, text, *words, **environment):
        called = self.call(*words, **environment)
        self.assertEqual((called.returncode, called.stderr), (code, "simulated_femur: %s\n" % text))

    def test_words_become_those_of_marrow_run(self):
        words = ["--shape_seed", "4", "--variation=-1e-05", "--fracture_seed", "", "--output_errors", "x.json"]
        of_slicer = {"LD_LIBRARY_PATH": "/slicer/lib", "PYTHONHOME": "/slicer/python", "PYTHONPATH": "/slicer/site"}
        called = self.call(*words, "--item_stage", "final", **of_slicer)
        self.assertEqual((called.returncode, called.stderr), (0, ""))
        given = self.given()
        pipeline = self.module.program.with_name("simulated_femur.yaml")
        self.assertEqual(given[:4], ["run", str(pipeline), "shape_seed=4", "variation=-1e-05"])
        self.assertEqual(given[4:-1], ["--only", "errors", "--json", "--quiet", "--out"])
        self.assertFalse(pathlib.Path(given[-1]).exists())  # the run's folder does not stay
        self.assertEqual(self.read("x.json"), "errors/distal/final.json")
        self.assertNotIn("/slicer/", self.read("environment"))

    def test_booleans_are_always_said_because_slicer_leaves_out_what_is_false(self):
        self.write("part.yaml", PART)
        self.module = self.export(KINDS, "kinds.yaml")
        for words, wanted in ((["--logarithm"], "logarithm=true"), ([], "logarithm=false")):
            self.call(*words, "--run_folder", "run", "--needed", "x")
            self.assertIn(wanted, self.given())
            shutil.rmtree(self.scratch / "run")

    def test_the_folder_of_the_run_stays_if_it_is_named(self):
        called = self.call("--run_folder", "all", "--output_errors", self.target, "--item_stage", "first")
        self.assertEqual((called.returncode, called.stderr), (0, ""))
        self.assertNotIn("--only", self.given())
        self.assertEqual(self.target.read_text(), "errors/distal/first.json")
        self.assertEqual(self.read("all/outputs/pose/distal.yaml"), "pose/distal.yaml")

    def test_marrows_code_is_the_modules(self):
        for code in (0, 1, 2, 3, 130):
            self.makes(code, "errors/distal/final.json")
            self.target.unlink(missing_ok=True)
            called = self.call("--output_errors", self.target)
            self.assertEqual((called.returncode, called.stderr), (code, ""))
            self.assertTrue(self.target.exists())
        for code in (1, 0):
            self.makes(code)
            self.assert_said(1, "the run made nothing for --output_errors", "--output_errors", self.target)

    def test_events_become_what_slicer_reads(self):
        events = [
            {"event": "started", "node": "pose", "item": "a<b"},
            {"event": "progress", "node": "pose", "item": "a<b", "fraction": 0.25, "text": "search"},
            {"event": "started", "node": "pose/inner"},
            {"event": "warning", "node": "pose", "text": "is odd"},
            {"event": "finished", "node": "pose", "item": "a<b", "seconds": 1.5},
            {"event": "verdict", "output": "verdict", "item": "distal", "judgement": "doubtful", "reasons": ["x", "y"]},
        ]
        self.makes(3, "errors/distal/final.json", events=events)
        total = len(yaml.safe_load(FEMUR.read_text())["nodes"]) - 1  # all but the overlay
        self.assertEqual(
            self.call("--output_errors", self.target).stdout,
            "<filter-start>\n<filter-name>pose (a&lt;b)</filter-name>\n"
            "<filter-comment>pose (a&lt;b)</filter-comment>\n</filter-start>\n"
            "<filter-stage-progress>0.250</filter-stage-progress>\n"
            "warning: pose: is odd\n"
            "<filter-progress>%.3f</filter-progress>\n"
            "<filter-end>\n<filter-name>pose (a&lt;b)</filter-name>\n<filter-time>1.500</filter-time>\n</filter-end>\n"
            "verdict (distal): doubtful: x; y\n"
            "<filter-progress>1.000</filter-progress>\n" % (1 / total),
        )

    def test_faults_of_a_call(self):
        errors = ["--output_errors", self.target]
        items = "there are distal/final, distal/first; choose by --item_fragment, --item_stage"
        results = "--output_verdict, --output_pose, --output_errors, --output_overlay, --run_folder"
        for code, text, *words in (
            (2, "there is no parameter '--output_pos'; did you mean '--output_pose'?", "--output_pos", "x.tfm"),
            (2, "there is no parameter 'zzz'; --xml shows all", "zzz"),
            (2, "the parameter '--output_pose' is given without a value", "--output_pose"),
            (2, "no result is asked for; give one of: " + results, "--shape_seed", "2"),
            (2, "--output_pose is a file that ends with .tfm, not pose.h5", "--output_pose", "pose.h5"),
            (1, "--output_errors takes one item, and 2 fit: " + items, *errors),
            (1, "--output_errors takes one item, and none fits: " + items, *errors, "--item_stage", "second"),
        ):
            with self.subTest(text):
                self.assert_said(code, text, *words)
        self.assertFalse(self.target.exists())

    def test_marrow_is_found_where_it_was_else_in_path(self):
        text = self.module.program.read_text()
        self.assertIn('PROGRAM = "%s"' % MARROW, text)
        self.module.program.write_text(text.replace(str(MARROW), "/nowhere/marrow"))
        self.assert_said(
            2,
            "there is no program at /nowhere/marrow, where marrow was when this module was made, and no marrow in "
            "PATH; set the variable MARROW to its path",
            *("--output_errors", self.target),
            MARROW="",
            PATH="/usr/bin:/bin",
        )
        (self.scratch / "fake").rename(self.scratch / "marrow")
        called = self.call("--output_errors", self.target, MARROW="", PATH="%s:/usr/bin:/bin" % self.scratch)
        self.assertEqual(called.returncode, 1, called.stderr)  # it ran: there are two items


if __name__ == "__main__":
    main()
