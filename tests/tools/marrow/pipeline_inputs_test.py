# SPDX-License-Identifier: Apache-2.0
"""Which inputs a pipeline has: `marrow check` and `marrow inspect FILE.yaml` list them."""
import json

from harness.program import Case, main

PIPELINE = """marrow: 1
name: listed
help: Reads a pose.
inputs:
  pose: {type: path, help: the file}
  other: {type: path, default: data/other.yaml}
  none: {type: path, default: ""}
  maps: {default: world_to_ct, help: direction}
  seed: {type: integer, default: 7}
  size_mm: {type: number, default: 1e-3}
  thin: {type: boolean, default: true}
nodes: {a: {uses: read.pose, with: {path: $pose, maps: $maps}}, b: {uses: read.landmarks, with: {path: $other}}}
outputs: {found: a, points: b}
"""
LINES = """  input pose (path, must be given): the file
  input other (path, default '%s/data/other.yaml')
  input none (path, default '')
  input maps (text, default 'world_to_ct'): direction
  input seed (integer, default 7)
  input size_mm (number, default 1e-3)
  input thin (boolean, default true)
"""
PART = """marrow: 1
inputs:
  models: {type: mesh, over: fragment, help: surfaces}
  ct: {type: volume, optional: true}
nodes: {obj: {uses: write.obj, in: {mesh: models}}}
outputs: {obj: obj}
"""
PART_LINES = """  input models (mesh for each fragment; given by a pipeline that uses this one): surfaces
  input ct (volume, optional; given by a pipeline that uses this one)
"""


class PipelineInputs(Case):
    def told(self, *arguments):
        result = self.marrow(*arguments)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        return result.stdout

    def test_check_lists_them(self):
        self.write("p.yaml", PIPELINE)
        said = self.told("check", "p.yaml", "other=x.yaml")
        self.assertTrue(
            said.startswith("p.yaml: good; 2 nodes, 2 outputs\n" + LINES % self.scratch + "  note: nothing uses"), said
        )

    def test_inspect_lists_inputs_and_outputs(self):
        self.write("p.yaml", PIPELINE)
        self.assertEqual(
            self.told("inspect", "p.yaml"),
            "listed\n  Reads a pose.\n\n"
            + LINES % self.scratch
            + "  output found (pose): pose of the model in the world\n"
            "  output points (landmarks for each fragment): points in CT coordinates (mm), in pixels of views, and in "
            "world coordinates (mm)\n",
        )
        self.write("part.yaml", PART)
        self.assertEqual(
            self.told("inspect", "part.yaml"),
            "part\n\n" + PART_LINES + "  output obj (obj_file for each fragment): %s\n" % self.help_of("write.obj"),
        )

    def help_of(self, node):
        return json.loads(self.told("inspect", node, "--json"))["outputs"][0]["help"]

    def test_inspect_as_json(self):
        self.write("p.yaml", PIPELINE)
        said = json.loads(self.told("inspect", "p.yaml", "--json"))
        self.assertEqual((said["name"], said["help"]), ("listed", "Reads a pose."))
        self.assertEqual(said["inputs"][0], {"name": "pose", "type": "path", "help": "the file"})
        self.assertEqual(said["inputs"][4], {"name": "seed", "type": "integer", "help": "", "default": "7"})
        self.assertEqual(
            [(one["name"], one["type"], one["axes"]) for one in said["outputs"]],
            [("found", "pose", []), ("points", "landmarks", ["fragment"])],
        )
        self.write("part.yaml", PART)
        self.assertEqual(
            json.loads(self.told("inspect", "part.yaml", "--json"))["inputs"],
            [
                {"name": "models", "type": "mesh", "help": "surfaces", "over": "fragment", "optional": False},
                {"name": "ct", "type": "volume", "help": "", "optional": True},
            ],
        )

    def test_faults(self):
        self.write("p.yaml", PIPELINE)
        result = self.marrow("inspect", "p.yaml", "--yaml")
        self.assertEqual(
            (result.returncode, result.stderr),
            (2, "marrow: error: --yaml prints a snippet for a node, and 'p.yaml' is a pipeline\n"),
        )
        self.write("bad.yaml", "marrow: 1\nnodes: {a: {uses: no.no}}\noutputs: {a: a}\n")
        result = self.marrow("inspect", "bad.yaml")
        self.assertEqual(result.returncode, 2)
        self.assertIn("bad.yaml:2:19: error: unknown node 'no.no'", result.stderr)


if __name__ == "__main__":
    main()
