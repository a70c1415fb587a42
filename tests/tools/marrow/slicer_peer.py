# SPDX-License-Identifier: Apache-2.0
"""What 3D Slicer does with a command-line module: its command line, its files, and what it reads of the output."""
import os
import pathlib
import re
import subprocess
import xml.etree.ElementTree

from harness.program import Case

FILES = ("image", "geometry", "transform", "pointfile")
TEXTS = ("file", "directory", "string")


class Module:
    def __init__(self, program, folder):
        self.program, self.folder = program, folder
        self.xml = subprocess.run([program, "--xml"], stdout=subprocess.PIPE, check=True).stdout
        self.parameters = {}
        for parameter in xml.etree.ElementTree.fromstring(self.xml).findall("parameters/*[name]"):
            self.parameters[parameter.findtext("name")] = parameter

    def temporary_file(self, name):
        """Slicer gives the file the first of the parameter's ends, and no digits."""
        return self.folder / ("temporary_" + name + self.parameters[name].get("fileExtensions").split(",")[0])

    def words(self, **values):
        """The command line. Files that Slicer makes or reads are given as True, or as the file to be read."""
        words = [self.program]
        for name, parameter in self.parameters.items():
            value = values.pop(name, None)
            if value is None:
                value = parameter.findtext("default") or ""
            if parameter.tag == "boolean":
                words += ["--" + name] if value in (True, "true") else []
            elif parameter.tag in FILES:
                words += ["--" + name, self.temporary_file(name) if value is True else value] if value else []
            elif value != "" or parameter.tag not in TEXTS:
                words += ["--" + name, value]
        assert not values, values
        return [str(word) for word in words]

    def run(self, environment=None, **values):
        return self.called(self.words(**values)[1:], environment)

    def called(self, words, environment=None):
        return subprocess.run(
            [self.program, *map(str, words)],
            capture_output=True,
            text=True,
            cwd=self.folder,
            env={**os.environ, **(environment or {})},
        )


def progress(output):
    """The values of the progress bar."""
    return [float(text) for text in re.findall("<filter-progress>(.*?)</filter-progress>", output)]


def read_tfm(file):
    """The matrix of a text of ITK: from the fixed to the moving image, in LPS. The centre moves with the rotation."""
    lines = pathlib.Path(file).read_text().splitlines()
    keys = dict(line.split(": ", 1) for line in lines if ": " in line)
    numbers = [float(word) for word in keys["Parameters"].split()]
    centre = [float(word) for word in keys["FixedParameters"].split()]
    assert len(numbers) == 12 and keys["Transform"].split("_")[0] in ("AffineTransform", "MatrixOffsetTransformBase")
    matrix = [numbers[0:3], numbers[3:6], numbers[6:9]]
    moved = [numbers[9 + i] + centre[i] - sum(matrix[i][k] * centre[k] for k in range(3)) for i in range(3)]
    return [[*matrix[i], moved[i]] for i in range(3)] + [[0, 0, 0, 1]]


# One input of each kind. The camera reaches its node through a part.
KINDS = """marrow: 1
name: all-kinds
help: Text with <tags> & "quotes".
inputs:
  ct: {type: path, help: a CT}
  surface: {type: path}
  start: {type: path}
  numbers: {type: path}
  points: {type: path}
  patient: {type: path}
  below: {type: path, default: data}
  camera: {type: path, default: a.camera.yaml}
  offset_hu: {type: number, default: 2e-05}
  frame: {type: integer, default: 3}
  logarithm: {type: boolean, default: true}
  coordinates: {type: text, default: world}
  fragment: {type: text, default: distal}
  needed: {type: text}
nodes:
  ct: {uses: read.volume, with: {path: $ct, value_offset_hu: $offset_hu}}
  surface: {uses: read.mesh, with: {path: $surface, coordinates: $coordinates}}
  start: {uses: read.pose, with: {path: $start}}
  numbers: {uses: read.pose, with: {path: $numbers, maps: ct_to_world}}
  points: {uses: read.landmarks, with: {path: $points, fragment: $fragment}}
  patient: {uses: read.case, with: {path: $patient}}
  view: {uses: part.yaml, with: {camera: $camera, image: $below/image.png, frame: $frame, name: $needed}}
  edges: {uses: edges.gradient_mask, in: {view: view}, with: {logarithm: $logarithm}}
outputs: {ct: ct, surface: surface, start: start, numbers: numbers, points: points, patient: patient.seeds,
  edges: edges}
"""
PART = """marrow: 1
inputs: {camera: {type: path}, image: {type: path}, frame: {type: integer}, name: {type: text}}
nodes: {view: {uses: read.view, with: {camera: $camera, image: $image, frame: $frame, name: $name}}}
outputs: {view: view}
"""


class Export(Case):
    """For tests of modules that are made of a text."""

    def export(self, text, name="exported.yaml"):
        """The module of a pipeline with this text."""
        self.write(name, text)
        result = self.marrow("export", "slicer", name, "--out", "modules")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        made = self.scratch / result.stdout.splitlines()[0].removeprefix("made ")
        return Module(made, self.scratch)
