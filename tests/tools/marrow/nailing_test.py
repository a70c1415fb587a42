# SPDX-License-Identifier: Apache-2.0
"""A small run of the pipeline for closed nailing, and an implant from files as a person gives it."""
import json

import yaml

from harness.cases import metrics
from harness import SOURCE
from harness.program import Case, main, marrow

PIPELINE = SOURCE / "pipelines" / "guidance" / "nailing.yaml"


class Nailing(Case):
    def test_the_holes_are_found_and_planned(self):
        out = self.scratch / "run"
        result = marrow(
            "run",
            PIPELINE,
            "--out",
            out,
            "--set",
            "bone.resolution_mm=2",
            "--set",
            "implant.resolution_mm=1",
            "--set",
            "nail_searched.poses=2000",
            *(
                word
                for name in ("plan", "verdict", "implant", "locking", "drills", "nail_overlay")
                for word in ("--only", name)
            ),
        )
        self.assertEqual(result.returncode, 0, result.stderr)
        errors = metrics(out / "outputs" / "locking.json")
        print("%(angle_deg).2f degrees, %(offset_mm).3f mm, view %(view_deg).2f degrees" % errors)
        self.assertLess(errors["angle_deg"], 1)
        self.assertLess(errors["offset_mm"], 0.5)
        self.assertLess(errors["view_deg"], 1)
        self.assertIn("nail", result.stdout + result.stderr)
        plan = json.loads((out / "outputs" / "plan.json").read_text())
        holes = yaml.safe_load((out / "outputs" / "implant" / "holes.yaml").read_text())["holes"]
        self.assertEqual([drill["hole"] for drill in plan["drills"]], list(holes))
        for drill in plan["drills"]:
            self.assertAlmostEqual(sum(x * x for x in drill["direction"]), 1, places=9)
        verdict = yaml.safe_load((out / "outputs" / "verdict.yaml").read_text())
        self.assertIn(verdict["judgement"], ("trusted", "doubtful"))
        self.an_implant_from_files_is_the_same(out / "outputs" / "implant")

    def an_implant_from_files_is_the_same(self, folder):
        """What was written is read back: the same holes, and a surface that differs by the rounding of STL only."""
        self.write(
            "p.yaml",
            """marrow: 1
nodes:
  implant: {uses: read.implant, with: {holes: %s/holes.yaml, surface: %s/surface.stl}}
outputs: {implant: implant.implant}
"""
            % (folder, folder),
        )
        result = marrow("run", self.scratch / "p.yaml", "--out", self.scratch / "again", "--quiet")
        self.assertEqual(result.returncode, 0, result.stderr)
        again = self.scratch / "again" / "outputs" / "implant"
        written, read = (yaml.safe_load((path / "holes.yaml").read_text())["holes"] for path in (folder, again))
        self.assertEqual(list(written), list(read))
        for name, hole in written.items():
            for key in ("centre_mm", "axis"):
                for first, second in zip(hole[key], read[name][key]):
                    self.assertAlmostEqual(first, second, places=12)
        # Triangles that are too small for STL's numbers are gone.
        triangles, kept = ((path.stat().st_size - 84) / 50 for path in (folder / "surface.stl", again / "surface.stl"))
        self.assertGreater(triangles, 10000)
        self.assertLess(abs(kept / triangles - 1), 0.01)


if __name__ == "__main__":
    main()
