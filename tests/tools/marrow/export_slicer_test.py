# SPDX-License-Identifier: Apache-2.0
"""marrow export slicer: the description is valid, and the module gives what `marrow run` gives, called as 3D Slicer
calls it (slicer_peer.py). Poses are read back from ITK's text by the test's own reader."""
import itertools
import json
import pathlib
import re
import shutil
import struct

import yaml

from harness import MARROW, SOURCE
from harness.cases import matrix_product
from harness.program import main, marrow
from harness.shipped import inputs_of, shipped
from other_programs import needs, read_mha, vtk
from slicer_peer import KINDS, PART, Export, Module, progress, read_tfm

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
NRRD = """NRRD0004
type: float
dimension: 3
space: left-posterior-superior
sizes: 2 2 2
space directions: (0.5,0,0) (0,0.75,0) (0,0,2)
kinds: domain domain domain
endian: little
encoding: raw
space origin: (-10,20.5,30)

"""
# What becomes of KINDS: name, tag, ends of files, default and channel. Slicer would save the inverse of `numbers`.
PARAMETERS = """ct image .nrrd - input
surface geometry .vtp - input
start transform .tfm - input
numbers file - - input
points pointfile .mrk.json - input
patient directory - - input
below directory - data input
camera file - a.camera.yaml input
offset_hu double - 0.00002 -
frame integer - 3 -
logarithm boolean - true -
coordinates string-enumeration - world -
fragment string - distal -
needed string - - -
output_ct image .mha - output
output_surface geometry .vtp - output
output_start transform .tfm - output
output_numbers transform .tfm - output
output_points pointfile .mrk.json - output
output_patient pointfile .mrk.json - output
output_edges file .png - output
item_fragment string - - -
run_folder directory - - output
"""


class Made(Export):
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

        inputs = {"fracture_seed": "3", "rotation_axial_deg": "-4.5"}
        given = ["%s=%s" % item for item in inputs.items()]
        self.expect(0, "run", "simulated-femur.yaml", *given, "--out", "run", "--quiet")
        pose = yaml.safe_load(self.read("run/outputs/pose/distal.yaml"))["matrix"]
        files = {"output_overlay": "overlay.png", "output_errors": "errors.json"}
        items = {"item_view": "lateral", "item_stage": "final"}
        environment = {"MARROW_CACHE": str(self.scratch / "other-cache")}
        called = module.run(environment, **inputs, **files, **items, output_pose=True)
        self.assertEqual((called.returncode, called.stderr), (0, ""))
        found = read_tfm(module.temporary_file("output_pose"))  # from the world to the CT, as Slicer saves it
        product = matrix_product(pose, found)
        for i, k in itertools.product(range(4), range(4)):
            self.assertAlmostEqual(product[i][k], float(i == k), 9)
        self.assertGreater(abs(pose[0][3]), 1)  # the identity would also be its own inverse

        overlays = map(self.without_recipe, ("overlay.png", "run/outputs/overlay/distal/lateral.png"))
        self.assertEqual(*overlays)
        self.assertEqual(self.read("errors.json"), self.read("run/outputs/errors/distal/final.json"))
        self.assert_progress(called.stdout)
        self.assertRegex(called.stdout, r"(?m)^verdict \(distal\): trusted: ")
        self.assertFalse((self.scratch / "runs").exists())

    def without_recipe(self, picture):
        """The bytes of a picture without its recipe: that of the module makes only the outputs that are asked for."""
        self.expect(0, "recipe", "--remove", picture, "--out", "bare.png")
        return (self.scratch / "bare.png").read_bytes()

    def assert_progress(self, output):
        values = progress(output)
        self.assertEqual(values, sorted(values))
        self.assertEqual(values[-1], 1)
        nodes = len(yaml.safe_load(self.read("simulated-femur.yaml"))["nodes"])
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
        places = {"below": str(self.scratch / "data"), "camera": str(self.scratch / "a.camera.yaml")}
        expected = []
        for line in PARAMETERS.splitlines():
            name, *of_name = ("" if word == "-" else word for word in line.split())
            expected.append([name, *of_name[:2], places.get(name, of_name[2]), of_name[3]])
        found = []
        for name, one in module.parameters.items():
            texts = [one.get("fileExtensions"), one.findtext("default"), one.findtext("channel")]
            found.append([name, one.tag, *(text or "" for text in texts)])
        self.assertEqual(found, expected)
        choices = [one.text for one in module.parameters["coordinates"].findall("element")]
        self.assertEqual(choices, ["ct", "world"])
        self.assertIn(b"<description>Text with &lt;tags&gt; &amp; &quot;quotes&quot;.</description>", module.xml)

    def test_modules_of_all_shipped_pipelines_are_valid(self):
        texts = ("path", "text", "number", "integer", "boolean")
        files = [file for file in shipped() if all(one["type"] in texts for one in inputs_of(file).values())]
        self.assertIn("femur-best.yaml", [file.name for file in files])
        for file in files:
            out = self.scratch / file.parent.name / file.stem
            self.assertEqual(self.expect(0, "export", "slicer", file, "--out", out).stderr, "")
            name = re.sub("[^a-z0-9]", "_", file.stem)
            self.assert_valid((out / (name + ".xml")).read_bytes(), name)
            self.assertEqual(self.expect(0, "check", out / (name + ".yaml")).stderr, "")

    @needs("numpy", "vtk")
    def test_files_of_slicer_go_in_and_come_out(self):
        module = self.export(EXCHANGE)
        values = [-1000, 0, 20, 300, 1200, 1300.5, 7, 8]
        points = [{"label": "a%d" % i, "position": point} for i, point in enumerate(POINTS)]
        markups = {"markups": [{"type": "Fiducial", "coordinateSystem": "LPS", "controlPoints": points}]}
        files = {
            "ct": self.write("ct.nrrd", NRRD.encode() + struct.pack("<8f", *values)),
            "surface": self.write("surface.vtp", VTP),
            "start": self.write("start.tfm", TFM),
            "points": self.write("points.mrk.json", json.dumps(markups)),
        }
        called = module.run(**files, **{"output_" + name: True for name in files})
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


