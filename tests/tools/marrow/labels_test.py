# SPDX-License-Identifier: Apache-2.0
"""read.labels on files as nibabel, pydicom, 3D Slicer and TotalSegmentator write them, against what was put in."""
import gzip
import struct
import unittest

from harness import SOURCE
from harness.program import main
from other_programs import Reading, needs, nibabel, numpy, pydicom, read_mha

SIZE = (12, 10, 8)
TOTALSEGMENTATOR = (
    '<?xml version="1.0" encoding="UTF-8"?> <CaretExtension> <VolumeInformation Index="0"> <LabelTable>\n'
    '<Label Key="2" Red="0.1" Green="0.2" Blue="0.3" Alpha="1"><![CDATA[tibia]]></Label>\n'
    '<Label Key="5" Red="0.1" Green="0.2" Blue="0.3" Alpha="1"><![CDATA[fibula]]></Label>\n'
    "</LabelTable> </VolumeInformation></CaretExtension>"
)
BOTH = {"tibia": 2, "fibula": 5}
BY_NUMBER = {"label 2": 2, "label 5": 5}


def labels():
    """Two boxes, indexed x, y, z: label 2 in the middle, label 5 at an end of the grid."""
    values = numpy.zeros(SIZE, numpy.uint8)
    values[4:7, 3:6, 3:5] = 2
    values[0:2, 0:3, 0:2] = 5
    return values


def box():
    """A third box, which overlaps the first."""
    values = numpy.zeros(SIZE, numpy.uint8)
    values[5:9, 4:8, 2:6] = 1
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


def nrrd(values, affine=AFFINE, notes="", space="left-posterior-superior"):
    """`values` is indexed x, y, z, or layer, x, y, z."""
    vectors = " ".join("(%s)" % ",".join(map(repr, map(float, affine[:3, k]))) for k in range(3))
    layers = values.ndim == 4
    header = (
        "NRRD0004\ntype: unsigned char\ndimension: %d\nspace: %s\nsizes: %s\nspace directions: %s%s\nkinds: %sdomain "
        "domain domain\nencoding: gzip\nspace origin: (%s)\n%s\n"
        % (
            *(values.ndim, space, " ".join(map(str, values.shape)), "none " * layers, vectors, "list " * layers),
            *(",".join(map(repr, map(float, affine[:3, 3]))), notes),
        )
    )
    return header.encode() + gzip.compress(values.tobytes(order="F"))


def segments(*listed):
    """How Slicer notes segments: (name, label, layer) each."""
    note = "Segment{0}_ID:=Segment_{0}\nSegment{0}_Name:={1}\nSegment{0}_LabelValue:={2}\nSegment{0}_Layer:={3}\n"
    return "".join(note.format(number, *segment) for number, segment in enumerate(listed))


def dataset(**elements):
    made = pydicom.Dataset()
    for keyword, value in elements.items():
        setattr(made, keyword, value)
    return made


def even(data):
    return data + b"\0" * (len(data) % 2)


