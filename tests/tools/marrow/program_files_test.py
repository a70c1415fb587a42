# SPDX-License-Identifier: Apache-2.0
"""What programs of others are given, as other programs read it, and what is made of their output."""
import json
import shutil
import struct
import subprocess
import unittest

from harness.program import main
from other_programs import needs, nibabel, numpy, read_mha, vtk
from program_cases import Programs

SIZE, SPACING, ORIGIN = (4, 3, 2), (0.5, 0.75, 2.0), (10.0, -20.0, 30.0)
AXES = ((0.6, 0.8, 0.0), (-0.8, 0.6, 0.0), (0.0, 0.0, 1.0))  # direction of each axis of the grid


class Files(Programs):
    """Each input in each format, read by another program, and read back."""

    def setUp(self):
        super().setUp()
        count = SIZE[0] * SIZE[1] * SIZE[2]
        listed = lambda numbers: " ".join(map(repr, numbers))
        self.values = [1.5 * i - 7 for i in range(count)]
        header = (
            "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
            "TransformMatrix = %s\nOffset = %s\nElementSpacing = %s\nDimSize = %s\nElementType = MET_FLOAT\n"
            "ElementDataFile = LOCAL\n" % (listed(sum(AXES, ())), listed(ORIGIN), listed(SPACING), listed(SIZE))
        )
        (self.scratch / "ct.mha").write_bytes(header.encode() + struct.pack("<%df" % count, *self.values))
        self.ct = {"uses": "read.volume", "with": {"path": "ct.mha"}}

    def copied(self, kind, of, extension, source, extra=None, **options):
        """Runs a program that copies {of.extension}; returns the file that it was given."""
        kept = self.kept("kept." + extension)
        command = ["python3", "{files.1}", "{%s.%s}" % (of, extension), "{output.%s}" % extension, str(kept)]
        node = self.node(kind, command, {of: "source"}, files=["copied.py"], **options)
        self.run_it({"source": source, "it": node, **(extra or {})})
        return kept

    def expect_grid(self, keys):
        """NIfTI has 32 bits for these numbers."""
        for key, expected in (("Offset", ORIGIN), ("ElementSpacing", SPACING), ("TransformMatrix", sum(AXES, ()))):
            numpy.testing.assert_allclose([float(word) for word in keys[key].split()], expected, atol=1e-5)

    @needs("numpy")
    def test_volumes(self):
        for of in ("volume", "second_volume"):
            for extension in ("mha", "nrrd", "nii", "nii.gz"):
                with self.subTest(of + "." + extension):
                    self.copied("volume", of, extension, self.ct)
                    values, keys = read_mha(self.scratch / "out/outputs/it.mha")
                    self.assertEqual(values.ravel().tolist(), self.values)
                    self.expect_grid(keys)

    @needs("numpy", "nibabel")
    def test_nifti_as_nibabel_reads_it(self):
        affine = numpy.eye(4)
        affine[:3, :3] = (numpy.array(AXES) * numpy.array(SPACING)[:, None]).T
        affine[:3, 3] = ORIGIN
        affine = numpy.diag([-1, -1, 1, 1]) @ affine  # RAS
        image = nibabel.load(self.copied("volume", "volume", "nii.gz", self.ct))
        for transform, code in (image.get_sform(coded=True), image.get_qform(coded=True)):
            self.assertEqual(code, 1)
            numpy.testing.assert_allclose(transform, affine, atol=1e-5)
        self.assertEqual(image.header.get_xyzt_units()[0], "mm")
        self.assertEqual(image.get_fdata().ravel(order="F").tolist(), self.values)

    @needs("vtk", "numpy")
    def test_mha_as_vtk_reads_it(self):
        reader = vtk.vtkMetaImageReader()
        reader.SetFileName(str(self.copied("volume", "volume", "mha", self.ct)))
        reader.Update()
        image = reader.GetOutput()
        self.assertEqual(image.GetDimensions(), SIZE)
        got = [image.GetScalarComponentAsDouble(x, y, z, 0) for z in range(2) for y in range(3) for x in range(4)]
        self.assertEqual(got, self.values)

    @needs("numpy", "nibabel")
    def test_labels_become_a_field(self):
        """A box of 4 x 3 x 2 voxels of label 7, and one voxel of label 2."""
        self.write(
            "labels.py",
            "import nibabel, numpy, sys\nlabels = numpy.zeros((12, 11, 10), dtype=numpy.uint8)\n"
            "labels[4:8, 4:7, 4:6] = 7\nlabels[1, 1, 1] = 2\n"
            "nibabel.save(nibabel.Nifti1Image(labels, numpy.diag([-2.0, -1.0, 3.0, 1])), sys.argv[1])\n",
        )
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
        told = self.failure(command, kind="field", files=["labels.py"], labels=[5, 6])
        self.assertIn("the labels that the program made have no voxel of these labels: there are 2, 7", told)

    @needs("numpy", "nibabel")
    def test_a_field_is_given_as_a_mask(self):
        threshold = {"uses": "segment.threshold", "in": {"volume": "ct"}, "with": {"threshold_hu": 10}}
        kept = self.kept("kept.nii.gz")
        command = ["python3", "{files.1}", "{field.nii.gz}", "{output.nii.gz}", str(kept)]
        node = self.node("volume", command, {"field": "bone.bone"}, files=["copied.py"])
        self.run_it({"ct": self.ct, "bone": threshold, "it": node})
        mask = nibabel.load(kept)
        self.assertEqual(mask.get_data_dtype(), numpy.uint8)
        self.assertEqual(mask.get_fdata().ravel(order="F").tolist(), [float(value >= 10) for value in self.values])

    @needs("numpy", "vtk")
    def test_meshes(self):
        corners = [(0.1, 0, 0), (1, 0, 0.25), (0, 1, 0), (0, 0, 1)]
        faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
        lines = ["v %r %r %r" % corner for corner in corners] + ["f %d %d %d" % tuple(i + 1 for i in f) for f in faces]
        self.write("solid.obj", "\n".join(lines) + "\n")
        source = {"uses": "read.mesh", "with": {"path": "solid.obj"}}
        readers = {"stl": vtk.vtkSTLReader, "ply": vtk.vtkPLYReader, "obj": vtk.vtkOBJReader,
                   "vtp": vtk.vtkXMLPolyDataReader}  # fmt: skip
        for extension, make in readers.items():
            with self.subTest(extension):
                file = self.copied("mesh", "mesh", extension, source)
                reader = make()
                reader.SetFileName(str(file))
                reader.Update()
                read = reader.GetOutput()
                self.assertEqual(read.GetNumberOfCells(), 4)
                seen = sorted(read.GetPoint(i) for i in range(4))
                numpy.testing.assert_allclose(seen, sorted(corners), atol=1e-7)
                back = ply_points(self.scratch / "out/outputs/it.ply")
                numpy.testing.assert_allclose(sorted(map(tuple, back)), sorted(corners), atol=1e-7)

    @needs("numpy", "tifffile", "PIL")
    def test_images(self):
        import PIL.Image
        import tifffile

        grey = numpy.arange(12, dtype=numpy.uint16).reshape(3, 4) * 5000
        PIL.Image.fromarray(grey).save(self.scratch / "grey.png")
        source = {"uses": "read.image", "with": {"path": "grey.png"}}
        for extension, read in (("png", PIL.Image.open), ("tif", tifffile.imread)):
            with self.subTest(extension):
                file = self.copied("image", "image", extension, source)
                self.assertEqual(numpy.array(read(file)).tolist(), grey.tolist())
        tifffile.imwrite(self.scratch / "grey.tif", (grey / 7).astype(numpy.float32))
        source["with"]["path"] = "grey.tif"
        file = self.copied("image", "image", "tif", source)
        self.assertEqual(tifffile.imread(file).tolist(), (grey / 7).astype(numpy.float32).tolist())
        told = self.failure(["true", "{image.png}", "{output.png}"], {"image": "i"}, "image", {"i": source})
        self.assertIn(
            "has grey values that are no whole numbers, and PNG has no place for them; write {image.tif}", told
        )

    def test_figures(self):
        self.write(
            "figures.py",
            "import json, sys\ngiven = json.load(open(sys.argv[1]))\n"
            "json.dump({'plain': given['value']['value'] + 0.5, 'length': {'value': 2, 'unit': 'mm'}},"
            " open(sys.argv[2], 'w'))\n",
        )
        command = ["python3", "{files.1}", "{metrics.json}", "{output.json}"]
        node = self.node("metrics", command, {"metrics": "c"}, files=["figures.py"])
        self.run_it({"c": {"uses": "test.constant", "with": {"value": 3}}, "it": node})
        made = json.loads((self.scratch / "out/outputs/it.json").read_text())["metrics"]
        self.assertEqual(
            made, [{"name": "plain", "value": 3.5, "unit": ""}, {"name": "length", "value": 2, "unit": "mm"}]
        )
        for text, why in (
            ("[1]", "holds no JSON object"),
            ("{}", "holds no figure"),
            ('{"a": "b"}', "has no number for 'a'"),
        ):
            self.write("figures.txt", text)
            copy = ["python3", "{files.1}", "{files.2}", "{output.json}"]
            told = self.failure(copy, kind="metrics", files=["copied.py", "figures.txt"])
            self.assertIn("output.json " + why + '; expected figures as {"name": 1.5} or', told)

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
            numpy.testing.assert_allclose(values.ravel(), [factor * value for value in self.values], rtol=1e-6)
            self.expect_grid(keys)  # by MetaImage and by NRRD
        record = json.loads((self.scratch / "out/run.json").read_text())
        printed = subprocess.run(version, capture_output=True, text=True).stdout.strip()
        self.assertEqual([node.get("program_version") for node in record["nodes"]], [None, printed, printed])


def ply_points(file):
    """The vertices of a binary PLY as marrow writes it."""
    data = file.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    count = int(data[:end].split(b"element vertex ")[1].split()[0])
    return numpy.frombuffer(data[end:], dtype="<f8", count=3 * count).reshape(-1, 3)


main()
