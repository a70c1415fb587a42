# SPDX-License-Identifier: Apache-2.0
"""The schemas for editors, held against the shipped pipelines and experiments by an independent validator."""
import json
import shutil

import jsonschema
import yaml

from harness import SOURCE
from harness.program import Case, main, marrow
from harness.sample import sample
from harness.shipped import shipped


class SchemaCase(Case):
    """Tests of one schema, whose text schema_text() gives."""

    @classmethod
    def setUpClass(cls):
        cls.schema = json.loads(cls.schema_text())
        jsonschema.Draft7Validator.check_schema(cls.schema)
        cls.validator = jsonschema.Draft7Validator(cls.schema)

    def errors(self, text):
        return [error.message for error in self.validator.iter_errors(yaml.safe_load(text))]


class Schema(SchemaCase):
    @staticmethod
    def schema_text():
        return marrow("schema").stdout

    def test_every_pipeline_is_valid(self):
        files = shipped() + sorted((SOURCE / "pipelines" / "parts").glob("*.yaml"))
        self.assertGreater(len(files), 30)
        for path in files:
            errors = [error.message for error in self.validator.iter_errors(yaml.safe_load(path.read_text()))]
            self.assertEqual(errors, [], str(path))
            self.assertEqual(marrow("check", path).returncode, 0, str(path))

    def test_faults_are_found(self):
        good = yaml.safe_load((SOURCE / "pipelines" / "femur" / "femur.yaml").read_text())
        for spoil in (
            lambda p: p["nodes"]["edges"].update(uses="edges.nothing"),
            lambda p: p["nodes"]["edges"]["with"].update(low=1000),
            lambda p: p["nodes"]["edges"]["with"].update(hihg=1),
            lambda p: p["nodes"]["edges"]["in"].pop("view"),
            lambda p: p.update(colour="red"),
            lambda p: p.pop("marrow"),
        ):
            bad = json.loads(json.dumps(good))
            spoil(bad)
            self.assertFalse(self.validator.is_valid(bad))

    def test_the_committed_schema_is_current(self):
        self.assertEqual(
            json.loads((SOURCE / "schemas" / "pipeline.schema.json").read_text()),
            self.schema,
            "run: marrow schema --out schemas/pipeline.schema.json",
        )


# All that an experiment file can say.
EXPERIMENT = """experiment: 1
name: all
help: one of each
pipeline: PIPELINES/femur/femur.yaml
inputs: {}
set: {start.uses: initial.manual, edges.low: 40, contour_cost.in.views: [case.views.frontal, case.views.lateral]}
cases:
  input: case
  folders: [cases/*]
  simulate:
    pipeline: PIPELINES/simulate/simulate.yaml
    output: case
    set: {cameras.beta_deg: [0, 60]}
    seeds: 1..2
    inputs: {variation: 1}
    draw: {rotation_axial_deg: [-10, 10]}
    seed_input: [shape_seed]
variants:
  nelder_mead:
  bobyqa: {optimizer.uses: optimizer.bobyqa}
matrix: {edges.high: [75, 80]}
starts: {node: start, count: 2, seed: 3, rotation_deg: 4, translation_mm: 5, distance_mm: 8}
metrics: [errors.distal.final.mtre_mm, {figure: errors.distal.final.rotation_deg, label: rotation}]
success: {errors.distal.final.mtre_mm: 2}
initial_error: errors.distal.start.mtre_mm
baseline: bobyqa+75+1
pictures: [overlay]
timed_cells: 1
compare_all: true
sweep: {options: {edges.sigma_px: {range: [1, 2], scale: log, whole: false}}, grid: 2}
stop: {width: 0.1, figure: success, most_cases: 10, look_every: 5}
"""
# What replaces its last two keys.
TUNE = """tune:
  options: {edges.sigma_px: {range: [1, 2], scale: log, whole: false}}
  figure: errors.distal.final.mtre_mm
  failed_as: 10
  variant: bobyqa+75
  optimizer: {uses: optimizer.cma_es, with: {}}
  points: 5
  training_cases: 2
"""
# What of it becomes what, and is then refused by the schema and by the program alike.
WRONG = {
    "experiment: 1": "experiment: 2",
    "name: all": "name: a/b",
    "help: one": "halp: one",
    "pipeline: PIPELINES/femur/femur.yaml\n": "",
    "edges.low": "edges",
    "inputs: {}": "inputs: {case: [1]}",
    "  input: case": "  input: [case]",
    "folders: [cases/*]": "folders: cases/*",
    "    output: case": "    out: case",
    "seeds: 1..2": "seeds: 1-2",
    "    pipeline: PIPELINES/simulate/simulate.yaml\n": "",
    "set: {cameras.beta_deg: [0, 60]}": "set: [cameras]",
    "[-10, 10]": "[-10]",
    "[shape_seed]": "shape_seed",
    "  bobyqa: {optimizer.uses: optimizer.bobyqa}": "  bobyqa: optimizer.bobyqa",
    "  nelder_mead:": "  nelder/mead:",
    "[75, 80]": "75",
    "node: start, ": "",
    "count: 2": "count: 0",
    "seed: 3": "seed: -3",
    "rotation_deg: 4": "rotation_deg: 400",
    "translation_mm: 5": "translation: 5",
    "{figure: ": "{path: ",
    "label: rotation": "lable: rotation",
    "mtre_mm: 2": "mtre_mm: low",
    "initial_error: errors.distal.start.mtre_mm": "initial_error: errors",
    "baseline: bobyqa+75+1": "baseline: [bobyqa]",
    "pictures: [overlay]": "pictures: overlay",
    "timed_cells: 1": "timed_cells: all",
    "compare_all: true": "compare_all: pairs",
    "range: [1, 2]": "range: [1]",
    "scale: log": "scale: loud",
    "whole: false": "whole: perhaps",
    ", grid: 2": "",
    "width: 0.1, ": "",
    "most_cases: 10": "most_cases: 0",
    "look_every": "look_evry",
}


