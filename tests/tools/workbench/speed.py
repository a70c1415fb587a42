#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Measures in headless Chromium how fast pages follow. For the page "Case": how long a CT of 512 x 512 x 400 voxels
takes to open and to segment, and how fast its slices follow the wheel. For the page "Place": how long it takes from a
change of the pose until both overlays are painted, the server's part of this, and the memory of server and page before
and after 1,000 drags. The figures are for people: no test depends on them.

    tests/tools/workbench/speed.py [Ct | Place]
"""
import array
import os
import pathlib
import shutil
import statistics
import time
import unittest

from bench import PageTest
from harness import formats
from harness.cases import simulate
from harness.modules import modules
from placing import PlacePage

SIZE = (512, 512, 400)
WIDTHS_PX, POSES, DRAGS = (512, 1024), 300, 1000
# How long each of 60 notches of the wheel over a slice takes until the next slice is on the canvas.
WHEEL = """const [view, done] = arguments, canvas = document.querySelector('[data-slice="' + view + '"]'), times = [];
canvas.focus();
(async () => {
  for (let i = 0; i < 60; ++i) {
    const before = canvas.dataset.shown, begin = performance.now();
    canvas.dispatchEvent(new WheelEvent('wheel', {deltaY: -120, bubbles: true, cancelable: true}));
    while (canvas.dataset.shown === before || canvas.dataset.shown === '')
      await new Promise((next) => setTimeout(next, 0));
    times.push(performance.now() - begin);
    await new Promise((next) => setTimeout(next, Math.max(0, 33 - times.at(-1))));
  }
  done(times);
})();"""
# How long each change of the pose takes until it is painted and shown in all views.
MOVE = """
const page = marrow.place(), took = [], [count, answer] = arguments;
let missing = new Set(), all = () => {};
const painted = page.painted.bind(page);
page.painted = (view, since) => {
  painted(view, since);
  missing.delete(view.name);
  if (!missing.size) all();
};
const shown = () => new Promise((resolve) => requestAnimationFrame(() => {
  const channel = new MessageChannel();
  channel.port1.onmessage = resolve;
  channel.port2.postMessage(0);
}));
(async () => {
  const from = structuredClone(page.placed);
  for (let i = 0; i < count; ++i) {
    const begin = performance.now(), angle = 0.1 * i;
    missing = new Set(page.views.map((view) => view.name));
    const done = new Promise((resolve) => (all = resolve));
    page.move(from, Geometry.shift([5 * Math.sin(angle), 5 * Math.cos(angle), 3 * Math.sin(0.7 * angle)]), true);
    await done;
    await shown();
    took.push(performance.now() - begin);
  }
  page.move(from, Geometry.identity(), false);
  page.painted = painted;
  answer(took);
})();
"""


def tell(what, times_ms):
    ordered = sorted(times_ms)
    told = (statistics.median(ordered), ordered[int(0.95 * (len(ordered) - 1))], ordered[-1], os.getloadavg()[0])
    print("  %s: median %.1f ms, 95 %% %.1f ms, longest %.1f ms, load %.1f" % (what, *told), flush=True)


def timed(action):
    begin = time.perf_counter()
    action()
    return 1000 * (time.perf_counter() - begin)


class Ct(PageTest):
    def slices(self):
        """Uneven soft tissue with a straight bone."""
        tissue = array.array("h", [(x * y) % 150 - 50 for y in range(SIZE[1]) for x in range(SIZE[0])])
        for z in range(SIZE[2]):
            one = tissue[1000 * z :] + tissue[: 1000 * z]
            for y in range(216, 297) if 20 <= z < SIZE[2] - 20 else ():
                half = int((40**2 - (y - 256) ** 2) ** 0.5)
                row = y * SIZE[0] + 256 - half
                one[row : row + 2 * half] = array.array("h", [900]) * (2 * half)
            one[0] = -1000
            yield one

    def test_one_file_and_a_series(self):
        values = array.array("h")
        for one in self.slices():
            values.extend(one)
        header = formats.mha(formats.straight(SIZE, (0.7, 0.7, 1.0)), [])
        (self.folder / "large.mha").write_bytes(header + values.tobytes())
        formats.dicom_series(self.folder / "series", SIZE, values)
        server = self.enter()
        for name in ("series", "large.mha"):
            begin = time.monotonic()
            ct = server.done("/api/ct/open", ct={"file": name})["name"]
            print("%s: opened in %.2f s" % (name, time.monotonic() - begin))
            for axis in (2, 1, 0):
                path = "/api/ct/slice?ct=%s&axis=%d&index=%%d" % (ct, axis)
                times_ms = [timed(lambda: server.bytes(path % index)) for index in range(0, SIZE[axis], 4)]
                tell("slice across axis %d from the server" % axis, times_ms)
        seeds = [[179, 179, 200], [179, 179, 100], [179, 179, 300]]
        for method in ("bone", "femur"):
            asked = {"ct": ct, "fragments": {"shaft": {"seeds": seeds}}, "method": method}
            print("  %s: segmented in %.1f s" % (method, timed(lambda: server.done("/api/segment", **asked)) / 1000))
        server.change({"ct": {"file": "large.mha"}, "fragments": {}, "views": []})
        self.show("case=mine")
        self.wait("[...document.querySelectorAll('[data-slice]')].every((one) => one.dataset.shown)")
        self.driver.set_script_timeout(300)
        for view in ("axial", "coronal", "sagittal"):
            tell(view + ", from the wheel to the canvas", self.driver.execute_async_script(WHEEL, view))


class Place(PlacePage):
    def server_times(self):
        poses = {bone["name"]: bone["start"] for bone in self.about["bones"]}
        width_px = max(view["camera"]["width_px"] for view in self.about["views"])
        asked = {"case": "case", "what": "radiograph", "step_px": -(-width_px // 1024), "poses": poses}
        for i in range(POSES):
            for pose in poses.values():
                pose[0][3] += 0.05 * (1 if i % 40 < 20 else -1)
            views = [{**asked, "view": view["name"]} for view in self.about["views"]]
            yield timed(lambda: [self.server.bytes("/api/place/overlay", one) for one in views])

    def drags(self, count):
        left, top, width, height = self.browser.box(".place-canvas")
        x, y = left + width / 2, top + height / 2
        for i in range(count):
            self.browser.drag_along([(x, y), (x + (20 if i % 2 else -20), y + i % 7), (x, y)])
        time.sleep(2)

    def memory_mb(self):
        status = pathlib.Path("/proc/%d/status" % self.server.process.pid).read_text().splitlines()
        server_kb = next(int(line.split()[1]) for line in status if line.startswith("VmRSS:"))
        self.driver.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
        return server_kb / 1024, self.driver.execute_cdp_cmd("Runtime.getHeapUsage", {})["usedSize"] / 1e6

    def test_poses_and_drags(self):
        script = modules(Geometry="workbench/page/geometry.js") + MOVE
        for width_px in WIDTHS_PX:
            sizes = [word for side in ("width", "height") for word in ("--set", "cameras.%s_px=%d" % (side, width_px))]
            pixel = "cameras.pixel_mm=%r" % (0.586 * 512 / width_px)
            shutil.rmtree(self.folder / "case")
            made = simulate(self.scratch / str(width_px), *sizes, "--set", pixel)
            shutil.copytree(made, self.folder / "case")
            self.place()
            self.driver.execute_async_script(script, 30)  # warm
            print("%d px, all pixels while moving:" % width_px)
            tell("pose change to both views painted", self.driver.execute_async_script(script, POSES))
            print("  slow views, with every second pixel:", self.page("views.filter((view) => view.isSlow).length"))
            tell("server alone, both views", self.server_times())
        self.drags(20)
        before = self.memory_mb()
        self.drags(DRAGS)
        told = "memory of server and scripts before %d drags %.0f and %.1f MB, after them %.0f and %.1f MB"
        print(told % (DRAGS, *before, *self.memory_mb()))


if __name__ == "__main__":
    unittest.main()
