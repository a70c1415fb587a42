# SPDX-License-Identifier: Apache-2.0
"""Programs of others as steps of a pipeline: how they are called, how they fail, and how their version counts."""
import os
import pathlib
import shutil
import signal

from harness.program import main, wait_until
from program_cases import Programs


FAILS = "import sys; print('one'); sys.stdout.flush(); print('two', file=sys.stderr); sys.exit(3)"


class Words(Programs):
    """What reaches the program: its words, its folder, its standard input."""

    def test_words_are_what_they_are(self):
        odd = [
            "a b",
            "; touch x",
            "`id`",
            "$$(id)",
            "'",
            '"',
            "*",
            "\\n",
            "",
            "{{volume}}",
            "ü",
            "--help",
            "|",
            ">f",
            "&",
        ]
        script = (
            "import json, os, sys\njson.dump([sys.argv[3:], os.getcwd(), sys.stdin.read()], open(sys.argv[1], 'w'))\n"
            "json.dump({'a': 1}, open(sys.argv[2], 'w'))\n"
        )
        self.write("a 'b\" $HOME; c.py", script)
        command = ["python3", "{files.1}", str(self.scratch / "kept 'it' \"now\".json"), "{output.json}", *odd]
        self.run_it({"it": self.node("metrics", command, files=["a 'b\" $$HOME; c.py"])})
        words, folder, stdin = self.json("kept 'it' \"now\".json")
        plain = [word.replace("{{", "{").replace("}}", "}").replace("$$", "$") for word in odd]
        self.assertEqual(words, plain)
        self.assertEqual(stdin, "", "the standard input is empty")
        self.assertNotEqual(folder, str(self.scratch))
        self.assertFalse(os.path.exists(folder), "its folder is gone")
        self.assertFalse((self.scratch / "x").exists())

    def test_a_program_that_names_its_output_itself(self):
        script = (
            "import os, sys\nos.makedirs(sys.argv[1] + '/sub')\n"
            "open(sys.argv[1] + '/sub/b.json', 'w').write('{{\"a\": 4}}')\n"
        )
        named = lambda file: self.node("metrics", ["python3", "-c", script, "{output_folder}"], output_file=file)
        self.run_it({"it": named("sub/b.json")})
        self.assertEqual(self.metric("out/outputs/it.json"), 4)
        self.expect_failures(
            (
                named("sub/c.json"),
                "the program 'python3' ended well, but made no file 'c.json' in {output_folder}; did you mean "
                "'sub/b.json'?",
            ),
            (named("../c.json"), "output_file is '../c.json', but must be a name below {output_folder}"),
        )

    def test_places_that_nothing_fills(self):
        places = (
            ("{volum.mha}", "the command has the place '{volum.mha}', which nothing fills ({{ stands for a brace); did"
             " you mean 'volume'?"),
            ("{volume.mh}", "the place '{volume.mh}' of the command has an unknown format; did you mean 'mha'?"),
            ("{volume}", "the place '{volume}' of the command has no format; known: mha, nrrd, nii, nii.gz"),
            ("{output.png}", "the place '{output.png}' of the command has an unknown format; known: mha, nrrd, nii,"
             " nii.gz"),
            ("{mesh.stl}", "the command has '{mesh.stl}', but nothing is wired to the input 'mesh'"),
            ("{mesh.stl", "the word '{mesh.stl' of the command has a { without a }; write {{ for the character {"),
            ("{files.2}", "the command has the place '{files.2}', but the option files has 1 path: {files.1}"),
            ("{files.x}", "the command has the place '{files.x}', but the option files has 1 path: {files.1}"),
            ("{output.nrrd}", "the command has two outputs, 'output.mha' and 'output.nrrd'; a node makes one"),
        )  # fmt: skip
        volume = lambda *command, **options: self.node("volume", list(command), **options)
        self.expect_failures(
            *((volume("true", "{output.mha}", word, files=["copied.py"]), why) for word, why in places),
            (
                volume("true"),
                "the command does not say where its output goes; write {output.mha}, or {output_folder} and",
            ),
            (
                volume("true", "{output.mha}", output_file="a.mha"),
                "the command has {output...}, and there is an output_file, too; give one of them",
            ),
            (
                volume("true", output_file="a.mha"),
                "but the command does not name the folder that it is in; write {output_folder}",
            ),
            (
                volume("true", "{output.mha}", "{files.1}", files=["nothing.txt"]),
                "nothing.txt is not there; the option files names it",
            ),
        )

    def test_what_a_pipeline_must_give(self):
        self.refused(["command", "1 error"], "check", self.pipeline({"it": self.node("volume", [])}))
        node = self.node("volume", ["true", "{output.mha}"])
        del node["with"]["version_command"]
        self.refused("'version_command'", "check", self.pipeline({"it": node}))


