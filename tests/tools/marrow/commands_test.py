# SPDX-License-Identifier: Apache-2.0
import json
import os
import re
import resource
import signal
import subprocess
import time

from harness import BUILD, MARROW, SOURCE, TEST_PLUGINS
from harness.program import Case, main, marrow, wait_until

WORK = """marrow: 1
nodes:
  a: {uses: test.work, with: {value: 2}}
  b: {uses: test.work, with: {value: 2.000001}}
outputs: {a: a, b: b}
"""
NUMBER = "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 3}}\noutputs: {number: c}\n"


def busy_seconds():
    """What all programs together, and other machines on the same processors, have used of them since the start."""
    with open("/proc/stat") as file:
        user, nice, system, idle, waiting, *rest = map(int, file.readline().split()[1:])
    return (user + nice + system + sum(rest[:3])) / os.sysconf("SC_CLK_TCK")


class Commands(Case):
    def test_help_everywhere(self):
        for command in ([], ["run"], ["check"], ["list"], ["inspect"], ["graph"], ["schema"], ["doctor"], ["describe"]):
            result = marrow(*command, "--help")
            self.assertEqual(result.returncode, 0)
            self.assertIn("--help", result.stdout)

    def test_a_wrong_command_line_is_code_2(self):
        self.assertEqual(marrow("rnu").returncode, 2)
        result = marrow("inspect", "mesh.marching_cbues")
        self.assertEqual(result.returncode, 2)
        self.assertIn("did you mean 'mesh.marching_cubes'?", result.stderr)

    def test_no_folder_that_is_read_is_written_to(self):
        case = self.scratch / "case"
        (case / "inner").mkdir(parents=True)
        self.write("case/data", "1")
        os.symlink("case", self.scratch / "link")
        self.write(
            "p.yaml",
            (
                "marrow: 1\ninputs: {x: {type: path}}\nnodes:\n  c: {uses: test.constant, with: {path: $x}}\noutputs:"
                " {number: c}\n"
            ),
        )
        run = lambda *arguments, cache="", cwd=self.scratch: marrow(
            "run",
            self.scratch / "p.yaml",
            "--quiet",
            *arguments,
            plugins=[TEST_PLUGINS],
            cwd=cwd,
            extra_environment={"MARROW_CACHE": str(cache or self.scratch / "cache")}
        )
        sentence = (
            "marrow: error: %%s %%s lies in %s, a folder that node 'c' reads, which would change while it is read;"
            " %%s\n" % case
        )
        for out, arguments, cwd in (
            ("runs", ["x=."], case),
            ("case/out", ["x=case"], self.scratch),
            ("link/inner", ["x=case/"], self.scratch),
            ("case/new/out", ["x=link"], self.scratch),
        ):
            result = run(*arguments, *([] if out == "runs" else ["--out", out]), cwd=cwd)
            self.assertEqual(
                (result.returncode, result.stderr),
                (2, sentence % ("the output folder", out, "choose another with --out")),
            )
        result = run("x=case", "--out", "out", cache=case / "cache")
        self.assertEqual(
            (result.returncode, result.stderr),
            (
                2,
                sentence
                % ("the store of results", case / "cache", "set MARROW_CACHE to another folder, or give --no-cache"),
            ),
        )
        self.assertEqual(
            sorted(path.name for path in self.scratch.rglob("*")),
            ["case", "data", "inner", "link", "p.yaml"],
            "nothing is made",
        )
        self.assertEqual(run("x=case", "--out", "case-out").returncode, 0)
        self.assertEqual(
            run("x=case/data", "--out", "case/out").returncode, 0, "a file does not change by what is beside it"
        )
        self.assertEqual(run("x=case", "--out", "again", "--no-cache", cache=case / "cache").returncode, 0)
        (self.scratch / "runs" / "p").mkdir(parents=True)
        self.assertEqual(run("x=runs/p").returncode, 0, "the results go to another folder beside it")
        result = marrow("rerun", "case-out", "--out", "case/again", plugins=[TEST_PLUGINS], cwd=self.scratch)
        self.assertEqual(
            (result.returncode, result.stderr),
            (2, sentence % ("the output folder", "case/again", "choose another with --out")),
        )

    def test_list_check_inspect_load_no_plugin_and_are_quick(self):
        for command in (
            ["list"],
            ["check", SOURCE / "pipelines" / "femur" / "femur.yaml"],
            ["inspect", "mesh.marching_cubes"],
        ):
            loads = marrow(*command, extra_environment={"LD_DEBUG": "files"})
            self.assertEqual(loads.returncode, 0, loads.stdout)
            self.assertNotIn("calling init: " + str(BUILD / "lib" / "marrow"), loads.stderr)
            times = []
            for _ in range(9):
                start = time.perf_counter()
                marrow(*command)
                times.append(time.perf_counter() - start)
            print(command[0], "median %.1f ms" % (1000 * sorted(times)[4]))

    def test_inspect_yaml_can_be_pasted(self):
        snippet = marrow("inspect", "mesh.marching_cubes", "--yaml").stdout.replace("NODE", "bone")
        text = (
            "marrow: 1\nnodes:\n  bone: {uses: segment.threshold, in: {volume: ct}}\n  ct: {uses: read.volume, with:"
            " {path: x}}\n" + snippet
        )
        result = marrow("check", self.write("p.yaml", text + "outputs: {mesh: marching_cubes}\n"))
        self.assertEqual(result.returncode, 0, result.stderr)

    def test_overrides_hold_in_any_order(self):
        for settings in (
            ["grey_cost.sigma=0.1", "grey_cost.uses=similarity.pattern_intensity"],
            ["grey_cost.uses=similarity.pattern_intensity", "grey_cost.sigma=0.1"],
        ):
            out = self.scratch / settings[0]
            marrow(
                "run",
                SOURCE / "pipelines" / "femur" / "femur-grey-values.yaml",
                "case=/nowhere",
                "--out",
                out,
                *[part for one in settings for part in ("--set", one)]
            )
            self.assertIn("sigma: 0.1", (out / "pipeline.yaml").read_text())
        wrong = marrow(
            "check",
            SOURCE / "pipelines" / "femur" / "femur-grey-values.yaml",
            "--set",
            "grey_cost.sigma=0.1",
            "--set",
            "grey_cost.uses=similarity.mutual_information",
        )
        self.assertIn(
            "--set grey_cost.sigma=0.1: error: 'similarity.mutual_information' has no option 'sigma'", wrong.stderr
        )

    def test_run_writes_its_record(self):
        out = self.scratch / "out"
        result = marrow(
            "run", self.write("p.yaml", NUMBER), "--out", out, "--seed", 5, "--set", "c.value=4", plugins=[TEST_PLUGINS]
        )
        self.assertEqual(result.returncode, 0, result.stderr)
        record = json.loads((out / "run.json").read_text())
        self.assertEqual(record["seed"], 5)
        self.assertEqual(record["overrides"], ["c.value=4"])
        self.assertEqual(record["status"], "done")
        self.assertEqual(record["nodes"][0]["calls"], 1)
        self.assertEqual(len(record["plugins"][0]["build_id"]), 32)
        self.assertIn("value: 4", (out / "pipeline.yaml").read_text())
        self.assertEqual(marrow("check", out / "pipeline.yaml", plugins=[TEST_PLUGINS]).returncode, 0)

    def test_only_the_outputs_that_are_asked_for(self):
        path = self.write(
            "two.yaml",
            "marrow: 1\nnodes:\n  a: {uses: test.constant, with: {value: 30}}\n"
            "  b: {uses: test.constant, with: {value: 40}}\noutputs: {first: a, second: b}\n",
        )
        out = self.scratch / "out"
        result = marrow("run", path, "--out", out, "--only", "second", plugins=[TEST_PLUGINS])
        self.assertEqual(result.returncode, 0, result.stderr)
        record = json.loads((out / "run.json").read_text())
        self.assertEqual([(node["id"], node["status"]) for node in record["nodes"]], [("b", "done")])
        self.assertEqual([file.stem for file in (out / "outputs").iterdir()], ["second"])
        self.assertNotIn("first", (out / "pipeline.yaml").read_text())
        result = marrow("run", path, "--only", "secnd", plugins=[TEST_PLUGINS])
        self.assertEqual(result.returncode, 2)
        self.assertIn(
            "marrow: error: --only: the pipeline has no output 'secnd'; did you mean 'second'?\n", result.stderr
        )

    def test_events_as_json(self):
        def events(*arguments):
            result = marrow("run", self.write("p.yaml", NUMBER), "--json", *arguments, plugins=[TEST_PLUGINS])
            return [json.loads(line) for line in result.stdout.splitlines()]

        made = events("--out", self.scratch / "made", "--no-cache")
        self.assertEqual([event["event"] for event in made], ["started", "finished", "ended"])
        self.assertEqual(made[-1]["status"], "done")
        events("--out", self.scratch / "kept")
        self.assertEqual([event["event"] for event in events("--out", self.scratch / "read")], ["cached", "ended"])

    def test_quiet_prints_nothing(self):
        result = marrow(
            "run", self.write("p.yaml", NUMBER), "--out", self.scratch / "out", "--quiet", plugins=[TEST_PLUGINS]
        )
        self.assertEqual((result.stdout, result.stderr), ("", ""))

    def test_nothing_is_overwritten(self):
        (self.scratch / "out").mkdir()
        (self.scratch / "out" / "mine.txt").write_text("keep")
        result = marrow("run", self.write("p.yaml", NUMBER), "--out", self.scratch / "out", plugins=[TEST_PLUGINS])
        self.assertEqual(result.returncode, 2)
        self.assertIn("is already there and not empty", result.stderr)
        self.assertEqual([path.name for path in (self.scratch / "out").iterdir()], ["mine.txt"])

    def test_unwritable_folder(self):
        self.write("file", "")
        result = marrow(
            "run", self.write("p.yaml", NUMBER), "--out", self.scratch / "file" / "out", plugins=[TEST_PLUGINS]
        )
        self.assertEqual(result.returncode, 2)
        self.assertIn("cannot make the output folder", result.stderr)

    def test_a_failed_node_is_code_1_and_the_others_results_stay(self):
        text = NUMBER.replace(
            "outputs:", "  f: {uses: test.fail_above, in: {a: c}, with: {value: 1}}\noutputs:"
        ).replace("number: c", "number: c, f: f")
        result = marrow("run", self.write("p.yaml", text), "--out", self.scratch / "out", plugins=[TEST_PLUGINS])
        self.assertEqual(result.returncode, 1)
        self.assertIn(
            "node 'f' (test.fail_above) failed: the number is too large; give a smaller one (its inputs: a = c)",
            result.stderr,
        )
        self.assertTrue((self.scratch / "out" / "outputs" / "number.json").exists())

    def test_a_failure_is_said_once_and_what_it_stops_is_counted(self):
        nodes = "  f: {uses: test.fail_above, in: {a: c}, with: {value: 1}}\n  g: {uses: test.add, in: {a: f}}\n"
        text = NUMBER.replace("outputs:", nodes + "  h: {uses: test.add, in: {a: g}}\noutputs:")
        text = text.replace("number: c", "number: c, h: h")
        result = marrow("run", self.write("p.yaml", text), "--out", self.scratch / "out", plugins=[TEST_PLUGINS])
        self.assertEqual(result.returncode, 1)
        said = result.stdout + result.stderr
        self.assertEqual(said.count("the number is too large"), 1, said)
        self.assertIn("2 nodes were not run because of it\n", result.stdout)
        self.assertIn("  h: not made: node 'f' failed\n", result.stdout)
        self.assertNotIn("is missing", said)
        nodes = {node["id"]: node for node in json.loads((self.scratch / "out" / "run.json").read_text())["nodes"]}
        self.assertEqual(nodes["f"]["not_run_because_of_it"], 2)
        self.assertEqual(nodes["h"]["reason"], "node 'f' failed")
        report = marrow("show", self.scratch / "out", plugins=[TEST_PLUGINS])
        self.assertEqual(report.returncode, 0, report.stderr)
        self.assertIn("2 nodes were not run because of it", (self.scratch / "out" / "report.html").read_text())

    def test_options_that_do_not_go_together_are_a_fault_of_the_file(self):
        cameras = "marrow: 1\nnodes:\n  c: {uses: camera.carm, with: {beta_deg: [0, 60, 90]}}\noutputs: {cameras: c}\n"
        path = self.write("p.yaml", cameras)
        for command, *arguments in (["check"], ["run", "--out", self.scratch / "out"]):
            result = marrow(command, path, *arguments)
            self.assertEqual(result.returncode, 2, command)
            self.assertIn(
                "p.yaml:3:33: error: options 'names' (2), 'alpha_deg' (2) and 'beta_deg' (3) of camera.carm must have"
                " the same length\n    c: {uses: camera.carm, with: {beta_deg: [0, 60, 90]}}\n",
                result.stderr,
            )
        self.assertFalse((self.scratch / "out").exists())
        mended = ["check", path, "--set", "c.beta_deg=[0, 60]"]
        self.assertEqual(marrow(*mended).returncode, 0)
        result = marrow(*mended, "--set", "c.source_to_isocentre_mm=1000")
        self.assertEqual(result.returncode, 2)
        self.assertIn(
            "option 'source_to_isocentre_mm' of camera.carm is 1000, which is not below option"
            " 'source_to_detector_mm' (1000)",
            result.stderr,
        )

    def test_two_slow_nodes_overlap(self):
        path = self.write("p.yaml", WORK)
        # A busy machine, or the one that it is a guest of, may put both threads on one core, or let one of them wait.
        for attempt in range(5):
            out = self.scratch / str(attempt)
            busy_before, before, start = (
                busy_seconds(),
                resource.getrusage(resource.RUSAGE_CHILDREN),
                time.perf_counter(),
            )
            self.assertEqual(
                marrow("run", path, "--out", out, "--threads", 2, "--no-cache", plugins=[TEST_PLUGINS]).returncode, 0
            )
            wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
            cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            others = max(0, busy_seconds() - busy_before - cpu)
            print("two slow nodes: CPU %.0f %%, other programs %.0f %%" % (100 * cpu / wall, 100 * others / wall))
            record = json.loads((out / "run.json").read_text())
            # Each lasts 2 seconds on the clock: one after the other they begin 2 seconds apart.
            is_apart = abs(record["nodes"][0]["start_s"] - record["nodes"][1]["start_s"]) >= 2
            if not is_apart and (cpu / wall > 1.5 or os.cpu_count() - others / wall < 1.9):
                return
        self.fail(
            "two nodes never overlapped, or never used more than 150 % of a core on a machine with nothing else to do"
        )

    def test_control_c_ends_cleanly(self):
        path = self.write(
            "p.yaml",
            WORK.replace("2.000001", "1000").replace("outputs: {", "  c: {uses: test.constant}\noutputs: {c: c, "),
        )
        environment = dict(os.environ, MARROW_PLUGIN_PATH=str(TEST_PLUGINS))
        process = subprocess.Popen(
            [str(MARROW), "run", str(path), "--out", str(self.scratch / "out")],
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(process.kill)
        log = self.scratch / "out" / "log.txt"
        wait_until(lambda: log.exists() and "c: " in log.read_text(), "the first node did not end")
        process.send_signal(signal.SIGINT)
        errors = process.communicate(timeout=300)[1]  # a node would work for longer
        self.assertEqual(process.returncode, 130)
        self.assertIn("stopped by Ctrl-C; what was done is in", errors)
        self.assertEqual(json.loads((self.scratch / "out" / "run.json").read_text())["status"], "cancelled")
        self.assertTrue((self.scratch / "out" / "outputs" / "c.json").exists())

    def test_graph(self):
        text = marrow("graph", SOURCE / "pipelines" / "femur" / "femur.yaml").stdout
        self.assertIn("for each view", text)
        dot = marrow("graph", SOURCE / "pipelines" / "femur" / "femur.yaml", "--dot").stdout
        self.assertTrue(dot.startswith("digraph"))
        self.assertIn("style=dashed", dot)

    def test_other_files_are_not_taken_for_pipelines(self):
        experiment = SOURCE / "pipelines/experiments/demo.yaml"
        said = "marrow: error: %s: this is an experiment, not a pipeline; look at it by: marrow compare %s --dry-run\n"
        for command in ("check", "run", "plan", "graph"):
            result = marrow(command, experiment, cwd=self.scratch)
            self.assertEqual((result.returncode, result.stderr), (2, said % (experiment, experiment)))
        pose = SOURCE / "pipelines/wrist/radius-0002.pose.yaml"
        result = marrow("check", pose)
        self.assertEqual(result.returncode, 2)
        self.assertIn(
            ": this is a file of the format marrow-pose, not a pipeline; a pipeline names it in an option or "
            "an input",
            result.stderr,
        )

    def test_no_name_of_a_node_in_framework_or_tools(self):
        """But the workbench calls those that read the files of a case, and the export to 3D Slicer those that write. A
        network is made for a node, from what other nodes make."""
        may = {"workbench": re.compile(r"read\.\w+|camera\.dicom"), "slicer": re.compile(r"write\.\w+")}
        may["studies"] = re.compile(r"mask\.threshold")
        may["network"] = may["networks"] = re.compile(r"\w+\.\w+")
        names = [node["name"] for node in json.loads(marrow("list", "--json").stdout)]
        self.assertGreater(len(names), 20)
        for folder in ("framework", "tools"):
            for path in (SOURCE / folder).rglob("*"):
                if path.is_file() and "__pycache__" not in path.parts:
                    text = path.read_text()
                    for name in names:
                        if path.parent.name not in may or not may[path.parent.name].fullmatch(name):
                            self.assertNotIn(name, text, str(path))


if __name__ == "__main__":
    main()
