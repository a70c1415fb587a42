#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Measures how long a CT of 512 x 512 x 400 voxels takes to open and to segment, and how fast its slices follow the
wheel. Prints figures and tests nothing.

    tests/tools/workbench/ct_benchmark.py
"""
import array
import os
import statistics
import time

import bench
from bench import PageTest
from harness import formats

SIZE = (512, 512, 400)


def milliseconds(times_s):
    ordered = sorted(1000 * one for one in times_s)
    return "median %.1f ms, 95 %% %.1f ms, longest %.1f ms" % (
        statistics.median(ordered),
        ordered[int(0.95 * (len(ordered) - 1))],
        ordered[-1],
    )


class Benchmark(PageTest):
    def measure(self, name, make):
        make(self.folder / name)
        server = self.open()
        server.enter()
        print("%s, load %.1f" % (name, os.getloadavg()[0]))
        begin = time.monotonic()
        state = server.finish(server.json("POST", "/api/ct/open", {"ct": {"file": name}})["job"])
        print("  opened in %.2f s" % (time.monotonic() - begin), state["error"])
        ct = state["result"]["name"]
        for axis in (2, 1, 0):
            times = []
            for index in range(0, SIZE[axis], 4):
                begin = time.monotonic()
                server.ask("GET", "/api/ct/slice?ct=%s&axis=%d&index=%d" % (ct, axis, index))
                times.append(time.monotonic() - begin)
            print("  slice across axis %d from the server: %s" % (axis, milliseconds(times)))
        return server

    def wheel(self, server, name):
        """From an event of the wheel to the slice on the canvas, in the browser."""
        server.json(
            "POST",
            "/api/draft/change",
            {
                "case": "c",
                "revision": 0,
                "what": "ct",
                "document": {"ct": {"file": name}, "fragments": {}, "views": []},
            },
        )
        self.show(self.open(), "case=c")  # the address of a server works in one browser
        self.wait_for_slices()
        self.browser.driver.set_script_timeout(300)
        for view in ("axial", "coronal", "sagittal"):
            times = self.browser.driver.execute_async_script(
                """const [view, done] = arguments, canvas = document.querySelector('[data-slice="' + view + '"]');
                canvas.focus();
                const times = [];
                (async () => {
                  for (let i = 0; i < 60; ++i) {
                    const before = canvas.dataset.shown, begin = performance.now();
                    canvas.dispatchEvent(new WheelEvent('wheel', {deltaY: -120, bubbles: true, cancelable: true}));
                    while (canvas.dataset.shown === before || canvas.dataset.shown === '')
                      await new Promise((next) => setTimeout(next, 0));
                    times.push((performance.now() - begin) / 1000);
                    await new Promise((next) => setTimeout(next, Math.max(0, 33 - 1000 * times.at(-1))));
                  }
                  done(times);
                })();""",
                view,
            )
            print("  %s, from the wheel to the canvas, 30 notches a second: %s" % (view, milliseconds(times)))
        print("  load %.1f" % os.getloadavg()[0])

    def test_one_file(self):
        server = self.measure("large.mha", self.write_mha)
        for method in ("bone", "femur"):
            self.segment(server, method)
        self.wheel(server, "large.mha")

    def test_series(self):
        self.measure("series", self.write_series)

    def slices(self):
        """Uneven soft tissue with a straight bone."""
        tissue = array.array("h", [(x * y) % 150 - 50 for y in range(SIZE[1]) for x in range(SIZE[0])])
        for z in range(SIZE[2]):
            one = tissue[1000 * z :] + tissue[: 1000 * z]
            if 20 <= z < SIZE[2] - 20:
                for y in range(216, 297):
                    half = int((40**2 - (y - 256) ** 2) ** 0.5)
                    row = y * SIZE[0] + 256 - half
                    one[row : row + 2 * half] = array.array("h", [900]) * (2 * half)
            one[0] = -1000
            yield one

    def segment(self, server, method):
        ct = server.finish(server.json("POST", "/api/ct/open", {"ct": {"file": "large.mha"}})["job"])["result"]["name"]
        begin = time.monotonic()
        fragments = {"shaft": {"seeds": [[179, 179, 200], [179, 179, 100], [179, 179, 300]]}}
        asked = {"ct": ct, "fragments": fragments, "method": method}
        job, since = server.json("POST", "/api/segment", asked)["job"], 0
        while True:
            state = server.json("GET", "/api/job?job=%s&since=%d" % (job, since))
            since = state["next"]
            for event in state["events"]:
                if event["event"] == "grown":
                    print("  %s: %s after %.1f s" % (method, event["stage"], time.monotonic() - begin), flush=True)
            if state["state"] != "running":
                print("  %s: %s %s, load %.1f" % (method, state["state"], state["error"], os.getloadavg()[0]))
                return

    def write_mha(self, path):
        with open(path, "wb") as file:
            header = formats.mha(formats.straight(SIZE, (0.7, 0.7, 1.0)), [])
            file.write(header)
            for values in self.slices():
                file.write(values.tobytes())

    def write_series(self, folder):
        values = array.array("h")
        for one in self.slices():
            values.extend(one)
        formats.dicom_series(folder, SIZE, values)


if __name__ == "__main__":
    bench.main()
