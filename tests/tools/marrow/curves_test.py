# SPDX-License-Identifier: Apache-2.0
"""`marrow curves`: which frames are compared, what is said and written. The numbers: curves_numbers_test.py."""
import math

from curves_cases import Curves
from harness.program import main

FRAMES = list(range(1, 41))
WAVE = [10 * math.sin(0.3 * frame) for frame in FRAMES]


def of_frames(**columns):
    return {"frame": FRAMES, **columns}


def moved(amount):
    return [value + amount for value in WAVE]


class Sequences(Curves):
    def test_the_table_and_the_sentence(self):
        told = self.curves(*self.two(of_frames(flexion_deg=WAVE), of_frames(flexion_deg=moved(2))))
        self.assertTrue(told.startswith("first: a.csv\nsecond: b.csv (differences are second - first)\n"), told)
        self.assertRegex(told, r"flexion_deg +deg +40 +40 +0 % +0 % +2 ")
        self.assertIn("\nflexion_deg: the second is 2 deg larger on average, ", told)
        self.assertIn("Curves as a page, CSV and JSON: add --out FOLDER\n", told)
        again = [value + (3 if i < len(WAVE) / 2 else -2) for i, value in enumerate(WAVE)]  # one slow wave
        told = self.curves(*self.two(of_frames(x_mm=WAVE), of_frames(x_mm=again)))
        self.assertIn("\nx_mm: no difference shown on average: the second is 0.5 mm larger on average, ", told)

    def test_gaps_are_counted_and_not_bridged(self):
        holes = [None if 5 <= i < 9 else value for i, value in enumerate(WAVE)]
        files = self.two(of_frames(x_mm=holes), {"frame": FRAMES[:-10], "x_mm": WAVE[:-10]})
        figure = self.compared(*files)["x_mm"]
        self.assertEqual([figure[key] for key in ("times", "both", "only_first", "only_second")], [40, 26, 10, 4])
        self.assertEqual(figure["difference"][5:9], [None] * 4)
        self.assertEqual(figure["interpolated"], None)
        # A frame that was not found is a gap.
        found = [0 if i == 3 else 1 for i in range(40)]
        files = self.two(of_frames(found=found, x_mm=WAVE, deviation_x_mm=WAVE), of_frames(x_mm=WAVE))
        figures = self.compared(*files)
        self.assertEqual(list(figures), ["x_mm"])
        self.assertEqual(figures["x_mm"]["only_second"], 1)

    def test_twice_the_frame_rate_takes_no_interpolation_and_another_one_does(self):
        times = [i / 30 for i in range(40)]
        at_rate = lambda rate, count: self.two(
            {"time_s": times, "x_mm": times},
            {"time_s": [i / rate for i in range(count)], "x_mm": [i / rate + 1 for i in range(count)]},
        )
        figure = self.compared(*at_rate(60, 79))["x_mm"]
        self.assertEqual((figure["both"], figure["interpolated"]), (40, None))
        files = at_rate(47, 60)
        figure = self.compared(*files)["x_mm"]
        self.assertEqual(figure["interpolated"], "second")
        self.assertAlmostEqual(max(abs(d - 1) for d in figure["difference"] if d is not None), 0, places=12)
        said = "note: the times differ: the second sequence was interpolated linearly at those of the first\n"
        self.assertIn(said, self.curves(*files))

    def test_seconds_count_only_where_both_know_them(self):
        slow = of_frames(time_s=[frame / 10 for frame in FRAMES], x_mm=WAVE)
        files = self.two(slow, of_frames(x_mm=WAVE))
        self.assertEqual(self.compared(*files)["x_mm"]["time_unit"], "frame")
        self.assertIn("note: only one of the two says at which second its frames are", self.curves(*files))
        said = "the seconds of its frames are not known in both; leave out --by seconds"
        self.refused(said, "curves", *files, "--by", "seconds")
        both = self.two(slow, {**slow, "time_s": [frame / 20 for frame in FRAMES]})
        self.assertEqual(self.compared(*both)["x_mm"]["time_unit"], "s")
        self.assertEqual(self.compared(*both, "--by", "frames")["x_mm"]["rms"], 0)

    def test_autoscopers_track_beside_a_folder_of_the_same(self):
        def track(folder, places_mm):
            row = lambda x: ",".join(["NaN"] * 16) if x is None else "1,0,0,%g,0,1,0,0,0,0,1,0,0,0,0,1" % x
            self.write(folder + "/bone.tra", "\n".join(map(row, places_mm)) + "\n")

        track("a", [1, 2, None, 4])
        track("b", [1.5, 2.5, 3.5, 4.5])
        figures = self.compared("a", "b")
        self.assertEqual([name for name in figures if name.endswith("mm")], ["bone.x_mm", "bone.y_mm", "bone.z_mm"])
        self.assertEqual(figures["bone.x_mm"]["difference"], [0.5, 0.5, None, 0.5])
        self.assertEqual(figures["bone.turn_z_deg"]["rms"], 0)

    def write_frames(self, folder, frames, name, unit, more=0):
        for frame in frames:
            values = (name, frame + more, unit)
            text = '{"metrics": [{"name": "%s", "value": %d, "unit": "%s"}]}' % values
            self.write("%s/joint/%04d.json" % (folder, frame), text)

    def test_figures_of_which_each_frame_has_a_file(self):
        for folder, more in (("a", 0), ("b", 3)):
            self.write_frames(folder, (1, 2, 4), "flexion_deg", "deg", more)
        figure = self.compared("a", "b")["joint.flexion_deg"]
        self.assertEqual((figure["at"], figure["difference"], figure["unit"]), ([1, 2, 4], [3, 3, 3], "deg"))
        self.assertIn(", without an interval;", figure["sentence"])
        for folder, unit in (("c", "mm"), ("d", "cm")):
            self.write_frames(folder, (1, 2), "gap", unit)
        self.refused("its unit is 'mm' in the first and 'cm' in the second", "curves", "c", "d")

    def test_the_files_hold_all_curves(self):
        files = self.two(of_frames(x_mm=WAVE), of_frames(x_mm=moved(1)))
        told = self.curves(*files, "--out", "out")
        self.assertTrue(told.endswith("out/report.html\n"), told)
        rows = self.csv("out/curves.csv")
        self.assertEqual([float(row["first"]) for row in rows], WAVE)
        self.assertEqual({(row["figure"], row["unit"], row["time_unit"]) for row in rows}, {("x_mm", "mm", "frame")})
        self.assertEqual(self.page_data()["over_time"]["sequences"][0]["figures"][0]["first"], WAVE)
        self.refused("out is not a new or empty folder; choose another with --out", "curves", *files, "--out", "out")

    def test_only_the_figures_that_are_wanted(self):
        files = self.two(*[of_frames(x_mm=WAVE, flexion_deg=WAVE)] * 2)
        self.assertEqual(list(self.compared(*files, "--figure", "flexion_deg")), ["flexion_deg"])
        said = "no figure over time that both have is called 'flexon_deg'; did you mean 'flexion_deg'?"
        self.refused(said, "curves", *files, "--figure", "flexon_deg")


