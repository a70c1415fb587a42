# SPDX-License-Identifier: Apache-2.0
"""Words of the command line count literally: texts, empty words, words that are given twice, and numbers, for which no
other text is taken."""
import yaml

from harness.program import Case, main

PIPELINE = """marrow: 1
name: p
inputs: {data: {type: path, default: x}, word: {default: one}}
nodes:
  c: {uses: test.constant, with: {path: $data, word: $word}}
outputs: {o: c}
"""
# Texts that YAML would read as a comment, an anchor, a tag and so on. For each there is a file of this name.
TEXTS = ("a #b", "&a b", "! b", "*a", "- a", "a: b", "~", "null", "%a", "| a", " a ", "a\nb", "größe 漢")
LARGEST_SEED = 2**64 - 1
NO_WHOLE_NUMBERS = ["-1", "-0", "+1", str(2**64), "1" + 23 * "0", "010", "0x10", "1e3", "1.5", "1 ", " 1", "1,000"]
NO_WHOLE_NUMBERS += ["abc", "nan", ""]
NO_AMOUNTS = ("nan", "inf", "-inf", "1e30", "1e400", "-5", "0", "1e-9", "0x10", "0,5", "5 MB", "+5", "abc", "")
EMPTY = "marrow: error: a word after '%s' is empty, and nothing has an empty name; a variable may have no value\n"


