# SPDX-License-Identifier: Apache-2.0
"""Files that other programs wrote are read by the program as those programs read them; many more are tried by
tests/python/foreign_files_test.py. What is not installed is skipped, and said so."""
from harness.program import main
from other_programs import DICOM, PIL, Reading, needs, nibabel, numpy, pydicom, tifffile


def dicom_values(file):
    data = pydicom.dcmread(file)
    return data.pixel_array * float(data.get("RescaleSlope", 1)) + float(data.get("RescaleIntercept", 0))


class OtherPrograms(Reading):
    @needs("pydicom", "numpy", "PIL")
    def test_dicom(self):
        files = [DICOM / name for name in ("CT_small.dcm", "MR_small_RLE.dcm")]
        for file, image in zip(files, self.images(files)):
            self.assert_scaled(image, dicom_values(file))

    @needs("pydicom", "numpy", "PIL")
    def test_dicom_of_a_card(self):
        files = sorted((DICOM / "dicomdirtests" / "TINY_ALPHA").rglob("IM*"))
        for file, outcome in zip(files, self.read_all("read.image", files)):
            if isinstance(outcome, str):
                self.assertIn(file.name, outcome)
                self.assertNotRegex(outcome, "damaged|cut off")

    @needs("nibabel", "numpy")
    def test_nifti_has_its_values_where_its_affine_says(self):
        values = numpy.random.default_rng(1).integers(-1000, 2000, (7, 6, 5)).astype("int16")
        affine = numpy.eye(4)
        affine[:3, :3] = numpy.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]]) @ numpy.diag([0.5, 0.75, 2])
        affine[:3, 3] = [11, -22, 33]
        nibabel.save(nibabel.Nifti1Image(values, affine), self.scratch / "a.nii.gz")
        got, keys = self.volume("a.nii.gz")
        self.assertTrue((got.transpose(2, 1, 0) == values.astype("f4")).all())
        lps = numpy.diag([-1, -1, 1, 1]) @ affine  # NIfTI's world is RAS, MetaImage's is LPS
        self.assertLess(numpy.abs(numpy.array(keys["Offset"].split(), float) - lps[:3, 3]).max(), 1e-4)
        spacing = numpy.array(keys["ElementSpacing"].split(), float)
        axes = numpy.array(keys["TransformMatrix"].split(), float).reshape(3, 3).T  # one axis after the other
        self.assertLess(numpy.abs(axes * spacing - lps[:3, :3]).max(), 1e-4)

    @needs("tifffile", "numpy")
    def test_stacks_of_tiff(self):
        values = numpy.random.default_rng(2).integers(0, 4096, (5, 24, 32)).astype("uint16")
        stacks = {}
        for name, options in (
            ("plain", {}),
            ("zlib", {"compression": "zlib"}),
            ("big", {"bigtiff": True}),
            ("motorola", {"byteorder": ">"}),
            ("strips", {"rowsperstrip": 5}),
        ):
            for kind in ("uint16", "float32", "uint8"):
                file = "%s-%s.tif" % (name, kind)
                stacks[file] = (values // 16 if kind == "uint8" else values).astype(kind)
                more = {"photometric": "minisblack", "metadata": None, **options}
                tifffile.imwrite(self.scratch / file, stacks[file], **more)
        for (file, pages), (got, _) in zip(stacks.items(), self.volumes(stacks, ", voxel_size_mm: [1, 2, 3]")):
            self.assertTrue((got == pages).all(), file)

    @needs("PIL", "numpy")
    def test_pillow(self):
        deep = numpy.random.default_rng(3).integers(0, 65536, (20, 30)).astype("uint16")
        images = {}
        for name, options in (
            ("plain.png", {"optimize": True}),
            ("plain.tif", {}),
            ("lzw.tif", {"compression": "tiff_lzw"}),
            ("deflate.tif", {"compression": "tiff_adobe_deflate"}),
            ("packbits.tif", {"compression": "packbits"}),
        ):
            for bits, pixels in ((16, deep), (8, (deep >> 8).astype("uint8"))):
                images["%d-%s" % (bits, name)] = pixels
                PIL.fromarray(pixels).save(self.scratch / ("%d-%s" % (bits, name)), **options)
        for (file, pixels), image in zip(images.items(), self.images(images)):
            self.assertTrue((image == pixels).all(), file)

    @needs("PIL", "numpy")
    def test_differences_between_floats(self):
        values = numpy.random.default_rng(5).normal(100, 20, (20, 30)).astype("float32")
        files = []
        for predictor in (1, 3):
            for compression in ("tiff_lzw", "tiff_adobe_deflate"):
                files.append("%s-%d.tif" % (compression, predictor))
                image = PIL.fromarray(values)
                image.save(self.scratch / files[-1], compression=compression, tiffinfo={317: predictor})
        for image in self.images(files):
            self.assert_scaled(image, values)

    @needs("PIL", "numpy")
    def test_colours_and_palettes_are_refused(self):
        colours = PIL.fromarray(numpy.random.default_rng(4).integers(0, 256, (9, 8, 3)).astype("uint8"))
        colours.save(self.scratch / "rgb.png")
        colours.quantize(16).save(self.scratch / "palette.png")
        self.assertIn("has colours: the pixel at", self.refused("read.image", "rgb.png"))
        self.assertIn("an X-ray image is grey", self.refused("read.image", "palette.png"))


if __name__ == "__main__":
    main()
