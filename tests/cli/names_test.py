# SPDX-License-Identifier: Apache-2.0
"""Names and folders: what a name may be, that no two results share a file, that no text of a file commands the
terminal."""
import json
import os
import shutil
import subprocess
import time

from cases import png
from marrow_cli import MARROW, TEST_PLUGINS, Case, main, marrow

NUMBER = "marrow: 1\n%snodes:\n  c: {uses: test.constant, with: {value: 3}}\noutputs: {number: c}\n"
SIDES = (
    "marrow: 1\nname: sides\nnodes:\n  s: {uses: test.sides, with: {names: %s}}\n  a: {uses: test.add, in: {a:"
    " s.both}}\noutputs: {o: a}\n"
)
ESCAPE = "\x1b[2J\x1b]0;owned\x07\nmarrow: forged"


class Commands(Case):
    def marrow(self, *arguments, **more):
        return marrow(*arguments, plugins=[TEST_PLUGINS], **{"cwd": self.scratch, **more})

    def expect(self, code, *arguments, **more):
        result = self.marrow(*arguments, **more)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result

    def everything(self):
        return sorted(str(path.relative_to(self.scratch)) for path in self.scratch.rglob("*"))


class Names(Commands):
    def test_a_pipelines_name_is_no_path(self):
        (self.scratch / "a" / "b").mkdir(parents=True)
        for name in ("run.json", "log.txt", "pipeline.yaml"):
            self.write("a/" + name, "mine")
        for name in ("../../x", "..", ".", "/tmp/marrow-x", "a\\\\b", "x\\e[2J"):
            self.write("a/b/p.yaml", NUMBER % ('name: "%s"\n' % name))
            before = self.everything()
            for command in ("run", "check", "plan"):
                result = self.expect(2, command, "p.yaml", cwd=self.scratch / "a" / "b")
                self.assertIn("p.yaml:2:1: error: a pipeline's name becomes a file name: '", result.stderr)
                self.assertIn("hint: use at most 100 letters", result.stderr)
            self.assertEqual(self.everything(), before)
        self.write("a/b/..yaml", NUMBER % "")
        self.assertIn(
            "the pipeline takes its name from its file, and '.' cannot name a folder",
            self.expect(2, "run", "..yaml", cwd=self.scratch / "a" / "b").stderr,
        )
        self.assertEqual((self.scratch / "a" / "pipeline.yaml").read_text(), "mine")

    def test_the_folder_of_a_rerun_is_none_either(self):
        self.expect(0, "run", self.write("p.yaml", NUMBER % ""), "--out", "a", "--quiet")
        self.write(
            "a/pipeline.yaml", (self.scratch / "a" / "pipeline.yaml").read_text().replace("name: p", "name: ../../x")
        )
        self.assertIn(
            "a pipeline's name becomes a file name: '../../x' cannot be one", self.expect(2, "rerun", "a").stderr
        )
        self.assertFalse((self.scratch / "runs").exists())

    def test_two_runs_at_once_never_share_a_folder(self):
        text = NUMBER % "name: both\n"
        self.write("p.yaml", text)
        environment = dict(os.environ, MARROW_PLUGIN_PATH=str(TEST_PLUGINS))
        for round in range(10):
            (self.scratch / ("empty%d" % round)).mkdir()
            for folder in (None, "out%d" % round, "empty%d" % round):
                out = ["--out", folder] if folder else []
                pair = [
                    subprocess.Popen(
                        [str(MARROW), "run", "p.yaml", "--set", "c.value=%d" % value, *out],
                        cwd=self.scratch,
                        env=environment,
                        stdout=subprocess.DEVNULL,
                        stderr=subprocess.PIPE,
                        text=True,
                    )
                    for value in (1, 2)
                ]
                errors = [process.communicate()[1] for process in pair]
                codes = [process.returncode for process in pair]
                self.assertEqual(sorted(codes), [0, 2] if folder else [0, 0], errors)
                if folder:
                    self.assertRegex(
                        errors[codes.index(2)],
                        "marrow: error: the output folder %s (was taken by another run just now|is already there and"
                        " not empty); choose another with --out" % folder,
                    )
        values = []
        for folder in [*(self.scratch / "runs").iterdir(), *self.scratch.glob("out*"), *self.scratch.glob("empty*")]:
            value = json.loads((folder / "outputs" / "number.json").read_text())["metrics"][0]["value"]
            self.assertEqual(json.loads((folder / "run.json").read_text())["overrides"], ["c.value=%d" % value])
            self.assertIn("value: %d\n" % value, (folder / "pipeline.yaml").read_text())
            values.append(value)
        self.assertEqual(len(values), 40)
        self.assertEqual(
            sorted(path.name for path in (self.scratch / "runs").iterdir()),
            sorted(["both"] + ["both-%d" % i for i in range(2, 21)]),
        )

    def test_each_item_has_a_file_of_its_own(self):
        names = ["a/b", "a_b", "a\\b", "..", "same", "same"]
        self.write("p.yaml", SIDES % json.dumps(names))
        self.expect(0, "run", "p.yaml", "--out", "a", "--quiet")
        record = json.loads((self.scratch / "a" / "run.json").read_text())
        files = record["outputs"][0]["files"]
        self.assertEqual(
            files, ["outputs/o/" + name + ".json" for name in ("a%2Fb", "a_b", "a%5Cb", "%2E.", "same", "same (2)")]
        )
        values = [json.loads((self.scratch / "a" / file).read_text())["metrics"][0]["value"] for file in files]
        self.assertEqual(values, [10, 20, 30, 40, 50, 60])
        # What reads a run finds each of them, without the store too.
        shutil.copytree(self.scratch / "a", self.scratch / "b")
        changed = self.scratch / "b" / "run.json"
        key = record["outputs"][0]["items"][0][1]
        changed.write_text(
            changed.read_text().replace(key, "f" * 32).replace('"digests"', '"of the files of another run"')
        )
        self.write(
            "b/outputs/o/a%2Fb.json", (self.scratch / "a" / "outputs/o/a%2Fb.json").read_text().replace("10.0", "11.0")
        )
        told = self.expect(
            1, "diff", "a", "b", extra_environment={"MARROW_CACHE": str(self.scratch / "no store")}
        ).stdout
        self.assertIn("a%2Fb  value                    11, was 10 (+1) (by the files in outputs/)\n", told)
        self.expect(0, "show", "a")
        self.assertIn(
            '"columns":["a%2Fb","a_b","a%5Cb","%2E.","same","same (2)"]',
            (self.scratch / "a" / "report.html").read_text(),
        )

    def test_no_name_commands_the_terminal(self):
        self.write(
            "p.yaml",
            "marrow: 1\nnodes:\n  s: {uses: test.sides, with: {names: [%s, %s]}}\n  w: {uses: test.work, with: {value:"
            " 0.3}, in: {after: s.both}}\n  f: {uses: test.fail_above, in: {a: s.both}, with: {value: 10}}\noutputs:"
            " {o: f, w: w}\n" % (json.dumps(ESCAPE), json.dumps("\x9b31m\u202e")),
        )
        told = []
        for arguments in (
            ["run", "p.yaml", "--out", "a"],
            ["diff", "a", "a"],
            ["rerun", "a", "--out", "b"],
            ["graph", "p.yaml"],
            ["plan", "p.yaml"],
            ["show", "a"],
            ["run", "p.yaml", "--out", "c", "--set", "f.in.a=s." + ESCAPE.replace(".", "")],
            ["inspect", ESCAPE],
            ["list", ESCAPE],
        ):
            result = subprocess.run(
                [str(MARROW), *arguments],
                cwd=self.scratch,
                env=dict(os.environ, MARROW_PLUGIN_PATH=str(TEST_PLUGINS)),
                capture_output=True,
            )
            told.append(result.stdout + result.stderr)
        told += [(self.scratch / "a" / "log.txt").read_bytes(), (self.scratch / "b" / "log.txt").read_bytes()]
        for text in told:
            for bad in (b"\x1b", b"\x07", b"\xc2\x9b", b"\xe2\x80\xae", b"\nmarrow: forged"):
                self.assertNotIn(bad, text)
        self.assertIn(b"f (\\x1b[2J\\x1b]0;owned\\x07\\x0amarrow: forged)", told[0])
        self.assertRegex(told[-1], rb"w \(\\u009b31m\\u202e\): \d")

    def test_nor_does_a_faulty_file(self):
        # YAML itself lets no escape sequence through, but these it does.
        self.write(
            "p.yaml",
            (
                'marrow: 1\n"k\\e[2J": 1\nnodes:\n  c: {uses: "u\\e[31m", with: {"o\\e": 1}}  # \u009b31m'
                ' \u202e\noutputs: {"o\\e": "r\\e"}\n'
            ),
        )
        for arguments in (
            ["check", "p.yaml"],
            ["run", "p.yaml", "--set", "c.value=\x1b[2J"],
            ["check", "p.yaml", "\x1b[2J=1"],
            ["check", "\x1b[2J.yaml"],
        ):
            result = self.expect(2, *arguments)
            for bad in ("\x1b", "\x9b", "\u202e"):
                self.assertNotIn(bad, result.stdout + result.stderr)
        self.assertIn(
            "the key 'k\\x1b[2J' in the pipeline holds a control character", self.expect(2, "check", "p.yaml").stderr
        )
        self.assertIn("# \\u009b31m \\u202e", self.expect(2, "check", "p.yaml").stderr, "the line as it is quoted")
        self.assertIn(
            "k\x1b[2J",
            json.loads(self.expect(2, "check", "--json", "p.yaml").stdout)[0]["message"],
            "JSON has escapes of its own",
        )

    def test_nor_does_an_argument_or_a_folder(self):
        name, cache = "a" + ESCAPE.replace("/", "") + "\u202e", self.scratch / "cache\x1b[2J"
        self.write(name, "x")
        self.write(
            "p.yaml",
            (
                "marrow: 1\ninputs: {x: {type: path}}\nnodes:\n  w: {uses: test.work, with: {value: 0.01, path:"
                " $x}}\noutputs: {o: w}\n"
            ),
        )
        environment = {"MARROW_CACHE": str(cache)}
        self.expect(0, "run", "p.yaml", "x=" + name, "--out", "o", extra_environment=environment)
        key = json.loads((self.scratch / "o" / "run.json").read_text())["nodes"][0]["keys"]["number"]
        commands = [
            [0, "cache", "info"],
            [0, "cache", "why", key],
            [2, "cache", "why", ESCAPE],
            [2, "cache", "gc", "--keep-gb", ESCAPE],
            [2, "run", "p.yaml", "--threads", ESCAPE],
            [2, "run", "p.yaml", "--seed", ESCAPE],
            [2, "run", "p.yaml", "--" + ESCAPE],
            [0, "doctor"],
        ]
        for code, *arguments in commands:
            environment["MARROW_PLUGIN_PATH"] = str(TEST_PLUGINS) + ":/nowhere" + ESCAPE
            result = self.expect(code, *arguments, extra_environment=environment)
            for bad in ("\x1b", "\x07", "\u202e", "\nmarrow: forged"):
                self.assertNotIn(bad, result.stdout + result.stderr, arguments)
            self.assertIn("\\x1b[2J", result.stdout + result.stderr, arguments)

    def test_names_in_dot_files_and_pages_are_names(self):
        self.write(
            "p.yaml",
            (
                "marrow: 1\nname: 'a\"b'\nnodes:\n  'c\"; x': {uses: test.constant}\n  s: {uses: test.sides, with:"
                " {names: ['</script><script>alert(1)</script>', b]}}\noutputs: {'o\"': 'c\"; x', s: s.both}\n"
            ),
        )
        dot = self.expect(0, "graph", "--dot", "p.yaml").stdout
        self.assertIn('digraph "a\\"b" {', dot)
        self.assertIn('  "c\\"; x" [label="c\\"; x\\ntest.constant"];', dot)
        self.expect(0, "run", "p.yaml", "--out", "a", "--quiet")
        self.expect(0, "show", "a")
        page = (self.scratch / "a" / "report.html").read_text()
        self.assertNotIn("<script>alert", page)
        data = page.split('<script type="application/json" id="data">')[1].split("</script>")[0]
        self.assertEqual(json.loads(data)["figures"][-1]["columns"][0], "<%2Fscript><script>alert(1)<%2Fscript>")


