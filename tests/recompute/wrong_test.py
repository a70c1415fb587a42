# SPDX-License-Identifier: Apache-2.0
"""A figure of a run that is changed is found and named, and figures that cannot be recomputed are listed."""
import shutil

from recomputing import counts, different, recompute, recompute_all, run  # it finds the modules below
from harness.program import Case, main


def changed(path, before, after):
    """Replaces the first occurrence of a text in a file."""
    text = path.read_text()
    assert before in text, "%s holds no %s" % (path, before)
    path.write_text(text.replace(before, after, 1))


def with_other_number(path, key, factor):
    """Multiplies the number that follows a key, in JSON or YAML."""
    text = path.read_text()
    begin = text.index(key) + len(key)
    begin += next(k for k, letter in enumerate(text[begin:]) if letter in "-0123456789")
    end = begin + next(k for k, letter in enumerate(text[begin:]) if letter not in "-+.e0123456789")
    path.write_text(text[:begin] + repr(float(text[begin:end]) * factor) + text[end:])


class Wrong(Case):
    @classmethod
    def setUpClass(cls):
        cls.shared = cls.shared_folder()
        cls.made = run(cls.shared / "run", "femur/landmarks.yaml")

    def setUp(self):
        super().setUp()
        self.folder = self.scratch / "run"
        shutil.copytree(self.made, self.folder)
        self.outputs = self.folder / "outputs"

    def assert_found(self, *figures):
        code, said = recompute_all(self.folder)
        self.assertEqual(code, 1, said)
        self.assertEqual(different(said), set(figures), said)
        self.assertEqual(counts(said)[1], len(figures))
        return said

    def test_figures_of_each_kind_and_judgements(self):
        with_other_number(self.outputs / "errors/final.json", '"axial_deg",', 1.0001)
        with_other_number(self.outputs / "errors/start.json", '"mtre_mm",', 1.2)
        with_other_number(self.outputs / "at_landmarks.json", '"rms_mm",', 0.999)
        with_other_number(self.outputs / "projection.json", '"frontal_mpd_mm",', 1.5)
        with_other_number(self.outputs / "reprojection.json", '"lateral_mrpd_mm",', 0.5)
        with_other_number(self.outputs / "pose.yaml", "rotation_deg: [", 1.01)
        changed(self.outputs / "projection.json", '"mpd_px"', '"mpd_pixels"')  # one is left out, another is not known
        # The run's record has the right judgement and probability, which the file contradicts now.
        with_other_number(self.outputs / "verdict.yaml", "failure_probability:", 1.001)
        changed(self.outputs / "verdict.yaml", "judgement: trusted", "judgement: doubtful")
        said = self.assert_found(
            "errors.metrics/final axial_deg",
            "errors.metrics/start mtre_mm",
            "at_landmarks.metrics rms_mm",
            "projection.metrics frontal_mpd_mm",
            "projection.metrics mpd_px",
            "reprojection.metrics lateral_mrpd_mm",
            "pose.pose deviation_frontal_deg",
            "verdict.verdict failure_probability",
            "verdict.verdict judgement",
            "run.json/verdict failure_probability",
            "run.json/verdict judgement",
        )
        self.assertIn("not recomputed: projection.metrics: mpd_pixels: ", said)

    def test_a_figure_of_the_verdict_on_which_its_probability_rests(self):
        with_other_number(self.outputs / "verdict.yaml", 'name: "outline_part_mm", value:', 1.5)
        self.assert_found("verdict.verdict failure_probability")

    def test_another_pose(self):
        changed(self.outputs / "tracked.yaml", "  - [", "  - [0.001, 1, 2, 3]  # ")
        code, said = recompute_all(self.folder)
        self.assertEqual(code, 1, said)
        self.assertIn("tracked_errors.metrics rotation_deg", different(said))

    def test_what_cannot_be_recomputed_is_listed(self):
        code, said = recompute(self.folder)  # without the program
        self.assertEqual(code, 0, said)
        self.assertIn("not recomputed: errors.metrics/final: rotation_deg, ", said)
        self.assertIn(": no file holds pose.stages; give --marrow\n", said)
        self.assertGreater(counts(said)[2], 50)

    def test_nothing_recomputed_is_no_success(self):
        for name in [path.name for path in self.outputs.iterdir()]:
            path = self.outputs / name
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        (self.folder / "run.json").write_text('{"nodes": [], "outputs": [], "seed": 1}')
        code, said = recompute(self.folder)
        self.assertEqual(code, 1, said)
        self.assertIn("0 figures recomputed, 0 of them different; 0 not recomputed", said)


if __name__ == "__main__":
    main()
