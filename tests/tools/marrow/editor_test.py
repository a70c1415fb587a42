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
        cls.nodes = json.loads(marrow("list", "--json").stdout)

    def ask(self, *nodes):
        """What the editor shows for each node, at the mark in it; the mark itself is not part of the file."""
        questions = []
        for node in nodes:
            text = json.dumps({"marrow": 1, "nodes": {"one": node}, "outputs": {"all": "one"}})
            questions.append({"text": text.replace(MARK, ""), "at": text.index(MARK)})
        answers = subprocess.run(
            ["node", EDITOR / "ask.cjs"],
            cwd=INSTALLED,
            input=json.dumps({"schema": self.schema, "questions": questions}),
            capture_output=True,
            text=True,
            timeout=300,
        )
        self.assertEqual(answers.returncode, 0, answers.stderr)
        return json.loads(answers.stdout)

    def test_uses_completes_the_names_of_all_nodes(self):
        (answer,) = self.ask({"uses": MARK})
        self.assertEqual(set(answer["completions"]), {json.dumps(node["name"]) for node in self.nodes})

    def test_each_node_completes_its_options_and_the_inputs_of_its_kind(self):
        inputs = {}
        for node in self.nodes:
            kind = node["name"].split(".")[0]
            inputs.setdefault(kind, set()).update(port["name"] for port in node["inputs"])
        answers = self.ask(
            *({"uses": node["name"], word: {MARK: ""}} for node in self.nodes for word in ("with", "in"))
        )
        for i, node in enumerate(self.nodes):
            options, ports = (set(answer["completions"]) for answer in answers[2 * i : 2 * i + 2])
            self.assertEqual(options, {option["name"] for option in node["options"]}, node["name"])
            self.assertGreaterEqual(ports, inputs[node["name"].split(".")[0]], node["name"])

    def test_a_value_completes_with_its_default_or_its_choices(self):
        number, truth, choice = self.ask(
            {"uses": "edges.canny", "with": {"sigma_px": MARK}},
            {"uses": "edges.canny", "with": {"logarithm": MARK}},
            {"uses": "simulate.clutter", "with": {"knee": MARK}},
        )
        self.assertEqual(set(number["completions"]), {"1.5"})
        self.assertEqual(set(truth["completions"]), {"true", "false"})
        self.assertEqual(set(choice["completions"]), {'"off"', '"mild"', '"usual"', '"bad"'})

    def test_hover_shows_help_range_and_unit(self):
        option, port, summary = self.ask(
            {"uses": "edges.canny", "with": {MARK + "sigma_px": 1}},
            {"uses": "edges.canny", "in": {MARK + "view": "x"}},
            {"uses": MARK + "edges.canny"},
        )
        canny = next(node for node in self.nodes if node["name"] == "edges.canny")
        self.assertEqual(option["hover"], "standard deviation of the Gaussian derivative (number, 0.7 to 10 [px])")
        self.assertIn("X-ray view", port["hover"])
        self.assertEqual(summary["hover"], canny["summary"])

    def test_faults_are_marked(self):
        good = {"uses": "edges.canny", "with": {"sigma_px": 1}, "in": {"view": "$view" + MARK}}
        nothing, unknown, outside, unwired = self.ask(
            good, {**good, "with": {"sigma": 1}}, {**good, "with": {"sigma_px": 100}}, {"uses": "edges.canny" + MARK}
        )
        self.assertEqual(nothing["faults"], [])
        self.assertEqual(unknown["faults"], ["Property sigma is not allowed."])
        self.assertEqual(outside["faults"], ["Value is above the maximum of 10."])
        self.assertEqual(unwired["faults"], ['Missing property "in".'])


if __name__ == "__main__":
    install()
    main()
