# SPDX-License-Identifier: Apache-2.0
"""A small run of the pipeline for closed nailing, and an implant from files as a person gives it."""
import json

import yaml

from cases import metrics
from marrow_cli import SOURCE, Case, main, marrow

PIPELINE = SOURCE / "pipelines" / "nailing.yaml"


class Nailing(Case):
    def test_the_holes_are_found_and_planned(self):
        out = self.scratch / "run"
        result = marrow(
            "run",
            PIPELINE,
            "--out",
            out,
            "--set",
            "femur.resolution_mm=2",
            "--set",
            "nail_searched.poses=2000",
            "--only",
            "plan,verdict,implant,locking,hole_errors,drills,nail_overlay",
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
        self.an_implant_from_files_is_the_same(out / "outputs" / "implant", plan)

    def an_implant_from_files_is_the_same(self, folder, plan):
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
        for name in ("holes.yaml", "surface.stl"):
            written = (self.scratch / "again" / "outputs" / "implant" / name).read_bytes()
            self.assertEqual(len(written), len((folder / name).read_bytes()), name)
        self.assertEqual(
            yaml.safe_load((self.scratch / "again" / "outputs" / "implant" / "holes.yaml").read_text()).keys(),
            yaml.safe_load((folder / "holes.yaml").read_text()).keys(),
        )


if __name__ == "__main__":
    main()