class Refused(Export):
    def test_nothing_is_written_over(self):
        self.export(EXCHANGE)
        modules = self.scratch / "modules"
        kept = lambda: {file: file.read_bytes() for file in modules.iterdir()}
        for name in ("exchange", "exchange.xml", "exchange.yaml"):
            before = kept()
            said = "it exists already, and nothing was written"
            self.refused(said, "export", "slicer", "exported.yaml", "--out", "modules")
            self.assertEqual(kept(), before)
            (modules / name).unlink()

    def test_a_part_names_that_clash_and_a_fault(self):
        pose = "{uses: read.pose, with: {path: %s}}"
        for inputs, node, outputs, said in (
            (
                *("{model: {type: mesh}}", "a: {uses: write.obj, in: {mesh: model}}", "a: a"),
                "its input 'model' is data of type mesh, which only another pipeline can give; export the pipeline "
                "that uses this one",
            ),
            (
                *("{output_a: {type: path}}", "a: " + pose % "$output_a", "a: a"),
                "two inputs or outputs would be the parameter 'output_a' of the module; rename one of them",
            ),
            (
                *("{}", "slicer_a: " + pose % "x.yaml", "a: slicer_a"),
                "the module adds a node 'slicer_a', and the pipeline has one already; rename it",
            ),
            (
                *("{}", "a: " + pose % "x.yaml", "a: a, slicer_a: a"),
                "the module adds an output 'slicer_a', and the pipeline has one already; rename it",
            ),
        ):
            with self.subTest(said):
                self.write("p.yaml", "marrow: 1\ninputs: %s\nnodes: {%s}\noutputs: {%s}\n" % (inputs, node, outputs))
                told = self.expect(2, "export", "slicer", "p.yaml", "--out", "modules").stderr
                self.assertEqual(told, "marrow: error: p.yaml: %s\n" % said)
        faulty = ("marrow: 1\nnodes: {a: {uses: read.poze}}\noutputs: {a: a}\n", 2, 19, "unknown node 'read.poze'")
        self.faults(faulty, command=("export", "slicer", "--out", "modules"))
        self.assertFalse((self.scratch / "modules").exists())


# A module of marrow export slicer, called with a program in marrow's place: its words, events, codes and faults.
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
