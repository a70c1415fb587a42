# SPDX-License-Identifier: Apache-2.0
"""The schema for editors, held against the shipped pipelines by an independent validator."""
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
        for spoil in (lambda p: p["nodes"]["edges"].update(uses="edges.nothing"), lambda p: p["nodes"]["edges"]["with"].update(low=1000),
                      lambda p: p["nodes"]["edges"]["with"].update(hihg=1), lambda p: p["nodes"]["edges"]["in"].pop("view"),
                      lambda p: p.update(colour="red"), lambda p: p.pop("marrow")):
            bad = json.loads(json.dumps(good))
            spoil(bad)
            self.assertFalse(self.validator.is_valid(bad))

    def test_the_committed_schema_is_current(self):
        self.assertEqual(json.loads((SOURCE / "schemas" / "pipeline.schema.json").read_text()), self.schema,
                         "run: marrow schema --out schemas/pipeline.schema.json")


if __name__ == "__main__":
    main()
