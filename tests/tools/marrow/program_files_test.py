# SPDX-License-Identifier: Apache-2.0
"""What programs of others are given, as other programs read it, and what is made of their output."""
import shutil
import subprocess
import unittest

from harness.formats import mha
from harness.program import main
from other_programs import PIL, needs, nibabel, numpy, read_mha, tifffile, vtk
from program_cases import Programs

SIZE, SPACING, ORIGIN = (4, 3, 2), (0.5, 0.75, 2.0), (10.0, -20.0, 30.0)
AXES = ((0.6, 0.8, 0.0), (-0.8, 0.6, 0.0), (0.0, 0.0, 1.0))  # direction of each axis of the grid
VALUES = [1.5 * i - 7 for i in range(SIZE[0] * SIZE[1] * SIZE[2])]
LABELS = """import nibabel, numpy, sys
labels = numpy.zeros((12, 11, 10), dtype=numpy.uint8)
labels[4:8, 4:7, 4:6] = 7
labels[1, 1, 1] = 2
nibabel.save(nibabel.Nifti1Image(labels, numpy.diag([-2.0, -1.0, 3.0, 1])), sys.argv[1])
"""
FIGURES = """import json, sys
given = json.load(open(sys.argv[1]))
json.dump({'plain': given['value']['value'] + 0.5, 'length': {'value': 2, 'unit': 'mm'}}, open(sys.argv[2], 'w'))
"""


def ply_points(file):
    """The vertices of a binary PLY as marrow writes it."""
    data = file.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    count = int(data[:end].split(b"element vertex ")[1].split()[0])
    return numpy.frombuffer(data[end:], dtype="<f8", count=3 * count).reshape(-1, 3)


def read_by_vtk(reader, file):
    reader.SetFileName(str(file))
    reader.Update()
    return reader.GetOutput()


