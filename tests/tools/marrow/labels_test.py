# SPDX-License-Identifier: Apache-2.0
"""read.labels on files as nibabel, pydicom, 3D Slicer and TotalSegmentator write them, against what was put in."""
import gzip
import struct
import unittest

from harness import SOURCE
from harness.program import main, marrow
from other_programs import Reading, needs, nibabel, numpy, pydicom, read_mha

SIZE = (12, 10, 8)
TOTALSEGMENTATOR = (
    '<?xml version="1.0" encoding="UTF-8"?> <CaretExtension> <VolumeInformation Index="0"> <LabelTable>\n'
    '<Label Key="2" Red="0.1" Green="0.2" Blue="0.3" Alpha="1"><![CDATA[tibia]]></Label>\n'
    '<Label Key="5" Red="0.1" Green="0.2" Blue="0.3" Alpha="1"><![CDATA[fibula]]></Label>\n'
    "</LabelTable> </VolumeInformation></CaretExtension>"
)


def labels():
    """Two boxes, indexed x, y, z: label 2 in the middle, label 5 at an end of the grid."""
    values = numpy.zeros(SIZE, numpy.uint8)
    values[4:7, 3:6, 3:5] = 2
    values[0:2, 0:3, 0:2] = 5
    return values


def marked(file):
    """The places (mm, LPS) of all voxels inside, sorted."""
    values, keys = read_mha(file)
    axes = numpy.array(keys["TransformMatrix"].split(), float).reshape(3, 3)
    spacing = numpy.array(keys["ElementSpacing"].split(), float)
    origin = numpy.array(keys["Offset"].split(), float)
    index = numpy.argwhere(values == 1)[:, ::-1]
    assert set(numpy.unique(values)) <= {0, 1}
    return in_order(origin + (index * spacing) @ axes)


def in_order(points):
    points = numpy.round(points, 4) + 0.0
    return points[numpy.lexsort(points.T)]


def places(values, label, affine):
    """The same from the array and the matrix that maps its indices to LPS."""
    index = numpy.argwhere(values == label)
    return in_order(index @ affine[:3, :3].T + affine[:3, 3])


# Turned about z, mirrored in one axis, with voxels that are no cubes: LPS from index.
AFFINE = numpy.array([[0, -1.5, 0, 10], [0.8, 0, 0, -20], [0, 0, 2, 30], [0, 0, 0, 1]], float)
MIRRORED = AFFINE @ numpy.diag([1, -1, 1, 1])


def nrrd(values, affine, notes="", kinds="domain domain domain", layers=None, space="left-posterior-superior"):
    """`values` is indexed x, y, z, or layer, x, y, z."""
    vectors = " ".join("(%s)" % ",".join(map(repr, map(float, affine[:3, k]))) for k in range(3))
    sizes = " ".join(map(str, values.shape))
    header = (
        "NRRD0004\ntype: unsigned char\ndimension: %d\nspace: %s\nsizes: %s\nspace directions: %s%s\nkinds: %s\n"
        "encoding: gzip\nspace origin: (%s)\n%s\n"
        % (
            *(values.ndim, space, sizes, "none " if layers else "", vectors, "list " + kinds if layers else kinds),
            *(",".join(map(repr, map(float, affine[:3, 3]))), notes),
        )
    )
    return header.encode() + gzip.compress(values.tobytes(order="F"))


def segment_note(number, name, label, layer):
    return "Segment%d_ID:=Segment_%d\nSegment%d_Name:=%s\nSegment%d_LabelValue:=%d\nSegment%d_Layer:=%d\n" % (
        *(number, number + 1, number, name, number, label),
        *(number, layer),
    )


@needs("numpy")
class Labels(Reading):
    def masks(self, file, options=""):
        result, out = self.run_node("read.labels", options, file)
        self.assertEqual(result.returncode, 0, "%s: %s" % (file, result.stderr))
        return {path.stem: path for path in (out / "it").glob("*.mha")}, result.stderr

    def expect(self, file, name, label, affine=AFFINE, values=None, options=""):
        masks, _ = self.masks(file, options)
        self.assertIn(name, masks)
        expected = places(labels() if values is None else values, label, affine)
        numpy.testing.assert_allclose(marked(masks[name]), expected, atol=2e-3)

    def put(self, name, data):
        (self.scratch / name).write_bytes(data)
        return self.scratch / name

    def nifti(self, name="labels.nii.gz", names="", affine=AFFINE, values=None):
        image = nibabel.Nifti1Image(labels() if values is None else values, numpy.diag([-1, -1, 1, 1]) @ affine)
        if names:
            image.header.extensions.append(nibabel.nifti1.Nifti1Extension(0, names.encode()))
        nibabel.save(image, self.scratch / name)
        return self.scratch / name


