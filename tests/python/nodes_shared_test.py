# SPDX-License-Identifier: Apache-2.0
"""Inputs of nodes written in Python are packed once and mapped, not copied for each call."""
import gc
import os
import pathlib

import numpy
from harness.package import main, marrow
from written_nodes import Written, processes, view

PLACES = """
import os

@marrow.node("own.place", summary="where the samples are")
def place(volume: Annotated[marrow.Volume, "ct"], view: Annotated[Optional[marrow.View], "view"] = None) -> Annotated[
        marrow.Metrics, marrow.named("figures")]:
    address = volume.array.ctypes.data
    for line in open("/proc/self/maps"):
        begin, end = (int(part, 16) for part in line.split()[0].split("-"))
        if begin <= address < end:
            inode, shared = int(line.split()[4]), "s" in line.split()[1] and "w" not in line.split()[1]
    return marrow.Metrics({"process": os.getpid(), "address": address, "inode": inode, "shared": shared,
                           "sum": float(volume.array[3, 2, 1]), "aligned": volume.array.flags.aligned})
"""


def shared_megabytes():
    """What this process holds in memory without a name."""
    total = 0
    for entry in pathlib.Path("/proc/self/fd").iterdir():
        try:
            if "memfd:marrow" in os.readlink(entry):
                total += os.stat(entry).st_size / 1e6
        except OSError:
            pass
    return total


class Shared(Written):
    def test_samples_are_mapped_once(self):
        file = self.plugin(PLACES)
        samples = numpy.arange(100 * 200 * 200, dtype="float32").reshape(100, 200, 200)  # 16 MB
        volume = marrow.Volume(samples, spacing_mm=(1, 1, 1))
        found = [marrow.own.place(volume, view(seed)) for seed in range(4)]
        self.assertEqual(len({(one["process"], one["address"], one["inode"]) for one in found}), 1)
        self.assertEqual((found[0]["shared"], found[0]["aligned"]), (1, 1))
        self.assertEqual(found[0]["sum"], samples[3, 2, 1])
        self.assertAlmostEqual(shared_megabytes(), 16, delta=1)
        views = {"item%d" % seed: view(seed) for seed in range(8)}
        of_two = marrow.own.place.using(threads=2)(volume, views)
        self.assertEqual({one["inode"] for one in of_two.values()}, {found[0]["inode"]}, "all processes map the same")
        self.assertLessEqual(len(processes(file)), 2)

    def test_memory_is_given_back(self):
        self.plugin(PLACES)
        for size in (100, 120, 140):
            marrow.own.place(marrow.Volume(numpy.ones((size, 200, 200), "float32"), spacing_mm=(1, 1, 1)))
            gc.collect()
            self.assertLess(shared_megabytes(), 0.17 * size, "only the last one is there")


if __name__ == "__main__":
    main()