class Files(Programs):
    """Each input in each format, read by another program, and read back."""

    def setUp(self):
        super().setUp()
        columns = list(zip(*AXES))
        grid = {"size": SIZE, "spacing_mm": SPACING, "origin_mm": ORIGIN, "direction": columns}
        self.write("ct.mha", mha(grid, VALUES, "MET_FLOAT"))
        self.ct = {"uses": "read.volume", "with": {"path": "ct.mha"}}

    def copied(self, kind, inputs, source):
        """Runs programs that copy {input.extension}, one for each of these inputs. Gives the file that each was given,
        and what was made of its output."""
        nodes, given = {}, []
        for i, place in enumerate(inputs):
            of, extension = place.split(".", 1)
            given.append(self.scratch / ("kept%d.%s" % (i, extension)))
            words = ["{files.1}", "{%s}" % place, "{output.%s}" % extension, str(given[-1])]
            nodes["n%d" % i] = self.node(kind, ["python3", *words], {of: "source"}, files=["copied.py"])
        self.run_it({"source": source, **nodes}, outputs={name: name for name in nodes})
        made = [next((self.scratch / "out/outputs").glob(name + ".*")) for name in nodes]
        return list(zip(given, made))

    def expect_grid(self, keys):
        """NIfTI has 32 bits for these numbers."""
        for key, expected in (("Offset", ORIGIN), ("ElementSpacing", SPACING), ("TransformMatrix", sum(AXES, ()))):
            numpy.testing.assert_allclose([float(word) for word in keys[key].split()], expected, atol=1e-5)

    @needs("numpy", "nibabel", "vtk")
    def test_volumes(self):
        extensions = ("mha", "nrrd", "nii", "nii.gz")
        places = ["%s.%s" % (of, extension) for of in ("volume", "second_volume") for extension in extensions]
        files = dict(zip(places, self.copied("volume", places, self.ct)))
        for place, (_, made) in files.items():
            with self.subTest(place):
                values, keys = read_mha(made)
                self.assertEqual(values.ravel().tolist(), VALUES)
                self.expect_grid(keys)
        affine = numpy.eye(4)
        affine[:3, :3] = (numpy.array(AXES) * numpy.array(SPACING)[:, None]).T
        affine[:3, 3] = ORIGIN
        affine = numpy.diag([-1, -1, 1, 1]) @ affine  # RAS
        image = nibabel.load(files["volume.nii.gz"][0])
        for transform, code in (image.get_sform(coded=True), image.get_qform(coded=True)):
            self.assertEqual(code, 1)
            numpy.testing.assert_allclose(transform, affine, atol=1e-5)
        self.assertEqual(image.header.get_xyzt_units()[0], "mm")
        self.assertEqual(image.get_fdata().ravel(order="F").tolist(), VALUES)
        image = read_by_vtk(vtk.vtkMetaImageReader(), files["volume.mha"][0])
        self.assertEqual(image.GetDimensions(), SIZE)
        got = [image.GetScalarComponentAsDouble(x, y, z, 0) for z in range(2) for y in range(3) for x in range(4)]
        self.assertEqual(got, VALUES)

    @needs("numpy", "nibabel")
    def test_labels_become_a_field(self):
        """A box of 4 x 3 x 2 voxels of label 7, and one voxel of label 2."""
        self.write("labels.py", LABELS)
        command = ["/usr/bin/python3", "{files.1}", "{output.nii.gz}"]
        field = self.node("field", command, files=["labels.py"], labels=[7], band_mm=6)
        mesh = {"uses": "mesh.marching_cubes", "in": {"field": "it"}}
        self.run_it({"it": field, "mesh": mesh}, outputs={"it": "it", "mesh": "mesh"})
        values, keys = read_mha(self.scratch / "out/outputs/it.mha")
        at = lambda x, y, z: float(values[z, y, x])
        # Beside the surface, half a voxel of 2 x 1 x 3 mm; further away, along one axis, whole voxels more.
        self.assertEqual([at(4, 5, 4), at(3, 5, 4), at(5, 4, 4), at(5, 3, 4)], [-1, 1, -0.5, 0.5])
        numpy.testing.assert_allclose([at(5, 2, 4), at(5, 1, 4), at(2, 5, 4)], [1.5, 2.5, 3], atol=1e-6)
        self.assertEqual(at(1, 1, 1), 6, "another label is outside")
        points = ply_points(self.scratch / "out/outputs/mesh.ply")
        numpy.testing.assert_allclose(points.min(axis=0), [7, 3.5, 10.5], atol=1e-9)
        numpy.testing.assert_allclose(points.max(axis=0), [15, 6.5, 16.5], atol=1e-9)
        others = self.node("field", command, files=["labels.py"], labels=[5, 6])
        said = "the labels that the program made have no voxel of these labels: there are 2, 7"
        self.expect_failures((others, said))

    @needs("numpy", "nibabel")
    def test_a_field_is_given_as_a_mask(self):
        threshold = {"uses": "segment.threshold", "in": {"volume": "ct"}, "with": {"threshold_hu": 10}}
        words = ["{field.nii.gz}", "{output.nii.gz}", str(self.scratch / "kept.nii.gz")]
        node = self.node("volume", ["python3", "{files.1}", *words], {"field": "bone.bone"}, files=["copied.py"])
        self.run_it({"ct": self.ct, "bone": threshold, "it": node})
        mask = nibabel.load(self.scratch / "kept.nii.gz")
        self.assertEqual(mask.get_data_dtype(), numpy.uint8)
        self.assertEqual(mask.get_fdata().ravel(order="F").tolist(), [float(value >= 10) for value in VALUES])

    @needs("numpy", "vtk")
    def test_meshes(self):
        corners = [(0.1, 0, 0), (1, 0, 0.25), (0, 1, 0), (0, 0, 1)]
        faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
        lines = ["v %r %r %r" % corner for corner in corners] + ["f %d %d %d" % tuple(i + 1 for i in f) for f in faces]
        self.write("solid.obj", "\n".join(lines) + "\n")
        source = {"uses": "read.mesh", "with": {"path": "solid.obj"}}
        readers = [vtk.vtkSTLReader(), vtk.vtkPLYReader(), vtk.vtkOBJReader(), vtk.vtkXMLPolyDataReader()]
        files = self.copied("mesh", ["mesh.stl", "mesh.ply", "mesh.obj", "mesh.vtp"], source)
        for reader, (given, made) in zip(readers, files):
            with self.subTest(given.name):
                read = read_by_vtk(reader, given)
                self.assertEqual(read.GetNumberOfCells(), 4)
                seen = sorted(read.GetPoint(i) for i in range(4))
                numpy.testing.assert_allclose(seen, sorted(corners), atol=1e-7)
                numpy.testing.assert_allclose(sorted(map(tuple, ply_points(made))), sorted(corners), atol=1e-7)

    @needs("numpy", "tifffile", "PIL")
    def test_images(self):
        grey = numpy.arange(12, dtype=numpy.uint16).reshape(3, 4) * 5000
        PIL.fromarray(grey).save(self.scratch / "grey.png")
        source = {"uses": "read.image", "with": {"path": "grey.png"}}
        files = self.copied("image", ["image.png", "image.tif"], source)
        for read, (given, _) in zip((PIL.open, tifffile.imread), files):
            self.assertEqual(numpy.array(read(given)).tolist(), grey.tolist())
        tifffile.imwrite(self.scratch / "grey.tif", (grey / 7).astype(numpy.float32))
        source["with"]["path"] = "grey.tif"
        ((given, _),) = self.copied("image", ["image.tif"], source)
        self.assertEqual(tifffile.imread(given).tolist(), (grey / 7).astype(numpy.float32).tolist())
        node = self.node("image", ["true", "{image.png}", "{output.png}"], {"image": "i"})
        said = "has grey values that are no whole numbers, and PNG has no place for them; write {image.tif}"
        self.expect_failures((node, said), sources={"i": source})

    def test_figures(self):
        self.write("figures.py", FIGURES)
        command = ["python3", "{files.1}", "{metrics.json}", "{output.json}"]
        node = self.node("metrics", command, {"metrics": "c"}, files=["figures.py"])
        self.run_it({"c": {"uses": "test.constant", "with": {"value": 3}}, "it": node})
        plain, length = {"name": "plain", "value": 3.5, "unit": ""}, {"name": "length", "value": 2, "unit": "mm"}
        self.assertEqual(self.json("out/outputs/it.json")["metrics"], [plain, length])
        rows = []
        copy = ["python3", "{files.1}", "{files.2}", "{output.json}"]
        for text, why in (
            ("[1]", "holds no JSON object"),
            ("{}", "holds no figure"),
            ('{"a": "b"}', "has no number for 'a'"),
        ):
            name = "figures%d.txt" % len(rows)
            self.write(name, text)
            said = "output.json " + why + '; expected figures as {"name": 1.5} or'
            rows.append((self.node("metrics", copy, files=["copied.py", name]), said))
        self.expect_failures(*rows)

    @unittest.skipUnless(shutil.which("plastimatch"), "not installed here: plastimatch")
    @needs("numpy")
    def test_plastimatch(self):
        """Twice the volume and three times the volume, by plastimatch, from two inputs."""
        version = ["plastimatch", "--version"]
        twice = ["plastimatch", "add", "--weight", "2", "--output", "{output.mha}", "{volume.mha}"]
        double = self.node("volume", twice, {"volume": "ct"}, version_command=version)
        both = ["plastimatch", "add", "--output", "{output.nrrd}", "{volume.nrrd}", "{second_volume.mha}"]
        triple = self.node("volume", both, {"volume": "ct", "second_volume": "double"}, version_command=version)
        self.run_it({"ct": self.ct, "double": double, "it": triple}, outputs={"it": "it", "double": "double"})
        for name, factor in (("double", 2), ("it", 3)):
            values, keys = read_mha(self.scratch / ("out/outputs/%s.mha" % name))
            numpy.testing.assert_allclose(values.ravel(), [factor * value for value in VALUES], rtol=1e-6)
            self.expect_grid(keys)  # by MetaImage and by NRRD
        printed = subprocess.run(version, capture_output=True, text=True).stdout.strip()
        versions = [node.get("program_version") for node in self.nodes().values()]
        self.assertEqual(versions, [None, printed, printed])


if __name__ == "__main__":
    main()
