# SPDX-License-Identifier: Apache-2.0
"""marrow export slicer: the description is valid, and the module gives what `marrow run` gives, called as 3D Slicer
calls it (slicer_peer.py). Poses are read back from ITK's text by the test's own reader."""
import itertools
import json
import pathlib
import re
import struct

import yaml
from harness import SOURCE
from harness.cases import matrix_product
from harness.program import main
from harness.shipped import inputs_of, shipped
from other_programs import needs, read_mha, vtk
from slicer_peer import KINDS, PART, Export, progress, read_tfm

SCHEMA = pathlib.Path(__file__).parent / "slicer_module.rng"
COARSE = ("spacing_mm: [1, 1, 1.2]", "spacing_mm: [1.5, 1.5, 1.5]")

EXCHANGE = """marrow: 1
name: exchange
inputs: {ct: {type: path}, surface: {type: path}, start: {type: path}, points: {type: path}}
nodes:
  ct: {uses: read.volume, with: {path: $ct}}
  surface: {uses: read.mesh, with: {path: $surface}}
  start: {uses: read.pose, with: {path: $start}}
  points: {uses: read.landmarks, with: {path: $points}}
outputs: {ct: ct, surface: surface, start: start, points: points}
"""
TFM = """#Insight Transform File V1.0
#Transform 0
Transform: AffineTransform_double_3_3
Parameters: 0 -1 0 1 0 0 0 0 1 10 20.5 -30
FixedParameters: 1 2 3
"""
POINTS = [[-195.99323699260385, 6.125348335657372, -90.18842609112076], [150.5, 71.25, -79.875]]
CORNERS = [(0, 0, 0), (20, 0, 0), (0, 30, 0), (0, 0, 40)]
VTP = """<?xml version="1.0"?>
<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian"><PolyData>
<Piece NumberOfPoints="4" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="4">
<Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">0 0 0 20 0 0 0 30 0 0 0 40</DataArray></Points>
<Polys><DataArray type="Int64" Name="connectivity" format="ascii">0 2 1 0 1 3 0 3 2 1 2 3</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">3 6 9 12</DataArray></Polys>
</Piece></PolyData></VTKFile>
"""


class Made(Export):
    def refused(self, *arguments):
        result = self.marrow("export", "slicer", *arguments)
        self.assertEqual(result.returncode, 2, result.stdout)
        return result.stderr.strip().removeprefix("marrow: error: ")

    def assert_valid(self, description, name):
        try:
            from lxml import etree
        except ImportError:
            self.skipTest("not installed here: python3-lxml")
        schema = etree.RelaxNG(etree.parse(str(SCHEMA)))
        self.assertTrue(schema.validate(etree.fromstring(description)), "%s: %s" % (name, schema.error_log))


class Simulated(Made):
    def test_the_module_gives_the_pose_of_marrow_run(self):
        text = (SOURCE / "pipelines" / "femur" / "simulated-femur.yaml").read_text()
        self.assertEqual(text.count(COARSE[0]), 1)
        module = self.export(text.replace(*COARSE), "simulated-femur.yaml")
        self.assertEqual(module.program.name, "simulated_femur")
        self.assert_valid(module.xml, module.program.name)

        inputs = ("fracture_seed=3", "rotation_axial_deg=-4.5")
        ran = self.marrow("run", "simulated-femur.yaml", *inputs, "--out", "run", "--quiet")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        pose = yaml.safe_load((self.scratch / "run/outputs/pose/distal.yaml").read_text())["matrix"]

        called = module.run(
            {"MARROW_CACHE": str(self.scratch / "other-cache")},
            fracture_seed="3",
            rotation_axial_deg="-4.5",
            output_pose=True,
            output_overlay=self.scratch / "overlay.png",
            output_errors=self.scratch / "errors.json",
            item_view="lateral",
            item_stage="final",
        )
        self.assertEqual((called.returncode, called.stderr), (0, ""))
        found = read_tfm(module.temporary_file("output_pose"))  # from the world to the CT, as Slicer saves it
        product = matrix_product(pose, found)
        for i, k in itertools.product(range(4), range(4)):
            self.assertAlmostEqual(product[i][k], float(i == k), 9)
        self.assertGreater(abs(pose[0][3]), 1)  # the identity would also be its own inverse

        outputs = self.scratch / "run" / "outputs"
        self.assertEqual(
            self.without_recipe(self.scratch / "overlay.png"),
            self.without_recipe(outputs / "overlay/distal/lateral.png"),
        )
        self.assertEqual(
            (self.scratch / "errors.json").read_bytes(), (outputs / "errors/distal/final.json").read_bytes()
        )
        self.assert_progress(called.stdout)
        self.assertRegex(called.stdout, r"(?m)^verdict \(distal\): trusted: ")
        self.assertFalse((self.scratch / "runs").exists())

    def without_recipe(self, picture):
        """The bytes of a picture without its recipe: that of the module makes only the outputs that are asked for."""
        result = self.marrow("recipe", "--remove", picture, "--out", "bare.png")
        self.assertEqual(result.returncode, 0, result.stderr)
        return (self.scratch / "bare.png").read_bytes()

    def assert_progress(self, output):
        values = progress(output)
        self.assertEqual(values, sorted(values))
        self.assertEqual(values[-1], 1)
        nodes = len(yaml.safe_load((self.scratch / "simulated-femur.yaml").read_text())["nodes"])
        self.assertEqual(len(set(values)), nodes + 1)  # and the writer; calls of one node for two views are one step
        started, ended = output.count("<filter-start>"), output.count("<filter-end>")
        self.assertEqual(started, ended)
        self.assertGreater(started, nodes)
        self.assertIn("<filter-start>\n<filter-name>edges (frontal)</filter-name>\n", output)


