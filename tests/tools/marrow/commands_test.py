# SPDX-License-Identifier: Apache-2.0
"""Every command at its simplest, and how runs end: what they write, refuse, share and leave."""
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import time

from harness import BUILD, SOURCE
from harness.program import Case, main, marrow, wait_until

WORK = """marrow: 1
nodes:
  a: {uses: test.work, with: {value: 2}}
  b: {uses: test.work, with: {value: 2.000001}}
outputs: {a: a, b: b}
"""
NUMBER = "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 3}}\noutputs: {number: c}\n"
OF_PATH = "marrow: 1\ninputs: {x: {type: path}}\nnodes:\n  c: {uses: test.constant, with: {path: $x}}\n"
FAILING = "  f: {uses: test.fail_above, in: {a: c}, with: {value: 1}}\n"
FEMUR = SOURCE / "pipelines" / "femur" / "femur.yaml"


def busy_seconds():
    """What all programs together, and other machines on the same processors, have used of them since the start."""
    with open("/proc/stat") as file:
        user, nice, system, idle, waiting, *rest = map(int, file.readline().split()[1:])
    return (user + nice + system + sum(rest[:3])) / os.sysconf("SC_CLK_TCK")


class Looking(Case):
    """Commands that run nothing."""

    plugins = []

    def test_help_everywhere(self):
        for command in ([], ["run"], ["check"], ["list"], ["inspect"], ["graph"], ["schema"], ["doctor"], ["describe"]):
            self.assertIn("--help", self.printed(*command, "--help"))

    def test_a_wrong_command_line_is_code_2(self):
        self.refusals(("", "rnu"), ("did you mean 'mesh.marching_cubes'?", "inspect", "mesh.marching_cbues"))

    def test_list_check_inspect_load_no_plugin_and_are_quick(self):
        for command in (["list"], ["check", FEMUR], ["inspect", "mesh.marching_cubes"]):
            loads = self.expect(0, *command, extra_environment={"LD_DEBUG": "files"}).stderr
            self.assertNotIn("calling init: " + str(BUILD / "lib" / "marrow"), loads)
            times = []
            for _ in range(9):
                start = time.perf_counter()
                marrow(*command)
                times.append(time.perf_counter() - start)
            print(command[0], "median %.1f ms" % (1000 * sorted(times)[4]))

    def test_inspect_yaml_can_be_pasted(self):
        snippet = self.printed("inspect", "mesh.marching_cubes", "--yaml").replace("NODE", "bone")
        bone = "  bone: {uses: segment.threshold, in: {volume: ct}}\n  ct: {uses: read.volume, with: {path: x}}\n"
        self.write("p.yaml", "marrow: 1\nnodes:\n" + bone + snippet + "outputs: {mesh: marching_cubes}\n")
        self.expect(0, "check", "p.yaml")

    def test_overrides_hold_in_any_order(self):
        pipeline = FEMUR.with_name("femur-grey-values.yaml")
        sigma, uses = ["--set", "grey_cost.sigma=0.1"], ["--set", "grey_cost.uses=similarity.pattern_intensity"]
        for out, settings in (("one", sigma + uses), ("two", uses + sigma)):
            self.marrow("run", pipeline, "case=/nowhere", "--out", out, *settings)
            self.assertIn("sigma: 0.1", self.read(out + "/pipeline.yaml"))
        self.refused(
            "--set grey_cost.sigma=0.1: error: 'similarity.mutual_information' has no option 'sigma'",
            *["check", pipeline, *sigma, "--set", "grey_cost.uses=similarity.mutual_information"],
        )

    def test_graph(self):
        self.assertIn("for each view", self.printed("graph", FEMUR))
        dot = self.printed("graph", FEMUR, "--dot")
        self.assertTrue(dot.startswith("digraph"))
        self.assertIn("style=dashed", dot)

    def test_other_files_are_not_taken_for_pipelines(self):
        experiment = SOURCE / "pipelines/experiments/demo.yaml"
        said = "marrow: error: %s: this is an experiment, not a pipeline; look at it by: marrow compare %s --dry-run\n"
        for command in ("check", "run", "plan", "graph"):
            self.assertEqual(self.expect(2, command, experiment).stderr, said % (experiment, experiment))
        self.refused(
            ": this is a file of the format marrow-pose, not a pipeline; a pipeline names it in an option or an input",
            *("check", SOURCE / "pipelines/wrist/radius-0002.pose.yaml"),
        )

    def test_no_name_of_a_node_in_framework_or_tools(self):
        """But the workbench calls those that read the files of a case, and the export to 3D Slicer those that write. A
        network is made for a node, from what other nodes make."""
        may = {"workbench": re.compile(r"read\.\w+|camera\.dicom"), "slicer": re.compile(r"write\.\w+")}
        may["studies"] = re.compile(r"mask\.threshold")
        may["network"] = may["networks"] = re.compile(r"\w+\.\w+")
        names = [node["name"] for node in self.json_of("list")]
        self.assertGreater(len(names), 20)
        for path in (path for folder in ("framework", "tools") for path in (SOURCE / folder).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                text = path.read_text()
                for name in names:
                    if path.parent.name not in may or not may[path.parent.name].fullmatch(name):
                        self.assertNotIn(name, text, str(path))


class Runs(Case):
    def test_no_folder_that_is_read_is_written_to(self):
        case = self.write("case/data", "1").parent
        (case / "inner").mkdir()
        os.symlink("case", self.scratch / "link")
        pipeline = self.write("p.yaml", OF_PATH + "outputs: {number: c}\n")
        inside = {"MARROW_CACHE": str(case / "cache")}

        def refused(what, out, advice, *arguments, **more):
            said = "marrow: error: %s %s lies in %s, a folder that node 'c' reads, which would change while it is read;"
            result = self.marrow(*arguments, **more)
            told = (result.returncode, result.stderr)
            self.assertEqual(told, (2, said % (what, out, case) + " %s\n" % advice))

        run = ["run", pipeline, "--quiet"]
        for out, arguments, cwd in (
            ("runs", ["x=."], case),
            ("case/out", ["x=case", "--out", "case/out"], self.scratch),
            ("link/inner", ["x=case/", "--out", "link/inner"], self.scratch),
            ("case/new/out", ["x=link", "--out", "case/new/out"], self.scratch),
        ):
            refused("the output folder", out, "choose another with --out", *run, *arguments, cwd=cwd)
        advice = "set MARROW_CACHE to another folder, or give --no-cache"
        to_out = ["x=case", "--out", "out"]
        refused("the store of results", case / "cache", advice, *run, *to_out, extra_environment=inside)
        self.assertEqual(self.everything(), ["case", "case/data", "case/inner", "link", "p.yaml"], "nothing is made")
        self.expect(0, *run, "x=case", "--out", "case-out")
        self.expect(0, *run, "x=case/data", "--out", "case/out")  # a file does not change by what is beside it
        self.expect(0, *run, "x=case", "--out", "again", "--no-cache", extra_environment=inside)
        (self.scratch / "runs" / "p").mkdir(parents=True)
        self.expect(0, *run, "x=runs/p")  # the results go to another folder beside it
        again = ["rerun", "case-out", "--out", "case/again"]
        refused("the output folder", "case/again", "choose another with --out", *again)

    def test_a_run_writes_its_record(self):
        self.write("p.yaml", NUMBER)
        self.expect(0, "run", "p.yaml", "--out", "out", "--seed", 5, "--set", "c.value=4")
        record = self.json("out/run.json")
        self.assertEqual((record["seed"], record["overrides"], record["status"]), (5, ["c.value=4"], "done"))
        self.assertEqual(record["nodes"][0]["calls"], 1)
        self.assertEqual(len(record["plugins"][0]["build_id"]), 32)
        self.assertIn("value: 4", self.read("out/pipeline.yaml"))
        self.expect(0, "check", "out/pipeline.yaml")
        quiet = self.expect(0, "run", "p.yaml", "--out", "quiet", "--quiet")
        self.assertEqual((quiet.stdout, quiet.stderr), ("", ""))

    def test_only_the_outputs_that_are_asked_for(self):
        self.write("two.yaml", NUMBER.replace("outputs: {", "  a: {uses: test.constant}\noutputs: {first: a, "))
        self.expect(0, "run", "two.yaml", "--out", "out", "--only", "number")
        self.assertEqual({name: node["status"] for name, node in self.nodes().items()}, {"c": "done"})
        self.assertEqual([file.stem for file in (self.scratch / "out/outputs").iterdir()], ["number"])
        self.assertNotIn("first", self.read("out/pipeline.yaml"))
        said = "marrow: error: --only: the pipeline has no output 'numbr'; did you mean 'number'?\n"
        self.refused(said, "run", "two.yaml", "--only", "numbr")

    def test_events_as_json(self):
        self.write("p.yaml", NUMBER)
        events = lambda *arguments: list(
            map(json.loads, self.printed("run", "p.yaml", "--json", *arguments).splitlines())
        )
        made = events("--out", "made", "--no-cache")
        self.assertEqual([event["event"] for event in made], ["started", "finished", "ended"])
        self.assertEqual(made[-1]["status"], "done")
        events("--out", "kept")
        self.assertEqual([event["event"] for event in events("--out", "read")], ["cached", "ended"])

    def test_nothing_is_overwritten(self):
        self.write("p.yaml", NUMBER)
        self.write("out/mine.txt", "keep")
        self.refusals(
            ("is already there and not empty", "run", "p.yaml", "--out", "out"),
            ("cannot make the output folder", "run", "p.yaml", "--out", "out/mine.txt/out"),
        )
        self.assertEqual(self.everything(), ["out", "out/mine.txt", "p.yaml"])

    def test_a_failure_is_code_1_said_once_and_what_it_stops_is_counted(self):
        more = "  g: {uses: test.add, in: {a: f}}\n  h: {uses: test.add, in: {a: g}}\n"
        text = NUMBER.replace("outputs:", FAILING + more + "outputs:").replace("number: c", "number: c, h: h")
        result = self.expect(1, "run", self.write("p.yaml", text), "--out", "out")
        self.assertIn(
            "node 'f' (test.fail_above) failed: the number is too large; give a smaller one (its inputs: a = c)",
            result.stderr,
        )
        self.assertTrue((self.scratch / "out/outputs/number.json").exists(), "the others' results stay")
        said = result.stdout + result.stderr
        self.assertEqual(said.count("the number is too large"), 1, said)
        self.assertIn("2 nodes were not run because of it\n", result.stdout)
        self.assertIn("  h: not made: node 'f' failed\n", result.stdout)
        self.assertNotIn("is missing", said)
        nodes = self.nodes()
        self.assertEqual(nodes["f"]["not_run_because_of_it"], 2)
        self.assertEqual(nodes["h"]["reason"], "node 'f' failed")
        self.expect(0, "show", "out")
        self.assertIn("2 nodes were not run because of it", self.read("out/report.html"))

    def test_options_that_do_not_go_together_are_a_fault_of_the_file(self):
        camera = "  c: {uses: camera.carm, with: {beta_deg: [0, 60, 90]}}\n"
        self.write("p.yaml", "marrow: 1\nnodes:\n" + camera + "outputs: {cameras: c}\n")
        said = (
            "p.yaml:3:33: error: options 'names' (2), 'alpha_deg' (2) and 'beta_deg' (3) of camera.carm must have the "
            "same length\n  " + camera
        )
        self.refusals((said, "check", "p.yaml"), (said, "run", "p.yaml", "--out", "out"))
        self.assertFalse((self.scratch / "out").exists())
        mended = ["check", "p.yaml", "--set", "c.beta_deg=[0, 60]"]
        self.expect(0, *mended)
        self.refused(
            "option 'source_to_isocentre_mm' of camera.carm is 1000, which is not below option "
            "'source_to_detector_mm' (1000)",
            *(*mended, "--set", "c.source_to_isocentre_mm=1000"),
        )

    def test_two_slow_nodes_overlap(self):
        self.write("p.yaml", WORK)
        # A busy machine, or the one that it is a guest of, may put both threads on one core, or let one of them wait.
        for attempt in range(5):
            shutil.rmtree(self.scratch / "out", ignore_errors=True)
            busy_before, start = busy_seconds(), time.perf_counter()
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            self.expect(0, "run", "p.yaml", "--out", "out", "--threads", 2, "--no-cache")
            wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
            cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            others = max(0, busy_seconds() - busy_before - cpu)
            print("two slow nodes: CPU %.0f %%, other programs %.0f %%" % (100 * cpu / wall, 100 * others / wall))
            begins = [node["start_s"] for node in self.nodes().values()]
            # Each lasts 2 seconds on the clock: one after the other they begin 2 seconds apart.
            is_apart = abs(begins[0] - begins[1]) >= 2
            if not is_apart and (cpu / wall > 1.5 or os.cpu_count() - others / wall < 1.9):
                return
        self.fail("two nodes never overlapped, or never used more than 150 % of a core on an idle machine")

    def test_control_c_ends_cleanly(self):
        text = WORK.replace("2.000001", "1000").replace("outputs: {", "  c: {uses: test.constant}\noutputs: {c: c, ")
        process = self.start("run", self.write("p.yaml", text), "--out", "out", stdout=subprocess.DEVNULL)
        log = self.scratch / "out" / "log.txt"
        wait_until(lambda: log.exists() and "c: " in log.read_text(), "the first node did not end")
        process.send_signal(signal.SIGINT)
        errors = process.communicate(timeout=300)[1]  # a node would work for longer
        self.assertEqual(process.returncode, 130)
        self.assertIn("stopped by Ctrl-C; what was done is in", errors)
        self.assertEqual(self.json("out/run.json")["status"], "cancelled")
        self.assertTrue((self.scratch / "out/outputs/c.json").exists())


if __name__ == "__main__":
    main()
