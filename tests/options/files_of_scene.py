# SPDX-License-Identifier: Apache-2.0
"""Files for the nodes that read some, written by a pipeline."""
import pathlib

from harness import onnx
from harness.formats import mha, straight
from harness.package import SCRATCH, SOURCE, marrow

PIPELINE = """marrow: 1
nodes:
  cameras:  {uses: camera.carm, with: {width_px: 96, height_px: 96, pixel_mm: 3}}
  bone:     {uses: simulate.femur, with: {resolution_mm: 4}}
  phantom:  {uses: simulate.fracture, in: {bone: bone}}
  views:    {uses: simulate.fluoroscopy, in: {phantom: phantom, cameras: cameras}}
  volume:   {uses: simulate.ct, in: {phantom: phantom}, with: {spacing_mm: [4, 4, 5], range_mm: [0, 250]}}
  case:     {uses: simulate.case, in: {volume: volume, views: views, phantom: phantom}, with: {start: exact}}
  case_parts: {uses: simulate.case_parts, in: {case: case}}
  parts:    {uses: simulate.truth, in: {phantom: phantom}}
  start:    {uses: initial.manual, in: {model: parts.models.distal, start: parts.starts.distal},
    with: {rotation_deg: [1, 2, 3]}}
  nail:     {uses: simulate.nail, with: {resolution_mm: 2}}
  seen:     {uses: simulate.landmarks, in: {phantom: phantom, cameras: cameras}}
  rtk:      {uses: write.rtk, in: {cameras: cameras}, with: {pixel_mm: [3]}}
  matrix:   {uses: write.plastimatch, in: {camera: cameras.frontal}, with: {pixel_mm: [3]}}
  xreg:     {uses: write.xreg, in: {cameras: cameras, landmarks: seen.landmarks.distal}, with: {pixel_mm: [3]}}
  transform: {uses: write.tfm, in: {pose: start}}
  points:   {uses: write.fcsv, in: {landmarks: seen.landmarks.distal}}
  shown:    {uses: simulate.bead_board, with: {board: BOARD, views: 4, width_px: 512, height_px: 512, pixel_mm: 0.6}}
  found:    {uses: camera.bead_board, in: {images: shown.images}, with: {board: BOARD}}
outputs: {case: case, cameras: cameras, model: parts.models.distal, start: start, nail: nail.implant, rtk: rtk,
  matrix: matrix, xreg: xreg, transform: transform, points: points, seeds: case_parts.seeds.distal,
  calibration: found.calibration, landmarks: seen.landmarks.distal, beads: shown.images}
"""


def written():
    """The folder with the pipeline's outputs."""
    folder = SCRATCH / "files"
    if not folder.exists():
        text = PIPELINE.replace("BOARD", str(SOURCE / "pipelines" / "calibration" / "board.yaml"))
        pipeline = SCRATCH / "files.yaml"
        pipeline.write_text(text)
        marrow.Pipeline(pipeline).run(folder=folder)
    return folder / "outputs"


def surface_of(mesh, name, scale=1.0):
    """An OBJ file of a mesh."""
    path = pathlib.Path(SCRATCH / (name + ".obj"))
    lines = ["v %.6f %.6f %.6f" % tuple(scale * point) for point in mesh.vertices_mm]
    lines += ["f %d %d %d" % tuple(triangle + 1) for triangle in mesh.triangles]
    path.write_text("\n".join(lines) + "\n")
    return path


def labels_of(first, second):
    """A label map in which one voxel has each of the two labels."""
    path = pathlib.Path(SCRATCH / ("labels-%d-%d.mha" % (first, second)))
    values = [0] * 125
    values[62], values[63] = first, second
    path.write_bytes(mha(straight((5, 5, 5)), values))
    return str(path)


NETWORK = """marrow-network: 1
name: written
help: a network of one convolution
version: 1.0.0
licence: Apache-2.0
trained: {data: nothing, good_for: tests, not_for: anything else}
input:
  values: line_integrals
  bone: bright
  pixel_mm: 4
  normalise: {method: percentiles, low: 1, high: 99}
  size_px: [32, 32]
  overlap_px: 8
outputs:
  edge_strength: {layer: maps, activation: sigmoid}
"""


def network(least=0.5, classes=()):
    """The description of a network that sees a border, or the classes in turn, the more the denser the surroundings."""
    path = pathlib.Path(SCRATCH / ("network-%s-%s.yaml" % (least, "-".join(classes))))
    text, count = NETWORK, max(1, len(classes))
    if classes:
        text = text.replace("edge_strength: {layer: maps,", "classes: {layer: maps, names: [%s]," % ", ".join(classes))
    weights = [[[[(1 + k) / 3] * 3] * 3] for k in range(count)]
    layer, tensors = onnx.convolution("image", "maps", weights, [-3 * least * (1 + k) - k for k in range(count)])
    path.write_text(text)
    path.with_suffix(".onnx").write_bytes(onnx.model([layer], tensors, {"maps": (count, 32, 32)}, 32, 32))
    return str(path)


def slices_network(least_hu=300):
    """The description of a network of two classes of a CT: bone is brighter than this, cortex brighter still."""
    path = pathlib.Path(SCRATCH / ("slices-%d.yaml" % least_hu))
    layer, tensors = onnx.convolution("image", "maps", [[[[10.0]]]] * 2, [-least_hu / 100, -least_hu / 100 - 3])
    path.with_suffix(".onnx").write_bytes(onnx.model([layer], tensors, {"maps": (2, 32, 32)}, 32, 32))
    text = NETWORK.replace("values: line_integrals", "values: hounsfield").replace("pixel_mm: 4", "pixel_px: 1")
    text = text.replace("{method: percentiles, low: 1, high: 99}", "{method: fixed, low: 0, high: 1000}")
    path.write_text(text.replace("edge_strength: {layer: maps,", "classes: {layer: maps, names: [bone, cortex],"))
    return str(path)


def points_network(name, names, kernel=(0.6, 0, 0)):
    """A network whose heat map of each point is the bone, moved to one side."""
    path = pathlib.Path(SCRATCH / (name + ".yaml"))
    weights = [[[[0, 0, 0], list(kernel), [0, 0, 0]]] for _ in names]
    layer, tensors = onnx.convolution("image", "points", weights, [0] * len(names))
    path.with_suffix(".onnx").write_bytes(onnx.model([layer], tensors, {"points": (len(names), 64, 64)}, 64, 64))
    text = NETWORK.replace("pixel_mm: 4", "pixel_mm: 2").replace("[32, 32]", "[64, 64]").replace("px: 8", "px: 16")
    heat_maps = "heat_maps: {layer: points, names: [%s], activation: none}" % ", ".join(names)
    path.write_text(text.replace("edge_strength: {layer: maps, activation: sigmoid}", heat_maps))
    return str(path)
