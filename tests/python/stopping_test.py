# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C, and runs from several threads of Python."""
import os
import signal
import subprocess
import sys
import threading
import time

import numpy
from harness.package import FEMUR, Case, interrupt, main, marrow, small_case

LONG = """marrow: 1
nodes:
  a: {uses: test.constant}
  b: {uses: test.work, in: {after: a}, with: {value: %s}}
outputs: {b: b}
"""


class Stopping(Case):
    def test_ctrl_c_stops_a_run_and_no_handler_changes(self):
        pipeline = marrow.Pipeline(self.write("long.yaml", LONG % 300))
        handler = signal.getsignal(signal.SIGINT)
        interrupt(self, lambda: pipeline.run(keep=False))
        self.assertIs(signal.getsignal(signal.SIGINT), handler)
        interrupt(self, lambda: time.sleep(300))  # outside of a run it does what it did before
        short = marrow.Pipeline(self.write("short.yaml", LONG % 0.01))
        self.assertEqual(short.run(keep=False).nodes["b"].status, "done")

    def test_ctrl_c_stops_a_node(self):
        work = marrow.test.work.using()
        interrupt(self, lambda: work(marrow.test.constant(), value=300))

    def test_a_handler_of_ones_own_is_called_and_may_go_on(self):
        seen = []
        timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
        before = signal.signal(signal.SIGINT, lambda number, frame: seen.append(number))
        try:
            timer.start()
            result = marrow.Pipeline(self.write("long.yaml", LONG % 1)).run(keep=False)
            timer.join()  # it may come late
        finally:
            signal.signal(signal.SIGINT, before)
        self.assertEqual(seen, [signal.SIGINT])
        self.assertEqual(result.nodes["b"].status, "done")

    def test_a_process_ends_by_ctrl_c(self):
        file = self.write("long.yaml", LONG % 1000)
        code = "import marrow; print('begun', flush=True); marrow.Pipeline(%r).run(keep=False)" % str(file)
        environment = {**os.environ, "PYTHONPATH": os.path.dirname(os.path.dirname(marrow.__file__))}
        with subprocess.Popen(
            [sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as process:
            self.assertEqual(process.stdout.readline(), "begun\n")
            time.sleep(0.5)
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=300)
        self.assertIn("KeyboardInterrupt", errors)
        self.assertEqual(process.returncode, -signal.SIGINT)

    def test_other_threads_of_python_go_on(self):
        is_begun = threading.Event()

        def count():
            """Ends the run after a hundred steps of its own, of which a run that holds all up would let it do few."""
            is_begun.wait()
            for _ in range(100):
                time.sleep(0.001)
            os.kill(os.getpid(), signal.SIGINT)

        counter = threading.Thread(target=count, daemon=True)
        counter.start()
        begin = lambda event: is_begun.set() if (event["event"], event.get("node")) == ("started", "b") else None
        with self.assertRaises(KeyboardInterrupt):
            marrow.Pipeline(self.write("long.yaml", LONG % 300)).run(keep=False, progress=begin)
        counter.join()

    def test_runs_of_several_threads_at_once(self):
        folder, _ = small_case()
        expected = {
            high: marrow.Pipeline(FEMUR, case=folder)
            .set("edges.high", high)
            .run(only=["edges"])["edges"]["lateral"]
            .pixels
            for high in (80, 85, 90, 95)
        }
        results, faults = {}, []

        def run(high):
            try:
                pipeline = marrow.Pipeline(FEMUR, case=folder).set("edges.high", high)
                for keep in (False, True, False):
                    results[high, len(results)] = pipeline.run(only=["edges"], keep=keep)["edges"]["lateral"].pixels
            except BaseException as fault:  # shown below, in the main thread
                faults.append(fault)

        threads = [threading.Thread(target=run, args=(high,)) for high in expected]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(faults, [])
        self.assertEqual(len(results), 12)
        for (high, _), pixels in results.items():
            self.assertTrue(numpy.array_equal(pixels, expected[high]))


if __name__ == "__main__":
    main()
