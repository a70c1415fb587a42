# SPDX-License-Identifier: Apache-2.0
"""The installed package is whole wherever it lies."""
import os
import pathlib
import subprocess
import sys

from harness.package import BUILD, SOURCE, Case, main

CODE = """
import marrow, numpy
from marrow import _core, program
print(marrow.__file__)
print(_core.framework_file())
print(program.path())
print("edges.canny" in _core.node_names())
z, y, x = numpy.mgrid[-9:10, -9:10, -9:10]
ball = marrow.SignedField(numpy.sqrt(x**2 + y**2 + z**2) - 6, spacing_mm=(1, 1, 1))
print(len(marrow.mesh.marching_cubes(ball).triangles) > 100)
camera = marrow.Camera(9, 9, [[9, 0, 4], [0, 9, 4], [0, 0, 1]], numpy.eye(4))
step = marrow.View(numpy.repeat(numpy.arange(9), 9).reshape(9, 9).astype("uint16") * 1000, camera)
print(len(marrow.edges.steepest_python(step)))
"""


class Install(Case):
    def test_it_may_be_moved(self):
        install = ["cmake", "--install", BUILD, "--prefix", self.scratch / "first"]
        subprocess.run(install, check=True, stdout=subprocess.DEVNULL)
        (self.scratch / "first").rename(self.scratch / "moved")
        packages = self.scratch / "moved" / "lib" / "python3" / "dist-packages"
        environment = {key: value for key, value in os.environ.items() if not key.startswith("MARROW_")}
        environment.update(PYTHONPATH=str(packages), MARROW_CACHE=str(self.scratch / "cache"))
        environment["MARROW_PLUGIN_PATH"] = str(SOURCE / "docs" / "example-plugin")
        how = {"env": environment, "cwd": self.scratch, "capture_output": True, "text": True}
        done = subprocess.run([sys.executable, "-c", CODE], **how)
        self.assertEqual(done.returncode, 0, done.stderr)
        files = done.stdout.splitlines()
        for file, end in zip(files, ("marrow/__init__.py", "libmarrow.so.0", "bin/marrow")):
            self.assertTrue(pathlib.Path(file).is_relative_to(self.scratch / "moved"), file)
            self.assertIn(end, file)
        self.assertEqual(files[3:], ["True", "True", "49"])
        for name in ("py.typed", "__init__.pyi", "nodes.pyi", "_core.pyi", "surface_view.js"):
            self.assertTrue((packages / "marrow" / name).is_file(), name)
            self.assertFalse((packages / "marrow" / name).is_symlink(), name)


if __name__ == "__main__":
    main()