class OptionTexts(Case):
    has_own_store = False

    def setUp(self):
        super().setUp()
        self.write("p.yaml", PIPELINE)

    def path_of(self, folder):
        """By another reader of YAML than marrow's."""
        return yaml.safe_load(self.read(folder + "/pipeline.yaml"))["nodes"]["c"]["with"]["path"]

    def test_a_run_reads_the_file_that_is_named_and_a_repetition_too(self):
        for name in ("a", "b"):
            self.write(name, "what would be read by mistake")
        for number, text in enumerate(TEXTS):
            self.write(text, "content")
            out = "out%d" % number
            self.expect(0, "run", "p.yaml", "--set", "c.path=" + text, "--out", out, "--quiet")
            record = self.json(out + "/run.json")
            self.assertEqual(record["overrides"], ["c.path=" + text])
            self.assertEqual(self.path_of(out), str(self.scratch / text))
            self.assertIsNotNone(record["nodes"][0]["files"]["path"], "the file is there")
            again = self.printed("rerun", out, "--out", out + "-again", "--quiet")
            self.assertIn("identical: the only node came out the same\n", again)
            self.assertNotIn("Also changed", again)
            self.expect(0, "run", "p.yaml", "data=" + text, "--out", out + "-input", "--quiet")
            self.assertEqual(self.path_of(out + "-input"), str(self.scratch / text))

    def test_an_input_may_stand_after_set(self):
        told = self.expect(0, "run", "--set", "c.value=4", "p.yaml", "--set", "c.flag=true", "word=two", "--out", "o")
        self.assertEqual(told.stderr.count("note"), 0, told.stderr)
        record = self.json("o/run.json")
        self.assertEqual((record["overrides"], record["inputs"]), (["c.value=4", "c.flag=true"], {"word": "two"}))
        self.expect(0, "run", "p.yaml", "--only", "o", "word=two", "--out", "only")

    def test_what_is_given_twice_is_said(self):
        twice = ["p.yaml", "--set", "c.value=4", "--set", "c.value=5"]
        note = "note: --set c.value is given twice: '5' counts, '4' does not\n"
        self.assertIn("  " + note, self.printed("check", *twice))
        for command in (["plan", *twice], ["run", *twice, "--out", "o"]):
            self.assertIn("marrow: " + note, self.expect(0, *command).stderr)
        self.assertEqual(self.metric("o/outputs/o.json"), 5)
        self.assertEqual(
            self.expect(2, "check", "p.yaml", "data=a", "data=b").stderr,
            "marrow: error: the input 'data' is given twice, as 'a' and as 'b'; a run has one value of each input\n",
        )
        self.write("twice.yaml", PIPELINE.replace("word: $word", "value: 1, value: 2"))
        self.refused("'value' is given twice in 'with' of node 'c'", "check", "twice.yaml")

    def test_nothing_has_an_empty_name(self):
        for command in ("run", "compare", "check", "plan", "graph", "watch", "show", "rerun", "diff"):
            self.assertEqual(self.expect(2, command, "").stderr, EMPTY % command)
        for option in (["--out", ""], ["--out="], ["--shared-cache", ""], ["--only", ""]):
            self.assertEqual(self.expect(2, "run", "p.yaml", *option).stderr, EMPTY % option[0].rstrip("="))
        said = (
            "data=: error: input 'data' is an empty path\n"
            "  hint: name a file or a folder; the folder in which you are is  .\n"
        )
        self.refused(said, "run", "p.yaml", "data=")
        self.refused("a word of the command is empty", "")
        self.assertEqual(self.everything(), ["p.yaml"], "nothing was made")

    def test_names_that_look_the_same_are_shown(self):
        said = ["has no option 'val\\u200bue'\n", "the pipeline has no input 'wo\\u200drd'\n"]
        self.refused(said, "check", "p.yaml", "--set", "c.val\u200bue=4", "wo\u200drd=one")
        self.write("q.yaml", PIPELINE.replace("  c:", "  c: {uses: test.draw}\n  c\u2060:"))
        said = "q.yaml:6:3: error: the key 'c\\u2060' in nodes holds U+2060, which cannot be seen"
        self.refused(said, "check", "q.yaml")

    def refuse_each(self, command, option, texts, expected):
        for text in texts:
            said = "%s is '%s', but must be %s" % (option, text, expected) if text else EMPTY % option
            self.refused(said, command, "p.yaml", option, text)

    def test_numbers_within_their_bounds_and_no_other_texts(self):
        """One option of each kind gets all texts, which one function reads; the others those beyond their bounds."""
        self.refuse_each("run", "--seed", NO_WHOLE_NUMBERS, "a whole number from 0 to %d" % LARGEST_SEED)
        self.refuse_each("run", "--file-memory", NO_AMOUNTS, "a number of megabytes from 0.001 to 1000000000")
        for command, option, least, most in (
            ("plan", "--seed", 0, LARGEST_SEED),
            ("run", "--threads", 1, 1024),
            ("compare", "--threads", 1, 1024),
            ("cell", "--threads", 1, 1024),
            ("compare", "--jobs", 1, 1024),
            ("compare", "--shown", 0, 10000),
        ):
            texts = (least - 1, most + 1, 2**32 + 1) if most < 2**32 else (least - 1, most + 1)
            self.refuse_each(command, option, map(str, texts), "a whole number from %d to %d" % (least, most))
        for command, option, unit in (
            ("run", "--file-seconds", "seconds"),
            ("compare", "--file-memory", "megabytes"),
            ("compare", "--time-limit", "seconds"),
            ("compare", "--memory-limit", "megabytes"),
        ):
            expected = "a number of %s from 0.001 to 1000000000" % unit
            self.refuse_each(command, option, ("nan", "1e30", "0"), expected)
        self.assertEqual(self.everything(), ["p.yaml"], "nothing is made")
        for good in (0, 8, LARGEST_SEED):
            limits = ["--file-memory", "1e3", "--file-seconds", "2.5"]
            self.expect(0, "run", "p.yaml", "--seed", good, "--out", "out-%d" % good, "--quiet", *limits)
            self.assertEqual(self.json("out-%d/run.json" % good)["seed"], good)

    def test_the_help_says_what_holds_without_numbers(self):
        for command, default in (
            (["run"], r"--seed WHOLE NUMBER[= ]\[?1\b"),
            (["compare"], r"--time-limit NUMBER[= ]\[?600\b"),
            (["cache", "gc"], r"--keep-gb NUMBER[= ]\[?10\b"),
        ):
            self.assertRegex(self.printed(*command, "--help"), default)


if __name__ == "__main__":
    main()
