# SPDX-License-Identifier: Apache-2.0
"""Files of other programs in pipelines: read in a process of their own, written as outputs, and understood by those
programs (plastimatch, VTK, h5py). What is not installed is skipped, and said so."""
import re
import shutil
import subprocess

from harness import SOURCE
from harness.program import Case, main
from other_programs import Reading, h5py, needs, numpy, read_mha, vtk

XREG = SOURCE / "tests/plugins/toolbox/exchange/data/xreg-by-h5py.h5"
POSE = (
    "marrow-pose: 1\ntarget: world\nsource: ct\n"
    "rotation: [[0, -1, 0], [1, 0, 0], [0, 0, 1]]\ntranslation_mm: [1, 2, 3]\n"
)
LABELLED = ",0,0,0,1,1,1,0,head,,\n"
TRANSFORM = (
    "#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\nParameters: %s\n"
    "FixedParameters: 0 0 0\n"
)


class Formats(Case):
    def written(self, nodes, outputs):
        """The folder of the outputs of a pipeline."""
        self.write("p.yaml", "marrow: 1\nnodes:\n" + nodes + "outputs: {" + outputs + "}\n")
        shutil.rmtree(self.scratch / "out", ignore_errors=True)
        self.expect(0, "run", "p.yaml", "--out", "out", "--quiet")
        return self.scratch / "out/outputs"


class Pipelines(Formats):
    def test_the_pipelines_of_the_documentation_run(self):
        text = (SOURCE / "docs/formats.md").read_text()
        (exchange,) = (one for one in re.findall(r"```yaml\n(.*?)```", text, re.S) if "\nname: exchange\n" in one)
        heading = "# Markups fiducial file version = 4.11\n# CoordinateSystem = RAS\n"
        self.write("points.fcsv", heading + "1,1,2,3" + LABELLED)
        moved = TRANSFORM % "1 0 0 0 1 0 0 0 1 -12 14 -6"
        self.write("pose.tfm", moved)
        self.write("exchange.yaml", exchange)
        self.expect(0, "run", "exchange.yaml", "points=points.fcsv", "pose=pose.tfm", "--out", "out")
        self.assertIn('"position": [', self.read("out/outputs/points/distal.mrk.json"))
        self.assertEqual(self.read("out/outputs/pose.tfm"), moved)

    # The message of a crash or of a lack of memory would be another one.
    def test_a_damaged_file_is_refused_by_its_name(self):
        nodes = {
            **{"a.mrk.json": "read.landmarks", "a.fcsv": "read.seeds", "a.tfm": "read.pose", "a.obj": "read.mesh"},
            **{"a.vtp": "read.mesh", "a.xml": "read.camera", "a.h5": "read.camera"},
        }
        pipeline = "marrow: 1\nnodes:\n"
        for i, (name, node) in enumerate(nodes.items()):
            self.write(name, "damaged\n")
            pipeline += "  n%d: {uses: %s, with: {path: %s}, may_fail: true}\n" % (i, node, name)
        outputs = ", ".join("n%d: n%d" % (i, i) for i in range(len(nodes)))
        self.write("p.yaml", pipeline + "outputs: {%s}\n" % outputs)
        self.expect(0, "run", "p.yaml", "--out", "out", "--quiet")
        for i, name in enumerate(nodes):
            self.assertRegex(self.nodes()["n%d" % i]["reason"], re.escape(name) + "[:0-9]*: ")


@needs("numpy")
class Plastimatch(Formats):
    # plastimatch resamples by ITK. The transform that write.tfm gives by default moves the CT's content by the pose.
    def test_a_ball_is_warped_to_where_the_pose_moves_it(self):
        if not shutil.which("plastimatch"):
            self.skipTest("not installed here: plastimatch")
        self.write("pose.yaml", POSE)
        outputs = self.written(
            "  pose: {uses: read.pose, with: {path: pose.yaml}}\n  tfm: {uses: write.tfm, in: {pose: pose}}\n", "t: tfm"
        )
        ball, warped = self.scratch / "ball.mha", self.scratch / "warped.mha"
        for arguments in (
            "synth --pattern sphere --dim 100 --spacing 0.5 --radius 8 --background -1000 --foreground 1000".split()
            + ["--output", ball, "--origin", "-24.75 -24.75 -24.75", "--center", "10 -6 8"],
            ["warp", "--input", ball, "--xf", outputs / "t.tfm", "--output-img", warped, "--default-value", "-1000"],
        ):
            made = subprocess.run(["plastimatch", *map(str, arguments)], capture_output=True, text=True)
            self.assertEqual(made.returncode, 0, made.stdout + made.stderr)
        values, keys = read_mha(warped)
        inside = numpy.argwhere(values > 0)[:, ::-1]
        centre = inside.mean(axis=0) * 0.5 + numpy.array(keys["Offset"].split(), float)
        # A quarter turn takes (10, -6, 8) to (6, 10, 8), then comes (1, 2, 3).
        self.assertLess(numpy.abs(centre - [7, 12, 11]).max(), 0.1)


