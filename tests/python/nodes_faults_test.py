# SPDX-License-Identifier: Apache-2.0
"""What goes wrong in a node written in Python costs one call, and is said clearly."""
import os
import pathlib
import signal
import subprocess
import threading

from harness.package import BUILD, MARROW, main, marrow, wait_until
from written_nodes import Written, processes, view

CALLS = """
import os, signal, sys, threading, time

def figures():
    return marrow.Metrics({"process": os.getpid()})

@marrow.node("own.does", summary="does what it is told", seconds=600, memory_mb=500)
def does(view: Annotated[marrow.View, "view"], *, what: Annotated[str, "what"] = "") -> Annotated[
        marrow.Metrics, marrow.named("figures")]:
    exec(what)
    return figures()
"""


def has_ended(process):
    """Whether a process has ended, also where its parent does not know it yet."""
    try:
        return pathlib.Path("/proc/%d/stat" % process).read_text().rpartition(") ")[2].startswith("Z")
    except FileNotFoundError:
        return True


class Faults(Written):
    def does(self, what):
        return int(marrow.own.does(view(), what=what)["process"])

    def failure(self, what):
        return str(self.fault_of(lambda: self.does(what), marrow.RunError))

    def test_a_crash_costs_one_call(self):
        self.plugin(CALLS)
        first = self.does("")
        self.assertEqual(self.does(""), first)
        self.assertIn(
            "the process of mine.py was killed from outside (SIGKILL)",
            self.failure("os.kill(os.getpid(), signal.SIGKILL)"),
        )
        self.assertIn("crashed its process (Segmentation fault)", self.failure("os.kill(os.getpid(), 11)"))
        self.assertIn("ended its process; a node must return or raise", self.failure("os._exit(0)"))
        self.assertNotEqual(self.does(""), first)

    def test_a_process_that_is_killed_between_two_calls_costs_nothing(self):
        self.plugin(CALLS)
        # The first thread ends first. Until the last one ends, too, the pipes of the process are open.
        many_threads = "for _ in range(200): threading.Thread(target=time.sleep, args=(600,), daemon=True).start()"
        first = self.does(many_threads)
        os.kill(first, signal.SIGKILL)
        while not has_ended(first):
            pass
        self.assertNotEqual(self.does(""), first)

    def test_of_two_calls_at_once_only_the_killed_one_fails(self):
        file = self.plugin(CALLS)
        ends = {}

        def call(name, what):
            try:
                ends[name] = self.does(what)
            except marrow.RunError as error:
                ends[name] = str(error)

        # Each of them goes on until it is let go.
        code = "open(%r, 'w')\nwhile not os.path.exists(%r): time.sleep(0.02)"
        threads = [
            threading.Thread(target=call, args=(name, code % (str(self.scratch / name), str(self.scratch / "go"))))
            for name in ("a", "b")
        ]
        for thread in threads:
            thread.start()
        begun = lambda: all((self.scratch / name).exists() for name in ("a", "b"))
        try:
            wait_until(begun, "the calls did not begin")
            os.kill(processes(file)[0], signal.SIGKILL)
            wait_until(lambda: ends, "the killed call did not end")
        finally:
            self.write("go", "")
        for thread in threads:
            thread.join()
        self.assertEqual(sorted(isinstance(end, int) for end in ends.values()), [False, True], ends)
        self.assertIn("(SIGKILL)", next(end for end in ends.values() if isinstance(end, str)))

    def test_a_hang(self):
        file = self.plugin(CALLS.replace("seconds=600", "seconds=3"))
        self.assertIn(
            "mine.py took longer than 3 s, and its process was ended; if it needs more, give it more in "
            "@marrow.node(..., seconds=...)",
            self.failure("while True: pass"),
        )
        self.assertEqual(processes(file), [])
        self.does("")

    def test_too_much_memory(self):
        self.plugin(CALLS)
        text = self.failure("kept = [bytearray(b'x' * 50_000_000) for i in range(100) if not time.sleep(0.05)]")
        self.assertRegex(text, r"mine.py used more than 500(\.\d+)? MB of memory, and its process was ended")
        self.assertIn("memory_mb=", text)
        self.assertIn("out of memory", self.failure("raise MemoryError"))

    def test_exceptions(self):
        file = self.plugin(CALLS + "\ndef broken(number):\n    return 1 / number\n")
        line = file.read_text().splitlines().index("    return 1 / number") + 1
        self.assertIn(
            "%s, line %d, in broken: ZeroDivisionError: division by zero (return 1 / number)" % (file, line),
            self.failure("broken(0)"),
        )
        self.assertIn("in does: SystemExit: 3 (exec(what))", self.failure("sys.exit(3)"))
        said = self.failure("raise marrow.Error('the view shows no bone; take another one')")
        self.assertIn("the view shows no bone; take another one", said)
        self.assertNotIn("line", said)
        self.does("print('what a node prints is no answer'); sys.stdout.flush(); os.system('echo as little')")

    def test_a_seed_is_only_for_random_nodes(self):
        self.plugin(
            """
@marrow.node("own.draws", summary="draws")
def draws(view: Annotated[marrow.View, "view"], *, context: marrow.Context) -> Annotated[
        marrow.Metrics, marrow.named("figures")]:
    return marrow.Metrics({"seed": float(context.seed)})
"""
        )
        said = "it draws from context.seed, so declare it with random=True"
        self.refuses((said, lambda: marrow.own.draws(view())), kind=marrow.RunError)

    def test_wrong_outputs(self):
        pose = 'Annotated[marrow.Pose, marrow.named("p")]'
        rows = (
            ("none", pose, "None", "own.none returned nothing for the output 'p'"),
            ("other", pose, "view", "output 'p': expected pose, got view"),
            ("number", pose, "7", "output 'p': expected pose, got int"),
            ("many", pose, "[marrow.Pose(numpy.eye(4))]", "output 'p': expected one pose, got a list"),
            ("three", "Two", "(1, 2, 3)", "own.three returned 3 values, expected 2"),
        )
        text = 'class Two(NamedTuple):\n    a: Annotated[marrow.Pose, "a"]\n    b: Annotated[marrow.Pose, "b"]\n'
        for name, kind, value, _ in rows:
            text += '\n@marrow.node("own.%s", summary="wrong")\n' % name
            text += 'def %s(view: Annotated[marrow.View, "v"]) -> %s: return %s\n' % (name, kind, value)
        self.plugin(text)
        for name, _, _, said in rows:
            self.refuses((said, lambda: marrow.node("own." + name)(view())), kind=marrow.RunError)

    def stop_by_ctrl_c(self, body):
        """Stops a run in which a node runs this code, which does not end by itself."""
        file = self.plugin(
            CALLS
            + """
@marrow.node("own.waits", summary="waits")
def waits(camera: Annotated[Optional[marrow.Camera], "none"] = None, *, mark: Annotated[str, "mark"]) -> Annotated[
        marrow.Metrics, marrow.named("figures")]:
    open(mark + ".begun", "w")
%s
    return figures()
"""
            % body
        )
        mark = self.scratch / "ended"
        text = "marrow: 1\nnodes:\n  a: {uses: own.waits, with: {mark: %s}}\noutputs: {a: a.figures}\n" % mark
        pipeline = self.write("p.yaml", text)
        run = subprocess.Popen([str(MARROW), "run", str(pipeline), "--out", str(self.scratch / "out")])
        self.addCleanup(run.wait)
        self.addCleanup(run.kill)  # where the test ends before
        wait_until((self.scratch / "ended.begun").exists, "the node did not begin")
        run.send_signal(signal.SIGINT)
        self.assertEqual(run.wait(200), 130)
        self.assertEqual(processes(file), [])

    def test_ctrl_c_lets_the_node_clean_up(self):
        self.stop_by_ctrl_c("    try:\n        time.sleep(1000)\n    finally:\n        open(mark, 'w')")
        self.assertTrue((self.scratch / "ended").exists())

    def test_ctrl_c_ends_a_node_that_does_not_listen(self):
        body = "    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})\n    time.sleep(1000)"
        self.stop_by_ctrl_c(body)

    def test_a_killed_program_leaves_no_process(self):
        file = self.plugin(CALLS)
        script = (
            "import sys; sys.path.insert(0, %r); import marrow, numpy\n"
            "camera = marrow.Camera(9, 9, [[9, 0, 4], [0, 9, 4], [0, 0, 1]], numpy.eye(4))\n"
            "marrow.own.does(marrow.View(numpy.ones((9, 9), 'uint8'), camera), what=%r)\n"
        ) % (str(BUILD / "python"), "open(%r, 'w')\nwhile True: pass" % str(self.scratch / "begun"))
        run = subprocess.Popen(["/usr/bin/python3", "-c", script])
        self.addCleanup(run.wait)
        self.addCleanup(run.kill)  # where the test ends before
        wait_until((self.scratch / "begun").exists, "the node did not begin")
        self.assertNotEqual(processes(file), [])
        run.kill()
        run.wait()
        wait_until(lambda: not processes(file), "a process is left")


if __name__ == "__main__":
    main()