class Kinds(Made):
    def test_inputs_become_what_their_nodes_read(self):
        self.write("part.yaml", PART)
        module = self.export(KINDS)
        self.assert_valid(module.xml, module.program.name)
        self.assertEqual(module.program.name, "all_kinds")
        said = {
            name: (one.tag, one.get("fileExtensions"), one.findtext("default"), one.findtext("channel"))
            for name, one in module.parameters.items()
        }
        here = self.scratch
        self.assertEqual(
            said,
            {
                "ct": ("image", ".nrrd", None, "input"),
                "surface": ("geometry", ".vtp", None, "input"),
                "start": ("transform", ".tfm", None, "input"),
                "numbers": ("file", None, None, "input"),  # Slicer would save the inverse
                "points": ("pointfile", ".mrk.json", None, "input"),
                "patient": ("directory", None, None, "input"),
                "below": ("directory", None, str(here / "data"), "input"),
                "camera": ("file", None, str(here / "a.camera.yaml"), "input"),
                "offset_hu": ("double", None, "0.00002", None),
                "frame": ("integer", None, "3", None),
                "logarithm": ("boolean", None, "true", None),
                "coordinates": ("string-enumeration", None, "world", None),
                "fragment": ("string", None, "distal", None),
                "needed": ("string", None, None, None),
                "output_ct": ("image", ".mha", None, "output"),
                "output_surface": ("geometry", ".vtp", None, "output"),
                "output_start": ("transform", ".tfm", None, "output"),
                "output_numbers": ("transform", ".tfm", None, "output"),
                "output_points": ("pointfile", ".mrk.json", None, "output"),
                "output_patient": ("pointfile", ".mrk.json", None, "output"),
                "output_edges": ("file", ".png", None, "output"),
                "item_fragment": ("string", None, None, None),
                "run_folder": ("directory", None, None, "output"),
            },
        )
        choices = [one.text for one in module.parameters["coordinates"].findall("element")]
        self.assertEqual(choices, ["ct", "world"])
        self.assertIn(b"<description>Text with &lt;tags&gt; &amp; &quot;quotes&quot;.</description>", module.xml)

    def test_modules_of_all_shipped_pipelines_are_valid(self):
        texts = ("path", "text", "number", "integer", "boolean")
        files = [file for file in shipped() if all(one["type"] in texts for one in inputs_of(file).values())]
        self.assertIn("femur-best.yaml", [file.name for file in files])
        for file in files:
            out = self.scratch / file.parent.name / file.stem
            result = self.marrow("export", "slicer", file, "--out", out)
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            name = re.sub("[^a-z0-9]", "_", file.stem)
            self.assert_valid((out / (name + ".xml")).read_bytes(), name)
            result = self.marrow("check", out / (name + ".yaml"))
            self.assertEqual((result.returncode, result.stderr), (0, ""))

    @needs("numpy", "vtk")
    def test_files_of_slicer_go_in_and_come_out(self):
        module = self.export(EXCHANGE)
        header = (
            "NRRD0004\ntype: float\ndimension: 3\nspace: left-posterior-superior\nsizes: 2 2 2\n"
            "space directions: (0.5,0,0) (0,0.75,0) (0,0,2)\nkinds: domain domain domain\nendian: little\n"
            "encoding: raw\nspace origin: (-10,20.5,30)\n\n"
        )
        values = [-1000, 0, 20, 300, 1200, 1300.5, 7, 8]
        (self.scratch / "ct.nrrd").write_bytes(header.encode() + struct.pack("<8f", *values))
        self.write("surface.vtp", VTP)
        self.write("start.tfm", TFM)
        points = [{"label": "a%d" % i, "position": point} for i, point in enumerate(POINTS)]
        markups = {"markups": [{"type": "Fiducial", "coordinateSystem": "LPS", "controlPoints": points}]}
        self.write("points.mrk.json", json.dumps(markups))
        called = module.run(
            ct=self.scratch / "ct.nrrd",
            surface=self.scratch / "surface.vtp",
            start=self.scratch / "start.tfm",
            points=self.scratch / "points.mrk.json",
            output_ct=True,
            output_surface=True,
            output_start=True,
            output_points=True,
        )
        self.assertEqual((called.returncode, called.stderr), (0, ""))
        found, keys = read_mha(module.temporary_file("output_ct"))
        self.assertEqual(found.flatten().tolist(), values)
        self.assertEqual([float(n) for n in keys["Offset"].split()], [-10, 20.5, 30])
        self.assertEqual([float(n) for n in keys["ElementSpacing"].split()], [0.5, 0.75, 2])
        reader = vtk.vtkXMLPolyDataReader()
        reader.SetFileName(str(module.temporary_file("output_surface")))
        reader.Update()
        surface = reader.GetOutput()
        self.assertEqual([surface.GetPoint(i) for i in range(surface.GetNumberOfPoints())], CORNERS)
        self.assertEqual(surface.GetFieldData().GetAbstractArray("SPACE").GetValue(0), "LPS")
        found = read_tfm(module.temporary_file("output_start"))
        # About (1, 2, 3): y = R (x - c) + c + t, by hand.
        for row, wanted in zip(found, [[0, -1, 0, 13], [1, 0, 0, 21.5], [0, 0, 1, -30], [0, 0, 0, 1]]):
            for value, exact in zip(row, wanted):
                self.assertAlmostEqual(value, exact, 12)
        written = json.loads(module.temporary_file("output_points").read_text())["markups"][0]
        self.assertEqual(written["coordinateSystem"], "LPS")
        self.assertEqual([one["position"] for one in written["controlPoints"]], POINTS)