class Records(Commands):
    """run.json and pipeline.yaml of a folder that somebody else made, or that is damaged."""

    def setUp(self):
        super().setUp()
        self.expect(0, "run", self.write("p.yaml", NUMBER % ""), "--out", "a", "--quiet")
        self.record = json.loads((self.scratch / "a" / "run.json").read_text())

    def change(self, **values):
        self.write("a/run.json", json.dumps({**self.record, **values}))

    def test_wrong_records_are_refused(self):
        deep = "[" * 100000 + "]" * 100000
        node = self.record["nodes"][0]
        for values, why in (
            ({"threads": 10**9}, "its 'threads' is 1000000000; expected a whole number from 0 to 1024"),
            ({"threads": -1}, "its 'threads' is -1; expected"),
            ({"threads": 1.5}, "its 'threads': expected a whole number"),
            ({"threads": "2"}, "its 'threads': expected a whole number"),
            ({"seed": -1}, "its 'seed' is no whole number"),
            ({"seed": 1e30}, "its 'seed' is no whole number"),
            ({"seed": None}, "its 'seed' is no whole number"),
            ({"status": "\x1b[2J"}, "it says 'status': '\\x1b[2J'"),
            ({"nodes": {}}, "its 'nodes' is no list"),
            ({"nodes": [1]}, "what it should say is missing in it, or of another type"),
            ({"nodes": [{**node, "keys": {"number": "../x"}}]}, "a key in it has not 32 hexadecimal digits"),
            ({"inputs": 1}, "its 'inputs' is no object"),
            ({"outputs": {}}, "its 'outputs' is no list"),
            ({"overrides": [1]}, "of another type"),
            ({"pipeline": 1}, "of another type"),
        ):
            self.change(**values)
            for command in (["rerun", "a", "--out", "b"], ["diff", "a", "a"]):
                result = self.marrow(*command)
                error = result.stderr
                self.assertEqual(result.returncode, 2, (values, command, error))
                self.assertIn("marrow: error: a/run.json is not what 'marrow run' wrote: ", error)
                self.assertIn(why, error)
                self.assertIn("; run it again\n", error)
        for text, why in (
            ('{"nodes": %s}' % deep, "it: lists and objects are nested more than 64 deep"),
            ("{", "it:1:2: not valid JSON"),
            ("[]", "it holds no object"),
            ("", "it:1:1: not valid JSON"),
        ):
            self.write("a/run.json", text)
            for command in (["rerun", "a", "--out", "b"], ["diff", "a", "a"], ["show", "a"]):
                self.assertIn(
                    "a/run.json is not what 'marrow run' wrote: " + why + "; run it again",
                    self.expect(2, *command).stderr,
                )
        for values in ({"nodes": 1}, {"outputs": [1]}, {"pipeline": []}, {"seconds": "x"}):
            self.change(**values)
            self.assertIn("a/run.json is not what 'marrow run' wrote: ", self.expect(2, "show", "a").stderr)
        self.write("a/run.json", "{}")
        self.assertIn(
            "a/run.json is not what 'marrow run' wrote: what it should say is missing in it",
            self.expect(2, "show", "a").stderr,
        )
        self.assertFalse((self.scratch / "b").exists())

    def test_wrong_pipelines_are_refused(self):
        for text, why in (
            ("nodes: &a {c: *a}\n", "an alias names a list or map that it is in itself"),
            ("a: " + "[" * 50000, "nested more than 100 deep"),
            ("{", "not valid YAML"),
            ("x" * 4000001, "longer than 4 MB"),
            ("", "it holds no pipeline"),
            ("root:x:0:0\n", "it holds no pipeline"),
            ("[a]", "it holds no pipeline"),
            ("nodes: x\n", "it holds no pipeline"),
            ("nodes: {c: x}\n", "its node 'c' is no map"),
            ("nodes: {d: {uses: a}}\n", "its node 'c' is none of pipeline.yaml"),
        ):
            self.write("a/pipeline.yaml", text)
            for command in ("rerun", "diff"):
                error = self.expect(2, command, "a", *(["a"] if command == "diff" else [])).stderr
                self.assertIn(why, error)
                self.assertEqual(error.count("\n"), 1)
                self.assertNotIn("yaml-cpp", error)

    def test_no_pipe_keeps_a_reader_waiting(self):
        shutil.copytree(self.scratch / "a", self.scratch / "b")
        (self.scratch / "a" / "pipeline.yaml").unlink()
        os.mkfifo(self.scratch / "a" / "pipeline.yaml")
        os.mkfifo(self.scratch / "a" / "report.html")
        for command in (["diff", "a", "b"], ["diff", "b", "a"], ["rerun", "a", "--out", "c"]):
            self.assertIn(
                (
                    "a/pipeline.yaml is not what 'marrow run' wrote: the pipeline cannot be read: it is no regular"
                    " file; run it again"
                ),
                self.expect(2, *command, timeout=60).stderr,
            )
        self.expect(0, "show", "a", timeout=60)
        self.assertEqual(self.shown()["experiment"]["pipeline_text"], "")
        for name in ("a/pipeline.yaml", "/dev/zero"):
            for command in ("check", "graph", "run", "plan"):
                self.assertEqual(
                    self.expect(2, command, name, timeout=60).stderr,
                    "%s: error: the pipeline file cannot be read: it is no regular file\n  hint: write the text to a"
                    " file and give that\n1 error\n" % name,
                )
            self.assertIn("it is no regular file", self.expect(2, "compare", name, "--out", "c", timeout=60).stderr)
        self.assertFalse((self.scratch / "c").exists())
        (self.scratch / "out").symlink_to("/dev/stdout")
        page = subprocess.run(
            [str(MARROW), "show", "b", "--out", "out"], cwd=self.scratch, capture_output=True, text=True, timeout=60
        )
        self.assertIn("</html>", page.stdout, "a pipe that is named as the place of the page")

    def test_functions_that_call_each_other_in_a_circle(self):
        node, nodes, pipeline = self.record["nodes"][0], [], "marrow: 1\nname: p\nnodes:\n"
        for i in range(60):
            nodes.append(
                {**node, "id": "f%d" % i, "functions": ["number"], "inputs": {"a": "%032x" % 1, "b": "%032x" % 1}}
            )
            pipeline += "  f%d: {uses: x.y, in: {a: f%d, b: f%d}}\n" % (i, (i + 1) % 60, (i + 2) % 60)
        nodes.append({**node, "id": "c", "inputs": {"a": "%032x" % 1}})
        self.write("a/pipeline.yaml", pipeline + "  c: {uses: x.y, in: {a: f0}}\noutputs: {o: c}\n")
        self.change(nodes=nodes)
        shutil.copytree(self.scratch / "a", self.scratch / "b")
        for one in nodes:
            one["inputs"] = {port: "%032x" % 2 for port in one["inputs"]}
        nodes[-1]["keys"] = {"number": "%032x" % 3}
        self.write("b/run.json", json.dumps({**self.record, "nodes": nodes}))
        self.assertIn("First difference: node 'c'", self.expect(1, "diff", "a", "b", timeout=120).stdout)

    def shown(self):
        """What the page of the run holds."""
        page = (self.scratch / "a" / "report.html").read_text()
        return json.loads(page.split('<script type="application/json" id="data">')[1].split("</script>")[0])

    def test_a_page_shows_nothing_from_outside_the_run(self):
        secret = json.dumps({"metrics": [{"name": "secret figure", "value": 1, "unit": ""}]})
        (self.scratch / "a" / "outputs" / "inside.png").write_bytes(png(4, 4, lambda u, v: 0))
        self.expect(0, "show", "a")
        self.assertEqual(self.shown()["pictures"], {})
        self.write("secret.json", secret)
        (self.scratch / "secret.png").write_bytes(png(4, 4, lambda u, v: 1000 * u))
        (self.scratch / "a" / "outputs" / "link.png").symlink_to(self.scratch / "secret.png")
        (self.scratch / "a" / "outputs" / "link").symlink_to(self.scratch)
        outside = [
            "../secret.png",
            str(self.scratch / "secret.png"),
            "outputs/link.png",
            "outputs/link/secret.png",
            "outputs/../../secret.png",
            "../secret.json",
        ]
        self.change(outputs=[{"name": "o", "files": [*outside, "outputs/inside.png", "outputs/none.png", "outputs"]}])
        result = self.expect(0, "show", "a")
        self.assertEqual(
            result.stderr.splitlines(),
            ["marrow: warning: %s is not shown: it lies outside the run's folder a" % name for name in outside],
        )
        page = (self.scratch / "a" / "report.html").read_text()
        data = self.shown()
        self.assertEqual([picture["name"] for picture in data["cells"][0]["pictures"]], ["inside"])
        self.assertNotIn("secret figure", page)
        # diff reads files where the store has no values
        for folder, digit in (("b", "1"), ("a", "2")):
            self.change(outputs=[{"name": "o", "files": ["../secret.json"], "items": [["", digit * 32]]}])
            if folder == "b":
                shutil.copytree(self.scratch / "a", self.scratch / "b", symlinks=True)
        self.assertIn("by how much is not known", self.expect(1, "diff", "a", "b").stdout)

    def test_a_page_shows_no_pipeline_from_outside_the_run(self):
        secret = self.write("secret.yaml", (self.scratch / "a" / "pipeline.yaml").read_text() + "# secret\n")
        (self.scratch / "a" / "pipeline.yaml").unlink()
        (self.scratch / "a" / "pipeline.yaml").symlink_to(secret)
        result = self.expect(0, "show", "a")
        self.assertEqual(
            result.stderr, "marrow: warning: pipeline.yaml is not shown: it lies outside the run's folder a\n"
        )
        self.assertEqual(self.shown()["experiment"]["pipeline_text"], "")
        self.assertNotIn("graph", self.shown())
        self.assertNotIn("# secret", (self.scratch / "a" / "report.html").read_text())
        shutil.move(self.scratch / "a" / "run.json", self.scratch / "run.json")
        (self.scratch / "a" / "run.json").symlink_to(self.scratch / "run.json")
        self.assertIn(
            "a/run.json is a link to a file outside of the folder, of which nothing is shown; copy it there",
            self.expect(2, "show", "a").stderr,
        )

    def test_a_scene_fetches_nothing(self):
        scene = {
            "marrow-scene": 1,
            "meshes": [],
            "poses": [],
            "views": [{"name": "x", "image": "http://example.invalid/x.png"}],
        }
        self.write("a/outputs/scene.json", json.dumps(scene))
        self.change(outputs=[{"name": "scene", "files": ["outputs/scene.json"]}])
        self.expect(0, "show", "a")
        self.assertNotIn("example.invalid", (self.scratch / "a" / "report.html").read_text())


