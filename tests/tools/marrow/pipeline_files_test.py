# SPDX-License-Identifier: Apache-2.0
"""Which inputs a pipeline has: `marrow check` and `marrow inspect FILE.yaml` list them."""
import json
import re
import shutil

import yaml

from harness import SOURCE, formats
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
    files = {"p.yaml": PIPELINE, "part.yaml": PART}

    def told(self, *arguments):
        result = self.expect(0, *arguments)
        self.assertEqual(result.stderr, "")
        return result.stdout

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


# Outputs that a run does not make because its data lack something: the run ends well, and says which and why.
CAMERA = {"source_to_detector_mm": 1000, "source_to_isocentre_mm": 600, "pixel_mm": 1, "alpha_deg": 0, "beta_deg": 0}
PIPELINE_OF_LACKING = """marrow: 1
inputs: {case: {type: path}}
nodes:
  case:    {uses: read.case, with: {path: $case}}
  bone:    {uses: segment.level_set, in: {volume: case.ct, seeds: case.seeds}}
  model:   {uses: mesh.marching_cubes, in: {field: bone}}
  display: {uses: mesh.simplify, in: {mesh: model}}
outputs: {bone: bone, model: model, views: case.views, display: display}
"""
REASON = "node 'bone' (segment.level_set) needs 'seeds', which node 'case' (read.case) does not give"


