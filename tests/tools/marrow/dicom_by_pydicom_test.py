# SPDX-License-Identifier: Apache-2.0
"""DICOM files that pydicom wrote in ways that libraries decode or few programs know: marrow's values are pydicom's."""
import copy
import io
import shutil
import subprocess
import unittest

from harness.program import main
from other_programs import DICOM, Reading, needs, numpy, pydicom

try:
    from PIL import Image, features
    from pydicom.dataset import Dataset, FileMetaDataset
    from pydicom.encaps import encapsulate
    from pydicom.pixel_data_handlers.util import apply_modality_lut
    from pydicom.sequence import Sequence

    HAS_JPEG_2000 = bool(features.check("jpg_2000"))
except ImportError:
    HAS_JPEG_2000 = False

EXPLICIT, DEFLATED, JPEG_2000 = "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.1.99", "1.2.840.10008.1.2.4.90"
CT, ENHANCED_CT, XA = "1.2.840.10008.5.1.4.1.1.2", "1.2.840.10008.5.1.4.1.1.2.1", "1.2.840.10008.5.1.4.1.1.12.1"
ENHANCED_XA = "1.2.840.10008.5.1.4.1.1.12.1.1"


def grey_levels(shape, seed, bits=12):
    return numpy.random.default_rng(seed).integers(0, 2**bits, shape).astype("u2")


def jpeg_2000(frame, boxed=False):
    """A codestream, or a JP2 file with one in its boxes. Pillow writes 16 bits, and 8 bits of colours."""
    out = io.BytesIO()
    Image.fromarray(frame).save(out, "JPEG2000", irreversible=False, no_jp2=not boxed)
    return out.getvalue()


def dicom(class_uid, modality, pixels, syntax=EXPLICIT, bits=16):
    """`pixels`: rows and columns, or frames before them."""
    data = Dataset()
    data.file_meta = FileMetaDataset()
    data.file_meta.TransferSyntaxUID = syntax
    data.file_meta.MediaStorageSOPClassUID = data.SOPClassUID = class_uid
    data.file_meta.MediaStorageSOPInstanceUID = data.SOPInstanceUID = "1.2.3.4"
    data.is_little_endian, data.is_implicit_VR = True, False
    data.Modality, data.SeriesInstanceUID = modality, "1.2.9"
    data.SamplesPerPixel, data.PhotometricInterpretation = 1, "MONOCHROME2"
    data.Rows, data.Columns = pixels.shape[-2:]
    data.BitsAllocated, data.BitsStored, data.HighBit, data.PixelRepresentation = 16, bits, bits - 1, 0
    if pixels.ndim == 3:
        data.NumberOfFrames = len(pixels)
    if syntax == JPEG_2000:
        data.PixelData = encapsulate([jpeg_2000(frame) for frame in (pixels if pixels.ndim == 3 else [pixels])])
        data["PixelData"].is_undefined_length = True
    else:
        data.PixelData = pixels.tobytes()
    return data


def item(**values):
    part = Dataset()
    for name, value in values.items():
        setattr(part, name, value)
    return part


def sequence(**values):
    return Sequence([item(**values)])


def table(first, entries, kind, bits=16):
    part = item(ModalityLUTType=kind)
    part.add_new(0x00283002, "US", [len(entries), first, bits])
    part.add_new(0x00283006, "OW", numpy.array(entries, "<u2").tobytes())
    return Sequence([part])


def of_xa(**values):
    """What an image says of its pixels' size, with further values."""
    return {"ImagerPixelSpacing": [0.3, 0.3], "PatientOrientation": ["R", "F"], **values}