class Failures(Programs):
    def python(self, script, **options):
        """A node that makes a volume by a Python script."""
        return self.node("volume", ["python3", "-c", script, "{output.mha}"], **options)

    def volume(self, program, **options):
        return self.node("volume", [program, "{output.mha}"], **options)

    def test_what_is_said(self):
        self.expect_failures(
            (self.python(FAILS), "the program 'python3' ended with exit code 3; it printed:\none\ntwo"),
            (self.volume("false"), "the program 'false' ended with exit code 1; it printed nothing"),
            (
                self.python("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)"),
                "the program 'python3' crashed: Segmentation fault; it printed nothing",
            ),
            (
                self.python("import time; time.sleep(1000)", max_time_s=0.2),
                "the program 'python3' took longer than 0.2 s; it printed nothing",
            ),
            (
                self.python("x = bytearray(400_000_000)\nimport time; time.sleep(1000)", max_memory_mb=200),
                "the program 'python3' used more than 200 MB of memory",
            ),
            (
                self.python("print('all is well')"),
                "the program 'python3' ended well, but made no file 'output.mha'; it printed:\nall is well",
            ),
            (self.python("import sys; open(sys.argv[1], 'w').write('nonsense')"), "output.mha"),
            (
                self.volume("pyton3"),
                "there is no program 'pyton3' on the PATH; did you mean 'python3'? Or install it, or write its whole "
                "path",
            ),
            (self.volume("/no/where"), "there is no program /no/where; install it, or name another"),
            (self.volume("./copied.py"), "the program './copied.py' is neither a whole path nor a name on the PATH"),
            (
                self.volume("{files.1}", files=["copied.py"]),
                "copied.py is no program: it may not be executed; make it so with chmod +x",
            ),
        )

    def test_only_the_last_lines_are_said(self):
        (told,) = self.failures(self.python("for i in range(100): print('line', i)\nraise SystemExit(1)"))
        self.assertNotIn("line 79", told)
        self.assertIn("line 80\nline 81\n", told)
        self.assertIn("line 99", told)

    def test_a_failed_program_is_replayed(self):
        said = self.run_it({"it": self.python(FAILS)}, code=1)
        self.assertIn(" failed: the program 'python3' ended with exit code 3; it printed:\n  one\n  two\n", said)
        told = self.expect(1, "replay", "out").stdout
        self.assertIn("failed again, with the same error: the program 'python3' ended with exit code 3", told)

    def alive(self, file):
        process = int(pathlib.Path(file).read_text())
        try:
            return pathlib.Path("/proc/%d/stat" % process).read_text().rsplit(") ", 1)[1][0] not in "ZX"
        except FileNotFoundError:
            return False

    def test_what_a_program_leaves_running_ends_with_it(self):
        script = (
            "import subprocess, sys\nchild = subprocess.Popen(['sleep', '1000'], start_new_session=False)\n"
            "open(sys.argv[2], 'w').write(str(child.pid))\nopen(sys.argv[1], 'w').write('{{\"a\": 1}}')\n"
        )
        self.run_it({"it": self.node("metrics", ["python3", "-c", script, "{output.json}", str(self.scratch / "pid")])})
        self.assertFalse(self.alive(self.scratch / "pid"))

    def test_stopped_by_a_signal(self):
        """Its child has a session of its own, as those that a shell starts with setsid."""
        script = (
            "import os, subprocess, sys, time\nchild = subprocess.Popen(['sleep', '1000'], start_new_session=True)\n"
            "open(sys.argv[1], 'w').write(str(os.getpid()))\nopen(sys.argv[2] + 'x', 'w').write(str(child.pid))\n"
            "os.rename(sys.argv[2] + 'x', sys.argv[2])\ntime.sleep(1000)\n"
        )
        parent, child = self.scratch / "parent", self.scratch / "child"
        node = self.node("volume", ["python3", "-c", script, str(parent), str(child), "{output.mha}"])
        for sent in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(sent.name):
                shutil.rmtree(self.scratch / "out", ignore_errors=True)
                child.unlink(missing_ok=True)
                run = self.start("run", self.pipeline({"it": node}), "--out", "out")
                wait_until(child.exists, "it has not started its child")
                run.send_signal(sent)
                told = run.communicate(timeout=300)[1]
                self.assertEqual(run.returncode, 130, told)
                self.assertEqual([self.alive(parent), self.alive(child)], [False, False])


