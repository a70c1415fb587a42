# SPDX-License-Identifier: Apache-2.0
"""Outputs that a run does not make because its data lack something: the run ends well, and says which and why."""
import json
import shutil

import yaml

from harness import formats
from harness.program import Case, main

CAMERA = {"source_to_detector_mm": 1000, "source_to_isocentre_mm": 600, "pixel_mm": 1, "alpha_deg": 0, "beta_deg": 0}
PIPELINE = """marrow: 1
inputs: {case: {type: path}}
nodes:
  case:    {uses: read.case, with: {path: $case}}
  bone:    {uses: segment.level_set, in: {volume: case.ct, seeds: case.seeds}}
  model:   {uses: mesh.marching_cubes, in: {field: bone}}
  display: {uses: mesh.simplify, in: {mesh: model}}
outputs: {bone: bone, model: model, views: case.views, display: display}
"""
REASON = "node 'bone' (segment.level_set) needs 'seeds', which node 'case' (read.case) does not give"


class Lacking(Case):
    def setUp(self):
        super().setUp()
        grid = formats.straight((8, 8, 8))
        inside = [int(all(2 <= k < 6 for k in (i % 8, i // 8 % 8, i // 64))) for i in range(512)]
        self.write("case/labels.mha", formats.mha(grid, inside))
        self.write("case/ct.mha", formats.mha(grid, [2000 * one - 1000 for one in inside]))
        self.write("case/front.png", formats.png(64, 64, [128] * 4096))
        self.write("p.yaml", PIPELINE)

    def run_it(self, *arguments, **case):
        """Runs the pipeline on a case of one view and one bone, which has this besides."""
        camera = {"width_px": 64, "height_px": 64, "c_arm": CAMERA}
        views = [{"name": "frontal", "image": "front.png", "camera": camera}]
        self.write("case/case.yaml", yaml.safe_dump({"marrow-case": 1, "ct": "ct.mha", "views": views, **case}))
        return self.printed("run", "p.yaml", "case=case", "--out", "out", *arguments)

    def test_outputs_behind_the_lacking_value_are_named_with_the_reason(self):
        labelled = {"labels": "labels.mha", "fragments": {"bone": {"label": 1}}}
        self.assertIn("\n  model, display: not there because %s\n" % REASON, self.run_it(**labelled))
        shutil.rmtree(self.scratch / "out")
        end = json.loads(self.run_it("--json", **labelled).splitlines()[-1])
        self.assertEqual(end["absent"], {"model": REASON, "display": REASON})

    def test_nothing_is_said_if_nothing_lacks(self):
        self.assertNotIn("not there", self.run_it(fragments={"bone": {"seeds": [[3, 3, 3]]}}))


if __name__ == "__main__":
    main()
