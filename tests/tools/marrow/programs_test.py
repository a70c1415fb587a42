# SPDX-License-Identifier: Apache-2.0
"""Programs of others as steps of a pipeline: how they are called, how they fail, and how their version counts."""
import json
import os
import pathlib
import shutil
import signal
import subprocess

from harness import MARROW
from harness.program import main, wait_until
from program_cases import Programs


class Words(Programs):
    """What reaches the program: its words, its folder, its standard input."""

    def said(self, command, **options):
        """What a Python script says about itself, as a file that the test finds."""
        self.write(
            "a 'b\" $HOME; c.py",
            "import json, os, sys\njson.dump([sys.argv[3:], os.getcwd(), sys.stdin.read()], open(sys.argv[1], 'w'))\n"
            "json.dump({'a': 1}, open(sys.argv[2], 'w'))\n",
        )
        kept = self.kept("kept 'it' \"now\".json")
        words = ["python3", "{files.1}", str(kept), "{output.json}", *command]
        self.run_it({"it": self.node("metrics", words, files=["a 'b\" $$HOME; c.py"], **options)})
        return json.loads(kept.read_text())

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
        words, folder, stdin = self.said(odd)
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
        command = ["python3", "-c", script, "{output_folder}"]
        self.run_it({"it": self.node("metrics", command, output_file="sub/b.json")})
        made = json.loads((self.scratch / "out/outputs/it.json").read_text())["metrics"]
        self.assertEqual(made[0]["value"], 4)
        told = self.failure(command, kind="metrics", output_file="sub/c.json")
        self.assertIn(
            "the program 'python3' ended well, but made no file 'c.json' in {output_folder}; did you mean "
            "'sub/b.json'?",
            told,
        )
        told = self.failure(command, kind="metrics", output_file="../c.json")
        self.assertIn("output_file is '../c.json', but must be a name below {output_folder}", told)

    def test_places_that_nothing_fills(self):
        for word, why in (
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
        ):  # fmt: skip
            with self.subTest(word):
                self.assertIn(why, self.failure(["true", "{output.mha}", word], files=["copied.py"]))
        told = self.failure(["true"])
        self.assertIn(
            "the command does not say where its output goes; write {output.mha}, or {output_folder} and", told
        )
        told = self.failure(["true", "{output.mha}"], output_file="a.mha")
        self.assertIn("the command has {output...}, and there is an output_file, too; give one of them", told)
        told = self.failure(["true"], output_file="a.mha")
        self.assertIn("but the command does not name the folder that it is in; write {output_folder}", told)
        told = self.failure(["true", "{output.mha}", "{files.1}"], files=["nothing.txt"])
        self.assertIn("nothing.txt is not there; the option files names it", told)

    def test_what_a_pipeline_must_give(self):
        pipeline = self.pipeline({"it": self.node("volume", [])})
        told = self.marrow("check", pipeline).stderr
        self.assertIn("command", told)
        self.assertIn("1 error", told)
        node = self.node("volume", ["true", "{output.mha}"])
        del node["with"]["version_command"]
        self.assertIn("'version_command'", self.marrow("check", self.pipeline({"it": node})).stderr)


