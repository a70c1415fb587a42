# SPDX-License-Identifier: Apache-2.0
"""Builds everything that depends on a changed file, runs the tests near it, and puts everything back: sources, objects
and programs, with their times."""
import filecmp
import json
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import time

# For each folder, the tests near it, by the beginnings of their names. A GoogleTest suite is named program.suite.
NEAR = {
    "framework/marrow/base": ["domain.", "runtime", "cli_bad", "cli_ca", "cli_mi", "faults_"],
    "framework/marrow/domain": ["domain.", "runtime"]
    + ["fracture.", "evaluate.", "register.", "camera.", "mesh.", "read.", "initial."],
    "framework/marrow/runtime": ["runtime", "domain.", "compare.", "conformance_optimizer"]
    + "cli_bad cli_ca cli_co cli_d cli_k cli_mi cli_pl cli_r cli_sc cli_w".split(),
    "framework/marrow/compare": ["compare.", "compare_", "cli_compare", "cli_commands"],
    "plugins/camera": ["camera.", "conformance_camera", "cli_schema"],
    "plugins/evaluate": ["evaluate.", "cli_schema"],
    "plugins/fracture": ["fracture.", "evaluate.", "cli_schema"],
    "plugins/register": ["register.", "initial.", "cli_schema"],
    "plugins/similarity": ["similarity.", "conformance_similarity", "register.", "cli_schema"],
}
FOLDERS = sorted(NEAR)
LEAST_LIMIT_S = 30


class Graph:
    """What ninja makes from a source file, read from build.ninja and from the headers that the compiler listed."""

    def __init__(self, build):
        self.build = os.path.abspath(build)
        self.users = {}  # file -> what is made from it
        self.read_rules(os.path.join(self.build, "build.ninja"))
        self.read_headers()

    def read_rules(self, path):
        with open(path) as stream:
            text = stream.read().replace("$\n", "")
        for line in re.findall(r"^build (.*)$", text, re.M):
            outputs, _, inputs = line.replace("$:", "\0").partition(": ")
            inputs = inputs.partition(" || ")[0]  # order-only inputs do not count
            names = [
                [
                    name.replace("\0", ":").replace("$ ", " ")
                    for name in re.split(r"(?<!\$) +", part)
                    if name and name != "|"
                ]
                for part in (outputs, inputs)
            ]
            if names[1][0] == "phony":
                continue
            for source in names[1][1:]:
                self.users.setdefault(self.full(source), set()).update(map(self.full, names[0]))

    def read_headers(self):
        made = None
        for line in subprocess.run(
            ["ninja", "-C", self.build, "-t", "deps"], capture_output=True, text=True, check=True
        ).stdout.splitlines():
            if line.startswith(" "):
                self.users.setdefault(self.full(line.strip()), set()).add(made)
            elif line:
                made = self.full(line.partition(": #deps")[0])

    def full(self, name):
        return os.path.normpath(os.path.join(self.build, name))

    def made_from(self, source):
        """Everything that is made from a file, in any number of steps. Files that are only linked against the
        framework's shared library are left out."""
        made, left = set(), [os.path.abspath(source)]
        while left:
            for user in self.users.get(left.pop(), ()):
                if user not in made and "$" not in user:
                    made.add(user)
                    if "/lib/libmarrow.so" not in user:
                        left.append(user)
        return made


class Test:
    """One test of the test run. All cases of a GoogleTest suite count as one test."""

    def __init__(self, name, command, properties):
        self.name, self.command = name, command
        self.folder = properties.get("WORKING_DIRECTORY", ".")
        self.skipped = properties.get("SKIP_RETURN_CODE", 0)
        self.expected = properties.get("PASS_REGULAR_EXPRESSION", [])
        self.seconds = None

    def limit_s(self):
        return max(LEAST_LIMIT_S, 8 * self.seconds)


class DoesNotCompile(Exception):
    pass


class ChangesNothing(Exception):
    pass