@needs("pydicom", "numpy")
class Dicom(Reading):
    def written(self, data, name="x.dcm"):
        path = self.scratch / name
        path.parent.mkdir(exist_ok=True)
        data.save_as(path, write_like_original=False)
        return path

    def assert_image(self, data):
        """Values of a table are floats, which a PNG holds scaled."""
        path = self.written(data)
        read = pydicom.dcmread(path)
        if "ModalityLUTSequence" in read:
            return self.assert_scaled(self.image(path), apply_modality_lut(read.pixel_array, read))
        self.assertTrue((self.image(path) == read.pixel_array).all())

    def coded(self, code, **values):
        """An image of 53 x 37 pixels of 16 bits, with these bytes as its JPEG 2000."""
        data = dicom(XA, "XA", grey_levels((37, 53), 10, 16), JPEG_2000)
        data.PixelData = encapsulate([code])
        data["PixelData"].is_undefined_length = True
        for name, value in values.items():
            setattr(data, name, value)
        return self.written(data)

    @unittest.skipIf(not HAS_JPEG_2000, "not installed here: Pillow with JPEG 2000")
    def test_jpeg_2000(self):
        self.assert_image(dicom(XA, "XA", grey_levels((37, 53), 1, 16), JPEG_2000))
        pixels = grey_levels((37, 53), 11, 16)
        code = jpeg_2000(pixels, boxed=True)
        self.assertEqual(code[4:8], b"jP  ")
        self.assertTrue((self.image(self.coded(code)) == pixels).all())
        grey = jpeg_2000(grey_levels((37, 53), 12, 16))
        colours = jpeg_2000(grey_levels((37, 53, 3), 13, 8).astype("u1"))
        eight = {"BitsAllocated": 8, "BitsStored": 8, "HighBit": 7}
        with_colours = dict(eight, SamplesPerPixel=3, PhotometricInterpretation="YBR_RCT", PlanarConfiguration=0)
        for damaged, values, text in (
            (code.replace(b"jp2c", b"free"), {}, "no JPEG 2000 lies in the boxes of a JP2 file around the pixels"),
            (code[: code.index(b"jp2c") + 30], {}, "the compressed pixels end too early"),
            (
                *(code.replace(b"colr", b"pclr"), {}),
                "numbers of colours in a table (JP2 with a palette); convert it: gdcmconv",
            ),
            (colours, with_colours, "has 3 channels; an X-ray image has one: save it as grey levels"),
            (colours, eight, "the compressed pixels have 3 values each, the header says 1"),
            (grey[:6] + b"\x40\0" + grey[8:], {}, "are compressed by high-throughput JPEG 2000 (part 15)"),
            (grey[:6] + b"\x80\0" + grey[8:], {}, "are compressed by JPEG 2000 with extensions (part 2)"),
        ):
            with self.subTest(text):
                self.assertIn(text, self.refused("read.image", self.coded(damaged, **values)))

    def test_deflated(self):
        self.assert_image(dicom(XA, "XA", grey_levels((37, 53), 2), DEFLATED))

    def test_a_table_of_values(self):
        for first, count in ((0, 4096), (100, 512), (-5, 300)):
            with self.subTest(first=first, count=count):
                data = dicom(XA, "XA", grey_levels((37, 53), 3), bits=12 if first >= 0 else 16)
                entries = numpy.round(60000 * numpy.linspace(0, 1, count) ** 2)
                data.ModalityLUTSequence = table(max(first, 0), entries, "US")
                if first < 0:
                    data.PixelRepresentation = 1
                    data.ModalityLUTSequence[0].add_new(0x00283002, "SS", [count, first, 16])
                self.assert_image(data)

    def test_logarithms_with_the_table_that_makes_them_linear(self):
        data = dicom(XA, "XA", grey_levels((37, 53), 4), bits=12)
        data.PixelIntensityRelationship, data.PixelIntensityRelationshipSign = "LOG", 1
        data.ModalityLUTSequence = table(0, numpy.exp(numpy.arange(4096) / 4096 * 11).astype("u2"), "US")
        self.assert_image(data)

    def enhanced_xa(self, pixels, syntax=EXPLICIT, relation="LIN"):
        """Each frame from another side, and its geometry in functional groups."""
        data = dicom(ENHANCED_XA, "XA", pixels, syntax, bits=16 if syntax == JPEG_2000 else 12)
        geometry = item(DistanceSourceToDetector=1200.0)
        geometry.add_new(0x00189402, "FL", 780.0)
        grey = sequence(PixelIntensityRelationship=relation, PixelIntensityRelationshipSign=1)
        shared = sequence(XRayGeometrySequence=Sequence([geometry]), FramePixelDataPropertiesSequence=grey)
        side = lambda k: sequence(PositionerPrimaryAngle=5.0 * k, PositionerSecondaryAngle=2.0 * k)
        frames = Sequence([item(PositionerPositionSequence=side(k)) for k in range(len(pixels))])
        of_file = of_xa(SharedFunctionalGroupsSequence=shared, PerFrameFunctionalGroupsSequence=frames)
        for name, value in of_file.items():
            setattr(data, name, value)
        return data

    def test_an_enhanced_xa(self):
        """Each frame is pydicom's, and its camera that of a plain file with the same angles and distances."""
        pixels = grey_levels((3, 37, 53), 14)
        for syntax in (EXPLICIT, DEFLATED) + ((JPEG_2000,) if HAS_JPEG_2000 else ()):
            file = self.written(self.enhanced_xa(pixels, syntax))
            self.assertIn("has 3 frames; name one with frame (from 1)", self.refused("read.image", file))
            for k, frame in enumerate(pydicom.dcmread(file).pixel_array):
                with self.subTest(syntax=syntax, frame=k + 1):
                    self.assertTrue((self.image(file, ", frame: %d" % (k + 1)) == frame).all())
        plain = dicom(XA, "XA", pixels[2], bits=12)
        angles = {"PositionerPrimaryAngle": 10, "PositionerSecondaryAngle": 4}
        for name, value in of_xa(DistanceSourceToDetector=1200, DistanceSourceToPatient=780, **angles).items():
            setattr(plain, name, value)
        enhanced = self.camera(self.written(self.enhanced_xa(pixels)), frame=3)
        self.assertEqual(enhanced, self.camera(self.written(plain), frame=1))
        self.assertNotEqual(enhanced, self.camera(self.written(self.enhanced_xa(pixels)), frame=2))

    def camera(self, file, frame):
        node = "  it: {uses: camera.dicom, with: {paths: ['%s'], names: [a], frame: %d}}\n" % (file, frame)
        pipeline = self.write("camera.yaml", "marrow: 1\nnodes:\n" + node + "outputs: {it: it}\n")
        shutil.rmtree(self.scratch / "cameras", ignore_errors=True)
        self.expect(0, "run", pipeline, "--out", "cameras", "--quiet")
        return self.read("cameras/outputs/it/a.yaml")

    def test_logarithms_of_an_enhanced_xa(self):
        """The table TO_LINEAR of its PixelIntensityRelationshipLUTSequence makes them linear; TO_LOG does not count."""
        pixels = grey_levels((2, 37, 53), 15)
        data = self.enhanced_xa(pixels, relation="LOG")
        said = self.refused("read.image", self.written(data), ", frame: 2")
        without = "its values are logarithms (PixelIntensityRelationship (0028,1040) is LOG) without the table"
        self.assertIn(without, said)
        to_linear = numpy.exp(numpy.arange(4096) / 4096 * 11).astype("u2")
        tables = {"TO_LOG": (numpy.log1p(numpy.arange(4096)) * 5000).astype("u2"), "TO_LINEAR": to_linear}
        for functions, text in (
            (["TO_LOG"], "without the table"),
            (["TO_LOG", "TO_LINEAR"], None),
            (["TO_LOG", "TO_LINEAR", "TO_LINEAR"], "TO_LINEAR stands twice (LUTFunction (0028,9474))"),
        ):
            items = [table(0, tables[function], "", 16)[0] for function in functions]
            for part, function in zip(items, functions):
                part.LUTFunction = function
                del part.ModalityLUTType
            data.SharedFunctionalGroupsSequence[0].PixelIntensityRelationshipLUTSequence = Sequence(items)
            file = self.written(data)
            with self.subTest(tables=len(functions)):
                if text:
                    self.assertIn(text, self.refused("read.image", file, ", frame: 2"))
                else:
                    self.assert_scaled(self.image(file, ", frame: 2"), to_linear[pixels[1]])

    def enhanced(self, pixels, syntax):
        data = dicom(ENHANCED_CT, "CT", pixels, syntax)
        measures = sequence(PixelSpacing=[0.75, 0.5], SliceThickness=1.5)
        orientation = sequence(ImageOrientationPatient=[1, 0, 0, 0, 1, 0])
        shared = {"PixelMeasuresSequence": measures, "PlaneOrientationSequence": orientation}
        data.SharedFunctionalGroupsSequence = sequence(**shared)
        # From above to below, and each frame with a slope of its own.
        place = lambda k: sequence(ImagePositionPatient=[10, -20, 100 - 1.5 * k])
        value = lambda k: sequence(RescaleIntercept=-1024 - k, RescaleSlope=1 + k / 8, RescaleType="HU")
        frame = lambda k: item(PlanePositionSequence=place(k), PixelValueTransformationSequence=value(k))
        data.PerFrameFunctionalGroupsSequence = Sequence(map(frame, range(len(pixels))))
        return data

    def test_an_enhanced_ct(self):
        pixels = grey_levels((5, 11, 9), 5)
        expected = [frame * (1 + k / 8) - 1024 - k for k, frame in enumerate(pixels.astype(float))][::-1]
        for syntax in (EXPLICIT, DEFLATED) + ((JPEG_2000,) if HAS_JPEG_2000 else ()):
            file = self.written(self.enhanced(pixels, syntax), "ct/x.dcm")
            self.assertTrue((pydicom.dcmread(file).pixel_array == pixels).all())
            for path in (file, file.parent):
                with self.subTest(syntax=syntax, path=path.name):
                    values, keys = self.volume(path)
                    self.assertLess(float(numpy.abs(values - expected).max()), 1e-3)
                    self.assertEqual(keys["ElementSpacing"].split(), ["0.5", "0.75", "1.5"])
                    self.assertEqual([float(x) for x in keys["Offset"].split()], [10, -20, 94])

    def test_frames_without_places_are_refused(self):
        data = dicom(ENHANCED_CT, "CT", grey_levels((5, 11, 9), 6))
        said = self.refused("read.volume", self.written(data, "ct/x.dcm").parent / "x.dcm")
        self.assertIn("does not say where its frames lie (PerFrameFunctionalGroupsSequence is missing)", said)

    def slices(self, pixels, places, **values):
        for k, (frame, place) in enumerate(zip(pixels, places)):
            data = dicom(CT, "CT", frame)
            data.ImagePositionPatient, data.ImageOrientationPatient = [float(x) for x in place], [1, 0, 0, 0, 1, 0]
            data.PixelSpacing = [0.5, 0.5]
            data.RescaleSlope, data.RescaleIntercept = 1, -1024
            for name, value in values.items():
                setattr(data, name, value)
            path = self.written(data, "ct/%d.dcm" % k)
        return path.parent

    def test_a_table_of_hounsfield_units(self):
        pixels = grey_levels((3, 11, 9), 7)
        entries = (numpy.arange(4096) // 2).tolist()
        folder = self.slices(pixels, [(0, 0, k) for k in range(3)], ModalityLUTSequence=table(0, entries, "HU"))
        self.assertTrue((self.volume(folder)[0] == pixels // 2).all())
        self.slices(pixels, [(0, 0, k) for k in range(3)], ModalityLUTSequence=table(0, entries, "OD"))
        said = self.refused("read.volume", folder)
        self.assertIn("no Hounsfield units: ModalityLUTType (0028,3004) is 'OD', expected HU", said)

    def test_a_tilted_gantry_is_straightened(self):
        """Whole pixels are exact. Others lie between their neighbours as numpy interpolates them."""
        pixels = grey_levels((6, 11, 9), 8)
        for step_mm in (1.0, -1.0, 0.3, -0.3):  # 2 or 0.6 pixels a slice
            with self.subTest(step_mm=step_mm):
                folder = self.slices(pixels, [(0, step_mm * k, 2 * k) for k in range(6)])
                values, keys = self.volume(folder)
                rows = numpy.arange(values.shape[1]) * 0.5 + float(keys["Offset"].split()[1])
                self.assertEqual(values.shape[2], 9)
                for k, frame in enumerate(pixels.astype(float) - 1024):
                    padded = numpy.vstack([[-1000] * 9, frame, [-1000] * 9])
                    own = step_mm * k + 0.5 * numpy.arange(-1, 12)
                    expected = numpy.stack(
                        [numpy.interp(rows, own, padded[:, u], left=-1000, right=-1000) for u in range(9)], axis=1
                    )
                    self.assertLess(float(numpy.abs(values[k] - expected).max()), 0.01)
                    inside = (rows >= own[1]) & (rows <= own[-2])
                    self.assertGreaterEqual(int(inside.sum()), 10, "no row is lost")

    @unittest.skipIf(not shutil.which("dcmcjpls"), "not installed here: dcmcjpls and dcmcjpeg (dcmtk)")
    def test_what_dcmtk_compresses_is_what_dcmtk_decompresses(self):
        data = dicom(XA, "XA", grey_levels((37, 53), 9), bits=12)
        data.PatientID, data.StudyInstanceUID = "1", "1.2.8"
        plain, packed, raw = self.written(data), self.scratch / "packed.dcm", self.scratch / "raw.dcm"
        for compress, decompress in (
            (["dcmcjpls", "+en", "+md", "3"], "dcmdjpls"),
            (["dcmcjpls"], "dcmdjpls"),
            (["dcmcjpeg", "+ee"], "dcmdjpeg"),
            (["dcmcjpeg", "+el", "+sv", "5"], "dcmdjpeg"),
            (["dcmcrle"], "dcmdrle"),
        ):
            with self.subTest(compress=compress):
                subprocess.run(compress + [str(plain), str(packed)], check=True, capture_output=True)
                subprocess.run([decompress, str(packed), str(raw)], check=True, capture_output=True)
                self.assertTrue((self.image(packed) == pydicom.dcmread(raw).pixel_array).all())


# A CT among the files that lie beside it in real folders: pydicom's test files. The right volume is the one that
# pydicom reads from the slices. What is not installed is skipped, and said so.
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
