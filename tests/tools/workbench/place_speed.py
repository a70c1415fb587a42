#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Measures how long the page "Place" takes from a change of the pose until both overlays are painted, in headless
Chromium, and the server's part of this. Also measures the memory of server and page before and after 1,000 drags. The
figures are for people: no test depends on them.

    tests/tools/workbench/place_speed.py [WIDTH_PX ...]
"""
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

import bench
from harness.modules import modules

POSES = 300
DRAGS = 1000

MOVE = (
    modules(Geometry="workbench/page/geometry.js")
    + """
const page = marrow.place(), took = [];
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
const answer = arguments[1], count = arguments[0];
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
)


def summary(times_ms):
    ordered = sorted(times_ms)
    at = lambda fraction: ordered[int(fraction * (len(ordered) - 1))]
    return "median %.1f ms, 95th percentile %.1f ms, longest %.1f ms" % (
        statistics.median(ordered),
        at(0.95),
        ordered[-1],
    )


def memory_mb(process):
    lines = pathlib.Path("/proc/%d/status" % process).read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS:")) / 1024


def server_times(server, about):
    poses = {bone["name"]: bone["start"] for bone in about["bones"]}
    width_px = max(view["camera"]["width_px"] for view in about["views"])
    times_ms = []
    for i in range(POSES):
        for pose in poses.values():
            pose[0][3] += 0.05 * (1 if i % 40 < 20 else -1)
        begin = time.perf_counter()
        for view in about["views"]:
            asked = {
                "case": "case",
                "view": view["name"],
                "what": "radiograph",
                "step_px": -(-width_px // 1024),
                "poses": poses,
            }
            status, _, content = server.ask("POST", "/api/place/overlay", asked)
            assert status == 200, content
        times_ms.append(1e3 * (time.perf_counter() - begin))
    return times_ms


def drags(browser, count):
    """Presses, moves and releases of the mouse in the first view."""
    box = browser.js(
        "const r = document.querySelector('.place-canvas').getBoundingClientRect(); return [r.left, r.top, r.width,"
        " r.height]"
    )
    middle = {"x": box[0] + box[2] / 2, "y": box[1] + box[3] / 2}
    for i in range(count):
        to = {"x": middle["x"] + (20 if i % 2 else -20), "y": middle["y"] + (i % 7)}
        for kind, place, buttons in (
            ("mousePressed", middle, 1),
            ("mouseMoved", to, 1),
            ("mouseMoved", middle, 1),
            ("mouseReleased", middle, 0),
        ):
            browser.driver.execute_cdp_cmd(
                "Input.dispatchMouseEvent", dict(place, type=kind, button="left", buttons=buttons, clickCount=1)
            )


def page_mb(browser):
    browser.driver.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
    return browser.driver.execute_cdp_cmd("Runtime.getHeapUsage", {})["usedSize"] / 1e6


def measure(width_px, case, browser, with_drags):
    folder = case.parent
    server = bench.Server(folder)
    try:
        test = bench.PageTest()
        bench.PageTest.browser = browser
        test.show(server, "place=case")
        browser.js("marrow.place().judges = false")
        browser.js("return marrow.place().stopVerdict()")
        browser.driver.execute_async_script(MOVE, 30)  # warm
        load = os.getloadavg()[0]
        times_ms = browser.driver.execute_async_script(MOVE, POSES)
        coarse = browser.js("return marrow.place().views.some((view) => view.isSlow)")
        print("every second pixel while moving" if coarse else "all pixels while moving")
        print("%d px, pose change to both views painted: %s (load %.1f)" % (width_px, summary(times_ms), load))
        about = browser.js("return marrow.place().about")
        server.cookie = "; ".join(
            "%s=%s" % (cookie["name"], cookie["value"]) for cookie in browser.driver.get_cookies()
        )
        load = os.getloadavg()[0]
        print(
            "%d px, server alone, both views: %s (load %.1f)" % (width_px, summary(server_times(server, about)), load)
        )
        if with_drags:
            drags(browser, 20)
            time.sleep(1)
            before = memory_mb(server.process.pid), page_mb(browser)
            drags(browser, DRAGS)
            time.sleep(2)
            after = memory_mb(server.process.pid), page_mb(browser)
            print(
                "memory before and after %d drags: server %.0f and %.0f MB, page's scripts %.1f and %.1f MB"
                % (DRAGS, before[0], after[0], before[1], after[1])
            )
    finally:
        server.close()


def main():
    missing = bench.chromium.missing()
    if missing:
        print("skipped:", missing)
        return
    widths_px = [int(text) for text in sys.argv[1:]] or [512, 1024]
    scratch = pathlib.Path(tempfile.mkdtemp(prefix="marrow-place-"))
    browser = bench.chromium.Browser()
    try:
        for width_px in widths_px:
            out = scratch / str(width_px)
            subprocess.run(
                [
                    bench.MARROW,
                    "run",
                    bench.SOURCE / "pipelines" / "simulate" / "simulate.yaml",
                    "--out",
                    out,
                    "--quiet",
                ]
                + [word for name in ("width_px", "height_px") for word in ("--set", "cameras.%s=%d" % (name, width_px))]
                + ["--set", "cameras.pixel_mm=%r" % (0.586 * 512 / width_px)],
                check=True,
                stdout=subprocess.DEVNULL,
            )
            measure(width_px, out / "outputs" / "case", browser, with_drags=width_px == widths_px[0])
    finally:
        browser.close()
        shutil.rmtree(scratch)


if __name__ == "__main__":
    main()
