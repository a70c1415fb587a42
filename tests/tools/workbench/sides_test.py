#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The warnings about an X-ray that may be mirrored."""
import json
import struct
import unittest

from bench import BenchTest
from harness import formats

ARM = {"alpha_deg": 0, "beta_deg": 0, "source_to_detector_mm": 1000, "source_to_isocentre_mm": 600, "pixel_mm": 1}
CAMERA = {"width_px": 6, "height_px": 4, "c_arm": ARM}


def dicom(orientation=None, flip=None, angles=None):
    """An X-ray image of 6 x 4 pixels."""
    elements = {(8, 0x16): ("UI", "1.2.840.10008.5.1.4.1.1.12.1"), (8, 0x60): ("CS", "XA")}
    if angles:
        elements.update({(0x18, 0x1510): ("DS", str(angles[0])), (0x18, 0x1511): ("DS", str(angles[1]))})
    if flip:
        elements[0x18, 0x7034] = ("CS", flip)
    if orientation:
        elements[0x20, 0x20] = ("CS", orientation)
    return formats.dicom(6, 4, struct.pack("<24H", *range(1000, 1024)), elements)


class SidesTest(BenchTest):
    def warnings(self, camera=CAMERA, **header):
        (self.folder / "a.dcm").write_bytes(dicom(**header))
        status, headers, content = self.server.ask("POST", "/api/xray/view", {"image": "a.dcm", "camera": camera})
        self.assertEqual(status, 200, content)
        about = json.loads(headers["X-Marrow-About"])
        self.assertNotIn("fault", about)
        return about["warnings"]

    def setUp(self):
        super().setUp()
        self.server = self.open()
        self.server.enter()

    def test_only_what_the_header_says(self):
        self.assertEqual(self.warnings(), [])
        self.assertEqual(self.warnings(flip="NO"), [])
        self.assertEqual(self.warnings(orientation="R\\F"), [])
        self.assertEqual(self.warnings(orientation="L\\F", angles=(0, 0)), [], "it is mirrored back")
        (flipped,) = self.warnings(flip="YES")
        self.assertIn("was flipped left to right after it was taken", flipped)
        (mirrored,) = self.warnings(orientation="L\\F")
        self.assertIn(
            "is mirrored: by its header (PatientOrientation (0020,0020)) the patient's left is on the right", mirrored
        )

    def test_without_angles_it_is_not_known(self):
        (self.folder / "c.yaml").write_text(json.dumps({"marrow-camera": 1, **CAMERA}))
        (unknown,) = self.warnings(camera={"file": "c.yaml"}, orientation="L\\F")
        self.assertIn("whether it is mirrored is not known", unknown)


if __name__ == "__main__":
    unittest.main(verbosity=2)
