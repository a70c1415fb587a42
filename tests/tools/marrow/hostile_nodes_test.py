# SPDX-License-Identifier: Apache-2.0
"""Nodes in C++ and Python that do harm, in one run with healthy ones: these give the bytes that they give without them.
A node that ends the process is no program that has done its work."""
import json

from diff_cases import Runs
from harness import BUILD, TEST_PLUGINS
from harness.program import main

PYTHON = """
import locale
import os
import sys
from typing import Annotated

import marrow
import numpy

Number = Annotated[marrow.Metrics, "number"]


class Odd(BaseException):
    pass


@marrow.node("own.hostile", summary="does what it is told")
def hostile(a: Number, *, what: Annotated[str, "what"] = "") -> Annotated[marrow.Metrics, marrow.named("number")]:
    exec(what)
    return a


@marrow.node("own.sensitive", summary="what the state of its process leads to")
def sensitive(a: Number, *, number: Annotated[float, "added"] = 0) -> Annotated[
    marrow.Metrics, marrow.named("numbers")
]:
    return marrow.Metrics(
        {
            "number": number,
            "folder": len(os.getcwd()),
            "variable": "MARROW_HOSTILE" in os.environ,
            "text": sum(locale.setlocale(locale.LC_ALL).encode()),
            "least": numpy.float64(5e-324) / 1,
            "ignored": numpy.geterr()["divide"] == "ignore",
        }
    )
"""
IN_CPP = (
    "throw number,throw text,rounding,locale,locale of streams,locale of thread,handler,umask,environment,limit,"
    "standard input,instructions of OpenCV,threads of OpenCV,working folder"
).split(",")
IN_PYTHON = {
    "raise SystemExit(0)": "SystemExit: 0",
    "raise Odd('text')": "Odd: text",
    "os._exit(0)": "mine.py ended its process; a node must return or raise an exception",
    "locale.setlocale(locale.LC_ALL, 'C')": "the locale was changed while it ran; a node must leave it as it is",
    "os.environ['MARROW_HOSTILE'] = '1'": "the environment was changed while it ran; a node must leave it as it is",
    "os.chdir('/')": "the working folder was changed to / while it ran; a node must leave it as it is",
    "os.umask(0o111)": "the mask of new files' permissions (umask) was changed while it ran; a node must leave it",
    "numpy.seterr(all='ignore')": "numpy's treatment of faults in calculations was changed while it ran; a node must",
}
READS_STANDARD_INPUT = "assert sys.stdin.read() == ''"


class HostileNodes(Runs):
    def setUp(self):
        super().setUp()
        (self.scratch / "plugins").mkdir()
        self.write("plugins/mine.py", PYTHON)
        self.plugins = [self.scratch / "plugins", TEST_PLUGINS, BUILD / "tests" / "hostile_plugins"]
        self.environment = {"XDG_CACHE_HOME": str(self.scratch / "cache"), "MARROW_CACHE": str(self.scratch / "store")}

    def pipeline(self, hostile, healthy=8):
        """A pipeline whose outputs are the healthy nodes of both languages, with the hostile ones among them."""
        nodes = ["  c: {uses: test.constant, with: {value: 5}}"]
        for i in range(healthy):
            nodes.append("  c%d: {uses: test.sensitive, in: {a: c}, with: {number: %d}}" % (i, i))
            nodes.append("  p%d: {uses: own.sensitive, in: {a: c}, with: {number: %d}}" % (i, i))
        for i, (node, option, text) in enumerate(hostile):
            line = "  bad%d: {uses: %s, in: {a: c}, with: {%s: %s}, may_fail: true}"
            nodes.insert(1 + i % len(nodes), line % (i, node, option, json.dumps(text)))
        outputs = ["%s%d" % (kind, i) for kind in "cp" for i in range(healthy)] + [
            "bad%d" % i for i in range(len(hostile))
        ]
        return "marrow: 1\nnodes:\n%s\noutputs: {%s}\n" % (
            "\n".join(nodes),
            ", ".join("%s: %s" % (one, one) for one in outputs),
        )

    def written(self, name):
        return {
            path.name: path.read_bytes()
            for path in (self.scratch / name / "outputs").iterdir()
            if not path.name.startswith("bad")
        }

    def test_healthy_nodes_beside_them_give_the_same_bytes(self):
        self.run_into("alone", self.pipeline([]), "--no-cache")
        hostile = [("test.hostile", "how", how) for how in IN_CPP]
        hostile += [("own.hostile", "what", what) for what in [*IN_PYTHON, READS_STANDARD_INPUT]]
        self.run_into("beside", self.pipeline(hostile), "--threads", "6")
        self.assertEqual(self.written("beside"), self.written("alone"))
        self.assertEqual(len(self.written("alone")), 16)
        self.assertEqual(json.loads((self.scratch / "beside" / "run.json").read_text())["status"], "done")
        self.run_into("again", self.pipeline([]))
        self.assertEqual(self.written("again"), self.written("alone"), "the store has kept nothing wrong")
        # Of two nodes that change the locale at the same time, one puts it back before the other has ended, which then
        # has left it as it was. One after the other, each is told what it changed.
        self.run_into("in-turn", self.pipeline(hostile), "--threads", "1", "--no-cache")
        record = json.loads((self.scratch / "in-turn" / "run.json").read_text())
        reasons = {node["id"]: node.get("reason", "") for node in record["nodes"]}
        for i, how in enumerate(IN_CPP):
            self.assertIn("threw something" if how.startswith("throw") else " was changed", reasons["bad%d" % i], how)
        for i, (what, reason) in enumerate(IN_PYTHON.items(), len(IN_CPP)):
            self.assertIn(reason, reasons["bad%d" % i], what)
        self.assertEqual(reasons["bad%d" % (len(hostile) - 1)], "", "its standard input is empty, and no other's")
        record = json.loads((self.scratch / "again" / "run.json").read_text())
        self.assertEqual([node["calls"] for node in record["nodes"]], [0] * len(record["nodes"]))

    def test_a_node_that_ends_the_process_is_no_success(self):
        said = "node 'bad0' (test.hostile) failed: it ended the process; a node must return or throw an exception"
        for how in ("exit", "quick_exit", "_exit", "_Exit", "exit of a thread"):
            with self.subTest(how):
                out = self.scratch / how.replace(" ", "_")
                pipeline = self.write("p.yaml", self.pipeline([("test.hostile", "how", how)], healthy=0))
                result = self.marrow("run", pipeline, "--out", out)
                self.assertEqual(result.returncode, 70, result.stdout + result.stderr)
                self.assertIn("marrow: error: " + said, result.stderr)
                last = "marrow: error: node 'bad0' (test.hostile) ended the process; its exit code is 70\n"
                self.assertTrue(result.stderr.endswith(last), result.stderr)
                self.assertIn(said, (out / "log.txt").read_text())
                self.assertFalse((out / "run.json").exists(), "the run has not finished")
                self.assertEqual(list((out / "outputs").iterdir()), [])

    def test_a_child_that_a_node_forks_ends_as_it_likes(self):
        self.run_into("out", self.pipeline([("test.hostile", "how", "child")], healthy=1))


if __name__ == "__main__":
    main()
