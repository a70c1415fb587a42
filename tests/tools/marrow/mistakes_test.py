# SPDX-License-Identifier: Apache-2.0
"""What is said to a person who types a command wrong, or gives it another thing than it takes."""
import json
import shutil

import yaml

from compare_cases import Compared
from harness import SOURCE
from harness.program import Case, main

PIPELINE = "p.yaml: this is a pipeline, not %s; run it by: marrow run p.yaml"
EXPERIMENT = "e.yaml: this is an experiment, not %s; look at it by: marrow compare e.yaml --dry-run"
RUN = "run: this is the folder of a run, not %s; look at it by: marrow show run; repeat it by: marrow rerun run"
COMPARISON = (
    "comparison: this is the folder of a comparison, not %s; its report is comparison/report.html, its cells are runs "
    "(cells/VARIANT/CASE/START), and this continues it: marrow compare EXPERIMENT --out comparison"
)
CASE = "cases/0: this is the folder of a case, not %s; give it to a pipeline: marrow run PIPELINE case=cases/0"
FILE = "run/run.json: this is a file of a run, not %s; give the folder: run"
WITHOUT_DASHES = "an input of the pipeline is given without dashes, as  "


class Mistakes(Compared):
    def said(self, *arguments):
        """The one sentence for which nothing is done."""
        result = self.expect(2, *arguments)
        self.assertEqual(result.stdout, "")
        (line,) = result.stderr.splitlines()
        self.assertTrue(line.startswith("marrow: error: "), line)
        return line[len("marrow: error: ") :]

    def test_commands_and_options(self):
        for words, said in (
            ("chek", "there is no command 'chek'; did you mean 'check'?"),
            ("rnu p.yaml --quiet", "there is no command 'rnu'; did you mean 'run'?"),
            ("chek --help", "there is no command 'chek'; did you mean 'check'?"),
            ("cache inof", "'cache' has no command 'inof'; did you mean 'info'?"),
            ("new nodes x", "'new' has no command 'nodes'; did you mean 'node'?"),
            ("run p.yaml --case=x", "'run' has no option '--case'; " + WITHOUT_DASHES + "case=x"),
            ("check p.yaml --case x", "'check' has no option '--case'; " + WITHOUT_DASHES + "case=VALUE"),
            ("plan -case=x p.yaml", "'plan' has no option '-case'; " + WITHOUT_DASHES + "case=x"),
            (
                "run p.yaml --thread=3",
                "'run' has no option '--thread'; did you mean '--threads'? An" + WITHOUT_DASHES[2:] + "thread=3",
            ),
            (
                "compare e.yaml --dryrun",
                "'compare' has no option '--dryrun'; did you mean '--dry-run'? An"
                + WITHOUT_DASHES[2:]
                + "dryrun=VALUE",
            ),
            ("cache gc --keep=3", "'gc' has no option '--keep'; did you mean '--keep-gb'?"),
            ("cache gc --everything", "'gc' has no option '--everything'; known: those that --help shows"),
            ("--quiet run p.yaml", "'marrow' has no option '--quiet'; options of a command stand after its name"),
        ):
            with self.subTest(words):
                self.assertEqual(self.said(*words.split()), said)
        self.assertRegex(self.said("p.yaml"), r"^there is no command 'p.yaml'; known: run, compare, ")
        self.assertNotIn("worker", self.said("workr"), "it is for the program itself")

    def test_other_things_than_the_command_takes(self):
        self.expect(0, "run", "p.yaml", "case=cases/0", "--out", "run")
        self.compare(out="comparison")
        self.write("cases/0/case.yaml", "marrow-case: 1\n")
        before = self.everything()
        for wanted, commands, others in (
            (
                *("a pipeline", (["run"], ["check"], ["plan"], ["graph"], ["watch"], ["list", "--fits"])),
                (EXPERIMENT, RUN, COMPARISON, CASE),
            ),
            ("an experiment", (["compare"], ["cell"]), (PIPELINE, RUN, COMPARISON, CASE)),
            (*("the folder of a run", (["show"], ["rerun"], ["diff"])), (PIPELINE, EXPERIMENT, COMPARISON, CASE, FILE)),
        ):
            for command in commands:
                more = {"cell": ["a/0/0"], "list": ["m"], "diff": ["run"]}.get(command[0], [])
                for other in others:
                    with self.subTest(command=command, other=other):
                        given = other[: other.index(":")]
                        self.assertEqual(self.said(*command, given, *more), other % wanted)
        self.assertEqual(self.said("open", "e.yaml"), EXPERIMENT % "a pipeline")
        self.assertEqual(self.everything(), before, "nothing is made")
        self.assertEqual(
            self.said("check", SOURCE / "pipelines" / "wrist" / "radius-0002.pose.yaml").split(": ", 1)[1],
            "this is a file of the format marrow-pose, not a pipeline; a pipeline names it in an option or an input",
        )

    def test_a_start_that_fails_leaves_no_folder(self):
        self.write("bad", "refuse")
        self.write(
            "mine.yaml",
            "marrow: 1\ninputs: {x: {type: path}}\nnodes:\n  f: {uses: parse.test_number, with: {path: $x}}\n"
            "  a: {uses: test.add, in: {a: f}}\noutputs: {a: a}\n",
        )
        bad = ["run", "mine.yaml", "x=bad"]
        before = {path.name for path in self.scratch.iterdir()}
        result = self.expect(1, *bad)
        self.assertIn("node 'f'", result.stderr)
        self.assertIn("nothing was made, so no folder of results is kept\n", result.stdout)
        self.assertEqual({path.name for path in self.scratch.iterdir()} - before, {"cache"})
        said = self.expect(1, *bad, "--json").stdout
        self.assertEqual(json.loads(said.splitlines()[-1])["folder"], "")
        self.write("good", "3")
        self.expect(0, "run", "mine.yaml", "x=good")
        self.expect(1, *bad)
        self.write("good", "refuse")
        self.expect(1, "rerun", "runs/mine")
        self.assertEqual([path.name for path in (self.scratch / "runs").iterdir()], ["mine"])
        self.expect(1, *bad, "--out", "asked")
        self.assertTrue((self.scratch / "asked" / "run.json").exists(), "it was asked for")

    def test_a_long_word_is_no_format(self):
        for text in ("marrow-" + 3_000_000 * "a" + ": 1\n", "marrow" + 3_000_000 * " " + ": 1\n"):
            self.write("long.yaml", text)
            self.assertIn("long.yaml", self.expect(2, "check", "long.yaml").stderr)

    def test_tabs(self):
        for text, line in (
            ("marrow: 1\nnodes:\n\tc: {uses: test.constant}\noutputs: {o: c}\n", 3),
            ("marrow: 1\nnodes:\n  c:\n\t\tuses: test.constant\noutputs: {o: c}\n", 4),
            ("marrow: 1\nnodes:\n  c:\n    uses: test.constant\n\twith: {value: 3}\noutputs: {o: c}\n", 5),
            ("marrow: 1\nnodes:\n  c: {uses: test.constant}\noutputs:\n\t- c\n", 5),
        ):
            for command, content in (("check", text), ("compare", text.replace("marrow: 1", "experiment: 1"))):
                self.write("tabs.yaml", content)
                said = "tabs.yaml:%d:1: error: not valid YAML: a tab indents this line; write spaces" % line
                self.assertIn(said, self.expect(2, command, "tabs.yaml").stderr)