class ExperimentSchema(SchemaCase):
    @staticmethod
    def schema_text():
        return (SOURCE / "schemas" / "experiment.schema.json").read_text()

    def program(self, text):
        (self.scratch / "cases" / "one").mkdir(parents=True, exist_ok=True)
        return marrow(
            "compare", self.write("e.yaml", text.replace("PIPELINES", str(SOURCE / "pipelines"))), "--dry-run"
        )

    def test_every_experiment_is_valid_and_names_its_schema(self):
        files = sorted((SOURCE / "pipelines" / "experiments").glob("*.yaml"))
        self.assertGreaterEqual(len(files), 5)
        read = sample(files, 6)
        for path in files:
            text = path.read_text()
            self.assertEqual(
                text.splitlines()[0], "# yaml-language-server: $schema=../../schemas/experiment.schema.json", str(path)
            )
            self.assertEqual(self.errors(text), [], str(path))
            if path in read and "$env:" not in text:  # a file of the user's own is not here
                result = marrow("compare", path, "--dry-run")
                self.assertEqual(result.returncode, 0, str(path) + result.stderr)

    def test_one_file_has_every_key(self):
        self.assertEqual(self.errors(EXPERIMENT), [])
        result = self.program(EXPERIMENT)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("48 cells: 8 variants, 3 cases, 2 starts", result.stdout)
        file, schema = yaml.safe_load(EXPERIMENT), self.schema["properties"]
        simulation = schema["cases"]["properties"]["simulate"]["properties"]
        for keys, known in (
            (dict(file, tune="in the place of two others", extends="another file"), schema),
            (
                dict(file["cases"], seeds="by themselves", draw="so too", seed_input="so too"),
                schema["cases"]["properties"],
            ),
            (file["cases"]["simulate"], simulation),
            (file["starts"], schema["starts"]["properties"]),
            (yaml.safe_load(TUNE)["tune"], schema["tune"]["properties"]),
            (dict(file["sweep"], sobol="instead of the grid"), schema["sweep"]["properties"]),
            (
                dict(file["stop"], difference="instead of the figure", variant="of it", alpha="of it"),
                schema["stop"]["properties"],
            ),
        ):
            self.assertEqual(set(keys), set(known), "so the program knows all keys that the schema knows")

    def test_a_file_may_tune(self):
        text = EXPERIMENT[: EXPERIMENT.index("sweep:")].replace("bobyqa+75+1", "bobyqa+75") + TUNE
        self.assertEqual(self.errors(text), [])
        result = self.program(text)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("tuning: at most 5 points of 1 options on 2 training cases", result.stdout)
        for right, wrong in (
            ("points: 5", "points: 0"),
            ("uses: optimizer", "is: optimizer"),
            ("failed_as: 10", "fail: 1"),
        ):
            self.assertNotEqual(self.errors(text.replace(right, wrong)), [], wrong)
            self.assertEqual(self.program(text.replace(right, wrong)).returncode, 2, wrong)

    def test_what_is_wrong_is_refused_by_schema_and_program(self):
        for right, wrong in sample(WRONG.items(), 10):
            self.assertEqual(EXPERIMENT.count(right), 1, right)
            text = EXPERIMENT.replace(right, wrong)
            self.assertNotEqual(self.errors(text), [], wrong)
            self.assertEqual(self.program(text).returncode, 2, wrong)
        text = EXPERIMENT.replace("cases:\n", "cases:\n  seeds: 1..3\n")
        self.assertNotEqual(self.errors(text), [])
        self.assertIn("'seeds' beside other cases", self.program(text).stderr)

    def test_names_and_numbers_as_in_yaml(self):
        for change in (
            ("seeds: 1..2", "seeds: [1, 5]"),
            ("variants:\n  nelder_mead:", "variants:\n  nelder_mead: {}"),
            ("edges.low: 40", "edges.low: 40.5"),
        ):
            self.assertEqual(self.errors(EXPERIMENT.replace(*change)), [])