@needs("vtk", "numpy")
class Vtk(Formats):
    def test_vtk_reads_what_is_written(self):
        self.write("a.obj", "v 0 0 0\nv 10 0 0\nv 0 10 0\nv 0 0 10\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
        outputs = self.written(
            "  mesh: {uses: read.mesh, with: {path: a.obj}}\n  obj: {uses: write.obj, in: {mesh: mesh}}\n"
            "  vtp: {uses: write.vtp, in: {mesh: mesh}}\n",
            "a: obj, b: vtp",
        )
        for reader, file in ((vtk.vtkOBJReader(), "a.obj"), (vtk.vtkXMLPolyDataReader(), "b.vtp")):
            with self.subTest(file):
                reader.SetFileName(str(outputs / file))
                reader.Update()
                mass = vtk.vtkMassProperties()
                mass.SetInputData(reader.GetOutput())
                self.assertEqual(reader.GetOutput().GetNumberOfPoints(), 4)
                self.assertAlmostEqual(mass.GetVolume(), 1000 / 6, places=3)


@needs("h5py")
class Xreg(Formats, Reading):
    # xReg takes whole numbers as unsigned long, a text of fixed length, and points as matrices of one column.
    def test_the_layout_that_xreg_expects(self):
        self.write(
            "l.yaml",
            "marrow-landmarks: 1\nfragments: {a: {points: {head: [1, 2, 3]}, seen: {frontal: {head: [7, 8.5]}}}}\n",
        )
        outputs = self.written(
            "  cameras: {uses: camera.carm}\n  marks: {uses: read.landmarks, with: {path: l.yaml}}\n"
            "  xreg: {uses: write.xreg, in: {cameras: cameras, landmarks: marks}, with: {pixel_mm: [0.586]}}\n",
            "x: xreg",
        )
        with h5py.File(outputs / "x" / "a.h5") as file:
            self.assertEqual(file["num-projs"][()], 2)
            self.assertEqual(file["num-projs"].dtype, "uint64")
            camera = file["proj-001/cam"]
            self.assertEqual(camera["num-rows"][()], 512)
            self.assertEqual(camera["cam-coord-frame-type"][()], b"origin-at-focal-pt-det-pos-z")
            self.assertAlmostEqual(camera["intrinsic"][0, 0] * camera["col-spacing"][()], 1000)
            self.assertEqual(camera["extrinsic"].shape, (4, 4))
            self.assertEqual(file["proj-000/landmarks/head"][()].tolist(), [[7], [8.5]])
            self.assertNotIn("landmarks", file["proj-001"])

    def refused_copies(self, *rows):
        """Each copy of the file that was changed is refused: (name, change, what is said)."""
        for name, change, _ in rows:
            shutil.copy(XREG, self.scratch / (name + ".h5"))
            with h5py.File(self.scratch / (name + ".h5"), "a") as file:
                change(file)
        outcomes = self.read_all("read.camera", [name + ".h5" for name, _, _ in rows])
        for (name, _, said), outcome in zip(rows, outcomes):
            self.assertIn(said, outcome, name)

    # Only the file that is named counts in a node's key, so nothing is read from elsewhere.
    def test_what_lies_in_another_file_is_refused(self):
        def raw(file):
            del file["proj-000/cam/row-spacing"]
            outside = [(str(self.write("raw", bytes(8))), 0, 8)]
            file["proj-000/cam"].create_dataset("row-spacing", (1,), "f8", external=outside)

        link = "proj-000/cam: is a link to another place, which is not followed; copy what it leads to into the file"
        self.refused_copies(
            ("soft", replaced("proj-000/cam", h5py.SoftLink("/proj-001/cam")), link),
            ("other", replaced("proj-000/cam", h5py.ExternalLink(XREG, "/proj-001/cam")), link),
            ("raw", raw, "proj-000/cam/row-spacing: its values lie in another file, which is not read; copy them"),
        )

    def test_values_of_another_kind_are_refused_by_their_keys(self):
        def many(file):
            for i in range(10001):
                file["proj-000/landmarks/%d" % i] = [1.0, 2.0]

        cam, mark = "proj-000/cam/", "proj-000/landmarks/"
        rows = (
            ("missing", cam + "num-rows", None, "is missing; the file is cut off, or of another kind: write it again"),
            ("text", cam + "num-rows", "many", "expected numbers, got another type"),
            ("group", cam + "num-rows", {}, "expected numbers; the file is damaged"),
            ("shape", cam + "intrinsic", numpy.eye(4), "expected 9 numbers, got 16"),
            ("large", cam + "intrinsic", numpy.zeros((3000, 3000)), "expected 9 numbers, got 9000000"),
            ("number", cam + "cam-coord-frame-type", 1, "expected a text, got another type"),
            ("long", cam + "cam-coord-frame-type", numpy.bytes_(b"x" * 5000), "expected a short text; the file is"),
            ("flat", "proj-000/landmarks", 3.0, "expected a group; the file is damaged"),
            ("mark", mark + "FH-l", [1.0, 2.0, 3.0], "expected 2 numbers, got 3"),
            ("letters", mark + "a\nb", [1.0, 2.0], "its name "),
            ("named", mark + "a" * 300, [1.0, 2.0], "has a name that is damaged or too long"),
        )
        self.refused_copies(
            *((name, replaced(key, value), said) for name, key, value, said in rows),
            ("many", many, "landmarks: has 10003 items; at most 10000 are read"),
        )


def replaced(key, value):
    """A change of a file: another value under a key, a group for {}, or nothing for None."""

    def change(file):
        if key in file:
            del file[key]
        if isinstance(value, dict):
            file.create_group(key)
        elif value is not None:
            file[key] = value

    return change


if __name__ == "__main__":
    main()