class Sizes(Commands):
    def measured(self, *arguments):
        """Exit code, seconds, megabytes and what was said."""
        with open(self.scratch / "said", "wb") as said:
            start = time.perf_counter()
            process = subprocess.Popen(
                [str(MARROW), *map(str, arguments)],
                cwd=self.scratch,
                env=dict(os.environ, MARROW_PLUGIN_PATH=str(TEST_PLUGINS)),
                stdout=said,
                stderr=said,
            )
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        return (
            process.returncode,
            usage.ru_utime + usage.ru_stime,
            usage.ru_maxrss / 1000,
            (self.scratch / "said").read_text(),
        )

    def test_many_faults_are_counted(self):
        self.write("p.yaml", "marrow: 1\n" + "".join("%07d:\n" % i for i in range(430000)))
        code, _, megabytes, said = self.measured("check", "p.yaml")
        self.assertEqual(code, 2)
        self.assertLess(len(said), 20000)
        self.assertIn("and 429952 more faults\n430002 errors\n", said)
        self.assertEqual(said.count("unknown key"), 50)
        self.assertLess(megabytes, 2000)

    def test_files_of_13_MB_are_refused_at_once(self):
        self.write("p.yaml", "marrow: 1\n" + "".join("%08d:\n" % i for i in range(1300000)))
        code, seconds, _, said = self.measured("check", "p.yaml")
        self.assertEqual((code, said), (2, "p.yaml: error: the pipeline file is longer than 4 MB\n1 error\n"))
        self.assertLess(seconds, 20)

    def test_files_of_64_kB_take_little(self):
        nodes = "".join(" n%d: {uses: test.add, in: {a: n%d}}\n" % (i, i + 1) for i in range(1500))
        for text in (
            "marrow: 1\nnodes:\n" + nodes + " n1500: {uses: test.constant}\noutputs: {o: n0}\n",
            "[" * 64000,
            "- " * 32000,
            "&a [*a" + ", *a" * 16000 + "]",
            "marrow: 1\nnodes:\n" + "".join(" n%d: {uses: x%d}\n" % (i, i) for i in range(3200)),
            "x: " + "\x80" * 32000,
            "marrow: 1\ninputs: {a: {type: text, default: %s}}\nnodes:\n c: {uses: test.sides, with: {names: [%s]}}\n"
            % ("x" * 30000, "$a" * 15000),
        ):
            self.write("p.yaml", text)
            code, seconds, megabytes, said = self.measured("check", "p.yaml")
            self.assertIn(code, (0, 2), said[:1000])
            self.assertLess(seconds, 20, text[:60])
            self.assertLess(megabytes, 256, text[:60])
            self.assertLess(len(said), 100000)

    def test_what_cannot_be_printed_is_said(self):
        with open("/dev/full", "w") as full:
            result = subprocess.run([str(MARROW), "list"], stdout=full, stderr=subprocess.PIPE, text=True)
        self.assertIn(result.returncode, (1, 2))
        self.assertEqual(
            result.stderr, "marrow: error: what was to be printed could not be written; is the disk full?\n"
        )

    def test_what_is_replaced_and_what_not(self):
        self.assertIn("one that is there is replaced", " ".join(self.expect(0, "show", "--help").stdout.split()))
        self.assertIn("one that is there is replaced", " ".join(self.expect(0, "schema", "--help").stdout.split()))
        self.assertIn(
            "new or empty (default: runs/NAME, or runs/NAME-2 ... where that is there)",
            " ".join(self.expect(0, "run", "--help").stdout.split()),
        )
        self.expect(0, "schema", "--out", self.write("s.json", "old"))
        self.assertIn("json-schema", (self.scratch / "s.json").read_text())
        (self.scratch / "folder").mkdir()
        self.assertIn("cannot write folder: Is a directory", self.expect(2, "schema", "--out", "folder").stderr)
        self.assertEqual(self.everything(), ["folder", "s.json"], "nothing temporary is left")


if __name__ == "__main__":
    main()
