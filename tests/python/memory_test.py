# SPDX-License-Identifier: Apache-2.0
"""Memory stays level, however often nodes run: memory_test.py [CALLS of a small node]."""
import gc
import sys

import numpy
from harness.package import Case, main, marrow

CALLS = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
RUNS = 200


def resident_mb():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096 / 1e6


def growth_mb(call, warm, calls):
    """By how much memory grows over the calls after the first `warm` ones."""
    for _ in range(warm):
        call()
    gc.collect()
    before = resident_mb()
    for _ in range(calls):
        call()
    gc.collect()
    return resident_mb() - before


class Memory(Case):
    def test_a_small_node_leaves_nothing_behind(self):
        grown = growth_mb(lambda: marrow.test.constant(value=3), 100, CALLS)
        print("%d calls of a small node: %+.1f MB" % (CALLS, grown))
        self.assertLess(grown, 10)

    def test_a_volume_leaves_nothing_behind(self):
        samples = numpy.zeros((64, 128, 128), "float32")  # 4.2 MB
        samples[:, 32:96, 32:96] = 1000

        def call():
            volume = marrow.Volume(samples, spacing_mm=(1, 1, 1))
            mended = marrow.volume.bridge_metal(volume)
            self.assertEqual(mended.array.shape, samples.shape)

        grown = growth_mb(call, 20, RUNS)
        print("%d runs of a volume of %.1f MB: %+.1f MB" % (RUNS, samples.nbytes / 1e6, grown))
        self.assertLess(grown, 3 * samples.nbytes / 1e6)

    def test_errors_leave_nothing_behind(self):
        def call():
            with self.assertRaises(marrow.Error):
                marrow.test.constant(value="much")

        self.assertLess(growth_mb(call, 50, 500), 10)


if __name__ == "__main__":
    main()
