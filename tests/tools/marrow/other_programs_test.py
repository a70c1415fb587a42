# SPDX-License-Identifier: Apache-2.0
"""Files that other programs wrote (pydicom's test files, GDCM, nibabel, tifffile, Pillow, VTK) are read as those
programs read them. What is not installed is skipped, and said so."""
import shutil
import subprocess

from harness.program import main
from other_programs import DICOM, PIL, Reading, needs, nibabel, numpy, pydicom, read_mha, tifffile, vtk


@needs("pydicom", "numpy", "PIL")
class Dicom(Reading):
    def values(self, name):
        data = pydicom.dcmread(DICOM / name)
        return data.pixel_array * float(data.get("RescaleSlope", 1)) + float(data.get("RescaleIntercept", 0))

    def test_every_way_to_store_the_same_image(self):
        expected = self.values("MR_small.dcm")
        for name in (
            "MR_small",
            "MR_small_bigendian",
            "MR_small_expb",
            "MR_small_implicit",
            "MR_small_padded",
            "MR_small_RLE",
            "MR_small_jpeg_ls_lossless",
            "MR_small_jp2klossless",
        ):
            with self.subTest(name):
                self.assert_scaled(self.image(DICOM / (name + ".dcm")), expected)

    def test_values_are_scaled_as_the_header_says(self):
        self.assert_scaled(self.image(DICOM / "CT_small.dcm"), self.values("CT_small.dcm"))

    def test_what_gdcm_writes(self):
        if not shutil.which("gdcmconv"):
            self.skipTest("not installed here: gdcmconv (libgdcm-tools)")
        expected = self.values("MR_small.dcm")
        for option in ("--raw", "--jpeg", "--jpegls", "--j2k", "--rle", "--implicit", "--explicit"):
            with self.subTest(option):
                file = self.scratch / ("x%s.dcm" % option)
                made = subprocess.run(
                    ["gdcmconv", option, str(DICOM / "MR_small.dcm"), str(file)], capture_output=True, text=True
                )
                if made.returncode != 0 or not file.exists():
                    self.skipTest("gdcmconv %s: %s" % (option, made.stderr))
                self.assert_scaled(self.image(file), expected)

    def test_a_series(self):
        for folder in ("98892001/CT5N", "77654033/CT2"):
            with self.subTest(folder):
                slices = [pydicom.dcmread(path) for path in (DICOM / "dicomdirtests" / folder).iterdir()]
                slices.sort(
                    key=lambda s: numpy.dot(
                        s.ImagePositionPatient,
                        numpy.cross(s.ImageOrientationPatient[:3], s.ImageOrientationPatient[3:]),
                    )
                )
                expected = numpy.stack(
                    [s.pixel_array * float(s.RescaleSlope) + float(s.RescaleIntercept) for s in slices]
                )
                result, out = self.run_node("read.volume", "", DICOM / "dicomdirtests" / folder)
                print("\n   ", folder, result.stderr.strip().replace(str(DICOM), ""))
                if result.returncode == 0:
                    values, keys = read_mha(out / "it.mha")
                    self.assertLess(float(numpy.abs(values - expected).max()), 1e-3)
                    self.assertEqual(
                        [float(x) for x in keys["ElementSpacing"].split()[:2]],
                        [float(x) for x in slices[0].PixelSpacing[::-1]],
                    )
                    self.assertLess(
                        max(
                            abs(float(a) - float(b))
                            for a, b in zip(keys["Offset"].split(), slices[0].ImagePositionPatient)
                        ),
                        1e-4,
                    )
                else:
                    self.assertRegex(
                        result.stderr, "a slice is missing or the series is unevenly spaced|lie at the same place"
                    )

    def test_every_other_file_is_read_or_refused_by_name(self):
        read, refused, damaged = [], [], set()
        for path in sorted(DICOM.rglob("*")):
            if not path.is_file() or path.suffix not in (".dcm", "") or path.name.startswith(("README", "DICOMDIR")):
                continue
            copy = self.scratch / (path.name + ("" if path.suffix else ".dcm"))
            shutil.copy(path, copy)
            result, _ = self.run_node("read.image", "", copy)
            self.assertIn(result.returncode, (0, 1), "%s: %s" % (path, result.stderr))
            if result.returncode == 0:
                read.append(path.name)
            else:
                refused.append(path.name)
                self.assertIn(copy.name, result.stderr)
                if "damaged" in result.stderr or "cut off" in result.stderr:
                    damaged.add(path.name)
            copy.unlink()
        print("\n    read: %d, refused: %d (%s)" % (len(read), len(refused), ", ".join(refused[:8])))
        # What is cut off, has a kind of element that there is not, or does not say how it is written.
        broken = {"MR_truncated.dcm", "rtplan_truncated.dcm", "badVR.dcm", "meta_missing_tsyntax.dcm", "no_meta.dcm"}
        broken.add("JPEG2000-embedded-sequence-delimiter.dcm")  # bytes of its codestream were replaced
        self.assertLessEqual(damaged, broken)
        self.assertIn("MR_truncated.dcm", damaged)
        self.assertIn("MR_truncated.dcm", refused)
        self.assertIn("rtplan.dcm", refused)
        self.assertIn("SC_rgb_rle.dcm", refused)
        self.assertIn("693_J2KI.dcm", read)
        self.assertIn("CT_small.dcm", read)


