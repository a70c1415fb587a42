# SPDX-License-Identifier: Apache-2.0
"""tools/studies/searches on a comparison that is written here, whose counts are known."""
import pathlib
import subprocess
import tempfile
import unittest

from harness import SOURCE

CELLS = """cell,variant,status,errors.bone.rotation_deg,errors.bone.translation_mm,in_image.bone.mpd_mm
a,two_views,done,1,2,1
b,two_views,done,3,4,2
c,one_view,done,10,50,3
d,one_view,failed,,,
"""


class Searches(unittest.TestCase):
    def test_the_table_counts_and_gives_intervals_of_clopper_and_pearson(self):
        with tempfile.TemporaryDirectory() as folder:
            comparison = pathlib.Path(folder) / "global-search-pelvis"
            comparison.mkdir()
            (comparison / "cells.csv").write_text(CELLS)
            text = subprocess.check_output([str(SOURCE / "tools/studies/searches"), str(comparison)], text=True)
        rows = text.splitlines()[2:]
        # Of 2 of 2, the lower end is 0.025 ^ (1 / 2) = 15.8 %, of 1 of 2 it is 1 - 0.975 ^ (1 / 2) = 1.3 %.
        self.assertEqual(
            rows,
            [
                "| pelvis | two views | 2 of 2 (16 to 100 %) | 2 of 2 (16 to 100 %) | 2.0, 3.0 | 3.0, 4.0 | 1.5, 2.0 |",
                "| pelvis | one view | 0 of 2 (0 to 84 %) | 1 of 2 (1 to 99 %) | 10.0, 10.0 | 50.0, 50.0 | 3.0, 3.0 |",
            ],
        )


if __name__ == "__main__":
    unittest.main()