# Words of the command line count literally: texts, empty words, words that are given twice, and numbers, for which no
# other text is taken.
PIPELINE_OF_TEXTS = """marrow: 1
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
    files = {"p.yaml": PIPELINE_OF_TEXTS}

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
        self.write("twice.yaml", PIPELINE_OF_TEXTS.replace("word: $word", "value: 1, value: 2"))
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
        self.write("q.yaml", PIPELINE_OF_TEXTS.replace("  c:", "  c: {uses: test.draw}\n  c\u2060:"))
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


# Names and folders: what a name may be, that no two results share a file, and what is replaced.
NUMBER = "marrow: 1\n%snodes:\n  c: {uses: test.constant, with: {value: 3}}\noutputs: {number: c}\n"
SIDES = """marrow: 1
name: sides
nodes:
  s: {uses: test.sides, with: {names: %s}}
  a: {uses: test.add, in: {a: s.both}}
outputs: {o: a}
"""
ROUNDS = 5


class Names(Case):
    has_own_store = False

    def test_a_pipelines_name_is_no_path(self):
        for name in ("run.json", "log.txt", "pipeline.yaml"):
            self.write("a/" + name, "mine")
        below = self.scratch / "a" / "b"
        for name in ("../../x", "x\\e[2J"):  # hostile_pipelines_test.cpp has others
            self.write("a/b/p.yaml", NUMBER % ('name: "%s"\n' % name))
            before = self.everything()
            said = ["p.yaml:2:1: error: a pipeline's name becomes a file name: '", "hint: use at most 100 letters"]
            for command in ("run", "check", "plan"):
                self.refused(said, command, "p.yaml", cwd=below)
            self.assertEqual(self.everything(), before)
        self.write("a/b/..yaml", NUMBER % "")
        said = "the pipeline takes its name from its file, and '.' cannot name a folder"
        self.refused(said, "run", "..yaml", cwd=below)
        self.assertEqual(self.read("a/pipeline.yaml"), "mine")

    def test_the_folder_of_a_rerun_is_none_either(self):
        self.expect(0, "run", self.write("p.yaml", NUMBER % ""), "--out", "a", "--quiet")
        self.write("a/pipeline.yaml", self.read("a/pipeline.yaml").replace("name: p", "name: ../../x"))
        self.refused("a pipeline's name becomes a file name: '../../x' cannot be one", "rerun", "a")
        self.assertFalse((self.scratch / "runs").exists())

    def test_two_runs_at_once_never_share_a_folder(self):
        self.write("p.yaml", NUMBER % "name: both\n")
        for number in range(ROUNDS):
            (self.scratch / ("empty%d" % number)).mkdir()
            for folder in (None, "out%d" % number, "empty%d" % number):
                out = ["--out", folder] if folder else []
                pair = [self.start("run", "p.yaml", "--set", "c.value=%d" % value, *out) for value in (1, 2)]
                errors = [process.communicate()[1] for process in pair]
                codes = [process.returncode for process in pair]
                self.assertEqual(sorted(codes), [0, 2] if folder else [0, 0], errors)
                if folder:
                    self.assertRegex(
                        errors[codes.index(2)],
                        "marrow: error: the output folder %s (was taken by another run just now|is already there and"
                        " not empty); choose another with --out" % folder,
                    )
        runs = ["both"] + ["both-%d" % i for i in range(2, 2 * ROUNDS + 1)]
        self.assertEqual(sorted(path.name for path in (self.scratch / "runs").iterdir()), sorted(runs))
        for folder in ["runs/" + name for name in runs] + [
            kind % i for kind in ("out%d", "empty%d") for i in range(ROUNDS)
        ]:
            value = self.metric(folder + "/outputs/number.json")
            self.assertEqual(self.json(folder + "/run.json")["overrides"], ["c.value=%d" % value])
            self.assertIn("value: %d\n" % value, self.read(folder + "/pipeline.yaml"))

    def test_each_item_has_a_file_of_its_own(self):
        self.write("p.yaml", SIDES % json.dumps(["a/b", "a_b", "a\\b", "..", "same", "same"]))
        self.expect(0, "run", "p.yaml", "--out", "a", "--quiet")
        names = ["a%2Fb", "a_b", "a%5Cb", "%2E.", "same", "same (2)"]
        output = self.json("a/run.json")["outputs"][0]
        self.assertEqual(output["files"], ["outputs/o/" + name + ".json" for name in names])
        self.assertEqual([self.metric("a/" + file) for file in output["files"]], [10, 20, 30, 40, 50, 60])
        # What reads a run finds each of them, without the store too.
        shutil.copytree(self.scratch / "a", self.scratch / "b")
        record = self.read("b/run.json").replace(output["items"][0][1], "f" * 32)
        self.write("b/run.json", record.replace('"digests"', '"of the files of another run"'))
        self.write("b/outputs/o/a%2Fb.json", self.read("a/outputs/o/a%2Fb.json").replace("10.0", "11.0"))
        no_store = {"MARROW_CACHE": str(self.scratch / "no store")}
        told = self.expect(1, "diff", "a", "b", extra_environment=no_store).stdout
        self.assertIn("a%2Fb  value                    11, was 10 (+1) (by the files in outputs/)\n", told)
        self.expect(0, "show", "a")
        self.assertIn('"columns":%s' % json.dumps(names, separators=(",", ":")), self.read("a/report.html"))

    def test_what_is_replaced_and_what_not(self):
        for command, said in (
            ("show", "an existing one is replaced"),
            ("schema", "an existing one is replaced"),
            ("run", "new or empty (default: runs/NAME, or runs/NAME-2 ... if that exists)"),
        ):
            self.assertIn(said, " ".join(self.printed(command, "--help").split()))
        self.expect(0, "schema", "--out", self.write("s.json", "old"))
        self.assertIn("json-schema", self.read("s.json"))
        (self.scratch / "folder").mkdir()
        self.refused("cannot write folder: Is a directory", "schema", "--out", "folder")
        self.assertEqual(self.everything(), ["folder", "s.json"], "nothing temporary is left")


if __name__ == "__main__":
    main()