class Versions(Programs):
    def setUp(self):
        super().setUp()
        self.environment = {"PATH": "%s:%s" % (self.scratch / "bin", os.environ["PATH"])}
        self.use("1.0")

    def use(self, version, ends="exit 0", made=1):
        """Installs a version of a program, which makes a figure."""
        text = '#!/bin/sh\nif [ "$1" = --version ]; then echo "tool %s"; %s; fi\necho "{\\"a\\": %d}" > "$1"\n'
        self.write("bin/tool", text % (version, ends, made)).chmod(0o755)

    def tool(self, *version_command):
        return self.node("metrics", ["tool", "{output.json}"], version_command=list(version_command))

    def calls(self, **more):
        self.run_it({"it": self.tool("tool", "--version")}, **more)
        record = self.nodes()["it"]
        return record["calls"], record["program_version"]

    def test_another_version_has_another_key(self):
        self.assertEqual(self.calls(), (1, "tool 1.0"))
        self.assertEqual(self.calls(), (0, "tool 1.0"))
        self.use("1.1")
        plan = self.printed("plan", "p.yaml")
        self.assertIn("(prints 'tool 1.1'), was [tool, --version] (prints 'tool 1.0')", plan)
        (self.scratch / "out").rename(self.scratch / "before")
        self.assertEqual(self.calls(), (1, "tool 1.1"))
        self.assertIn("identical", self.printed("diff", "before", "out"), "another version gave the same figures")
        self.use("1.1", made=2)
        another_store = {"MARROW_CACHE": str(self.scratch / "other")}
        self.assertEqual(self.calls(extra_environment=another_store), (1, "tool 1.1"))
        told = self.expect(1, "diff", "before", "out").stdout
        self.assertIn("option 'version_command' is [tool, --version] (printed 'tool 1.1'), was ", told)
        self.assertIn("[tool, --version] (printed 'tool 1.0')", told)
        self.use("1.0")
        self.assertEqual(self.calls(), (0, "tool 1.0"), "what the old version made is still there")

    def test_a_version_that_is_not_told(self):
        self.use("1.0", "exit 4")
        for node, said in (
            (
                self.tool("tool", "--version"),
                "version_command: the program 'tool' ended with exit code 4; it printed:\n  tool 1.0\n",
            ),
            (self.tool("true"), "version_command: the program 'true' printed nothing; name a command that prints the"),
        ):
            self.assertIn(said, self.run_it({"it": node}, code=1))

    def test_a_script_counts_by_its_content(self):
        node = self.node("metrics", ["python3", "{files.1}", "{output.json}"], files=["script.py"])
        for value in (1, 2):
            self.write("script.py", "import sys\nopen(sys.argv[1], 'w').write('{\"a\": %d}')\n" % value)
            self.run_it({"it": node})
            self.assertEqual(self.metric("out/outputs/it.json"), value)


if __name__ == "__main__":
    main()