# Everything that a case file can say, except a camera in its own file and the two ways to write a transform.
CASE = """marrow-case: 1
ct: {file: ct.mha, voxel_size_mm: [1, 1, 1], flip: [z], value_offset_hu: 0, series_uid: "1.2"}
views:
  - {name: frontal, image: frontal.png, camera: frontal.camera.yaml, mask: frontal.mask.png}
  - name: lateral
    image: lateral.png
    camera:
      marrow-camera: 1
      width_px: 8
      height_px: 8
      intrinsics: [[1000, 0, 3.5], [0, 1000, 3.5], [0, 0, 1]]
      radial_distortion: [0, 0, 0]
      camera_from_world: {target: camera, source: world, rotation: ROTATION, translation_mm: [0, 0, 600]}
  - name: oblique
    image: oblique.png
    camera:
      width_px: 16
      height_px: 16
      c_arm: {alpha_deg: 5, beta_deg: 40, source_to_detector_mm: 1000, source_to_isocentre_mm: 600, pixel_mm: 0.5}
fragments:
  distal:
    seeds: [[1, 2, 3]]
    register: true
    start: {target: world, source: ct, rotation: ROTATION, translation_mm: [0, 0, 0]}
    truth: {target: world, source: ct, matrix: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}
""".replace(
    "ROTATION", "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]"
)
# What of it becomes what, and is then refused by the schema and by the program alike.
WRONG_CASE = {
    "marrow-case: 1": "marrow-case: 2",
    "ct: {file": "ct: {fiel",
    "flip: [z]": "flip: z",
    "value_offset_hu: 0": "value_offset_hu: none",
    "{name: frontal, ": "{",
    "mask: frontal": "maks: frontal",
    "width_px: 8": "width_px: 0",
    "[0, 0, 1]]\n      radial": "[0, 0]]\n      radial",
    "radial_distortion: [0, 0, 0]": "radial_distortion: [0, 0]",
    "{target: camera": "{target: world",
    "alpha_deg: 5": "alpha_deg: 95",
    "beta_deg: 40": "beta_degrees: 40",
    "pixel_mm: 0.5": "pixel_mm: 0",
    "fragments:": "fragment:",
    "    seeds: [[1, 2, 3]]": "    seeds: [[1, 2]]",
    "register: true": "register: yes please",
    "translation_mm: [0, 0, 0]}": "translation: [0, 0, 0]}",
    "truth: {target: world, source: ct": "truth: {target: world, source: camera",
    "matrix: [[1, 0, 0, 0], ": "matrix: [",
}


class CaseSchema(SchemaCase):
    @staticmethod
    def schema_text():
        return (SOURCE / "schemas" / "case.schema.json").read_text()

    def faults(self, text):
        """What the program says of the file itself: its other files are not there, which counts for nothing here."""
        folder = self.scratch / "case"
        folder.mkdir(exist_ok=True)
        (folder / "case.yaml").write_text(text)
        pipeline = self.write(
            "p.yaml", "marrow: 1\nnodes:\n  c: {uses: read.case, with: {path: case}}\noutputs: {c: c.ct}\n"
        )
        result = marrow("run", pipeline, "--out", self.scratch / "out", "--no-cache", cwd=self.scratch)
        self.assertEqual(result.returncode, 1, result.stderr)
        said = [line for line in result.stderr.splitlines() if "case.yaml" in line]
        self.assertGreater(len(said), 0, result.stderr)
        return [line for line in said if "there is no '" not in line]

    def test_one_file_has_every_key(self):
        self.assertEqual(self.errors(CASE), [])
        self.assertEqual(self.faults(CASE), [])

    def test_what_is_wrong_is_refused_by_schema_and_program(self):
        for right, wrong in sample(WRONG_CASE.items(), 8):
            with self.subTest(wrong):
                self.assertEqual(CASE.count(right), 1, right)
                text = CASE.replace(right, wrong)
                self.assertFalse(self.validator.is_valid(yaml.safe_load(text)))
                shutil.rmtree(self.scratch / "out", ignore_errors=True)
                self.assertNotEqual(self.faults(text), [])


if __name__ == "__main__":
    main()
