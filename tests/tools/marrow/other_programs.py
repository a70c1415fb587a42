# SPDX-License-Identifier: Apache-2.0
"""For tests on files of other programs: which of these programs are installed, and the nodes that read files."""
import pathlib
import shutil
import unittest
import zlib

from harness.program import Case


def module(name):
    try:
        return __import__(name, fromlist=["_"])
    except ImportError:
        return None


numpy, pydicom, nibabel, tifffile, PIL, vtk, h5py = map(
    module, ("numpy", "pydicom", "nibabel", "tifffile", "PIL.Image", "vtkmodules.all", "h5py")
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


def pipeline_of(node, files, options="", may_fail=False):
    """A pipeline that reads each of the files by a node of its own, n0, n1, ..."""
    line = "  n%d: {uses: %s, with: {path: '%s'%s}%s}\n"
    nodes = [line % (i, node, file, options, ", may_fail: true" * may_fail) for i, file in enumerate(files)]
    outputs = ", ".join("n%d: n%d" % (i, i) for i in range(len(files)))
    return "marrow: 1\nnodes:\n%soutputs: {%s}\n" % ("".join(nodes), outputs)


class Reading(Case):
    plugins = []

    def run_node(self, node, options, file):
        text = "marrow: 1\nnodes:\n  it: {uses: %s, with: {path: '%s'%s}}\noutputs: {it: it}\n" % (node, file, options)
        self.write("p.yaml", text)
        shutil.rmtree(self.scratch / "out", ignore_errors=True)
        return self.marrow("run", "p.yaml", "--out", "out", "--quiet"), self.scratch / "out/outputs"

    def read_all(self, node, files, options=""):
        """What becomes of these files in one run: of each the path of what is written, or why it is refused."""
        self.write("p.yaml", pipeline_of(node, files, options, may_fail=True))
        shutil.rmtree(self.scratch / "out", ignore_errors=True)
        self.expect(0, "run", "p.yaml", "--out", "out", "--quiet")
        return self.outcomes(len(files))

    def outcomes(self, count):
        nodes = self.nodes()
        written = {path.stem: path for path in (self.scratch / "out/outputs").iterdir()}
        return [written.get("n%d" % i) or nodes["n%d" % i]["reason"] for i in range(count)]

    def images(self, files, options=""):
        return [numpy.array(PIL.open(path)) for path in self.read_all("read.image", files, options)]

    def volumes(self, files, options=""):
        return [read_mha(path) for path in self.read_all("read.volume", files, options)]

    def image(self, file, options=""):
        return self.images([file], options)[0]

    def volume(self, file, options=""):
        return self.volumes([file], options)[0]

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
