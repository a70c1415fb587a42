# SPDX-License-Identifier: Apache-2.0
"""A small pipeline in a workbench, for the tests of the pages "Pipeline" and "Results"."""
from bench import BenchTest

PIPELINE = """\
marrow: 1
name: small
inputs:
  level: {type: number, help: height of the fracture}
nodes:
  bone: {uses: simulate.femur}
  fracture: {uses: simulate.fracture, in: {bone: bone}, with: {height_fraction: $level}}
  cameras:   # two views
    uses: camera.carm
    with:
      names: [frontal, lateral]   # as in the clinic
      width_px: 96
      height_px: 96
      pixel_mm: 3
  views: {uses: simulate.fluoroscopy, in: {phantom: fracture, cameras: cameras}}
  edges: {uses: edges.canny, in: {view: views}, with: {noise_high: 5}}  # quick
  truth: {uses: simulate.truth, in: {phantom: fracture}}
outputs: {cameras: cameras, edges: edges, model: truth.models}
"""


class PipelineBench(BenchTest):
    def setUp(self):
        super().setUp()
        self.file = self.folder / "small.yaml"
        self.file.write_text(PIPELINE)
