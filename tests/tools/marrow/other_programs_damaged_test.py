# SPDX-License-Identifier: Apache-2.0
"""Damaged copies of files that other programs wrote are refused by name, without a crash and in bounded memory. What is
not installed is skipped, and said so."""
import os
import random
import resource
import shutil
import subprocess

from harness import MARROW, program
from harness.program import main
from harness.sample import sample
from other_programs import DICOM, PIL, Reading, needs, nibabel, numpy, tifffile, vtk

DAMAGED = 10  # copies of each kind of file; by default a sample of them, with each way to damage one
SAMPLE = 4
STEP_MB, MOST_MB = 32, 4096
MEMORY = 64 << 20  # what reading a small file may take beyond what reading the good one takes


found_mb = {"least": 512}  # about where the search begins: most files need as much as the last one


def least_memory(pipeline_text, folder):
    """Bytes of address space in which the program reads a good file, to the next 32 MB."""

    def is_enough(megabytes):
        return run_limited(pipeline_text, folder, megabytes << 20).returncode == 0

    least = found_mb["least"]
    if is_enough(least):
        while is_enough(least - STEP_MB):
            least -= STEP_MB
    else:
        least += STEP_MB
        while not is_enough(least):
            least += STEP_MB
            assert least < MOST_MB, "no memory is enough"
    found_mb["least"] = least
    return least << 20


def run_limited(pipeline_text, folder, limit):
    shutil.rmtree(folder / "out", ignore_errors=True)
    (folder / "p.yaml").write_text(pipeline_text)

    def restrict():
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    # One thread: how many there are at the same moment, each with a stack, would be a matter of chance.
    command = [str(MARROW), "run", "p.yaml", "--out", "out", "--quiet", "--threads", "1"]
    return subprocess.run(
        command,
        cwd=folder,
        capture_output=True,
        text=True,
        errors="replace",
        timeout=240,
        preexec_fn=restrict,
        env=dict(os.environ, MARROW_PLUGIN_PATH=""),
    )


class Damaged(Reading):
    """Damaged copies of each kind of file, through the program as a person runs it."""

    def check(self, node, options, good):
        if program.IS_SANITIZED:
            self.skipTest("a sanitizer reserves all address space, so there is none to limit")
        text = "marrow: 1\nnodes:\n  it: {uses: %s, with: {path: '%s'%s}}\noutputs: {it: it}\n"
        limit = least_memory(text % (node, good, options), self.scratch) + MEMORY
        data = good.read_bytes()
        header = min(len(data), 400)
        bad = self.scratch / ("bad" + "".join(good.suffixes))
        read = 0
        numbers = sample(range(DAMAGED), SAMPLE, key=lambda number: number % 3)
        for number in numbers:
            source = random.Random(number * len(data))
            if number % 3 == 0:
                copy = data[: source.randrange(len(data) - 1)]
            elif number % 3 == 1:
                copy = data[: source.randrange(header)]
            else:
                copy = bytearray(data)
                for _ in range(3):
                    copy[source.randrange(header)] ^= source.randrange(1, 256)
            bad.write_bytes(copy)
            result = run_limited(text % (node, bad, options), self.scratch, limit)
            what = "%s, copy %d: %s" % (good.name, number, result.stderr)
            self.assertIn(result.returncode, (0, 1) if number % 3 == 2 else (1,), what)
            said = result.stderr.replace(str(self.scratch), "")  # the folder's name may hold any letters
            self.assertNotRegex(said, "bad_alloc|memory|std::|0x[0-9a-f]", what)
            if result.returncode == 1:
                self.assertIn(bad.name, result.stderr, what)
            read += result.returncode == 0
        print("\n    %-28s %d refused, %d read" % (good.name, len(numbers) - read, read))

    @needs("PIL", "numpy")
    def test_images(self):
        values = numpy.random.default_rng(5).integers(0, 65536, (40, 50)).astype("uint16")
        for name, options in (
            ("a.png", {}),
            ("lzw.tif", {"compression": "tiff_lzw"}),
            ("packbits.tif", {"compression": "packbits"}),
        ):
            PIL.fromarray(values).save(self.scratch / name, **options)
            self.check("read.image", "", self.scratch / name)

    @needs("tifffile", "numpy")
    def test_tiff_stack(self):
        values = numpy.random.default_rng(6).integers(0, 4096, (5, 24, 32)).astype("uint16")
        for name, options in (("zlib.tif", {"compression": "zlib"}), ("big.tif", {"bigtiff": True})):
            tifffile.imwrite(self.scratch / name, values, photometric="minisblack", metadata=None, **options)
            self.check("read.volume", ", voxel_size_mm: [1, 1, 1]", self.scratch / name)

    @needs("nibabel", "numpy")
    def test_nifti(self):
        image = nibabel.Nifti1Image(
            numpy.random.default_rng(7).integers(0, 3000, (9, 8, 7)).astype("int16"), numpy.eye(4)
        )
        for name in ("a.nii", "a.nii.gz"):
            nibabel.save(image, self.scratch / name)
            self.check("read.volume", "", self.scratch / name)

    @needs("pydicom")
    def test_dicom(self):
        for name in (
            "MR_small.dcm",
            "MR_small_implicit.dcm",
            "MR_small_bigendian.dcm",
            "MR_small_RLE.dcm",
            "MR_small_jpeg_ls_lossless.dcm",
        ):
            shutil.copy(DICOM / name, self.scratch / name)
            self.check("read.image", "", self.scratch / name)

    @needs("vtk")
    def test_vtk(self):
        image = vtk.vtkImageData()
        image.SetDimensions(7, 6, 5)
        image.AllocateScalars(vtk.VTK_SHORT, 1)
        image.GetPointData().GetScalars().FillComponent(0, 7)
        sphere = vtk.vtkSphereSource()
        sphere.Update()
        for writer, name, node, source in (
            (vtk.vtkMetaImageWriter(), "a.mha", "read.volume", image),
            (vtk.vtkSTLWriter(), "a.stl", "read.mesh", sphere.GetOutput()),
            (vtk.vtkPLYWriter(), "a.ply", "read.mesh", sphere.GetOutput()),
        ):
            writer.SetFileName(str(self.scratch / name))
            writer.SetInputData(source)
            if hasattr(writer, "SetFileTypeToBinary"):
                writer.SetFileTypeToBinary()
            writer.Write()
            self.check(node, "", self.scratch / name)


if __name__ == "__main__":
    main()
