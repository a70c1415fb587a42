# SPDX-License-Identifier: Apache-2.0
"""What an editor shows of a pipeline file by the schema, asked of VS Code's own library for JSON."""
import json
import pathlib
import shutil
import subprocess

from harness import BUILD, skip
from harness.program import Case, main, marrow

EDITOR = pathlib.Path(__file__).resolve().parent / "editor"
INSTALLED = BUILD / "tests" / "editor"
MARK = "HERE"  # the place that is asked about


def install():
    """Installs the versions of the lock file once for each build folder."""
    absent = [program for program in ("node", "npm") if not shutil.which(program)]
    if absent:
        skip("not installed here: %s; apt-get install nodejs npm" % ", ".join(absent))
    lock = (EDITOR / "package-lock.json").read_text()
    done = INSTALLED / "installed.json"
    if done.exists() and done.read_text() == lock:
        return
    INSTALLED.mkdir(parents=True, exist_ok=True)
    for name in ("package.json", "package-lock.json"):
        shutil.copyfile(EDITOR / name, INSTALLED / name)
    command = ["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--fetch-retries=1"]
    result = subprocess.run(command, cwd=INSTALLED, capture_output=True, text=True, timeout=300)
    if result.returncode != 0:
        said = (result.stderr.splitlines() or ["no reason"])[0]
        skip("npm cannot install vscode-json-languageservice (is there a network?): " + said)
    done.write_text(lock)


class Editor(Case):
    @classmethod
    def setUpClass(cls):
        cls.schema = json.loads(marrow("schema").stdout)
        cls.all_nodes = json.loads(marrow("list", "--json").stdout)

    def ask(self, *nodes):
        """What the editor shows for each node, at the mark in it; the mark itself is not part of the file."""
        questions = []
        for node in nodes:
            text = json.dumps({"marrow": 1, "nodes": {"one": node}, "outputs": {"all": "one"}})
            questions.append({"text": text.replace(MARK, ""), "at": text.index(MARK)})
        asked = json.dumps({"schema": self.schema, "questions": questions})
        usual = {"cwd": INSTALLED, "capture_output": True, "text": True, "timeout": 300}
        answers = subprocess.run(["node", EDITOR / "ask.cjs"], input=asked, **usual)
        self.assertEqual(answers.returncode, 0, answers.stderr)
        return json.loads(answers.stdout)

    def test_names_options_and_inputs_of_all_nodes_are_completed(self):
        inputs = {}
        for node in self.all_nodes:
            kind = node["name"].split(".")[0]
            inputs.setdefault(kind, set()).update(port["name"] for port in node["inputs"])
        words = [{"uses": node["name"], word: {MARK: ""}} for node in self.all_nodes for word in ("with", "in")]
        names, *answers = (set(answer["completions"]) for answer in self.ask({"uses": MARK}, *words))
        self.assertEqual(names, {json.dumps(node["name"]) for node in self.all_nodes})
        for node, options, ports in zip(self.all_nodes, answers[::2], answers[1::2]):
            self.assertEqual(options, {option["name"] for option in node["options"]}, node["name"])
            self.assertGreaterEqual(ports, inputs[node["name"].split(".")[0]], node["name"])

    def test_values_are_completed_help_is_shown_and_faults_are_marked(self):
        canny = next(node for node in self.all_nodes if node["name"] == "edges.canny")
        good = {"uses": "edges.canny", "with": {"sigma_px": 1}, "in": {"view": "$view" + MARK}}
        sigma = "standard deviation of the Gaussian derivative (number, 0.7 to 10 [px])"
        rows = (
            # A value completes with its default or its choices.
            ("completions", {"uses": "edges.canny", "with": {"sigma_px": MARK}}, ["1.5"]),
            ("completions", {"uses": "edges.canny", "with": {"logarithm": MARK}}, ["false", "true"]),
            (
                *("completions", {"uses": "simulate.clutter", "with": {"knee": MARK}}),
                ['"bad"', '"mild"', '"off"', '"usual"'],
            ),
            # What the pointer is over shows help, range and unit.
            ("hover", {"uses": "edges.canny", "with": {MARK + "sigma_px": 1}}, sigma),
            ("hover", {"uses": MARK + "edges.canny"}, canny["summary"]),
            ("faults", good, []),
            ("faults", {**good, "with": {"sigma": 1}}, ["Property sigma is not allowed."]),
            ("faults", {**good, "with": {"sigma_px": 100}}, ["Value is above the maximum of 10."]),
            ("faults", {"uses": "edges.canny" + MARK}, ['Missing property "in".']),
        )
        port = {"uses": "edges.canny", "in": {MARK + "view": "x"}}
        *answers, of_port = self.ask(*(node for _, node, _ in rows), port)
        for (key, node, expected), answer in zip(rows, answers):
            found = sorted(set(answer[key])) if key == "completions" else answer[key]
            self.assertEqual(found, expected, node)
        self.assertIn("X-ray view", of_port["hover"])


if __name__ == "__main__":
    install()
    main()
