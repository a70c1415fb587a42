# SPDX-License-Identifier: Apache-2.0
"""A small run of the pipeline for closed nailing, and an implant from files as a person gives it."""
import yaml

from harness import SOURCE
from harness.cases import metrics
from harness.program import Case, main

PIPELINE = SOURCE / "pipelines" / "guidance" / "nailing.yaml"
SETTINGS = ("bone.resolution_mm=2", "implant.resolution_mm=1", "nail_searched.poses=2000")
OUTPUTS = ("plan", "verdict", "implant", "locking", "drills", "nail_overlay")
READ_BACK = """marrow: 1
nodes:
  implant: {uses: read.implant, with: {holes: out/outputs/implant/holes.yaml, surface: out/outputs/implant/surface.stl}}
outputs: {implant: implant.implant}
"""


class Nailing(Case):
    def yaml(self, name):
        return yaml.safe_load(self.read(name))

    def test_the_holes_are_found_and_planned(self):
        options = [word for setting in SETTINGS for word in ("--set", setting)]
        options += [word for name in OUTPUTS for word in ("--only", name)]
        result = self.expect(0, "run", PIPELINE, "--out", "out", *options)
        errors = metrics(self.scratch / "out/outputs/locking.json")
        print("%(angle_deg).2f degrees, %(offset_mm).3f mm, view %(view_deg).2f degrees" % errors)
        self.assertLess(errors["angle_deg"], 1)
        self.assertLess(errors["offset_mm"], 0.5)
        self.assertLess(errors["view_deg"], 1)
        self.assertIn("nail", result.stdout + result.stderr)
        drills = self.json("out/outputs/plan.json")["drills"]
        self.assertEqual(
            [drill["hole"] for drill in drills], list(self.yaml("out/outputs/implant/holes.yaml")["holes"])
        )
        for drill in drills:
            self.assertAlmostEqual(sum(x * x for x in drill["direction"]), 1, places=9)
        self.assertIn(self.yaml("out/outputs/verdict.yaml")["judgement"], ("trusted", "doubtful"))
        self.an_implant_from_files_is_the_same()

    def an_implant_from_files_is_the_same(self):
        """What was written is read back: the same holes, and a surface that differs by the rounding of STL only."""
        self.write("p.yaml", READ_BACK)
        self.expect(0, "run", "p.yaml", "--out", "again", "--quiet")
        written, read = (self.yaml(out + "/outputs/implant/holes.yaml")["holes"] for out in ("out", "again"))
        self.assertEqual(list(written), list(read))
        for name, hole in written.items():
            for key in ("centre_mm", "axis"):
                for first, second in zip(hole[key], read[name][key]):
                    self.assertAlmostEqual(first, second, places=12)
        # Triangles that are too small for STL's numbers are gone.
        surfaces = (self.scratch / out / "outputs/implant/surface.stl" for out in ("out", "again"))
        triangles, kept = ((path.stat().st_size - 84) / 50 for path in surfaces)
        self.assertGreater(triangles, 10000)
        self.assertLess(abs(kept / triangles - 1), 0.01)


if __name__ == "__main__":
    main()
