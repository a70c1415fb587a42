# SPDX-License-Identifier: Apache-2.0
"""A script that has set a locale with decimal commas writes and reads the same numbers, and the same messages."""
import locale
import os
import subprocess

from harness.package import Case, main, marrow

QUARTER = "0,-1,0,1.5,1,0,0,-2.5,0,0,1,300.25,0,0,0,1\n"
PIPELINE = """marrow: 1
inputs:
  track: {type: path, help: a bone's poses}
  points: {type: path, help: points in the CT}
nodes:
  way: {uses: read.tra, with: {path: $track}}
  points: {uses: read.landmarks, with: {path: $points}}
  list: {uses: write.fcsv, in: {landmarks: points}}
outputs:
  way: way.track
  poses: way.poses
  points: list
"""
POINTS = """marrow-landmarks: 1
fragments:
  distal: {points: {notch: [1.5, -18.25, 12.125]}}
"""


class Locale(Case):
    def setUp(self):
        super().setUp()
        command = ["localedef", "-i", "de_DE", "-f", "UTF-8", str(self.scratch / "de_DE.UTF-8")]
        made = subprocess.run(command, capture_output=True)
        os.environ["LOCPATH"] = str(self.scratch)
        self.addCleanup(os.environ.pop, "LOCPATH")
        self.is_there = made.returncode == 0

    def set_decimal_commas(self):
        try:
            locale.setlocale(locale.LC_NUMERIC, "de_DE.UTF-8")
        except locale.Error:
            self.is_there = False
        self.addCleanup(locale.setlocale, locale.LC_NUMERIC, "C")
        if not self.is_there or locale.localeconv()["decimal_point"] != ",":
            self.skipTest("no locale with decimal commas can be made here (localedef, de_DE)")

    def test_files_have_the_same_bytes(self):
        pipeline = marrow.Pipeline(
            self.write("p.yaml", PIPELINE),
            track=self.write("a.tra", QUARTER + "NaN," * 15 + "NaN\n" + QUARTER),
            points=self.write("points.yaml", POINTS),
        )
        files = {}
        for name in ("before", "after"):
            if name == "after":
                self.set_decimal_commas()
            pipeline.run(folder=self.scratch / name, keep=False)
            outputs = self.scratch / name / "outputs"
            files[name] = {p.relative_to(outputs): p.read_bytes() for p in outputs.rglob("*") if p.is_file()}
        self.assertGreater(len(files["before"]), 3)
        self.assertEqual(files["after"], files["before"])
        self.assertIn(b"0,-1,0,1.5,1,0,0,-2.5,", b"".join(files["after"].values()))

    def test_messages_are_the_same(self):
        faulty = self.write("a.tra", "2.5,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1\n")
        said = []
        for with_commas in (False, True):
            if with_commas:
                self.set_decimal_commas()
            with self.assertRaises(marrow.Error) as caught:
                marrow.EdgeMap([[10.5, 2, 0, 1, 5]], width_px=10, height_px=10)
            said.append(str(caught.exception))
            with self.assertRaises(marrow.Error) as caught:
                marrow.read.tra(path=faulty)
            said.append(str(caught.exception))
        self.assertEqual(said[2:], said[:2])


if __name__ == "__main__":
    main()