class Bench:
    def __init__(self, root, build, jobs):
        self.root, self.build, self.jobs = pathlib.Path(root), pathlib.Path(build).resolve(), jobs
        self.own = self.build / "mutate"
        self.undo = self.own / "undo"
        self.own.mkdir(exist_ok=True)
        self.put_back()
        self.graph = Graph(self.build)
        self.tests = self.read_tests()

    def read_tests(self):
        text = subprocess.run(
            ["ctest", "--test-dir", str(self.build), "--show-only=json-v1"], capture_output=True, text=True, check=True
        ).stdout
        tests = {}
        for test in json.loads(text)["tests"]:
            command = test.get("command")
            if not command:
                continue
            name = test["name"]
            chosen = next((part for part in command if part.startswith("--gtest_filter=")), None)
            if chosen:
                suite = chosen.removeprefix("--gtest_filter=").rsplit(".", 1)[0]
                name = os.path.basename(command[0]).removeprefix("test_") + "." + suite
                command = [command[0], "--gtest_filter=%s.*" % suite, "--gtest_fail_fast", "--gtest_brief=1"]
            tests.setdefault(name, Test(name, command, {p["name"]: p["value"] for p in test.get("properties", [])}))
        return tests

    def near(self, path):
        names = next(names for folder, names in NEAR.items() if path.startswith(folder + "/"))
        return [test for test in self.tests.values() if test.name.startswith(tuple(names))]

    def run(self, test, limit_s):
        """None if the test passes, otherwise what failed."""
        self.last = test
        scratch = self.own / "scratch"
        shutil.rmtree(scratch, ignore_errors=True)
        scratch.mkdir()
        environment = dict(os.environ, TMPDIR=str(scratch), MARROW_CACHE=str(scratch / "cache"))
        with open(self.own / "output.txt", "w+", errors="replace") as output:
            process = subprocess.Popen(
                test.command,
                cwd=self.build / test.folder,
                stdout=output,
                stderr=subprocess.STDOUT,
                env=environment,
                start_new_session=True,
                preexec_fn=limit_resources,
            )
            try:
                code = process.wait(limit_s)
            except subprocess.TimeoutExpired:
                code = None
            finally:
                kill_group(process)
            output.seek(0)
            text = output.read()
        shutil.rmtree(scratch, ignore_errors=True)
        if test.expected:
            good = any(re.search(pattern, text) for pattern in test.expected)
        else:
            good = code in (0, test.skipped)
        if code is not None and good:
            return None
        failed = re.search(r"^\[  FAILED  \] ([\w./]+)|^(?:FAIL|ERROR): (\w+)", text, re.M)
        if failed:
            return "%s (%s)" % (test.name, failed.group(1) or failed.group(2))
        how = "time limit" if code is None else "signal %d" % -code if code < 0 else "exit code %d" % code
        return "%s, %s" % (test.name, how)

    def ninja(self, targets):
        names = [os.path.relpath(target, self.build) for target in targets]
        return subprocess.run(
            ["ninja", "-C", str(self.build), "-j", str(self.jobs), *names], capture_output=True, text=True
        )

    def measure(self, tests):
        """Measures the times of the tests with unchanged sources, and keeps them until the program of a test changes.
        Ends if a test fails, because such a test says nothing about a change."""
        programs = {test.command[0] for test in tests if test.command[0].startswith(str(self.build))}
        built = self.ninja(programs | {str(self.build / "bin/marrow")})
        if built.returncode:
            raise SystemExit("the sources do not build as they are:\n" + built.stdout[-2000:])
        kept = self.own / "times.json"
        times = json.loads(kept.read_text()) if kept.exists() else {}
        for test in tests:
            made = os.path.getmtime(test.command[0])
            if times.get(test.name, [0])[0] != made:
                begin = time.monotonic()
                failed = self.run(test, 1200)
                if failed:
                    raise SystemExit("fails before anything is changed: " + failed)
                times[test.name] = [made, time.monotonic() - begin]
                kept.write_text(json.dumps(times))
            test.seconds = times[test.name][1]

    def try_change(self, path, text, tests):
        """The test that fails if the file has another text, or None. Puts everything back. Ends if the test then still
        fails, because its failure says nothing about the change."""
        source = self.root / path
        made = self.graph.made_from(source)
        self.save([str(source), *made])
        self.last = None
        try:
            source.write_text(text)
            caught = self.first_failure(
                sorted(tests, key=lambda test: (test.command[0] not in made, test.seconds)), made
            )
        finally:
            self.put_back()
        without = self.run(self.last, self.last.limit_s()) if caught and self.last else None
        if without:
            raise SystemExit("fails also where nothing is changed: " + without)
        return caught

    def first_failure(self, tests, made):
        """Builds what each test needs and runs it. Tests that contain the changed code themselves come first."""
        libraries = {name for name in made if ".so" in name}
        changed, waiting = False, []
        for test in tests:
            wanted = {test.command[0]} if test.command[0] in made else libraries
            changed |= self.compile(made, wanted)
            if self.ninja(wanted).returncode:
                return "build of " + test.name  # a node could not be described, or the tests could not be listed
            if not changed:
                waiting.append(test)
                continue
            failed = self.run(test, test.limit_s())
            if failed:
                return failed
        if not changed:
            raise ChangesNothing()
        return next(filter(None, (self.run(test, test.limit_s()) for test in waiting)), None)

    def compile(self, made, wanted):
        """Whether the machine code has changed."""
        objects = [name for name in made if name.endswith(".o") and self.graph.made_from(name) & wanted]
        if objects and self.ninja(objects).returncode:
            raise DoesNotCompile()
        return not all(filecmp.cmp(name, self.saved[name], shallow=False) for name in objects)

    def save(self, names):
        shutil.rmtree(self.undo, ignore_errors=True)
        self.undo.mkdir()
        self.saved = {}
        described = [name[:-3] + ".json" for name in names if name.endswith(".so")]
        for number, name in enumerate([*names, *described]):
            if os.path.isfile(name):
                self.saved[name] = str(self.undo / str(number))
                shutil.copy2(name, self.saved[name])
        (self.undo / "list.json").write_text(json.dumps(self.saved))  # last: put_back() does nothing without it

    def put_back(self):
        """Puts everything back, also after a run that was killed."""
        listed = self.undo / "list.json"
        if listed.exists():
            for name, copy in json.loads(listed.read_text()).items():
                shutil.copy2(copy, name + ".put-back")
                os.replace(name + ".put-back", name)
        shutil.rmtree(self.undo, ignore_errors=True)


def limit_resources():
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_DATA, (8 << 30, 8 << 30))
    resource.setrlimit(resource.RLIMIT_FSIZE, (4 << 30, 4 << 30))


def kill_group(process):
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
    process.wait()