@needs("numpy")
class Labels(Reading):
    def masks(self, file, options=""):
        result, out = self.run_node("read.labels", options, file)
        self.assertEqual(result.returncode, 0, "%s: %s" % (file, result.stderr))
        return {path.stem: path for path in (out / "it").glob("*.mha")}, result.stderr

    def read_back(self, file, expected, affine=AFFINE, values=None, options=""):
        """The masks are those of these names, each with the voxels of its label. Gives what is said."""
        masks, said = self.masks(file, options)
        self.assertEqual(sorted(masks), sorted(expected))
        for name, label in expected.items():
            wanted = places(labels() if values is None else values, label, affine)
            numpy.testing.assert_allclose(marked(masks[name]), wanted, atol=2e-3)
        return said

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
            self.read_back(file, BOTH, affine, options=", labels: ['2', '5'], fragments: [tibia, fibula]")
            self.read_back(file, BY_NUMBER, affine)

    @needs("nibabel")
    def test_nifti_with_names_of_totalsegmentator(self):
        for name in ("labels.nii.gz", "labels.nii"):
            file = self.nifti(name, TOTALSEGMENTATOR)
            self.read_back(file, {"fibula": 5}, options=", labels: [fibula]")
            self.read_back(file, BOTH)

    @needs("nibabel")
    def test_a_name_of_totalsegmentator_in_a_file_without_names(self):
        values = labels()
        values[values == 5] = 75
        file = self.nifti(values=values)
        self.read_back(file, {"hip": 75}, values=values, options=", labels: [femur_left], fragments: [hip]")
        pipeline = "marrow: 1\nnodes: {it: {uses: read.labels, with: {path: %s, labels: [tibia]}}}\noutputs: {it: it}\n"
        self.write("p.yaml", pipeline % file)
        self.assertIn(
            "does not name its labels, and 'tibia' is 2 where TotalSegmentator's task appendicular_bones made it; this "
            "label is taken: give its number where another program made the file",
            self.expect(0, "run", "p.yaml", "--out", "warned").stderr,
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
        options = ", labels: [%s], fragments: [%s]" % (names, names)
        self.read_back(self.nifti(values=values), table, values=values, options=options)

    def test_nrrd(self):
        self.read_back(self.write("a.nrrd", nrrd(labels())), BY_NUMBER)
        ras = numpy.diag([-1, -1, 1, 1]) @ AFFINE
        self.read_back(self.write("a.nrrd", nrrd(labels(), ras, space="right-anterior-superior")), BY_NUMBER)

    def test_segments_of_slicer_that_overlap_in_layers(self):
        notes = segments(("tibia", 2, 0), ("fibula", 5, 0), ("talus", 1, 1))
        for affine in (AFFINE, MIRRORED):
            file = self.write("a.seg.nrrd", nrrd(numpy.stack([labels(), box()]), affine, notes))
            self.read_back(file, {"talus": 1}, affine, box(), ", labels: [talus]")
        self.read_back(file, {"bone": 5}, MIRRORED, options=", labels: [fibula], fragments: [bone]")
        masks, _ = self.masks(file)
        self.assertEqual(sorted(masks), ["fibula", "talus", "tibia"])
        numpy.testing.assert_allclose(marked(masks["tibia"]), places(labels(), 2, MIRRORED), atol=2e-3)

    def test_one_segment_a_layer_as_slicer_wrote_before_layers(self):
        parts = numpy.stack([labels() == 2, labels() == 5]).astype(numpy.uint8)
        notes = "Segment0_ID:=a\nSegment0_Name:=tibia\nSegment1_ID:=b\nSegment1_Name:=fibula\n"
        self.read_back(self.write("a.seg.nrrd", nrrd(parts, notes=notes)), BOTH)

    def test_metaimage(self):
        header = (
            "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nTransformMatrix = 0 1 0 "
            "-1 0 0 0 0 1\nOffset = 10 -20 30\nElementSpacing = 0.8 1.5 2\nDimSize = 12 10 8\nElementType = MET_UCHAR\n"
            "ElementDataFile = LOCAL\n"
        )
        self.read_back(self.write("a.mha", header.encode() + labels().tobytes(order="F")), BY_NUMBER)

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

    def segmentation(self, name="a.dcm", masks=None, kind="BINARY", change=lambda data: None):
        masks = masks or [labels() == 2, labels() == 5]
        shown = [  # frames that would be empty are not written
            (number, z, mask[:, :, z].T)
            for number, mask in enumerate(masks, 1)
            for z in range(SIZE[2])
            if mask[:, :, z].any()
        ]
        pixels = numpy.stack([frame for _, _, frame in shown]).astype(numpy.uint8)
        bits = 1 if kind == "BINARY" else 8
        packed = numpy.packbits(pixels.ravel(), bitorder="little") if bits == 1 else pixels * 180
        shared = dataset(
            PlaneOrientationSequence=[dataset(ImageOrientationPatient=[0, 1, 0, -1, 0, 0])],
            PixelMeasuresSequence=[dataset(PixelSpacing=[1.5, 0.8], SliceThickness=2, SpacingBetweenSlices=2)],
        )
        frames = [
            dataset(
                PlanePositionSequence=[dataset(ImagePositionPatient=[10, -20, 30 + 2 * z])],
                SegmentIdentificationSequence=[dataset(ReferencedSegmentNumber=number)],
            )
            for number, z, _ in shown
        ]
        data = dataset(
            **dict(SOPClassUID="1.2.840.10008.5.1.4.1.1.66.4", SOPInstanceUID="1.2.3", Modality="SEG"),
            **dict(SegmentationType=kind, Rows=SIZE[1], Columns=SIZE[0], SamplesPerPixel=1, PixelRepresentation=0),
            **dict(PhotometricInterpretation="MONOCHROME2", BitsAllocated=bits, BitsStored=bits, HighBit=bits - 1),
            **dict(MaximumFractionalValue=200) if kind == "FRACTIONAL" else {},
            SegmentSequence=[dataset(SegmentNumber=i + 1, SegmentLabel=name) for i, name in enumerate(BOTH)],
            SharedFunctionalGroupsSequence=[shared],
            PerFrameFunctionalGroupsSequence=frames,
            NumberOfFrames=len(frames),
            PixelData=even(packed.tobytes()),
        )
        change(data)
        data.file_meta = pydicom.dataset.FileMetaDataset()
        data.file_meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
        data.file_meta.MediaStorageSOPClassUID = data.SOPClassUID
        data.file_meta.MediaStorageSOPInstanceUID = data.SOPInstanceUID
        data.is_little_endian, data.is_implicit_VR = True, False
        data.save_as(self.scratch / name, write_like_original=False)
        return self.scratch / name

    def label_map(self, bits=8, change=lambda data: None):
        """The type LABELMAP: a frame a slice, whose pixels are the numbers of segments; 0 is background."""

        def as_label_map(data):
            data.SOPClassUID = "1.2.840.10008.5.1.4.1.1.66.7"
            data.BitsAllocated, data.BitsStored, data.HighBit = bits, bits, bits - 1
            data.PixelPaddingValue = 0
            data.SegmentSequence.insert(0, dataset(SegmentNumber=0, SegmentLabel="Background"))
            for frame in data.PerFrameFunctionalGroupsSequence:
                del frame.SegmentIdentificationSequence
            numbers = numpy.where(labels() == 5, 2, labels() == 2).astype(numpy.uint8 if bits == 8 else "<u2")
            used = [z for z in range(SIZE[2]) if numbers[:, :, z].any()]
            data.PixelData = even(b"".join(numbers[:, :, z].T.tobytes() for z in used))
            change(data)

        return self.segmentation("a.dcm", [labels() > 0], "LABELMAP", change=as_label_map)

    def test_by_name_and_number(self):
        for file in (lambda: self.label_map(8), lambda: self.label_map(16), self.segmentation):
            self.read_back(file(), BOTH)
            self.read_back(file(), {"bone": 5}, options=", labels: ['2'], fragments: [bone]")

    def test_segments_that_overlap(self):
        file = self.segmentation(masks=[labels() == 2, box() == 1])
        self.read_back(file, {"tibia": 2}, options=", labels: [tibia]")
        self.read_back(file, {"fibula": 1}, values=box(), options=", labels: [fibula]")

    def test_fractions_and_a_folder(self):
        (self.scratch / "seg").mkdir()
        self.segmentation("seg/a.dcm", kind="FRACTIONAL")
        self.read_back(self.scratch / "seg", BOTH)

    def test_what_is_refused(self):
        def moved(data):
            data.PerFrameFunctionalGroupsSequence[1].PlanePositionSequence[0].ImagePositionPatient = [10.5, -20, 38]

        def cut(data):
            data.PixelData = data.PixelData[:20]

        def unknown(data):
            data.SegmentationType = "OTHER"

        def twice(data):
            frames = data.PerFrameFunctionalGroupsSequence
            frames[1].PlanePositionSequence = frames[0].PlanePositionSequence

        def in_colour(data):
            data.PhotometricInterpretation = "PALETTE COLOR"

        def unlisted(data):
            del data.SegmentSequence[2]

        for make, change, said in (
            (self.segmentation, moved, "frame 2 lies 0.50 mm beside the even grid of the others"),
            (self.segmentation, cut, "it ends in the pixels of frame"),
            (
                *(self.segmentation, unknown),
                "SegmentationType (0062,0001) is 'OTHER'; expected BINARY, FRACTIONAL or LABELMAP",
            ),
            (self.label_map, twice, "frames 1 and 2 show the same slice"),
            (self.label_map, in_colour, "PALETTE COLOR"),
        ):
            self.assertIn(said, self.refused("read.labels", make(change=change)))
        self.read_back(self.label_map(change=unlisted), {"tibia": 2, "label 2": 5})
        (self.scratch / "two").mkdir()
        for name in ("two/a.dcm", "two/b.dcm"):
            self.segmentation(name)
        said = self.refused("read.labels", self.scratch / "two")
        self.assertIn("two: holds 2 segmentations ('a.dcm', 'b.dcm')", said)


class Faults(Labels):
    def test_labels_and_segments_that_are_not_there_or_cannot_be_told_apart(self):
        both = self.write("a.seg.nrrd", nrrd(labels(), notes=segments(("tibia", 2, 0), ("fibula", 5, 0))))
        plain = self.write("plain.nrrd", nrrd(labels()))
        alike = self.write("alike.nrrd", nrrd(labels(), notes=segments(("bone", 2, 0), ("bone", 5, 0))))
        empty = self.write("empty.nrrd", nrrd(labels(), notes=segments(("tibia", 2, 0), ("talus", 7, 0))))
        above = self.write("above.nrrd", nrrd(labels(), notes=segments(("tibia", 2, 3))))
        for file, chosen, said in (
            (both, "[tibai]", "has no segment 'tibai'; did you mean 'tibia'? it has 2 'tibia', 5 'fibula'"),
            (both, "['3']", "has no label 3; it has 2 'tibia', 5 'fibula'"),
            (plain, "['3']", "has no label 3; it has 2, 5"),
            (
                *(plain, "[femur_lef]"),
                "does not name its labels, and 'femur_lef' is no bone of TotalSegmentator's tables; did you mean "
                "'femur_left'? give its number; the file has the labels 2, 5",
            ),
            (
                *(plain, "[femur_left]"),
                "'femur_left' is 75 where TotalSegmentator's task total made it, which it lacks; it has the labels 2, "
                "5",
            ),
            (alike, "[bone]", "2 segments are called bone: 2 'bone', 5 'bone'; rename them"),
            (alike, "", "two segments are named 'bone'"),
            (empty, "[talus]", "its header lists the segment 7 'talus', but no voxel is of it"),
            (above, "", "puts the segment 'tibia' to the layer 3 with the label 2, but there are 1 layers"),
        ):
            with self.subTest(said):
                self.assertIn(said, self.refused("read.labels", file, chosen and ", labels: " + chosen))

    def test_what_is_no_label_map(self):
        header = nrrd(labels()).split(b"\n\n")[0].replace(b"unsigned char", b"float") + b"\nendian: little\n\n"
        for name, content, said in (
            ("empty.nrrd", nrrd(labels() * 0), "all its voxels are 0, so it marks nothing"),
            (
                *("part.nrrd", header + gzip.compress(struct.pack("<960f", *[0.5] * 960))),
                "is no label map: a voxel has the value 0.5; expected whole numbers from 0 to 65535",
            ),
            ("a.tif", b"II*\0", "a TIFF does not say where its voxels lie"),
        ):
            self.assertIn(said, self.refused("read.labels", self.write(name, content)))

    def test_too_many_labels(self):
        values = numpy.arange(1200, dtype=numpy.uint16).reshape(12, 10, 10, order="F")
        file = self.write("a.nrrd", nrrd(values).replace(b"unsigned char", b"unsigned short\nendian: little", 1))
        self.assertIn("has 1199 labels; say which to read by `labels`", self.refused("read.labels", file))
        self.assertEqual(list(self.masks(file, ", labels: ['7']")[0]), ["label 7"])

    def test_more_fragments_than_labels(self):
        pipeline = "marrow: 1\nnodes: {it: {uses: read.labels, with: {path: %s, fragments: [a]}}}\noutputs: {it: it}\n"
        self.write("p.yaml", pipeline % self.write("a.nrrd", nrrd(labels())))
        self.assertIn("fragments", self.expect(2, "check", "p.yaml").stderr)


if __name__ == "__main__":
    main()
