# SPDX-License-Identifier: Apache-2.0
"""A CT among the files that lie beside it in real folders: pydicom's test files. The right volume is the one that
pydicom reads from the slices. What is not installed is skipped, and said so."""
import copy
import shutil

from harness.program import main
from other_programs import DICOM, Reading, needs, numpy, pydicom

NO_CT = (
    "dicomdirtests/DICOMDIR",
    "ExplVR_BigEndNoMeta.dcm",
    "MR_small_jp2klossless.dcm",
    "SC_rgb_rle.dcm",
    "image_dfl.dcm",
    "liver_1frame.dcm",
    "rtdose.dcm",
    "rtplan.dcm",
    "rtstruct.dcm",
    "test-SR.dcm",
    "waveform_ecg.dcm",
)


@needs("pydicom", "numpy")
class DicomFolder(Reading):
    def setUp(self):
        super().setUp()
        self.ct = self.scratch / "ct"
        self.ct.mkdir()
        one = pydicom.dcmread(DICOM / "CT_small.dcm")
        one.SeriesInstanceUID = pydicom.uid.generate_uid(entropy_srcs=["ct"])
        for number in range(4):
            slice_ = copy.deepcopy(one)
            slice_.ImagePositionPatient = [0, 0, 2.5 * number]
            slice_.PixelData = (one.pixel_array + number).astype("<i2").tobytes()
            slice_.save_as(self.ct / ("IM%d" % number))
        self.series = str(one.SeriesInstanceUID)
        stored = numpy.stack([one.pixel_array + number for number in range(4)])
        self.expected = stored * float(one.RescaleSlope) + float(one.RescaleIntercept)

    def check(self, options, *names):
        values, keys = self.volume(self.ct, options)
        self.assertEqual(float(numpy.abs(values - self.expected).max()), 0)
        self.assertEqual(float(keys["ElementSpacing"].split()[2]), 2.5)
        lines = [line for line in (self.scratch / "out" / "log.txt").read_text().splitlines() if "passed over" in line]
        self.assertEqual(len(lines), 1, lines)
        for name in names:
            self.assertIn(name, lines[0])

    def test_objects_of_other_kinds_are_passed_over(self):
        for name in NO_CT:
            shutil.copy(DICOM / name, self.ct / name.replace("/", "-").replace("DICOMDIR", "DIRFILE"))
        self.check(
            "",
            "dicomdirtests-DIRFILE (a media directory)",
            "rtstruct.dcm (RTSTRUCT)",
            "rtplan.dcm (RTPLAN)",
            "test-SR.dcm (SR)",
            "liver_1frame.dcm (SEG)",
        )

    def test_the_named_series_is_read_among_all_test_files_of_pydicom(self):
        names = []
        for path in DICOM.glob("*.dcm"):
            if path.name not in ("meta_missing_tsyntax.dcm", "no_meta.dcm"):  # they do not say what they are
                shutil.copy(path, self.ct)
                names.append(path.name)
        self.assertGreater(len(names), 50)
        self.check(", series_uid: '%s'" % self.series)
        result, _ = self.run_node("read.volume", "", self.ct)
        self.assertEqual(result.returncode, 1)
        self.assertIn("series; name one with series_uid:", result.stderr)
        self.assertIn(self.series + " (CT, 4 slices", result.stderr)
        self.assertNotIn("(MR, ", result.stderr)


if __name__ == "__main__":
    main()