class Lacking(Case):
    def setUp(self):
        super().setUp()
        grid = formats.straight((8, 8, 8))
        inside = [int(all(2 <= k < 6 for k in (i % 8, i // 8 % 8, i // 64))) for i in range(512)]
        self.write("case/labels.mha", formats.mha(grid, inside))
        self.write("case/ct.mha", formats.mha(grid, [2000 * one - 1000 for one in inside]))
        self.write("case/front.png", formats.png(64, 64, [128] * 4096))
        self.write("p.yaml", PIPELINE_OF_LACKING)

    def run_it(self, *arguments, **case):
        """Runs the pipeline on a case of one view and one bone, which has this besides."""
        camera = {"width_px": 64, "height_px": 64, "c_arm": CAMERA}
        views = [{"name": "frontal", "image": "front.png", "camera": camera}]
        self.write("case/case.yaml", yaml.safe_dump({"marrow-case": 1, "ct": "ct.mha", "views": views, **case}))
        return self.printed("run", "p.yaml", "case=case", "--out", "out", *arguments)

    def test_outputs_behind_the_lacking_value_are_named_with_the_reason(self):
        labelled = {"labels": "labels.mha", "fragments": {"bone": {"label": 1}}}
        self.assertIn("\n  model, display: not there because %s\n" % REASON, self.run_it(**labelled))
        shutil.rmtree(self.scratch / "out")
        end = json.loads(self.run_it("--json", **labelled).splitlines()[-1])
        self.assertEqual(end["absent"], {"model": REASON, "display": REASON})

    def test_nothing_is_said_if_nothing_lacks(self):
        self.assertNotIn("not there", self.run_it(fragments={"bone": {"seeds": [[3, 3, 3]]}}))


# Outputs that no file can hold: what `check` and `run` say about them, and pipelines that only the program runs.
PIPELINE_OF_INSIDE = """marrow: 1
%snodes:
  optimizer: {uses: optimizer.nelder_mead}
  camera: {uses: read.camera, with: {path: camera.yaml}}
outputs:
  search: optimizer
  camera: camera
"""
CAMERA_OF_INSIDE = """marrow-camera: 1
width_px: 6
height_px: 4
intrinsics: [[10, 0, 2.5], [0, 10, 1.5], [0, 0, 1]]
camera_from_world:
  {target: camera, source: world, rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], translation_mm: [0, 0, 600]}
"""
ONLY_INSIDE = PIPELINE_OF_INSIDE % "only_inside: true\n"


class OnlyInside(Case):
    files = {"camera.yaml": CAMERA_OF_INSIDE}

    def test_a_function_is_no_output_of_a_command(self):
        message = "output 'search' is a function (optimizer), which no file can hold"
        hint = "leave it out; or, if no command runs the pipeline but only the program itself, say  only_inside: true"
        for command in ("check", "run"):
            self.faults((PIPELINE_OF_INSIDE % "", 6, 3, message, hint), command=[command])

    def test_a_pipeline_that_only_the_program_runs_may_have_it(self):
        self.write("p.yaml", ONLY_INSIDE)
        checked = self.expect(0, "check", "p.yaml")
        note = "  note: no command runs it, but the program itself (only_inside): no file need hold its outputs\n"
        self.assertEqual((checked.stdout, checked.stderr), ("p.yaml: good; 2 nodes, 2 outputs\n" + note, ""))
        ran = self.marrow("run", "p.yaml")
        self.assertNotEqual(ran.returncode, 0)
        self.assertIn(
            "p.yaml: output 'search' is a function, which no file can hold; the program itself runs this pipeline "
            "(only_inside): name other outputs with --only",
            ran.stderr,
        )
        self.assertFalse((self.scratch / "runs").exists())
        self.expect(0, "run", "p.yaml", "--only", "camera")
        self.assertTrue((self.scratch / "runs" / "p" / "outputs" / "camera.yaml").exists())

    def test_it_is_a_truth_value(self):
        self.write("p.yaml", PIPELINE_OF_INSIDE % "only_inside: perhaps\n")
        self.refused("p.yaml:2:1: error: only_inside", "check", "p.yaml")

    def test_all_pipelines_of_the_workbench_are_good(self):
        files = sorted((SOURCE / "pipelines" / "workbench").glob("*.yaml"))
        self.assertIn("place.yaml", [file.name for file in files])
        for file in files:
            self.assertEqual(self.expect(0, "check", file).stderr, "", file)


# A pose that nobody judged is never silent: a part of a pipeline gives the verdicts of its poses, too.
POSE = """marrow-pose: 1
target: world
source: ct
rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
translation_mm: [0, 0, %d]
covariance:
  - [%g, 0, 0, 0, 0, 0]
  - [0, %g, 0, 0, 0, 0]
  - [0, 0, %g, 0, 0, 0]
  - [0, 0, 0, 0.01, 0, 0]
  - [0, 0, 0, 0, 0.01, 0]
  - [0, 0, 0, 0, 0, 0.01]
"""
PIPELINE_OF_VERDICTS = """marrow: 1
nodes:
  bone: {uses: read.mesh, with: {path: box.stl}}
  found: {uses: read.pose, with: {path: found.yaml}}
  stages: {uses: deviations.calibrated, in: {stages: [found], model: bone}}
  other: {uses: read.pose, with: {path: other.yaml}}
  verdict: {uses: verdict.predicted, in: {pose: found, model: bone}}
outputs: {pose: stages.pose, found: found, other: other, bone: bone, verdict: verdict}
"""


def box_stl():
    """An ASCII STL of 20 x 20 x 100 mm."""
    corner = lambda index: [(-10, 10)[index & 1], (-10, 10)[index >> 1 & 1], (-50, 50)[index >> 2]]
    triangles = [(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4)]
    triangles += [(2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)]
    facet = lambda three: "facet normal 0 0 0\nouter loop\n%sendloop\nendfacet\n" % "".join(
        "vertex %g %g %g\n" % tuple(corner(one)) for one in three
    )
    return "solid box\n" + "".join(map(facet, triangles)) + "endsolid box\n"


class OnlyVerdicts(Case):
    def setUp(self):
        super().setUp()
        self.write("box.stl", box_stl())
        self.write("p.yaml", PIPELINE_OF_VERDICTS)
        # A radian about the long axis: nearly all errors are above 5 degrees.
        self.write("found.yaml", POSE % (700, 1e-6, 1e-6, 1))
        self.write("other.yaml", POSE % (710, 1e-6, 1e-6, 1e-6))

    def only(self, name, code):
        result = self.expect(code, "run", "p.yaml", "--no-cache", "--out", name, "--only", name)
        return result, self.json(name + "/run.json").get("verdicts")

    def test_a_part_of_a_pipeline_ends_as_the_whole(self):
        whole = self.expect(3, "run", "p.yaml", "--no-cache", "--out", "whole")
        self.assertEqual(re.findall("nobody judges the output '(.*)':", whole.stderr), ["other"])
        for name in ("found", "pose"):  # the second one has other deviations, and is judged by where it comes from
            result, verdicts = self.only(name, code=3)
            self.assertIn("\nverdict: WRONG (failure", result.stdout)
            self.assertEqual([one["output"] for one in verdicts], ["verdict"])
            self.assertNotIn("nobody judges", result.stderr)
            made = [path.name for path in (self.scratch / name / "outputs").iterdir()]
            self.assertEqual(sorted(made), sorted([name + ".yaml", "verdict.yaml"]))

    def test_a_pose_without_a_verdict_is_told(self):
        result, verdicts = self.only("other", code=0)
        self.assertIsNone(verdicts)
        note = "nobody judges the output 'other'"
        self.assertIn("marrow: note: %s: this pipeline has no verdict on that pose\n" % note, result.stderr)
        self.assertIn(note, self.read("other/log.txt"))
        self.assertNotIn("WRONG", result.stdout)

    def test_what_needs_no_pose_needs_no_verdict(self):
        result, verdicts = self.only("bone", code=0)
        self.assertIsNone(verdicts)
        self.assertNotIn("nobody judges", result.stderr)


# Pipelines of several files at the command line: show --resolved, graph, runs, rerun, --set-file, experiments.
BASE = """marrow: 1
inputs: {v: {type: number, default: 3}}
nodes:
  c: {uses: test.constant, with: {value: $v}}
  d: {uses: test.constant, with: {value: 4}}
  sum: {uses: test.add, in: {a: c, b: d}}
outputs: {sum: sum}
"""
PART_OF_EXTENDS = """marrow: 1
inputs: {to: {type: metrics}, by: {type: number, default: 3}}
nodes:
  c: {uses: test.constant, with: {value: $by}}
  sum: {uses: test.add, in: {a: to, b: c}}
outputs: {sum: sum}
"""
WHOLE = """marrow: 1
extends: base.yaml
nodes:
  plus: {uses: part.yaml, in: {to: sum}}
outputs: {sum: plus}
"""
MINE = "marrow: 1\nextends: whole.yaml\nset:\n  d.value: 5\n  sum.uses: test.add\n"
EXPERIMENT = """experiment: 1
pipeline: whole.yaml
cases: {seeds: 1..3}
variants: {one: {}, two: {plus.c.value: 4}}
metrics: [sum.value]
"""
EXTENDING = "experiment: 1\nextends: e.yaml\nvariants: {two: null, three: {plus.by: 9}}\ncases: {seeds: 1..2}\n"


class Extends(Case):
    def setUp(self):
        super().setUp()
        for name, text in (("base", BASE), ("part", PART_OF_EXTENDS), ("whole", WHOLE), ("mine", MINE)):
            self.write(name + ".yaml", text)

    def value(self, *arguments, out="run"):
        self.expect(0, "run", "whole.yaml", *arguments, "--out", out)
        return self.metric(out + "/outputs/sum.json")

    def tells(self, patterns, *command):
        told = self.printed(*command)
        for pattern in patterns:
            self.assertRegex(told, r"(?m)^%s$" % pattern)
        return told

    def test_a_run_and_what_it_writes(self):
        self.assertEqual(self.value(), 3 + 4 + 3)
        self.assertEqual(self.value("v=5", "--set", "plus.by=1", "--set", "d.value=2", out="two"), 5 + 2 + 1)
        self.assertEqual(self.value("--set", "plus.c.value=10", out="three"), 3 + 4 + 10)
        self.assertIn("plus/sum:", self.read("run/pipeline.yaml"))
        self.expect(0, "rerun", "run", "--out", "again")
        self.assertEqual(self.read("run/outputs/sum.json"), self.read("again/outputs/sum.json"))
        self.refused("values of inputs are for --resolved", "show", "run", "v=8")

    def test_show_resolved(self):
        lines = [r"  c: +# base\.yaml:4", r"      value: 8", r"      count: 0 +# default"]
        lines += [r"  plus/sum: +# part\.yaml:5", r"    in: \{a: sum, b: plus/c\}"]
        self.write("resolved.yaml", self.tells(lines, "show", "whole.yaml", "--resolved", "v=8"))
        self.expect(0, "check", "resolved.yaml")

    def test_plan_and_graph_say_where_nodes_of_other_files_are_written(self):
        lines = [
            r"c +test\.constant +runs: it has not run before \(base\.yaml:4\)",
            r"d +test\.constant +.* \(base\.yaml:5, value: mine\.yaml:4\)",
            r"sum +test\.add +.* \(base\.yaml:6, uses: mine\.yaml:5\)",
            r"plus/sum +test\.add +.* \(part\.yaml:5\)",
        ]
        self.tells(lines, "plan", "mine.yaml")
        self.tells([r"c +test\.constant .*before"], "plan", "base.yaml")
        self.assertEqual(self.json_of("plan", "mine.yaml")["nodes"]["c"]["written"], "base.yaml:4")
        self.tells([r"plus/sum  \(test\.add\)  \[\S*part\.yaml:5\]"], "graph", "whole.yaml")
        self.assertIn('tooltip="', self.printed("graph", "whole.yaml", "--dot"))
        deep = self.write("one/two/mine.yaml", "marrow: 1\nextends: ../../base.yaml\n")
        self.assertIn("(%s:4)" % (self.scratch.resolve() / "base.yaml"), self.printed("plan", deep))

    def test_diff_says_which_file_changed_an_option(self):
        self.expect(0, "run", "whole.yaml", "--out", "a")
        self.expect(0, "run", "mine.yaml", "--set", "d.count=2", "--out", "b")
        told = self.expect(1, "diff", "a", "b").stdout
        self.assertIn("why: option 'value' is 5, was 4 (mine.yaml:4, was base.yaml:5)", told)
        self.assertIn("why: option 'count' is 2, was 0 (--set d.count=2, was the default)", told)

    def test_a_file_of_settings(self):
        by_file = ["--set-file", "here.yaml"]
        self.write("here.yaml", "inputs: {v: 6}\nset: {plus.by: 1, d.uses: test.draw, d.in: 3}\n")
        self.refused("here.yaml:2", "run", "whole.yaml", *by_file)
        self.write("here.yaml", "inputs: {v: 6}\nset: {plus.by: 1, d.value: 5}\n")
        self.assertEqual(self.value(*by_file), 6 + 5 + 1)
        self.assertEqual(self.value("v=1", *by_file, "--set", "d.value=2", out="two"), 1 + 2 + 1)
        said = "unknown key 'input' in the file of settings"
        fault = ("input: {v: 6}\n", 1, 1, said, "did you mean 'inputs'?")
        self.faults(fault, command=("run", "whole.yaml", "--set-file"), file="here.yaml")
        said = "none.yaml: error: the file of settings cannot be read"
        self.refused(said, "run", "whole.yaml", "--set-file", "none.yaml")

    def test_an_experiment_that_extends(self):
        self.write("e.yaml", EXPERIMENT)
        self.write("f.yaml", EXTENDING)
        self.expect(0, "compare", "f.yaml", "--out", "out", "--quiet")
        variants = [cell.split("/")[0] for cell in self.rows()]
        self.assertEqual(len(variants), 2 * 2)
        self.assertEqual([name for name in variants if "two" in name], [])


if __name__ == "__main__":
    main()
