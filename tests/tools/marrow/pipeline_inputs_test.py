# SPDX-License-Identifier: Apache-2.0
"""Which inputs a pipeline has: `marrow check` and `marrow inspect FILE.yaml` list them."""
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
        result = self.expect(0, *arguments)
        self.assertEqual(result.stderr, "")
        return result.stdout

    def setUp(self):
        super().setUp()
        self.write("p.yaml", PIPELINE)
        self.write("part.yaml", PART)

    def test_check_lists_them(self):
        lines = "p.yaml: good; 2 nodes, 2 outputs\n" + LINES % self.scratch + "  note: nothing uses"
        said = self.told("check", "p.yaml", "other=x.yaml")
        self.assertTrue(said.startswith(lines), said)

    def test_inspect_lists_inputs_and_outputs(self):
        self.assertEqual(
            self.told("inspect", "p.yaml"),
            "listed\n  Reads a pose.\n\n"
            + LINES % self.scratch
            + "  output found (pose): pose of the model in the world\n"
            "  output points (landmarks for each fragment): points in CT coordinates (mm), in pixels of views, and in "
            "world coordinates (mm)\n",
        )
        obj = (
            "  output obj (obj_file for each fragment): %s\n"
            % self.json_of("inspect", "write.obj")["outputs"][0]["help"]
        )
        self.assertEqual(self.told("inspect", "part.yaml"), "part\n\n" + PART_LINES + obj)

    def test_inspect_as_json(self):
        said = self.json_of("inspect", "p.yaml")
        self.assertEqual((said["name"], said["help"]), ("listed", "Reads a pose."))
        self.assertEqual(said["inputs"][0], {"name": "pose", "type": "path", "help": "the file"})
        self.assertEqual(said["inputs"][4], {"name": "seed", "type": "integer", "help": "", "default": "7"})
        outputs = [(one["name"], one["type"], one["axes"]) for one in said["outputs"]]
        self.assertEqual(outputs, [("found", "pose", []), ("points", "landmarks", ["fragment"])])
        models = {"name": "models", "type": "mesh", "help": "surfaces", "over": "fragment", "optional": False}
        ct = {"name": "ct", "type": "volume", "help": "", "optional": True}
        self.assertEqual(self.json_of("inspect", "part.yaml")["inputs"], [models, ct])

    def test_faults(self):
        said = "marrow: error: --yaml prints a snippet for a node, and 'p.yaml' is a pipeline\n"
        self.assertEqual(self.expect(2, "inspect", "p.yaml", "--yaml").stderr, said)
        self.write("bad.yaml", "marrow: 1\nnodes: {a: {uses: no.no}}\noutputs: {a: a}\n")
        self.refused("bad.yaml:2:19: error: unknown node 'no.no'", "inspect", "bad.yaml")


if __name__ == "__main__":
    main()
