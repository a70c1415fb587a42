# SPDX-License-Identifier: Apache-2.0
"""Files that come with other programs' packages, and files that those programs write now, in one run. The table says of
each whether it is read with the values that the other program reads, or why it is refused. No sound file may be called
damaged, and each refusal must be one of those below."""
import concurrent.futures
import fnmatch

import foreign_found
import foreign_written
from foreign_found import row_of
from harness.package import Case, main

SOURCES = (
    foreign_found.of_pydicom,
    foreign_found.of_nibabel,
    foreign_found.of_scipy,
    foreign_written.by_gdcm,
    foreign_written.by_pydicom,
    foreign_written.by_plastimatch,
    foreign_written.by_nibabel,
    foreign_written.by_tifffile,
    foreign_written.by_pillow,
    foreign_written.by_vtk,
)
# Files that are cut off, that lack what every such file has, or that contradict themselves: only of these may a message
# say that they are damaged.
DAMAGED = {
    "MR_truncated.dcm": "is cut off: 8192 bytes of pixels expected, got 8130",
    "meta_missing_tsyntax.dcm": "it does not say how it is written (TransferSyntaxUID)",
    "nested_priv_SQ.dcm": "its header does not say how large the image is",
    "no_meta.dcm": "is not a DICOM file, or is damaged at its start",  # a blank stands before its first element
    "rtplan_truncated.dcm": "an element claims 976 bytes where 711 are left",
    "JPEG2000-embedded-sequence-delimiter.dcm": "the compressed pixels are of",  # bytes in them were replaced
    "csa_slice_norm.dcm": "it has no pixels",  # they were taken out of an MR slice
}
# Refusals of sound files that are right: which, and a part of the message.
NO_IMAGE = "; expected a CT slice or an X-ray image"
ONE_VOLUME, KNOWN_VOLUMES = " dimensions; expected one volume", ", not a volume that can be read; known are .mha"
REFUSED = (
    ("gdcmimg", "gdcmimg 16 bit", "1.2.840.113619.5.2 (unknown), which is not read"),  # of one manufacturer
    ("pydicom", "SC_*2frame.dcm", "has 2 frames; name one with frame (from 1)"),
    ("pydicom", "SC_rgb_small_odd.dcm", "has colours: the pixel at"),
    ("pydicom", "SC_rgb_jpeg_dcmd.dcm", "has colours: the pixel at"),
    ("pydicom", "SC_*", "has 3 channels; an X-ray image has one: save it as grey levels"),
    ("pydicom", "GDCMJ2K_TextGBR.dcm", "has 3 channels; an X-ray image has one: save it as grey levels"),
    ("pydicom", "ExplVR_BigEnd.dcm", "has colours: the pixel at"),
    ("pydicom", "*rtdose*", "holds a dose of radiotherapy" + NO_IMAGE),
    ("pydicom", "badVR.dcm", "holds a dose of radiotherapy" + NO_IMAGE),
    ("pydicom", "rtplan.dcm", "holds no image, it is of modality RTPLAN" + NO_IMAGE),
    ("pydicom", "ExplVR_*NoMeta.dcm", "holds no image, it is of modality RTPLAN" + NO_IMAGE),
    ("pydicom", "rtstruct.dcm", "holds no image, it is of modality RTSTRUCT" + NO_IMAGE),
    ("pydicom", "liver*.dcm", "its pixels have 1 of 1 bits"),
    ("pydicom", "*SR.dcm", "holds no image, it is of modality SR" + NO_IMAGE),
    ("pydicom", "reportsi*.dcm", "holds no image, it is of modality SR" + NO_IMAGE),
    ("pydicom", "waveform_ecg.dcm", "holds no image, it is of modality ECG" + NO_IMAGE),
    ("pydicom", "*.dcm", "holds no image" + NO_IMAGE),
    ("pydicom", "CR?", "the series has 1 slice; a volume needs at least 2"),
    ("pydicom", "CT2", "202.5 mm between 17106 and 17136, 1.25 mm between most slices"),
    ("pydicom", "CT2N", "holds no slice of a CT; there are: 6293 (a localizer) 6924 (a localizer)"),
    ("pydicom", "MR?", "holds no slice of a CT"),
    ("pydicom", "MR700", "is of modality 'MR'; expected CT, whose values are Hounsfield units"),
    ("pydicom", "PT000000", "holds no DICOM file"),
    ("nibabel", "example*.nii.gz", ONE_VOLUME),
    ("nibabel", "functional.nii", ONE_VOLUME),
    ("nibabel", "row_major.dconn.nii", ONE_VOLUME),
    ("nibabel", "*.mnc", KNOWN_VOLUMES),
    ("nibabel", "test.mgz", KNOWN_VOLUMES),
    ("nibabel", "analyze.hdr", KNOWN_VOLUMES[2:]),
    ("nibabel", "nifti?.hdr", "they are in an .img file beside this header; save both as one file (.nii)"),
    ("nibabel", "resampled_anat_moved.nii", "voxel (0, 0, 0) is not a finite number"),
    ("nibabel writes", "pair.img", KNOWN_VOLUMES[2:]),
    ("tifffile", "tiles.tif", "is stored in tiles; expected strips"),
    ("tifffile", "half.tif", "its pixels have 16 bits in a format that is not read"),
    ("Pillow", "jpeg.tif", "its pixels are compressed by method 7, which is not read"),
    ("Pillow", "L.gif", "is a GIF picture, not an image that can be read"),
    ("Pillow", "L.jp2", "is a JPEG 2000 picture, not an image that can be read"),
    ("Pillow", "L.webp", "is a WebP picture, not an image that can be read"),
    ("*", "*.p?m", "is a PNM picture, not an image that can be read"),
    ("VTK", "a.vti", KNOWN_VOLUMES[2:]),
    ("VTK", "legacy.vtk", "not a surface that can be read; known are .stl, .ply, .obj and .vtp"),
)


def is_right_to_refuse(sample, message):
    if sample.path.name in DAMAGED:
        return DAMAGED[sample.path.name] in message
    if "damaged" in message or "cut off" in message:
        return False
    return any(
        fnmatch.fnmatch(sample.group, group) and fnmatch.fnmatch(sample.name, name) and words in message
        for group, name, words in REFUSED
    )


class ForeignFiles(Case):
    def test_each_is_read_as_its_program_reads_it_or_refused_in_right_words(self):
        samples, absent = [], []
        for source in SOURCES:
            folder = self.scratch / source.__name__
            folder.mkdir()
            made = source(folder)
            if isinstance(made, str):
                absent.append(made)
            else:
                samples += made
        with concurrent.futures.ThreadPoolExecutor(4) as threads:
            rows = list(threads.map(lambda sample: row_of(sample, is_right_to_refuse), samples))
        print()
        for sample, (text, is_fault) in zip(samples, rows):
            print("%s %-14s %-40s %s" % ("FAULT" if is_fault else "     ", sample.group, sample.name, text))
        for name in absent:
            print("skipped, not installed here: " + name)
        equal = sum(text.startswith("read and equal") for text, _ in rows)
        print("%d files: %d read and equal, %d refused" % (len(rows), equal, len(rows) - equal))
        faults = ["%s: %s" % (one.path.name, text) for one, (text, is_fault) in zip(samples, rows) if is_fault]
        self.assertEqual(faults, [])
        if not samples:
            self.skipTest("none of these programs is installed here")


if __name__ == "__main__":
    main()
