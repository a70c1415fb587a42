# SPDX-License-Identifier: Apache-2.0
"""Words of the command line count literally: texts, empty words, and words that are given twice."""
import json
import subprocess

from harness import MARROW, TEST_PLUGINS
from harness.program import Case, main, marrow

PIPELINE = """marrow: 1
name: p
inputs: {data: {type: path, default: x}, word: {default: one}}
nodes:
  c: {uses: test.constant, with: {path: $data, word: $word}}
outputs: {o: c}
"""
# Texts that YAML would read as a comment, an anchor, a tag and so on. For each there is a file of this name.
TEXTS = ("a #b", "&a b", "! b", "*a", "- a", "a: b", "~", "null", "%a", "| a", " a ", "a\nb", "größe 漢")


class OptionTexts(Case):
    def run_it(self, code, *arguments):
        result = marrow(*arguments, plugins=[TEST_PLUGINS], cwd=self.scratch)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result

    def setUp(self):
        super().setUp()
        self.write("p.yaml", PIPELINE)

    def path_of(self, folder):
        """By another reader of YAML than marrow's, where it is installed; else by its words."""
        text = (self.scratch / folder / "pipeline.yaml").read_text()
        try:
            import yaml
        except ImportError:
            return None
        return yaml.safe_load(text)["nodes"]["c"]["with"]["path"]

    def test_a_run_reads_the_file_that_is_named_and_a_repetition_too(self):
        for name in ("a", "b"):
            self.write(name, "what would be read by mistake")
        for number, text in enumerate(TEXTS):
            self.write(text, "content")
            out = "out%d" % number
            self.run_it(0, "run", "p.yaml", "--set", "c.path=" + text, "--out", out, "--quiet")
            record = json.loads((self.scratch / out / "run.json").read_text())
            self.assertEqual(record["overrides"], ["c.path=" + text])
            self.assertIn(self.path_of(out), (None, str(self.scratch / text)))
            self.assertIsNotNone(record["nodes"][0]["files"]["path"], "the file is there")
            again = self.run_it(0, "rerun", out, "--out", out + "-again", "--quiet").stdout
            self.assertIn("identical: the only node came out the same\n", again)
            self.assertNotIn("Also changed", again)

    def test_the_same_texts_as_inputs(self):
        for number, text in enumerate(TEXTS):
            out = "out%d" % number
            self.run_it(0, "run", "p.yaml", "data=" + text, "--out", out, "--quiet")
            self.assertIn(self.path_of(out), (None, str(self.scratch / text)))

    def test_an_input_may_stand_after_set(self):
        told = self.run_it(0, "run", "--set", "c.value=4", "p.yaml", "--set", "c.flag=true", "word=two", "--out", "o")
        self.assertEqual(told.stderr.count("note"), 0, told.stderr)
        record = json.loads((self.scratch / "o" / "run.json").read_text())
        self.assertEqual(record["overrides"], ["c.value=4", "c.flag=true"])
        self.assertEqual(record["inputs"], {"word": "two"})
        self.run_it(0, "run", "p.yaml", "--only", "o", "word=two", "--out", "only")

    def test_what_is_given_twice_is_said(self):
        twice = ["p.yaml", "--set", "c.value=4", "--set", "c.value=5"]
        note = "note: --set c.value is given twice: '5' counts, '4' does not\n"
        self.assertIn("  " + note, self.run_it(0, "check", *twice).stdout)
        self.assertIn("marrow: " + note, self.run_it(0, "plan", *twice).stderr)
        self.assertIn("marrow: " + note, self.run_it(0, "run", *twice, "--out", "o").stderr)
        self.assertEqual(json.loads((self.scratch / "o/outputs/o.json").read_text())["metrics"][0]["value"], 5)
        self.assertEqual(
            self.run_it(2, "check", "p.yaml", "data=a", "data=b").stderr,
            "marrow: error: the input 'data' is given twice, as 'a' and as 'b'; a run has one value of each input\n",
        )
        self.write("twice.yaml", PIPELINE.replace("word: $word", "value: 1, value: 2"))
        self.assertIn("'value' is given twice in 'with' of node 'c'", self.run_it(2, "check", "twice.yaml").stderr)

    def test_nothing_has_an_empty_name(self):
        said = (
            "marrow: error: a word after '%s' is empty, and nothing has an empty name; a variable may have no value\n"
        )
        for command in ("run", "compare", "check", "plan", "graph", "watch", "show", "rerun", "diff"):
            self.assertEqual(self.run_it(2, command, "").stderr, said % command)
        for option in (["--out", ""], ["--out="], ["--shared-cache", ""], ["--only", ""]):
            self.assertEqual(self.run_it(2, "run", "p.yaml", *option).stderr, said % option[0].rstrip("="))
        self.assertIn(
            "data=: error: input 'data' is an empty path\n"
            "  hint: name a file or a folder; the folder in which you are is  .\n",
            self.run_it(2, "run", "p.yaml", "data=").stderr,
        )
        self.assertEqual([path.name for path in self.scratch.iterdir()], ["p.yaml"], "nothing was made")
        result = subprocess.run([MARROW, ""], capture_output=True, text=True)
        self.assertEqual(result.returncode, 2)
        self.assertIn("a word of the command is empty", result.stderr)

    def test_names_that_look_the_same_are_shown(self):
        told = self.run_it(2, "check", "p.yaml", "--set", "c.val\u200bue=4", "wo\u200drd=one").stderr
        self.assertIn("has no option 'val\\u200bue'\n", told)
        self.assertIn("the pipeline has no input 'wo\\u200drd'\n", told)
        self.write("q.yaml", PIPELINE.replace("  c:", "  c: {uses: test.draw}\n  c\u2060:"))
        self.assertIn(
            "q.yaml:6:3: error: the key 'c\\u2060' in nodes holds U+2060, which cannot be seen",
            self.run_it(2, "check", "q.yaml").stderr,
        )


if __name__ == "__main__":
    main()
