# SPDX-License-Identifier: Apache-2.0
"""What `marrow complete` offers, and that each shell offers it when Tab is pressed."""
import json
import os
import re
import shutil
import subprocess
import unittest

from harness import BUILD, MARROW, TEST_PLUGINS
from harness.program import Case, main, marrow
from harness.terminal import Terminal

PIPELINE = """marrow: 1
inputs:
  number: {type: path, help: "a file with a number"}
  case: {type: path}
nodes:
  first: {uses: test.constant, with: {value: 3, path: $number}}
  other: {uses: test.constant, with: {path: $case}}
  sum: {uses: test.add, in: {a: first, b: other}}
outputs: {total: sum, number: first}
"""


class Completion(Case):
    def setUp(self):
        super().setUp()
        self.write("p.yaml", PIPELINE)
        self.write("some-file.txt", "")
        (self.scratch / "some-folder").mkdir()
        self.environment = {
            **os.environ,
            "PATH": "%s:%s" % (BUILD / "bin", os.environ["PATH"]),
            "MARROW_PLUGIN_PATH": str(TEST_PLUGINS),
            "HOME": str(self.scratch),
            "TERM": "xterm",
        }

    def lines(self, *words):
        """What is offered for the last word."""
        done = subprocess.run(
            [MARROW, "complete"],
            input="".join(word + "\n" for word in words),
            capture_output=True,
            text=True,
            cwd=self.scratch,
            env=self.environment,
        )
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return done.stdout.splitlines()

    def words(self, *words):
        return [line.split("\t")[0] for line in self.lines(*words)]

    def test_commands(self):
        self.assertEqual(self.words("ins"), ["inspect"])
        self.assertEqual(self.lines("pla"), ["plan\tshow what a run would compute, what it would read back, and why"])
        self.assertEqual(self.words("cache", ""), ["info", "why", "gc"])
        every = self.words("")
        self.assertIn("run", every)
        self.assertNotIn("worker", every, "it is for the program itself")
        self.assertNotIn("complete", every)
        self.assertEqual(self.words("nothing-like-it", "x"), [])
        self.assertEqual(self.words(), [])

    def test_options(self):
        self.assertEqual(self.words("cache", "gc", "--k"), ["--keep-gb"])
        self.assertEqual(self.words("run", "p.yaml", "--dr"), ["--dry-run"])
        self.assertIn("--set", self.words("run", "--"))
        self.assertIn("--json", self.words("doctor", ""), "nothing else can follow")
        self.assertEqual(self.words("run", "--", "--dr"), [":files"], "options end there")

    def test_values_of_options(self):
        self.assertEqual(self.words("run", "p.yaml", "--log-level", "de"), ["debug"])
        self.assertEqual(self.words("run", "p.yaml", "--log-level=w"), ["--log-level=warning"])
        self.assertEqual(self.words("compare", "e.yaml", "--emit", ""), ["snakemake", "parallel"])
        self.assertEqual(self.words("completion", ""), ["bash", "fish", "zsh"])
        self.assertEqual(self.words("run", "p.yaml", "--seed", ""), [])
        for words in (["run", "p.yaml", "-o", ""], ["run", "--out=so"], ["show", ""], ["diff", "a", ""]):
            self.assertEqual(self.words(*words), [":folders"], words)
        for words in (["run", ""], ["check", "p"], ["compare", ""], ["schema", "--out", ""], ["describe", ""]):
            self.assertEqual(self.words(*words), [":files"], words)

    def test_nodes_and_kinds(self):
        nodes = {
            node["name"]: node["summary"]
            for node in json.loads(marrow("list", "--json", plugins=[TEST_PLUGINS]).stdout)
        }
        edges = ["%s\t%s" % (name, summary) for name, summary in nodes.items() if name.startswith("edges.")]
        self.assertGreater(len(edges), 1)
        self.assertEqual(self.lines("inspect", "edges."), edges)
        self.assertEqual(self.words("list", "simil"), ["similarity"])
        self.assertEqual(self.words("new", "node", "simil"), ["similarity."])
        self.assertIn("edges.canny", self.words("conformance", "edges.gradient_mask", "edges.ca"))

    def test_what_the_pipeline_has(self):
        self.assertEqual(self.lines("run", "p.yaml", "n"), ["number=\ta file with a number"])
        self.assertEqual(self.words("plan", "p.yaml", "number=x", ""), ["number=", "case="])
        self.assertEqual(self.words("run", "p.yaml", "number=some"), [":files"])
        self.assertEqual(self.words("run", "p.yaml", "--only", ""), ["total", "number"])
        self.assertEqual(self.words("run", "p.yaml", "--set", "s"), ["sum."])
        self.assertEqual(self.words("list", "--fits", "p.yaml", "f"), ["first"])
        self.assertEqual(self.words("list", "--fits", ""), [":files"])
        changes = self.words("run", "p.yaml", "--set", "first.")
        self.assertIn("first.uses=", changes)
        self.assertIn("first.value=", changes)
        self.assertEqual(self.words("run", "p.yaml", "--set", "first.uses=test.const"), ["first.uses=test.constant"])
        self.assertEqual(self.words("run", "p.yaml", "--set=first.may_fail=t"), ["--set=first.may_fail=true"])
        self.assertEqual(self.words("run", "none.yaml", "x"), [])
        self.write(
            "mine.yaml", "marrow: 1\nextends: p.yaml\nnodes: {part: {uses: p.yaml, with: {number: a, case: b}}}\n"
        )
        self.assertEqual(self.lines("run", "mine.yaml", "n"), ["number=\ta file with a number"])
        self.assertEqual(self.words("run", "mine.yaml", "--set", "part.s"), ["part.sum."])
        self.assertIn("part.first.value=", self.words("run", "mine.yaml", "--set", "part.first."))
        self.assertEqual(
            self.words("run", "mine.yaml", "--set", "part.first.may_fail=f"), ["part.first.may_fail=false"]
        )
        self.write("p.yaml", "nodes: [")
        self.assertEqual(self.words("run", "p.yaml", "x"), [])
        self.assertEqual(self.words("run", "p.yaml", "--set", "x"), [])

    def test_hostile_texts_stay_texts(self):
        self.write("p.yaml", PIPELINE.replace("  case:", '  "c\\e[2Jx": {type: path, help: "a\\tb"}\n  case:'))
        for line in self.lines("run", "p.yaml", ""):
            self.assertRegex(line, r"^[^\x00-\x08\x0a-\x1f]*$")

    # What is typed, and the line after Tab. The blank after a whole word comes from the shell.
    TYPED = (
        ("marrow ins", "marrow inspect "),
        ("marrow cache g", "marrow cache gc "),
        ("marrow run p.yaml num", "marrow run p.yaml number="),
        ("marrow run p.yaml number=some-fi", "marrow run p.yaml number=some-file.txt "),
        ("marrow run p.yaml --set su", "marrow run p.yaml --set sum."),
        ("marrow run p.yaml --set first.val", "marrow run p.yaml --set first.value="),
        ("marrow run p.yaml --set first.may_fail=t", "marrow run p.yaml --set first.may_fail=true "),
        ("marrow run p.yaml --out some-fo", "marrow run p.yaml --out some-folder/"),
        ("marrow check some-fi", "marrow check some-file.txt "),
        ("marrow run p.yaml --log-level=w", "marrow run p.yaml --log-level=warning "),
    )

    def expect_completed(self, shell):
        """Types each line and Tab, and then Ctrl-X Ctrl-P, which prints the line between angles."""
        for typed, whole in self.TYPED:
            with self.subTest(typed):
                before = len(shell.text)
                shell.type(typed + "\t")
                shell.type("\x18\x10")
                found = shell.until(lambda text: re.search(r"<<(marrow[^>\r\n]*)>>", text[before:]))
                shell.type("\x15")  # empties the line
                self.assertEqual(found.group(1), whole)

    def test_bash(self):
        start = (
            "bind 'set bell-style none'; bind 'set enable-bracketed-paste off'; PS1='$ '\n"
            "source <(marrow completion bash)\n"
            'bind -x \'"\\C-x\\C-p": printf "<<%s>>\\n" "$READLINE_LINE"\'\n'
            "echo is-'ready'\n"
        )
        with Terminal(["bash", "--norc", "--noprofile", "-i"], 200, self.scratch, self.environment) as shell:
            shell.type(start)
            shell.until(lambda text: "is-ready" in text)
            self.expect_completed(shell)

    @unittest.skipUnless(shutil.which("zsh"), "zsh is not installed")
    def test_zsh(self):
        start = (
            "PS1='$ '; unsetopt beep zle_bracketed_paste; autoload -Uz compinit; compinit -u -d dump\n"
            "source <(marrow completion zsh)\n"
            "say() { print -r -- \"<<$BUFFER>>\" }; zle -N say; bindkey -e; bindkey '^X^P' say\n"
            "echo is-'ready'\n"
        )
        with Terminal(["zsh", "-f", "-i"], 200, self.scratch, self.environment) as shell:
            shell.type(start)
            shell.until(lambda text: "is-ready" in text)
            self.expect_completed(shell)

    @unittest.skipUnless(shutil.which("fish"), "fish is not installed")
    def test_fish(self):
        for typed, whole in self.TYPED:
            command = "marrow completion fish | source; complete -C '%s'" % typed
            done = subprocess.run(
                ["fish", "--no-config", "-c", command],
                capture_output=True,
                text=True,
                cwd=self.scratch,
                env=self.environment,
            )
            offered = [line.split("\t")[0] for line in done.stdout.splitlines()]
            self.assertEqual(offered, [whole.split()[-1]], typed + done.stderr)

    def test_a_shell_without_a_script(self):
        result = marrow("completion", "csh")
        self.assertEqual(result.returncode, 2)
        self.assertIn("csh not in {bash,fish,zsh}", result.stderr)


if __name__ == "__main__":
    main()
