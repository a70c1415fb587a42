# SPDX-License-Identifier: Apache-2.0
"""What a notebook shows of values and results."""
import base64
import json
import re
import struct
import zlib

import numpy
from harness.package import PackageCase, main, marrow
from marrow.display import MOST_TRIANGLES, coarser, grey, png


def pixels_of_png(data):
    """The pixels of a PNG without filters, of 8 bits per channel."""
    width, height, _, kind = struct.unpack(">IIBB", data[16:26])
    packed = b"".join(part for part in re.findall(rb"IDAT(.*?)(?=.{4}.{4}IEND)", data, re.S))
    channels = {0: 1, 2: 3}[kind]
    rows = numpy.frombuffer(zlib.decompress(packed), "uint8").reshape(height, 1 + width * channels)
    return rows[:, 1:].reshape(height, width, channels)


class Display(PackageCase):
    def test_a_picture_is_a_png_with_its_pixels(self):
        pixels = numpy.arange(2 * 5 * 3, dtype="uint8").reshape(2, 5, 3)
        self.assertTrue(numpy.array_equal(pixels_of_png(png(pixels)), pixels))
        self.assertTrue(numpy.array_equal(pixels_of_png(png(pixels[:, :, 0]))[:, :, 0], pixels[:, :, 0]))

    def test_an_image_is_shown_from_its_darkest_to_its_brightest_pixel(self):
        shown = grey(numpy.array([[100, 200], [300, 1120]], "uint16"))
        self.assertEqual(shown.tolist(), [[0, 25], [50, 255]])
        self.assertEqual(grey(numpy.full((2, 2), 7, "uint8")).tolist(), [[0, 0], [0, 0]])
        text = marrow.Image(numpy.array([[0, 1]], "uint8"))._repr_html_()
        data = base64.b64decode(re.search(r"base64,([^\"]+)", text).group(1))
        self.assertEqual(pixels_of_png(data)[0, :, 0].tolist(), [0, 255])

    def test_a_large_surface_is_made_coarser(self):
        z, y, x = numpy.mgrid[-60:61, -60:61, -60:61]
        field = marrow.SignedField(numpy.sqrt(x**2 + y**2 + z**2) - 55, spacing_mm=(1, 1, 1))
        ball = marrow.mesh.marching_cubes(field)
        self.assertGreater(len(ball.triangles), MOST_TRIANGLES)
        vertices, triangles = coarser(ball.vertices_mm, ball.triangles)
        self.assertLess(len(triangles), MOST_TRIANGLES)
        self.assertGreater(len(triangles), MOST_TRIANGLES / 10)
        radii = numpy.linalg.norm(vertices - ball.vertices_mm.mean(axis=0), axis=1)
        self.assertLess(abs(radii - 55).max(), 2)
        self.assertLess(triangles.max(), len(vertices))
        drawn = json.loads(re.search(r'getElementById\("[^"]+"\), (\[.*\])\);\}\)', ball._repr_html_()).group(1))
        self.assertEqual(len(drawn[0]["triangles"]), 3 * len(triangles))
        self.assertEqual(len(drawn[0]["vertices"]), 3 * len(vertices))

    def test_a_result_shows_all_that_people_look_at(self):
        result = self.pipeline.run()
        text = result._repr_html_()
        self.assertIn("verdict distal: " + result["verdict"]["distal"].judgement, text)
        self.assertIn("errors distal final", text)
        self.assertIn("%.4g" % result["errors"]["distal"]["final"]["mtre_mm"], text)
        self.assertIn("%.4g" % result["pose"]["distal"].matrix[0, 3], text)
        self.assertIn("<figcaption>overlay distal frontal</figcaption>", text)
        self.assertEqual(text.count("data:image/png;base64,"), 4)
        self.assertEqual(text.count("<canvas"), 1)
        self.assertNotIn('src="http', text)
        curves = result["profiles"]["distal"]._repr_html_()
        self.assertEqual(curves.count("<polyline"), 6)
        is_known = result["profiles"]["distal"].profiles[0].truth is not None
        self.assertEqual(curves.count("stroke-dasharray"), 6 if is_known else 0)

    def test_figures_have_a_row_each(self):
        table = marrow.display.figures_table({"start": {"mm": 3.0, "deg": 1.0}, "final": {"mm": 0.5, "px": 2.0}})
        self.assertEqual(
            table,
            [
                {"figure": "mm", "start": 3.0, "final": 0.5},
                {"figure": "deg", "start": 1.0, "final": None},
                {"figure": "px", "start": None, "final": 2.0},
            ],
        )

    def test_names_cannot_become_markup(self):
        table = marrow.Table([{"<b>": "<script>", "value": 0.123456}])
        self.assertEqual(
            table._repr_html_(),
            "<table><tr><th>&lt;b&gt;</th><th>value</th></tr><tr><td>&lt;script&gt;</td><td>0.1235</td></tr></table>",
        )

    def test_a_page_is_written_for_a_result_without_a_folder(self):
        result = self.pipeline.run(only=["view3d", "pose"])
        self.assertIsNone(result.folder)
        page = marrow.show(result, open_browser=False)
        self.assertEqual(page, result.folder / "report.html")
        self.assertIn("<html", page.read_text()[:1000])
        self.assertTrue((result.folder / "run.json").is_file())


if __name__ == "__main__":
    main()
