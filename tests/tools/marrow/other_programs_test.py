# SPDX-License-Identifier: Apache-2.0
"""Files that other programs wrote are read by the program as those programs read them; many more are tried by
tests/python/foreign_files_test.py. What is not installed is skipped, and said so."""
import pathlib
import random
import resource
import shutil
import unittest

from harness.program import IS_SANITIZED, main
from harness.sample import sample
from other_programs import DICOM, PIL, Reading, needs, nibabel, numpy, pipeline_of, pydicom, tifffile, vtk


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


# Damaged copies of files that other programs wrote are refused by name, without a crash and in bounded memory. What is
# not installed is skipped, and said so.
DAMAGED = 10  # copies of each kind of file; by default a sample of them, with each way to damage one
SAMPLE = 4
STEP_MB, MOST_MB = 32, 4096
MEMORY_MB = 64  # what reading a small file may take beyond what reading the good one takes
found_mb = {"least": 512}  # about where the search begins: most files need as much as the last ones


def damaged(data, number):
    """Every third copy has changed bytes in its header, the others are cut off, one anywhere and one in the header."""
    source, header = random.Random(number * len(data)), min(len(data), 400)
    if number % 3 < 2:
        return data[: source.randrange(len(data) - 1 if number % 3 == 0 else header)]
    copy = bytearray(data)
    for _ in range(3):
        copy[source.randrange(header)] ^= source.randrange(1, 256)
    return bytes(copy)


@unittest.skipIf(IS_SANITIZED, "a sanitizer reserves all address space, so there is none to limit")
class Damaged(Reading):
    """Damaged copies of each kind of file, through the program as a person runs it."""

    def limited(self, pipeline, megabytes):
        """How a run ends that has this much address space."""

        def restrict():
            resource.setrlimit(resource.RLIMIT_AS, (megabytes << 20,) * 2)
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

        shutil.rmtree(self.scratch / "out", ignore_errors=True)
        self.write("p.yaml", pipeline)
        # One thread: how many there are at the same moment, each with a stack, would be a matter of chance.
        options = ["--quiet", "--no-cache", "--threads", "1"]
        program = self.start("run", "p.yaml", "--out", "out", *options, errors="replace", preexec_fn=restrict)
        said = program.communicate(timeout=240)[1]
        return program.returncode, said

    def least_memory_mb(self, pipeline):
        """Address space in which the program reads good files, to the next step."""
        is_enough = lambda megabytes: self.limited(pipeline, megabytes)[0] == 0
        least = found_mb["least"]
        if is_enough(least):
            while is_enough(least - STEP_MB):
                least -= STEP_MB
        else:
            least += STEP_MB
            while not is_enough(least):
                least += STEP_MB
                self.assertLess(least, MOST_MB, "no memory is enough")
        found_mb["least"] = least
        return least

    def check(self, node, names, options=""):
        """Copies of these good files, in one run under the limit of memory that they themselves need."""
        limit = self.least_memory_mb(pipeline_of(node, names, options)) + MEMORY_MB
        numbers = sample(range(DAMAGED), SAMPLE, key=lambda number: number % 3)
        copies = {"%d-%s" % (number, name): number for name in names for number in numbers}
        for copy, number in copies.items():
            good = (self.scratch / copy.split("-", 1)[1]).read_bytes()
            self.write(copy, damaged(good, number))
        code, said = self.limited(pipeline_of(node, copies, options, may_fail=True), limit)
        self.assertEqual(code, 0, said)
        for (copy, number), outcome in zip(copies.items(), self.outcomes(len(copies))):
            if isinstance(outcome, pathlib.Path):
                self.assertEqual(number % 3, 2, copy + " is cut off, and was read")
                continue
            self.assertIn(copy, outcome)
            said = outcome.replace(str(self.scratch), "")  # the folder's name may hold any letters
            self.assertNotRegex(said, "bad_alloc|memory|std::|0x[0-9a-f]|crash", copy)

    @needs("PIL", "numpy")
    def test_images(self):
        values = numpy.random.default_rng(5).integers(0, 65536, (40, 50)).astype("uint16")
        kinds = {"a.png": {}, "lzw.tif": {"compression": "tiff_lzw"}, "packbits.tif": {"compression": "packbits"}}
        for name, options in kinds.items():
            PIL.fromarray(values).save(self.scratch / name, **options)
        self.check("read.image", kinds)

    @needs("tifffile", "numpy")
    def test_tiff_stack(self):
        values = numpy.random.default_rng(6).integers(0, 4096, (5, 24, 32)).astype("uint16")
        kinds = {"zlib.tif": {"compression": "zlib"}, "big.tif": {"bigtiff": True}}
        for name, options in kinds.items():
            tifffile.imwrite(self.scratch / name, values, photometric="minisblack", metadata=None, **options)
        self.check("read.volume", kinds, ", voxel_size_mm: [1, 1, 1]")

    @needs("nibabel", "numpy")
    def test_nifti(self):
        values = numpy.random.default_rng(7).integers(0, 3000, (9, 8, 7)).astype("int16")
        for name in ("a.nii", "a.nii.gz"):
            nibabel.save(nibabel.Nifti1Image(values, numpy.eye(4)), self.scratch / name)
        self.check("read.volume", ["a.nii", "a.nii.gz"])

    @needs("pydicom")
    def test_dicom(self):
        kinds = ["", "_implicit", "_bigendian", "_RLE", "_jpeg_ls_lossless"]
        for kind in kinds:
            shutil.copy(DICOM / ("MR_small%s.dcm" % kind), self.scratch)
        self.check("read.image", ["MR_small%s.dcm" % kind for kind in kinds])

    @needs("vtk")
    def test_vtk(self):
        image = vtk.vtkImageData()
        image.SetDimensions(7, 6, 5)
        image.AllocateScalars(vtk.VTK_SHORT, 1)
        image.GetPointData().GetScalars().FillComponent(0, 7)
        sphere = vtk.vtkSphereSource()
        sphere.Update()
        for writer, name, source in (
            (vtk.vtkMetaImageWriter(), "a.mha", image),
            (vtk.vtkSTLWriter(), "a.stl", sphere.GetOutput()),
            (vtk.vtkPLYWriter(), "a.ply", sphere.GetOutput()),
        ):
            writer.SetFileName(str(self.scratch / name))
            writer.SetInputData(source)
            if hasattr(writer, "SetFileTypeToBinary"):
                writer.SetFileTypeToBinary()
            writer.Write()
        self.check("read.volume", ["a.mha"])
        self.check("read.mesh", ["a.stl", "a.ply"])


if __name__ == "__main__":
    main()
