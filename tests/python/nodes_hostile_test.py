# SPDX-License-Identifier: Apache-2.0
"""Nodes written in Python that take what is not theirs, or say what cannot be understood, cost one call."""
import os
import signal
import subprocess
import time

import numpy
from harness.package import MARROW, main, marrow, wait_until
from written_nodes import Written, processes, view

NODES = """
import ctypes, locale, os, signal, subprocess, sys, time

def figures(**values):
    return marrow.Metrics({"process": os.getpid(), **values})

@marrow.node("own.does", summary="does what it is told", memory_mb=400)
def does(view: Annotated[marrow.View, "view"], volume: Annotated[Optional[marrow.Volume], "ct"] = None, *,
         what: Annotated[str, "what"] = "", context: marrow.Context) -> Annotated[
        marrow.Metrics, marrow.named("figures")]:
    made = {}
    exec(what, globals(), {"view": view, "volume": volume, "context": context, "made": made})
    return figures(sum=float(view.image.array.sum()), **made)
"""
WRITE_TO_INPUTS = """
parent = os.getppid()
made["refused"] = made["written"] = 0
for name in os.listdir("/proc/%d/fd" % parent):
    place = "/proc/%d/fd/%s" % (parent, name)
    if "memfd:marrow" not in os.readlink(place) or os.stat(place).st_size < 1000:
        continue
    try:
        with open(place, "r+b") as stream:
            stream.write(bytes(1000))
        made["written"] += 1
    except PermissionError:
        made["refused"] += 1
"""
BUSY = """
@marrow.node("own.waits", summary="waits")
def waits(camera: Annotated[Optional[marrow.Camera], "none"] = None, *, mark: Annotated[str, "mark"]) -> Annotated[
        marrow.Metrics, marrow.named("figures")]:
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})
    open(mark, "w")
    time.sleep(1000)
"""
CHANGES = {
    "locale.setlocale(locale.LC_ALL, 'C')": "the locale was changed",
    "os.chdir('/')": "the working folder was changed to /",
    "signal.signal(signal.SIGUSR1, signal.SIG_IGN)": "the handling of a signal was changed",
}
TAKE = "kept = [bytearray(b'x' * 50_000_000) for i in range(10)]"


