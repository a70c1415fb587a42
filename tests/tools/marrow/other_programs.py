# SPDX-License-Identifier: Apache-2.0
"""For tests on files of other programs: which of these programs are installed, and the nodes that read files."""
import pathlib
import shutil
import unittest
import zlib

from harness.program import Case, marrow


def module(name):
    try:
        return __import__(name, fromlist=["_"])
    except ImportError:
        return None


numpy, pydicom, nibabel, tifffile, PIL, vtk = map(
    module, ("numpy", "pydicom", "nibabel", "tifffile", "PIL.Image", "vtkmodules.all")
)
DICOM = pathlib.Path(pydicom.__file__).parent / "data" / "test_files" if pydicom else None


def needs(*names):
    missing = [name for name in names if not globals()[name]]
    return unittest.skipIf(missing, "not installed here: python3 module " + ", ".join(missing))


def read_mha(path):
    """Values (z, y, x), and the header's keys, of a MetaImage of floats as marrow writes it."""
    data = path.read_bytes()
    end = data.index(b"\n", data.index(b"ElementDataFile")) + 1
    keys = dict(line.split(" = ", 1) for line in data[:end].decode().splitlines())
    body = zlib.decompress(data[end:]) if keys.get("CompressedData") == "True" else data[end:]
    size = [int(n) for n in keys["DimSize"].split()]
    return numpy.frombuffer(body, dtype="<f4").reshape(size[::-1]), keys


class Reading(Case):
    def run_node(self, node, options, file):
        pipeline = self.write(
            "p.yaml",
            "marrow: 1\nnodes:\n  it: {uses: %s, with: {path: '%s'%s}}\noutputs: {it: it}\n" % (node, file, options),
        )
        out = self.scratch / "out"
        shutil.rmtree(out, ignore_errors=True)
        return marrow("run", pipeline, "--out", out, "--quiet"), out / "outputs"

    def image(self, file, options=""):
        result, out = self.run_node("read.image", options, file)
        self.assertEqual(result.returncode, 0, "%s: %s" % (file, result.stderr))
        return numpy.array(PIL.open(out / "it.png"))

    def volume(self, file, options=""):
        result, out = self.run_node("read.volume", options, file)
        self.assertEqual(result.returncode, 0, "%s: %s" % (file, result.stderr))
        return read_mha(out / "it.mha")

    def refused(self, node, file, options=""):
        result, _ = self.run_node(node, options, file)
        self.assertEqual(result.returncode, 1, "%s: %s" % (file, result.stderr))
        self.assertIn(pathlib.Path(file).name, result.stderr)
        return result.stderr

    def assert_scaled(self, image, expected):
        """Floats are written as 16 bits between the least and the greatest."""
        low, high = float(expected.min()), float(expected.max())
        wanted = (expected.astype(float) - low) * (65535 / (high - low))
        self.assertEqual(image.shape, expected.shape)
        self.assertLessEqual(float(numpy.abs(image.astype(float) - wanted).max()), 1)