class Faults(Curves):
    def test_what_cannot_be_compared(self):
        x = of_frames(x_mm=WAVE)
        odd = [value if frame % 2 else None for frame, value in zip(FRAMES, WAVE)]
        even = [None if frame % 2 else value for frame, value in zip(FRAMES, WAVE)]
        for first, second, said in (
            (
                *(of_frames(flexion_deg=WAVE), of_frames(flexon_deg=WAVE)),
                "a.csv and b.csv have no figure over time in common; the first has 'flexion_deg'; the second has "
                "'flexon_deg'; 'flexon_deg' of the second is near 'flexion_deg' of the first",
            ),
            (*(of_frames(x_mm=odd), of_frames(x_mm=even)), "there is no time at which both sequences have a value"),
            (
                *(x, {"frame": [frame + 100 for frame in FRAMES], "x_mm": WAVE}),
                "no figure of a.csv and b.csv could be compared; 'x_mm': the two sequences do not overlap: the first "
                "is from 1 to 40, the second from 101 to 140",
            ),
        ):
            with self.subTest(said):
                self.refused(said, "curves", *self.two(first, second))
        self.assertEqual(self.compared("a.csv", "b.csv", "--lag", "100")["x_mm"]["rms"], 0)
        self.refusals(
            ("a comparison over time takes two sequences or more", "curves", "a.csv"),
            ("there.csv: no such file or folder", "curves", "there.csv", "b.csv"),
        )
        self.write("c/marrow-comparison", "")
        self.refused("give the folders of two of its variants: c/cells/VARIANT", "curves", "c")

    def test_damaged_tables(self):
        self.table("b.csv", of_frames(x_mm=WAVE))
        for text, fault in (
            ("case,error\n1,2\n", "a.csv holds no sequence: no table (CSV) with a column 'frame' or 'time_s'"),
            ("frame,x_mm\n1,2\n3\n", "a.csv, line 3: it has 1 cells, and the header 2"),
            ("frame,x_mm\n2,2\n1,3\n", "a.csv, line 3, column 'frame': 1 does not come after 2"),
            ("frame,x_mm\none,2\n", "a.csv, line 2, column 'frame': 'one' is not a number"),
            ("frame,x_mm\n1,2\n", "the first sequence has 1 frame; a comparison over time needs at least two"),
        ):
            with self.subTest(fault):
                self.write("a.csv", text)
                self.refused(fault, "curves", "a.csv", "b.csv")


class Trials(Curves):
    def trial(self, run, values):
        self.table(run + "/outputs/joint.csv", of_frames(flexion_deg=values))
        self.write(run + "/run.json", '{"outputs": [{"name": "j", "files": ["outputs/joint.csv"]}]}')

    def test_runs_are_paired_by_their_names(self):
        for i in range(6):
            self.trial("before/t%d" % i, WAVE)
            more = 0.1 * (i - 2.5)
            self.trial("after/t%d" % i, [v + more + (5 if frame > 30 else 0) for frame, v in zip(FRAMES, WAVE)])
        self.trial("after/alone", WAVE)
        told = self.curves("before", "after")
        self.assertIn("note: the run alone is in the second folder only\n", told)
        self.assertIn("6 trials; the simultaneous band is without 0 at frames 31 to 40\n", told)
        (one,) = self.answer_of("before", "after")["trials"]
        self.assertEqual([curve["trial"] for curve in one["figures"][0]["curves"]], ["t%d" % i for i in range(6)])

    def test_repetitions_of_a_trial_count_once_and_few_trials_have_no_band(self):
        for name, more in (("t1/0", 1), ("t1/1", 3), ("t2/0", 8)):
            self.trial("a/" + name, WAVE)
            self.trial("b/" + name, moved(more))
        (one,) = self.answer_of("a", "b")["trials"]
        self.assertAlmostEqual(one["figures"][0]["bias"], 5)
        self.assertIsNone(one["figures"][0]["mean"])
        self.assertIn("; a band takes at least 6 trials", one["figures"][0]["sentence"])

    def test_folders_that_cannot_be_paired(self):
        self.trial("a/t1", WAVE)
        self.trial("b/t2", WAVE)
        self.refusals(
            ("no run of a has the name of one of b; the first has 't1', the second 't2'", "curves", "a", "b"),
            ("a holds several runs and b/t2 does not", "curves", "a", "b/t2"),
        )


if __name__ == "__main__":
    main()