class Hostile(Written):
    def setUp(self):
        super().setUp()
        self.file = self.plugin(NODES)

    def does(self, what, *inputs, told=None):
        call = marrow.own.does.using(keep=False, progress=told.append if told is not None else None)
        return call(*(inputs or [view()]), what=what)

    def failure(self, what, *inputs):
        with self.assertRaises(marrow.RunError) as caught:
            self.does(what, *inputs)
        return str(caught.exception)

    def test_the_standard_input_is_empty_for_a_node_and_for_what_it_starts(self):
        first = self.does("")["process"]
        made = self.does(
            "made['read'] = len(sys.stdin.read())\n"
            "made['by_a_child'] = len(subprocess.run(['cat'], stdout=subprocess.PIPE).stdout)\n"
            "made['by_a_shell'] = os.system('cat')\n"
        )
        self.assertEqual((made["read"], made["by_a_child"], made["by_a_shell"]), (0, 0, 0))
        self.assertEqual(self.does("")["process"], first)

    def test_what_a_call_changes_is_its_failure(self):
        state = (
            "import numpy\n"
            "made['folder'], made['least'] = len(os.getcwd()), float(numpy.float64(5e-324) / 1)\n"
            "made['text'], made['default'] = sum(locale.setlocale(locale.LC_ALL).encode()), "
            "signal.getsignal(signal.SIGUSR1) == signal.SIG_DFL\n"
        )

        def state_now():
            made = self.does(state)
            return [made[name] for name in ("folder", "least", "text", "default")]

        before = state_now()
        for change, what in CHANGES.items():
            for code in (change, "%s\nimport colorsys" % change, "import sched\n%s" % change):
                said = self.failure(code)
                self.assertIn(what + " while it ran; a node must leave it as it is", said)
                self.assertEqual(state_now(), before)

    def test_what_a_module_changes_at_its_import_is_no_failure_of_the_call(self):
        (self.scratch / "plugins" / "sets.py").write_text("import signal\nsignal.signal(10, signal.SIG_IGN)\n")
        ignored = "made['ignored'] = signal.getsignal(10) == signal.SIG_IGN"
        self.assertEqual(self.does("import sets\n" + ignored)["ignored"], 1)
        self.assertEqual(self.does(ignored)["ignored"], 1)

    def test_a_call_may_raise_anything_and_not_end_its_process(self):
        for code, said in {
            "raise SystemExit(0)": "SystemExit: 0",
            "class Odd(BaseException): pass\nraise Odd('text')": "Odd: text",
            "class Odd(Exception):\n    def __str__(self): return 1 / 0\nraise Odd()": "Odd: no message",
            "os._exit(0)": "mine.py ended its process; a node must return or raise an exception",
        }.items():
            self.assertIn(said, self.failure(code))

    def test_no_descriptor_of_marrow_is_left_to_what_a_node_starts(self):
        here, there = self.scratch / "here", self.scratch / "there"
        list_to = "ls /proc/self/fd > '%s'"
        os.system(list_to % here)
        self.does("os.system(%r)" % (list_to % there))
        self.assertLessEqual(set(there.read_text().split()), set(here.read_text().split()))

    def test_a_forked_process_that_comes_out_of_the_node_answers_nothing(self):
        first = self.does("")["process"]
        made = self.does("if os.fork(): os.wait()")
        self.assertEqual(made["process"], first)
        self.assertEqual([self.does("")["process"] for _ in range(3)], 3 * [first])

    def test_inputs_cannot_be_changed_through_proc(self):
        volume = marrow.Volume(numpy.ones((20, 20, 20), "float32"), spacing_mm=(1, 1, 1))
        made = self.does(WRITE_TO_INPUTS, view(), volume)
        self.assertEqual(made["written"], 0)
        self.assertGreaterEqual(made["refused"], 2)  # the volume and the view
        self.assertEqual(self.does("made['sum_of_ct'] = float(volume.array.sum())", view(), volume)["sum_of_ct"], 8000)

    def test_a_changed_input_is_noticed_and_the_next_call_has_the_right_one(self):
        given = view()
        right = float(given.image.array.sum())
        self.assertIn(
            "own.does changed its input 'view'; a node must leave its inputs as they are: change a copy",
            self.failure("ctypes.memset(view.image.array.ctypes.data, 7, 100)", given),
        )
        self.assertEqual(self.does("", given)["sum"], right)

    def test_what_a_node_says_is_understood(self):
        said = self.failure("context.progress(float('nan'))")
        self.assertIn("progress: expected a number from 0 to 1, got nan", said)
        told = []
        self.does("context.warn('the folder caf' + chr(0xdce9) + ' is new')", told=told)
        self.assertIn(r"the folder caf\xe9 is new", [event["text"] for event in told])
        self.does("context.warn('x' * 70_000_000)", told=told)
        self.assertTrue(told and any(e["text"].endswith("xxx... (69900000 more characters)") for e in told))
        self.assertIn("... (", self.failure("raise ValueError('x' * 70_000_000)"))
        self.assertIn(r"caf\xe9", self.failure("raise ValueError('caf' + chr(0xdce9))"))

    def test_what_is_no_answer_is_said_to_be_none(self):
        code = (
            "for name in os.listdir('/proc/self/fd'):\n"
            "    if 'pipe:' in os.readlink('/proc/self/fd/' + name) and int(name) > 4:\n"
            "        try: os.write(int(name), b'hello\\n')\n"
            "        except OSError: pass\n"
        )
        self.assertIn("mine.py: its process", said := self.failure(code))
        self.assertIn("sent something that is not part of its job and was ended", said)

    def test_a_process_that_was_killed_is_no_fault_of_the_node(self):
        self.assertIn(
            "the process of mine.py was killed from outside (SIGKILL), as by a system whose memory, or that of a "
            "cluster's job, runs out; run it again, with more memory or fewer threads",
            self.failure("os.kill(os.getpid(), signal.SIGKILL)"),
        )

    def test_memory_of_what_a_node_starts_counts(self):
        for started in ("subprocess.run([sys.executable, '-c', %r])", "subprocess.run([sys.executable, '-c', %r], %s)"):
            child = TAKE + "; import time; time.sleep(100)"
            text = self.failure(started % ((child,) if started.count("%") == 1 else (child, "start_new_session=True")))
            self.assertRegex(text, r"mine.py used more than 400(\.\d+)? MB of memory, and its process was ended")
        self.assertEqual(processes(self.file), [])

    def test_nothing_is_left_of_what_a_node_started(self):
        mark = str(self.scratch / "number")
        child = "import os, time; open(%r, 'w').write(str(os.getpid())); time.sleep(1000)" % mark
        self.failure(
            "subprocess.Popen([sys.executable, '-c', %r], start_new_session=True)\n"
            "while not os.path.exists(%r) or not open(%r).read(): time.sleep(0.02)\n"
            "kept = [bytearray(b'x' * 50_000_000) for i in range(100) if not time.sleep(0.05)]" % (child, mark, mark)
        )
        number = int((self.scratch / "number").read_text())
        wait_until(lambda: not os.path.exists("/proc/%d" % number), "a process is left")

    def test_memory_that_processes_share_counts_once(self):
        self.does(
            "kept = bytearray(b'x' * 150_000_000)\n"
            "children = []\n"
            "for i in range(4):\n"
            "    number = os.fork()\n"
            "    if not number:\n"
            "        time.sleep(1); os._exit(0)\n"
            "    children.append(number)\n"
            "for number in children: os.waitpid(number, 0)"
        )

    def test_the_first_ctrl_c_says_what_is_waited_for(self):
        self.plugin(NODES + BUSY)
        mark = self.scratch / "begun"
        text = "marrow: 1\nnodes:\n  slow: {uses: own.waits, with: {mark: %s}}\noutputs: {a: slow.figures}\n" % mark
        pipeline = self.write("p.yaml", text)
        for signals in (1, 2):
            run = subprocess.Popen(
                [str(MARROW), "run", str(pipeline), "--out", str(self.scratch / ("out%d" % signals))],
                stderr=subprocess.PIPE,
                text=True,
            )
            self.addCleanup(run.kill)  # where the test ends before
            wait_until(mark.exists, "the node did not begin")
            mark.unlink()
            run.send_signal(signal.SIGINT)
            if signals == 2:
                time.sleep(0.1)
                run.send_signal(signal.SIGINT)
            _, said = run.communicate(timeout=200)
            self.assertEqual(run.returncode, 130)
            notice = "marrow: stopping; it waits for what is running: slow. A second Ctrl-C ends it at once"
            self.assertIn(notice, said)
            self.assertEqual("stopped at once; what was being done is lost" in said, signals == 2, said)

    def test_ctrl_c_in_python_says_that_a_node_is_waited_for(self):
        self.plugin(NODES + BUSY)
        mark = self.scratch / "begun"
        code = "import marrow; marrow.own.waits(mark=%r)" % str(mark)
        environment = {**os.environ, "PYTHONPATH": os.path.dirname(os.path.dirname(marrow.__file__))}
        run = subprocess.Popen(["/usr/bin/python3", "-c", code], env=environment, stderr=subprocess.PIPE, text=True)
        self.addCleanup(run.kill)  # where the test ends before
        wait_until(mark.exists, "the node did not begin")
        run.send_signal(signal.SIGINT)
        _, said = run.communicate(timeout=200)
        self.assertIn("marrow: stopping; it waits until the node that runs has ended", said)
        self.assertIn("KeyboardInterrupt", said)


if __name__ == "__main__":
    main()
