# SPDX-License-Identifier: Apache-2.0
"""What `marrow complete` offers, and that each shell offers it when Tab is pressed."""
import os
import re
import shutil
import subprocess
import unittest

from harness import BUILD, MARROW, SOURCE, TEST_PLUGINS
from harness.program import Case, SharedCase, main
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
EXTENDING = "marrow: 1\nextends: p.yaml\nnodes: {part: {uses: p.yaml, with: {number: a, case: b}}}\n"
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
BASH = """bind 'set bell-style none'; bind 'set enable-bracketed-paste off'; PS1='$ '
source <(marrow completion bash)
bind -x '"\\C-x\\C-p": printf "<<%s>>\\n" "$READLINE_LINE"'
echo is-'ready'
"""
ZSH = """PS1='$ '; unsetopt beep zle_bracketed_paste; autoload -Uz compinit; compinit -u -d dump
source <(marrow completion zsh)
say() { print -r -- "<<$BUFFER>>" }; zle -N say; bindkey -e; bindkey '^X^P' say
echo is-'ready'
"""


class Completion(Case):
    def setUp(self):
        super().setUp()
        self.write("p.yaml", PIPELINE)
        self.write("some-file.txt", "")
        (self.scratch / "some-folder").mkdir()
        variables = {"PATH": "%s:%s" % (BUILD / "bin", os.environ["PATH"]), "MARROW_PLUGIN_PATH": str(TEST_PLUGINS)}
        self.all_variables = {**os.environ, **variables, "HOME": str(self.scratch), "TERM": "xterm"}

    def called(self, command, typed=""):
        usual = {"capture_output": True, "text": True, "cwd": self.scratch, "env": self.all_variables}
        return subprocess.run(command, input=typed, **usual)

    def lines(self, *words):
        """What is offered for the last word."""
        done = self.called([MARROW, "complete"], "".join(word + "\n" for word in words))
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return done.stdout.splitlines()

    def words(self, *words):
        return [line.split("\t")[0] for line in self.lines(*words)]

    def offers(self, *rows):
        """Each row: the words of the command, and what is offered for the last one."""
        for typed, offered in rows:
            self.assertEqual(self.words(*typed.split(" ")), offered.split(), typed)

    def test_commands_and_options(self):
        every = self.words("")
        self.assertIn("run", every)
        self.assertNotIn("worker", every, "it is for the program itself")
        self.assertNotIn("complete", every)
        self.assertEqual(self.words(), [])
        self.assertEqual(self.lines("pla"), ["plan\tshow what a run would compute, what it would read back, and why"])
        self.assertIn("--set", self.words("run", "--"))
        self.assertIn("--json", self.words("doctor", ""), "nothing else can follow")
        self.offers(
            ("ins", "inspect"),
            ("cache ", "info why gc"),
            ("nothing-like-it x", ""),
            ("cache gc --k", "--keep-gb"),
            ("run p.yaml --dr", "--dry-run"),
            ("run -- --dr", ":files"),  # options end there
            ("run p.yaml --log-level de", "debug"),
            ("run p.yaml --log-level=w", "--log-level=warning"),
            ("compare e.yaml --emit ", "snakemake parallel"),
            ("completion ", "bash fish zsh"),
            ("run p.yaml --seed ", ""),
            *((words, ":folders") for words in ("run p.yaml -o ", "run --out=so", "show ", "diff a ")),
            *((words, ":files") for words in ("run ", "check p", "compare ", "schema --out ", "describe ")),
        )

    def test_nodes_and_kinds(self):
        nodes = [(node["name"], node["summary"]) for node in self.json_of("list")]
        edges = ["%s\t%s" % node for node in nodes if node[0].startswith("edges.")]
        self.assertGreater(len(edges), 1)
        self.assertEqual(self.lines("inspect", "edges."), edges)
        self.offers(("list simil", "similarity"), ("new node simil", "similarity."))
        self.assertIn("edges.canny", self.words("conformance", "edges.gradient_mask", "edges.ca"))

    def test_what_the_pipeline_has(self):
        self.write("mine.yaml", EXTENDING)
        for file in ("p.yaml", "mine.yaml"):
            self.assertEqual(self.lines("run", file, "n"), ["number=\ta file with a number"])
        changes = self.words("run", "p.yaml", "--set", "first.")
        self.assertIn("first.uses=", changes)
        self.assertIn("first.value=", changes)
        self.assertIn("part.first.value=", self.words("run", "mine.yaml", "--set", "part.first."))
        self.offers(
            ("plan p.yaml number=x ", "number= case="),
            ("run p.yaml number=some", ":files"),
            ("run p.yaml --only ", "total number"),
            ("run p.yaml --set s", "sum."),
            ("list --fits p.yaml f", "first"),
            ("list --fits ", ":files"),
            ("run p.yaml --set first.uses=test.const", "first.uses=test.constant"),
            ("run p.yaml --set=first.may_fail=t", "--set=first.may_fail=true"),
            ("run none.yaml x", ""),
            ("run mine.yaml --set part.s", "part.sum."),
            ("run mine.yaml --set part.first.may_fail=f", "part.first.may_fail=false"),
        )
        self.write("p.yaml", "nodes: [")
        self.offers(("run p.yaml x", ""), ("run p.yaml --set x", ""))

    def test_hostile_texts_stay_texts(self):
        self.write("p.yaml", PIPELINE.replace("  case:", '  "c\\e[2Jx": {type: path, help: "a\\tb"}\n  case:'))
        for line in self.lines("run", "p.yaml", ""):
            self.assertRegex(line, r"^[^\x00-\x08\x0a-\x1f]*$")

    def expect_completed(self, command, start):
        """Types each line and Tab, and then Ctrl-X Ctrl-P, which prints the line between angles."""
        with Terminal(command, 200, self.scratch, self.all_variables) as shell:
            shell.type(start)
            shell.until(lambda text: "is-ready" in text)
            for typed, whole in TYPED:
                with self.subTest(typed):
                    before = len(shell.text)
                    shell.type(typed + "\t")
                    shell.type("\x18\x10")
                    found = shell.until(lambda text: re.search(r"<<(marrow[^>\r\n]*)>>", text[before:]))
                    shell.type("\x15")  # empties the line
                    self.assertEqual(found.group(1), whole)

    def test_bash(self):
        self.expect_completed(["bash", "--norc", "--noprofile", "-i"], BASH)

    @unittest.skipUnless(shutil.which("zsh"), "zsh is not installed")
    def test_zsh(self):
        self.expect_completed(["zsh", "-f", "-i"], ZSH)

    @unittest.skipUnless(shutil.which("fish"), "fish is not installed")
    def test_fish(self):
        for typed, whole in TYPED:
            command = "marrow completion fish | source; complete -C '%s'" % typed
            done = self.called(["fish", "--no-config", "-c", command])
            offered = [line.split("\t")[0] for line in done.stdout.splitlines()]
            self.assertEqual(offered, [whole.split()[-1]], typed + done.stderr)

    def test_a_shell_without_a_script(self):
        self.refused("csh not in {bash,fish,zsh}", "completion", "csh")