@needs("nibabel", "numpy")
class Nifti(Reading):
    def test_values_and_affine(self):
        random_values = numpy.random.default_rng(1).integers(-1000, 2000, (7, 6, 5))
        turn = numpy.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]])
        affine = numpy.eye(4)
        affine[:3, :3] = turn @ numpy.diag([0.5, 0.75, 2])
        affine[:3, 3] = [11, -22, 33]
        for kind in ("int16", "float32", "uint16", "float64", "int32"):
            for extension in (".nii", ".nii.gz"):
                with self.subTest(kind + extension):
                    values = (random_values + 1000 * (kind == "uint16")).astype(kind)
                    file = self.scratch / ("a" + extension)
                    nibabel.save(nibabel.Nifti1Image(values, affine), file)
                    got, keys = self.volume(file)
                    self.assertTrue((got.transpose(2, 1, 0) == values.astype("f4")).all())
                    self.check_grid(keys, affine)

    def check_grid(self, keys, affine):
        """NIfTI's world is RAS, MetaImage's is LPS."""
        lps = numpy.diag([-1, -1, 1, 1]) @ affine
        self.assertLess(numpy.abs(numpy.array(keys["Offset"].split(), float) - lps[:3, 3]).max(), 1e-4)
        spacing = numpy.array(keys["ElementSpacing"].split(), float)
        axes = numpy.array(keys["TransformMatrix"].split(), float).reshape(3, 3).T  # one axis after the other
        self.assertLess(numpy.abs(axes * spacing - lps[:3, :3]).max(), 1e-4)

    def test_scaled_values(self):
        image = nibabel.Nifti1Image(numpy.arange(60, dtype="int16").reshape(5, 4, 3), numpy.eye(4))
        image.header.set_slope_inter(2.5, -1024)
        nibabel.save(image, self.scratch / "a.nii")
        expected = nibabel.load(self.scratch / "a.nii").get_fdata()
        self.assertLess(numpy.abs(self.volume(self.scratch / "a.nii")[0].transpose(2, 1, 0) - expected).max(), 1e-3)