class Refused(Made):
    def test_nothing_is_written_over(self):
        self.export(EXCHANGE)
        for name in ("exchange", "exchange.xml", "exchange.yaml"):
            kept = {file: file.read_bytes() for file in (self.scratch / "modules").iterdir()}
            self.assertIn(
                "it exists already, and nothing was written", self.refused("exported.yaml", "--out", "modules")
            )
            self.assertEqual({file: file.read_bytes() for file in (self.scratch / "modules").iterdir()}, kept)
            (self.scratch / "modules" / name).unlink()

    def test_a_part_and_names_that_clash(self):
        part = "marrow: 1\ninputs: {model: {type: mesh}}\nnodes: {obj: {uses: write.obj, in: {mesh: model}}}\n"
        self.write("part.yaml", part + "outputs: {obj: obj}\n")
        self.assertEqual(
            self.refused("part.yaml", "--out", "modules"),
            "part.yaml: its input 'model' is data of type mesh, which only another pipeline can give; export the "
            "pipeline that uses this one",
        )
        text = (
            "marrow: 1\ninputs: {output_it: {type: path}}\nnodes: {it: {uses: read.pose, with: {path: $output_it}}}\n"
        )
        self.write("same.yaml", text + "outputs: {it: it}\n")
        self.assertEqual(
            self.refused("same.yaml", "--out", "modules"),
            "same.yaml: two inputs or outputs would be the parameter 'output_it' of the module; rename one of them",
        )
        nodes = "marrow: 1\nnodes: {slicer_a: {uses: read.pose, with: {path: x.yaml}}}\n"
        self.write("node.yaml", nodes + "outputs: {a: slicer_a}\n")
        self.assertEqual(
            self.refused("node.yaml", "--out", "modules"),
            "node.yaml: the module adds a node 'slicer_a', and the pipeline has one already; rename it",
        )
        nodes = "marrow: 1\nnodes: {a: {uses: read.pose, with: {path: x.yaml}}}\n"
        self.write("output.yaml", nodes + "outputs: {a: a, slicer_a: a}\n")
        self.assertEqual(
            self.refused("output.yaml", "--out", "modules"),
            "output.yaml: the module adds an output 'slicer_a', and the pipeline has one already; rename it",
        )
        self.assertFalse((self.scratch / "modules").exists())

    def test_a_faulty_pipeline(self):
        self.write("faulty.yaml", "marrow: 1\nnodes: {a: {uses: read.poze}}\noutputs: {a: a}\n")
        self.assertIn("faulty.yaml:2:19: error: unknown node 'read.poze'", self.refused("faulty.yaml", "--out", "m"))
        self.assertFalse((self.scratch / "m").exists())


if __name__ == "__main__":
    main()