# The manual pages say what the help says, and are good troff.
VERSION = re.search(r"project\(marrow VERSION ([0-9.]+)", (SOURCE / "CMakeLists.txt").read_text()).group(1)


class Manual(SharedCase):
    def make(self):
        self.folder = self.scratch / "man"
        self.expect(0, "manual", "--out", self.folder)
        subprocess.run([BUILD / "bin" / "marrow-workbench", "manual", "--out", self.folder], check=True)
        self.helps = {}
        self.add_help()

    def add_help(self, *words):
        """Keeps the help of a command and of those below it, as (part, name, text) of each line."""
        lines, part = [], ""
        for line in self.printed(*words, "--help").splitlines():
            part = line if line.endswith(":") else part
            match = re.match(r"  (\S+).*?(?:\s{2,}(\S.*))?$", line)
            if match and not line.startswith("   "):
                lines.append((part, match.group(1), match.group(2) or ""))
        self.helps["-".join(["marrow", *words]) + ".1"] = lines
        for part, name, _ in lines:
            if part == "Subcommands:":
                self.add_help(*words, name)

    def shown(self, page, *options):
        command = ["groff", "-man", "-Tutf8", "-P-cbou", "-ww", *options, page]
        done = subprocess.run(command, capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""), page.name)
        return done.stdout

    def test_a_page_for_each_command(self):
        self.assertEqual({path.name for path in self.folder.iterdir()}, set(self.helps))
        self.assertIn("marrow-cache-gc.1", self.helps)

    @unittest.skipUnless(shutil.which("groff"), "groff is not installed")
    def test_each_option_with_its_help(self):
        for page, lines in self.helps.items():
            shown = self.shown(self.folder / page, "-rLL=500n")
            text = " ".join(shown.split()).replace("‐", "-").replace("−", "-")
            self.assertIn("marrow %s" % VERSION, text)
            for part, name, said in lines:
                if part in ("Options:", "Positionals:"):
                    self.assertIn(name.split("=")[0].replace(",", ", "), text, page)
                    self.assertIn(" ".join(said.split()), text, page)

    @unittest.skipUnless(shutil.which("groff"), "groff is not installed")
    def test_what_holds_for_all(self):
        text = self.shown(self.folder / "marrow.1", "-rLL=78n")
        self.assertRegex(text, r"(?m)^EXIT STATUS\n +0 +success")
        self.assertIn("MARROW_PLUGIN_PATH", text)
        self.assertLess(max(map(len, text.splitlines())), 80)

    @unittest.skipUnless(shutil.which("lexgrog"), "man-db is not installed")
    def test_apropos_finds_each(self):
        command = ["lexgrog", *sorted(self.folder.iterdir())]
        done = subprocess.run(command, capture_output=True, text=True, env={"LC_ALL": "C.UTF-8"})
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("marrow-plan - show what a run would compute", done.stdout)


if __name__ == "__main__":
    main()
