# SPDX-License-Identifier: Apache-2.0
"""The schemas for editors, held against the shipped pipelines and experiments by an independent validator."""
import json

import jsonschema
import yaml

from marrow_cli import SOURCE, Case, main, marrow


class Schema(Case):
    @classmethod
    def setUpClass(cls):
        cls.schema = json.loads(marrow("schema").stdout)
        jsonschema.Draft7Validator.check_schema(cls.schema)
        cls.validator = jsonschema.Draft7Validator(cls.schema)

    def test_every_pipeline_is_valid(self):
        files = sorted((SOURCE / "pipelines").glob("*.yaml"))
        self.assertGreater(len(files), 2)
        for path in files:
            errors = [error.message for error in self.validator.iter_errors(yaml.safe_load(path.read_text()))]
            self.assertEqual(errors, [], str(path))
            self.assertEqual(marrow("check", path).returncode, 0, str(path))

    def test_faults_are_found(self):
        good = yaml.safe_load((SOURCE / "pipelines" / "femur.yaml").read_text())
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
pipeline: PIPELINES/femur.yaml
inputs: {}
set: {start.uses: initial.manual, edges.low: 40, cost.in.views: [case.views.frontal, case.views.lateral]}
cases:
  input: case
  folders: [cases/*]
  simulate:
    pipeline: PIPELINES/simulate.yaml
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
baseline: bobyqa+75
pictures: [overlay]
timed_cells: 1
"""
# What of it becomes what, and is then refused by the schema and by the program alike.
WRONG = {
    "experiment: 1": "experiment: 2",
    "name: all": "name: a/b",
    "help: one": "halp: one",
    "pipeline: PIPELINES/femur.yaml\n": "",
    "edges.low": "edges",
    "inputs: {}": "inputs: {case: [1]}",
    "  input: case": "  input: [case]",
    "folders: [cases/*]": "folders: cases/*",
    "    output: case": "    out: case",
    "seeds: 1..2": "seeds: 1-2",
    "    pipeline: PIPELINES/simulate.yaml\n": "",
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
    "baseline: bobyqa+75": "baseline: [bobyqa]",
    "pictures: [overlay]": "pictures: overlay",
    "timed_cells: 1": "timed_cells: all",
}


class ExperimentSchema(Case):
    @classmethod
    def setUpClass(cls):
        cls.schema = json.loads((SOURCE / "schemas" / "experiment.schema.json").read_text())
        jsonschema.Draft7Validator.check_schema(cls.schema)
        cls.validator = jsonschema.Draft7Validator(cls.schema)

    def errors(self, text):
        return [error.message for error in self.validator.iter_errors(yaml.safe_load(text))]

    def program(self, text):
        (self.scratch / "cases" / "one").mkdir(parents=True, exist_ok=True)
        return marrow(
            "compare", self.write("e.yaml", text.replace("PIPELINES", str(SOURCE / "pipelines"))), "--dry-run"
        )

    def test_every_experiment_is_valid_and_names_its_schema(self):
        files = sorted((SOURCE / "pipelines" / "experiments").glob("*.yaml"))
        self.assertGreaterEqual(len(files), 5)
        for path in files:
            text = path.read_text()
            self.assertEqual(
                text.splitlines()[0], "# yaml-language-server: $schema=../../schemas/experiment.schema.json", str(path)
            )
            self.assertEqual(self.errors(text), [], str(path))
            result = marrow("compare", path, "--dry-run")
            self.assertEqual(result.returncode, 0, str(path) + result.stderr)

    def test_one_file_has_every_key(self):
        self.assertEqual(self.errors(EXPERIMENT), [])
        result = self.program(EXPERIMENT)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("24 cells: 4 variants, 3 cases, 2 starts", result.stdout)
        file, schema = yaml.safe_load(EXPERIMENT), self.schema["properties"]
        simulation = schema["cases"]["properties"]["simulate"]["properties"]
        for keys, known in (
            (file, schema),
            (
                dict(file["cases"], seeds="by themselves", draw="so too", seed_input="so too"),
                schema["cases"]["properties"],
            ),
            (file["cases"]["simulate"], simulation),
            (file["starts"], schema["starts"]["properties"]),
        ):
            self.assertEqual(set(keys), set(known), "so the program knows all keys that the schema knows")

    def test_what_is_wrong_is_refused_by_schema_and_program(self):
        for right, wrong in WRONG.items():
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


if __name__ == "__main__":
    main()
