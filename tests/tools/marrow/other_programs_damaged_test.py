# SPDX-License-Identifier: Apache-2.0
"""Damaged copies of files that other programs wrote are refused by name, without a crash and in bounded memory. What is
not installed is skipped, and said so."""
import pathlib
import random
import resource
import shutil
import unittest

from harness.program import IS_SANITIZED, main
from harness.sample import sample
from other_programs import DICOM, PIL, Reading, needs, nibabel, numpy, pipeline_of, tifffile, vtk

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
