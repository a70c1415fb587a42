# SPDX-License-Identifier: Apache-2.0
"""Pipelines with a node that runs a program, and what its failure says."""
import json
import shutil

from harness.program import Case

VERSION = ["python3", "--version"]
# Copies its input to its output, and both to where the test looks at them.
COPY = "import shutil, sys\nfor to in sys.argv[2:]: shutil.copy(sys.argv[1], to)\n"


class Programs(Case):
    def setUp(self):
        super().setUp()
        self.write("copied.py", COPY)

    def node(self, kind, command, inputs=None, **options):
        given = {"command": command, "version_command": VERSION, **options}
        return {"uses": "run.program_" + kind, "in": inputs or {}, "with": given}

    def pipeline(self, nodes, outputs=None):
        """JSON is YAML, too; its quotes need no care."""
        text = {"marrow": 1, "nodes": nodes, "outputs": outputs or {"it": "it"}}
        return self.write("p.yaml", json.dumps(text, indent=1))

    def run_it(self, nodes, code=0, outputs=None, **more):
        shutil.rmtree(self.scratch / "out", ignore_errors=True)
        result = self.marrow("run", self.pipeline(nodes, outputs), "--out", "out", "--quiet", **more)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result.stderr

    def failure(self, command, inputs=None, kind="volume", nodes=None, **options):
        told = self.run_it({**(nodes or {}), "it": self.node(kind, command, inputs, **options)}, code=1)
        self.assertIn(" failed: ", told)
        return told.split(" failed: ", 1)[1]

    def kept(self, name):
        return self.scratch / name