class Formats(Labels):
    @needs("nibabel")
    def test_nifti_by_number(self):
        for affine in (AFFINE, MIRRORED):
            file = self.nifti(affine=affine)
            self.expect(file, "tibia", 2, affine, options=", labels: ['2', '5'], fragments: [tibia, fibula]")
            self.expect(file, "label 5", 5, affine)

    @needs("nibabel")
    def test_nifti_with_names_of_totalsegmentator(self):
        for name in ("labels.nii.gz", "labels.nii"):
            file = self.nifti(name, TOTALSEGMENTATOR)
            self.expect(file, "fibula", 5, options=", labels: [fibula]")
            self.assertEqual(sorted(self.masks(file)[0]), ["fibula", "tibia"])

    @needs("nibabel")
    def test_a_name_of_totalsegmentator_in_a_file_without_names(self):
        values = labels()
        values[values == 5] = 75
        file = self.nifti(values=values)
        self.expect(file, "hip", 75, values=values, options=", labels: [femur_left], fragments: [hip]")
        pipeline = "marrow: 1\nnodes: {it: {uses: read.labels, with: {path: %s, labels: [tibia]}}}\noutputs: {it: it}\n"
        result = marrow("run", self.write("p.yaml", pipeline % file), "--out", self.scratch / "warned")
        self.assertIn(
            "does not name its labels, and 'tibia' is 2 where TotalSegmentator's task appendicular_bones made it; this "
            "label is taken: give its number where another program made the file",
            result.stderr,
        )

    @needs("nibabel")
    def test_the_table_of_totalsegmentator(self):
        """Ends of its runs of numbers, from totalsegmentator/map_to_binary.py of version 2."""
        table = {
            **{"sacrum": 25, "vertebrae_S1": 26, "vertebrae_L5": 27, "vertebrae_L1": 31, "vertebrae_T12": 32},
            **{"vertebrae_T1": 43, "vertebrae_C7": 44, "vertebrae_C1": 50, "humerus_left": 69, "scapula_right": 72},
            **{"clavicula_left": 73, "femur_right": 76, "hip_left": 77, "hip_right": 78, "skull": 91, "rib_left_1": 92},
            **{"rib_left_12": 103, "rib_right_1": 104, "rib_right_12": 115, "sternum": 116, "costal_cartilages": 117},
            **{"patella": 1, "fibula": 3, "tarsal": 4, "ulna": 7, "radius": 8, "metacarpal": 10, "phalanges_hand": 11},
        }
        values = numpy.zeros(SIZE, numpy.uint8)
        for i, number in enumerate(table.values()):
            values[i % SIZE[0], i // SIZE[0], 2] = number
        names = ", ".join(table)
        masks, _ = self.masks(self.nifti(values=values), ", labels: [%s], fragments: [%s]" % (names, names))
        for name, number in table.items():
            numpy.testing.assert_allclose(marked(masks[name]), places(values, number, AFFINE), atol=2e-3)

    def test_nrrd(self):
        self.expect(self.put("a.nrrd", nrrd(labels(), AFFINE)), "label 2", 2)
        ras = numpy.diag([-1, -1, 1, 1]) @ AFFINE
        self.expect(self.put("a.nrrd", nrrd(labels(), ras, space="right-anterior-superior")), "label 5", 5)

    def test_segments_of_slicer_that_overlap_in_layers(self):
        other = numpy.zeros(SIZE, numpy.uint8)
        other[5:9, 4:8, 2:6] = 1
        notes = segment_note(0, "tibia", 2, 0) + segment_note(1, "fibula", 5, 0) + segment_note(2, "talus", 1, 1)
        file = self.put("a.seg.nrrd", nrrd(numpy.stack([labels(), other]), AFFINE, notes, layers=2))
        self.expect(file, "tibia", 2)
        self.expect(file, "talus", 1, values=other)
        self.expect(file, "bone", 5, options=", labels: [fibula], fragments: [bone]")
        self.assertEqual(sorted(self.masks(file)[0]), ["fibula", "talus", "tibia"])
        mirrored = self.put("b.seg.nrrd", nrrd(numpy.stack([labels(), other]), MIRRORED, notes, layers=2))
        self.expect(mirrored, "talus", 1, MIRRORED, other)

    def test_one_segment_a_layer_as_slicer_wrote_before_layers(self):
        parts = numpy.stack([labels() == 2, labels() == 5]).astype(numpy.uint8)
        notes = "Segment0_ID:=a\nSegment0_Name:=tibia\nSegment1_ID:=b\nSegment1_Name:=fibula\n"
        self.expect(self.put("a.seg.nrrd", nrrd(parts, AFFINE, notes, layers=2)), "fibula", 5)

    def test_metaimage(self):
        header = (
            "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nTransformMatrix = 0 1 0 "
            "-1 0 0 0 0 1\nOffset = 10 -20 30\nElementSpacing = 0.8 1.5 2\nDimSize = 12 10 8\nElementType = MET_UCHAR\n"
            "ElementDataFile = LOCAL\n"
        )
        self.expect(self.put("a.mha", header.encode() + labels().tobytes(order="F")), "label 2", 2)

    @unittest.skipUnless((SOURCE / "../shared/data/pelvis_dicom").is_dir(), "the real data are not on this machine")
    @needs("nibabel")
    def test_a_real_slice_has_the_voxels_that_nibabel_sees(self):
        file = SOURCE / "../shared/data/pelvis_dicom/slice_1000_segmentation.nii.gz"
        image = nibabel.load(file)
        affine = numpy.diag([-1, -1, 1, 1]) @ image.affine
        values = numpy.asarray(image.dataobj)
        label = int(values.max())
        masks, _ = self.masks(file)
        numpy.testing.assert_allclose(marked(masks["label %d" % label]), places(values, label, affine), atol=2e-3)


@needs("numpy", "pydicom")
class DicomSegmentation(Labels):
    """Frames in LPS, one a slice and segment, as highdicom and dcmqi write them."""

    def segmentation(self, name, masks, kind="BINARY", names=("tibia", "fibula"), change=lambda data: None):
        from pydicom.dataset import Dataset, FileMetaDataset
        from pydicom.sequence import Sequence

        data = Dataset()
        data.SOPClassUID = "1.2.840.10008.5.1.4.1.1.66.4"
        data.SOPInstanceUID = "1.2.3"
        data.Modality = "SEG"
        data.SegmentationType = kind
        data.Rows, data.Columns = SIZE[1], SIZE[0]
        data.SamplesPerPixel, data.PhotometricInterpretation, data.PixelRepresentation = 1, "MONOCHROME2", 0
        bits = 1 if kind == "BINARY" else 8
        data.BitsAllocated, data.BitsStored, data.HighBit = bits, bits, bits - 1
        if kind == "FRACTIONAL":
            data.MaximumFractionalValue = 200
        data.SegmentSequence = Sequence()
        for number, segment in enumerate(names, 1):
            item = Dataset()
            item.SegmentNumber, item.SegmentLabel = number, segment
            data.SegmentSequence.append(item)
        shared, orientation, measures = Dataset(), Dataset(), Dataset()
        orientation.ImageOrientationPatient = [0, 1, 0, -1, 0, 0]
        measures.PixelSpacing, measures.SliceThickness, measures.SpacingBetweenSlices = [1.5, 0.8], 2, 2
        shared.PlaneOrientationSequence, shared.PixelMeasuresSequence = Sequence([orientation]), Sequence([measures])
        data.SharedFunctionalGroupsSequence = Sequence([shared])
        data.PerFrameFunctionalGroupsSequence, frames = Sequence(), []
        for number, mask in enumerate(masks, 1):
            for z in range(SIZE[2]):
                if not mask[:, :, z].any():
                    continue  # frames that would be empty are not written
                frame, position, segment = Dataset(), Dataset(), Dataset()
                position.ImagePositionPatient = [10, -20, 30 + 2 * z]
                segment.ReferencedSegmentNumber = number
                frame.PlanePositionSequence = Sequence([position])
                frame.SegmentIdentificationSequence = Sequence([segment])
                data.PerFrameFunctionalGroupsSequence.append(frame)
                frames.append(mask[:, :, z].T)
        data.NumberOfFrames = len(frames)
        pixels = numpy.stack(frames).astype(numpy.uint8)
        data.PixelData = (
            numpy.packbits(pixels.ravel(), bitorder="little").tobytes() if bits == 1 else (pixels * 180).tobytes()
        )
        data.PixelData += b"\0" * (len(data.PixelData) % 2)
        change(data)
        data.file_meta = FileMetaDataset()
        data.file_meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
        data.file_meta.MediaStorageSOPClassUID = data.SOPClassUID
        data.file_meta.MediaStorageSOPInstanceUID = data.SOPInstanceUID
        data.is_little_endian, data.is_implicit_VR = True, False
        data.save_as(self.scratch / name, write_like_original=False)
        return self.scratch / name

    def label_map(self, name, bits=8, change=lambda data: None):
        """The type LABELMAP: a frame a slice, whose pixels are the numbers of segments; 0 is background."""
        from pydicom.dataset import Dataset

        def as_label_map(data):
            data.SOPClassUID = "1.2.840.10008.5.1.4.1.1.66.7"
            data.BitsAllocated, data.BitsStored, data.HighBit = bits, bits, bits - 1
            data.PixelPaddingValue = 0
            background = Dataset()
            background.SegmentNumber, background.SegmentLabel = 0, "Background"
            data.SegmentSequence.insert(0, background)
            for frame in data.PerFrameFunctionalGroupsSequence:
                del frame.SegmentIdentificationSequence
            numbers = numpy.where(labels() == 5, 2, labels() == 2).astype(numpy.uint8 if bits == 8 else "<u2")
            used = [z for z in range(SIZE[2]) if numbers[:, :, z].any()]
            data.PixelData = b"".join(numbers[:, :, z].T.tobytes() for z in used)
            data.PixelData += b"\0" * (len(data.PixelData) % 2)
            change(data)

        return self.segmentation(name, [labels() > 0], "LABELMAP", change=as_label_map)

    def boxes(self):
        return [labels() == 2, labels() == 5]

    def test_label_maps(self):
        for bits in (8, 16):
            file = self.label_map("a.dcm", bits)
            self.expect(file, "tibia", 2)
            self.expect(file, "bone", 5, options=", labels: ['2'], fragments: [bone]")
            self.assertEqual(sorted(self.masks(file)[0]), ["fibula", "tibia"])

    def test_label_maps_that_are_refused(self):
        def twice(data):
            frames = data.PerFrameFunctionalGroupsSequence
            frames[1].PlanePositionSequence = frames[0].PlanePositionSequence

        def in_colour(data):
            data.PhotometricInterpretation = "PALETTE COLOR"

        def unlisted(data):
            del data.SegmentSequence[2]

        for change, expected in ((twice, "frames 1 and 2 show the same slice"), (in_colour, "PALETTE COLOR")):
            self.assertIn(expected, self.refused("read.labels", self.label_map("a.dcm", change=change)))
        self.expect(self.label_map("a.dcm", change=unlisted), "label 2", 5)

    def test_bits_by_name_and_number(self):
        file = self.segmentation("a.dcm", self.boxes())
        self.expect(file, "tibia", 2)
        self.expect(file, "bone", 5, options=", labels: ['2'], fragments: [bone]")

    def test_segments_that_overlap(self):
        other = numpy.zeros(SIZE, bool)
        other[5:9, 4:8, 2:6] = True
        file = self.segmentation("a.dcm", [labels() == 2, other])
        self.expect(file, "tibia", 2)
        self.expect(file, "fibula", 1, values=other.astype(int))

    def test_fractions_and_a_folder(self):
        (self.scratch / "seg").mkdir()
        self.segmentation("seg/a.dcm", self.boxes(), "FRACTIONAL")
        self.expect(self.scratch / "seg", "fibula", 5)

    def test_what_is_refused(self):
        def moved(data):
            data.PerFrameFunctionalGroupsSequence[1].PlanePositionSequence[0].ImagePositionPatient = [10.5, -20, 38]

        def cut(data):
            data.PixelData = data.PixelData[:20]

        def unknown(data):
            data.SegmentationType = "OTHER"

        for change, expected in (
            (moved, "frame 2 lies 0.50 mm beside the even grid of the others"),
            (cut, "it ends in the pixels of frame"),
            (unknown, "SegmentationType (0062,0001) is 'OTHER'; expected BINARY, FRACTIONAL or LABELMAP"),
        ):
            self.assertIn(
                expected, self.refused("read.labels", self.segmentation("a.dcm", self.boxes(), change=change))
            )
        (self.scratch / "two").mkdir()
        for name in ("two/a.dcm", "two/b.dcm"):
            self.segmentation(name, self.boxes())
        self.assertIn(
            "two: holds 2 segmentations ('a.dcm', 'b.dcm')", self.refused("read.labels", self.scratch / "two")
        )


class Faults(Labels):
    def said(self, file, labels):
        return self.refused("read.labels", file, ", labels: %s" % labels)

    def test_a_label_that_is_not_there(self):
        notes = segment_note(0, "tibia", 2, 0) + segment_note(1, "fibula", 5, 0)
        file = self.put("a.seg.nrrd", nrrd(labels(), AFFINE, notes))
        self.assertIn(
            "has no segment 'tibai'; did you mean 'tibia'? it has 2 'tibia', 5 'fibula'", self.said(file, "[tibai]")
        )
        self.assertIn("has no label 3; it has 2 'tibia', 5 'fibula'", self.said(file, "['3']"))
        plain = self.put("a.nrrd", nrrd(labels(), AFFINE))
        self.assertIn("has no label 3; it has 2, 5", self.said(plain, "['3']"))
        self.assertIn(
            "does not name its labels, and 'femur_lef' is no bone of TotalSegmentator's tables; did you mean "
            "'femur_left'? give its number; the file has the labels 2, 5",
            self.said(plain, "[femur_lef]"),
        )
        self.assertIn(
            "'femur_left' is 75 where TotalSegmentator's task total made it, which it lacks; it has the labels 2, 5",
            self.said(plain, "[femur_left]"),
        )

    def test_segments_that_cannot_be_told_apart(self):
        notes = segment_note(0, "bone", 2, 0) + segment_note(1, "bone", 5, 0)
        file = self.put("a.seg.nrrd", nrrd(labels(), AFFINE, notes))
        self.assertIn("2 segments are called bone: 2 'bone', 5 'bone'; rename them", self.said(file, "[bone]"))
        self.assertIn("two segments are named 'bone'", self.refused("read.labels", file))

    def test_a_segment_without_a_voxel(self):
        notes = segment_note(0, "tibia", 2, 0) + segment_note(1, "talus", 7, 0)
        file = self.put("a.seg.nrrd", nrrd(labels(), AFFINE, notes))
        self.assertIn("its header lists the segment 7 'talus', but no voxel is of it", self.said(file, "[talus]"))

    def test_a_segment_on_a_layer_that_is_not_there(self):
        file = self.put("a.seg.nrrd", nrrd(labels(), AFFINE, segment_note(0, "tibia", 2, 3)))
        self.assertIn(
            "puts the segment 'tibia' to the layer 3 with the label 2, but there are 1 layers",
            self.refused("read.labels", file),
        )

    def test_what_is_no_label_map(self):
        empty = self.put("empty.nrrd", nrrd(labels() * 0, AFFINE))
        self.assertIn("all its voxels are 0, so it marks nothing", self.refused("read.labels", empty))
        header = nrrd(labels(), AFFINE).split(b"\n\n")[0].replace(b"unsigned char", b"float") + b"\nendian: little"
        values = struct.pack("<960f", *[0.5] * 960)
        part = self.put("part.nrrd", header + b"\n\n" + gzip.compress(values))
        self.assertIn(
            "is no label map: a voxel has the value 0.5; expected whole numbers from 0 to 65535",
            self.refused("read.labels", part),
        )
        self.assertIn(
            "a TIFF does not say where its voxels lie", self.refused("read.labels", self.put("a.tif", b"II*\0"))
        )

    def test_too_many_labels(self):
        values = numpy.arange(1200, dtype=numpy.uint16).reshape(12, 10, 10, order="F")
        data = nrrd(values, AFFINE).replace(b"unsigned char", b"unsigned short\nendian: little", 1)
        file = self.put("a.nrrd", data)
        self.assertIn("has 1199 labels; say which to read by `labels`", self.refused("read.labels", file))
        self.assertIn("label 7", self.masks(file, ", labels: ['7']")[0])

    def test_more_fragments_than_labels(self):
        file = self.put("a.nrrd", nrrd(labels(), AFFINE))
        pipeline = "marrow: 1\nnodes: {it: {uses: read.labels, with: {path: %s, fragments: [a]}}}\noutputs: {it: it}\n"
        result = marrow("check", self.write("p.yaml", pipeline % file))
        self.assertEqual(result.returncode, 2)
        self.assertIn("fragments", result.stderr)


if __name__ == "__main__":
    main()