@needs("tifffile", "numpy")
class Tiff(Reading):
    def test_stacks(self):
        values = numpy.random.default_rng(2).integers(0, 4096, (5, 24, 32)).astype("uint16")
        for name, options in (
            ("plain", {}),
            ("zlib", {"compression": "zlib"}),
            ("big", {"bigtiff": True}),
            ("motorola", {"byteorder": ">"}),
            ("strips", {"rowsperstrip": 5}),
        ):
            for kind in ("uint16", "float32", "uint8"):
                with self.subTest("%s %s" % (name, kind)):
                    file = self.scratch / "a.tif"
                    pages = (values // 16 if kind == "uint8" else values).astype(kind)
                    tifffile.imwrite(file, pages, photometric="minisblack", metadata=None, **options)
                    result, out = self.run_node("read.volume", ", voxel_size_mm: [1, 2, 3]", file)
                    self.assertEqual(result.returncode, 0, result.stderr)
                    self.assertTrue((read_mha(out / "it.mha")[0] == pages).all())

    def test_tiles_are_refused_in_words(self):
        file = self.scratch / "tiles.tif"
        tifffile.imwrite(
            file, numpy.zeros((5, 24, 32), "uint16"), photometric="minisblack", metadata=None, tile=(16, 16)
        )
        self.assertIn(
            "is stored in tiles; expected strips", self.refused("read.volume", file, ", voxel_size_mm: [1, 2, 3]")
        )


@needs("PIL", "numpy")
class Images(Reading):
    def test_pillow(self):
        values = numpy.random.default_rng(3).integers(0, 65536, (20, 30)).astype("uint16")
        for name, options in (
            ("a.png", {}),
            ("b.png", {"optimize": True}),
            ("a.tif", {}),
            ("lzw.tif", {"compression": "tiff_lzw"}),
            ("deflate.tif", {"compression": "tiff_adobe_deflate"}),
            ("packbits.tif", {"compression": "packbits"}),
        ):
            for kind in ("uint16", "uint8"):
                with self.subTest("%s %s" % (name, kind)):
                    pixels = values if kind == "uint16" else (values >> 8).astype("uint8")
                    PIL.fromarray(pixels).save(self.scratch / name, **options)
                    self.assertTrue((self.image(self.scratch / name) == pixels).all())

    def test_differences_between_floats(self):
        values = numpy.random.default_rng(5).normal(100, 20, (20, 30)).astype("float32")
        for predictor in (1, 3):
            for compression in ("tiff_lzw", "tiff_adobe_deflate"):
                with self.subTest(predictor=predictor, compression=compression):
                    file = self.scratch / "a.tif"
                    PIL.fromarray(values).save(file, compression=compression, tiffinfo={317: predictor})
                    self.assert_scaled(self.image(file), values)

    def test_colours_and_palettes(self):
        colours = PIL.fromarray(numpy.random.default_rng(4).integers(0, 256, (9, 8, 3)).astype("uint8"))
        colours.save(self.scratch / "rgb.png")
        self.assertIn("has colours: the pixel at", self.refused("read.image", self.scratch / "rgb.png"))
        colours.quantize(16).save(self.scratch / "palette.png")
        self.assertIn("an X-ray image is grey", self.refused("read.image", self.scratch / "palette.png"))


@needs("vtk", "numpy", "PIL")
class Vtk(Reading):
    def grid(self, dimensions, kind):
        image = vtk.vtkImageData()
        image.SetDimensions(*dimensions)
        image.SetSpacing(0.5, 0.75, 2)
        image.SetOrigin(3, -4, 5)
        image.AllocateScalars(kind, 1)
        from vtkmodules.util.numpy_support import vtk_to_numpy

        values = vtk_to_numpy(image.GetPointData().GetScalars())
        values[:] = numpy.arange(values.size) * 37 % 251
        return image, values.reshape(dimensions[::-1])

    def save(self, writer, file, source):
        writer.SetFileName(str(file))
        writer.SetInputData(source)
        writer.Write()

    def test_volumes(self):
        image, values = self.grid((7, 6, 5), vtk.VTK_SHORT)
        for name, compressed in (("a.mha", False), ("packed.mha", True)):
            with self.subTest(name):
                writer = vtk.vtkMetaImageWriter()
                writer.SetCompression(compressed)
                self.save(writer, self.scratch / name, image)
                got, keys = self.volume(self.scratch / name)
                self.assertTrue((got == values).all())
                self.assertEqual(keys["ElementSpacing"].split(), ["0.5", "0.75", "2"])
                self.assertEqual(keys["Offset"].split(), ["3", "-4", "5"])
        folder = self.scratch / "detached"
        folder.mkdir()
        self.save(vtk.vtkMetaImageWriter(), folder / "a.mhd", image)
        self.assertTrue((self.volume(folder)[0] == values).all())
        self.save(vtk.vtkNIFTIImageWriter(), self.scratch / "a.nii", image)
        self.assertEqual(sorted(self.volume(self.scratch / "a.nii")[0].ravel()), sorted(values.ravel()))

    def test_images(self):
        image, values = self.grid((9, 7, 1), vtk.VTK_UNSIGNED_SHORT)
        for writer, name in ((vtk.vtkPNGWriter(), "a.png"), (vtk.vtkTIFFWriter(), "a.tif")):
            with self.subTest(name):
                self.save(writer, self.scratch / name, image)
                self.assertTrue((self.image(self.scratch / name) == values[0, ::-1]).all(), "VTK's rows run from below")

    def test_meshes(self):
        sphere = vtk.vtkSphereSource()
        sphere.SetRadius(20)
        sphere.Update()
        source = sphere.GetOutput()
        for writer, name in (
            (vtk.vtkSTLWriter(), "a.stl"),
            (vtk.vtkSTLWriter(), "text.stl"),
            (vtk.vtkPLYWriter(), "a.ply"),
            (vtk.vtkPLYWriter(), "text.ply"),
        ):
            with self.subTest(name):
                (writer.SetFileTypeToASCII if name.startswith("text") else writer.SetFileTypeToBinary)()
                self.save(writer, self.scratch / name, source)
                result, out = self.run_node("read.mesh", "", self.scratch / name)
                self.assertEqual(result.returncode, 0, result.stderr)
                reader = vtk.vtkPLYReader()
                reader.SetFileName(str(out / "it.ply"))
                reader.Update()
                self.assertEqual(reader.GetOutput().GetNumberOfCells(), source.GetNumberOfCells())
                self.assertEqual(reader.GetOutput().GetNumberOfPoints(), source.GetNumberOfPoints())
                self.assertLess(
                    max(abs(a - b) for a, b in zip(reader.GetOutput().GetBounds(), source.GetBounds())), 1e-4
                )


if __name__ == "__main__":
    main()
