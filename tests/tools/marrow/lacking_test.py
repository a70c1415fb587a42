#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Outputs that a run does not make because its data lack something: the run ends well, and says which and why."""
import json

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
        case = self.scratch / "case"
        case.mkdir()
        grid = formats.straight((8, 8, 8))
        inside = [int(all(2 <= k < 6 for k in (i % 8, i // 8 % 8, i // 64))) for i in range(512)]
        (case / "labels.mha").write_bytes(formats.mha(grid, inside))
        (case / "ct.mha").write_bytes(formats.mha(grid, [2000 * one - 1000 for one in inside]))
        (case / "front.png").write_bytes(formats.png(64, 64, [128] * 4096))
        camera = {"width_px": 64, "height_px": 64, "c_arm": CAMERA}
        views = [{"name": "frontal", "image": "front.png", "camera": camera}]
        self.write_case(labels="labels.mha", views=views, fragments={"bone": {"label": 1}})
        self.seeded = {"views": views, "fragments": {"bone": {"seeds": [[3, 3, 3]]}}}
        self.write("p.yaml", PIPELINE)

    def write_case(self, **case):
        self.write("case/case.yaml", yaml.safe_dump({"marrow-case": 1, "ct": "ct.mha", **case}))

    def run_it(self, *arguments):
        result = self.marrow("run", "p.yaml", "case=case", "--out", "out", *arguments)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        return result.stdout

    def test_outputs_behind_the_lacking_value_are_named_with_the_reason(self):
        self.assertIn("\n  model, display: not there because %s\n" % REASON, self.run_it())

    def test_as_json(self):
        end = json.loads(self.run_it("--json").splitlines()[-1])
        self.assertEqual(end["absent"], {"model": REASON, "display": REASON})

    def test_nothing_is_said_if_nothing_lacks(self):
        self.write_case(**self.seeded)
        self.assertNotIn("not there", self.run_it())


if __name__ == "__main__":
    main()
