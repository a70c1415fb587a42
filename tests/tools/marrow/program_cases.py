# SPDX-License-Identifier: Apache-2.0
"""Pipelines with a node that runs a program, and what its failure says."""
import json
import shutil

from harness.program import Case

VERSION = ["python3", "--version"]
# Copies its input to its output, and both to where the test looks at them.
COPY = "import shutil, sys\nfor to in sys.argv[2:]: shutil.copy(sys.argv[1], to)\n"


class Programs(Case):
    files = {"copied.py": COPY}

    def node(self, kind, command, inputs=None, **options):
        given = {"command": command, "version_command": VERSION, **options}
        return {"uses": "run.program_" + kind, "in": inputs or {}, "with": given}

    def pipeline(self, nodes, outputs=None):
        """JSON is YAML, too; its quotes need no care."""
        text = {"marrow": 1, "nodes": nodes, "outputs": outputs or {"it": "it"}}
        return self.write("p.yaml", json.dumps(text, indent=1))

    def run_it(self, nodes, code=0, outputs=None, **more):
        """Runs the pipeline; gives what is said."""
        shutil.rmtree(self.scratch / "out", ignore_errors=True)
        return self.expect(code, "run", self.pipeline(nodes, outputs), "--out", "out", "--quiet", **more).stderr

    def failures(self, *nodes, sources=()):
        """Why each of these nodes fails, in one run that goes on without them."""
        named = {"n%d" % i: {**node, "may_fail": True} for i, node in enumerate(nodes)}
        self.run_it({**dict(sources), **named}, outputs={name: name for name in named})
        recorded = self.nodes()
        return [recorded[name]["reason"] for name in named]

    def expect_failures(self, *rows, sources=()):
        """Rows of a node, and of what its failure says."""
        for (_, said), told in zip(rows, self.failures(*(node for node, _ in rows), sources=sources)):
            self.assertIn(said, told)