class Failures(Programs):
    def python(self, script, **options):
        """The failure of a Python script that is to make a volume."""
        return self.failure(["python3", "-c", script, "{output.mha}"], **options)

    def test_an_exit_code(self):
        told = self.python("import sys; print('one'); sys.stdout.flush(); print('two', file=sys.stderr); sys.exit(3)")
        self.assertIn("the program 'python3' ended with exit code 3; it printed:\n  one\n  two\n", told)
        self.assertIn(
            "the program 'false' ended with exit code 1; it printed nothing", self.failure(["false", "{output.mha}"])
        )
        told = self.python("for i in range(100): print('line', i)\nraise SystemExit(1)")
        self.assertNotIn("line 79\n", told)
        self.assertIn("line 80\n  line 81\n", told)
        self.assertIn("line 99\n", told)

    def test_a_crash(self):
        told = self.python("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
        self.assertIn("the program 'python3' crashed: Segmentation fault; it printed nothing", told)

    def test_too_long(self):
        told = self.python("import time; time.sleep(1000)", max_time_s=0.2)
        self.assertIn("the program 'python3' took longer than 0.2 s; it printed nothing", told)

    def test_too_much_memory(self):
        told = self.python("x = bytearray(400_000_000)\nimport time; time.sleep(1000)", max_memory_mb=200)
        self.assertIn("the program 'python3' used more than 200 MB of memory", told)

    def test_no_output(self):
        told = self.python("print('all is well')")
        self.assertIn(
            "the program 'python3' ended well, but made no file 'output.mha'; it printed:\n  all is well\n", told
        )
        told = self.python("import sys; open(sys.argv[1], 'w').write('nonsense')")
        self.assertIn("output.mha", told)

    def test_no_program(self):
        told = self.failure(["pyton3", "{output.mha}"])
        self.assertIn(
            "there is no program 'pyton3' on the PATH; did you mean 'python3'? Or install it, or write its whole path",
            told,
        )
        self.assertIn(
            "there is no program /no/where; install it, or name another", self.failure(["/no/where", "{output.mha}"])
        )
        told = self.failure(["./copied.py", "{output.mha}"])
        self.assertIn("the program './copied.py' is neither a whole path nor a name on the PATH", told)
        told = self.failure(["{files.1}", "{output.mha}"], files=["copied.py"])
        self.assertIn("copied.py is no program: it may not be executed; make it so with chmod +x", told)

    def test_a_failed_program_is_replayed(self):
        self.python("raise SystemExit(3)")
        told = self.marrow("replay", "out")
        self.assertEqual(told.returncode, 1, told.stderr)
        self.assertIn("failed again, with the same error: the program 'python3' ended with exit code 3", told.stdout)

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
        self.run_it({"it": self.node("metrics", ["python3", "-c", script, "{output.json}", str(self.kept("pid"))])})
        self.assertFalse(self.alive(self.kept("pid")))

    def test_stopped_by_a_signal(self):
        """Its child has a session of its own, as those that a shell starts with setsid."""
        script = (
            "import os, subprocess, sys, time\nchild = subprocess.Popen(['sleep', '1000'], start_new_session=True)\n"
            "open(sys.argv[1], 'w').write(str(os.getpid()))\nopen(sys.argv[2] + 'x', 'w').write(str(child.pid))\n"
            "os.rename(sys.argv[2] + 'x', sys.argv[2])\ntime.sleep(1000)\n"
        )
        parent, child = self.kept("parent"), self.kept("child")
        node = self.node("volume", ["python3", "-c", script, str(parent), str(child), "{output.mha}"])
        environment = {**os.environ, "MARROW_CACHE": str(self.scratch / "cache")}
        for sent in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(sent.name):
                shutil.rmtree(self.scratch / "out", ignore_errors=True)
                child.unlink(missing_ok=True)
                run = subprocess.Popen(
                    [MARROW, "run", self.pipeline({"it": node}), "--out", self.scratch / "out"],
                    env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                )  # fmt: skip
                wait_until(child.exists, "it has not started its child")
                run.send_signal(sent)
                _, told = run.communicate(timeout=300)
                self.assertEqual(run.returncode, 130, told)
                self.assertEqual([self.alive(parent), self.alive(child)], [False, False])


class Versions(Programs):
    def setUp(self):
        super().setUp()
        (self.scratch / "bin").mkdir()
        self.environment = {"PATH": "%s:%s" % (self.scratch / "bin", os.environ["PATH"])}
        self.use("1.0")

    def use(self, version, ends="exit 0", made=1):
        """Installs a version of a program, which makes a figure."""
        text = '#!/bin/sh\nif [ "$1" = --version ]; then echo "tool %s"; %s; fi\necho "{\\"a\\": %d}" > "$1"\n'
        text %= (version, ends, made)
        tool = self.write("bin/tool", text)
        tool.chmod(0o755)

    def calls(self, cache=True, **more):
        node = self.node("metrics", ["tool", "{output.json}"], version_command=["tool", "--version"])
        environment = self.environment if cache else {**self.environment, "MARROW_CACHE": str(self.scratch / "other")}
        told = self.run_it({"it": node}, extra_environment=environment, **more)
        record = json.loads((self.scratch / "out/run.json").read_text())["nodes"][0]
        return record["calls"], record.get("program_version"), told

    def test_another_version_has_another_key(self):
        self.assertEqual(self.calls()[:2], (1, "tool 1.0"))
        self.assertEqual(self.calls()[:2], (0, "tool 1.0"))
        self.use("1.1")
        told = self.marrow("plan", "p.yaml", extra_environment=self.environment).stdout
        self.assertIn("(prints 'tool 1.1'), was [tool, --version] (prints 'tool 1.0')", told)
        (self.scratch / "out").rename(self.scratch / "before")
        self.assertEqual(self.calls()[:2], (1, "tool 1.1"))
        told = self.marrow("diff", "before", "out").stdout
        self.assertIn("identical", told, "another version gave the same figures")
        self.use("1.1", made=2)
        self.assertEqual(self.calls(cache=False)[:2], (1, "tool 1.1"))
        told = self.marrow("diff", "before", "out").stdout
        self.assertIn("option 'version_command' is [tool, --version] (printed 'tool 1.1'), was ", told)
        self.assertIn("[tool, --version] (printed 'tool 1.0')", told)
        self.use("1.0")
        self.assertEqual(self.calls()[:2], (0, "tool 1.0"), "what the old version made is still there")

    def test_a_version_that_is_not_told(self):
        self.use("1.0", "exit 4")
        told = self.calls(code=1)[2]
        self.assertIn("version_command: the program 'tool' ended with exit code 4; it printed:\n  tool 1.0\n", told)
        node = self.node("metrics", ["tool", "{output.json}"], version_command=["true"])
        told = self.run_it({"it": node}, code=1, extra_environment=self.environment)
        self.assertIn("version_command: the program 'true' printed nothing; name a command that prints the", told)

    def test_a_script_counts_by_its_content(self):
        script = self.write("script.py", "import sys\nopen(sys.argv[1], 'w').write('{\"a\": 1}')\n")
        node = self.node("metrics", ["python3", "{files.1}", "{output.json}"], files=["script.py"])
        for text, value in ((script.read_text(), 1), (script.read_text().replace("1}", "2}"), 2)):
            script.write_text(text)
            self.run_it({"it": node})
            made = json.loads((self.scratch / "out/outputs/it.json").read_text())["metrics"]
            self.assertEqual(made[0]["value"], value)


main()
