#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Masks that are painted on X-rays by mouse and keys, and files for other programs. Also on straightened images, a
pipeline gets exactly the painted mask from the saved case."""
import json
import shlex

import numpy
from harness.page import main
from made_cases import BETA_DEG, HEIGHT, LOWER, MODEL, WIDTH, camera, pixel, read_png, write_png, write_scan
from selenium.webdriver.common.keys import Keys
from xray_bench import XrayPage

K1, K2 = 2.0, 6.0
PIPELINE = """marrow: 1
inputs: {case: {type: path, help: case}}
nodes: {case: {uses: read.case, with: {path: $case}}}
outputs: {view: case.views.frontal}
"""
PAINTED = """
    const canvas = document.querySelector('[data-view=frontal] canvas'), found = [];
    const [width, height] = arguments, zoom = Math.min(canvas.width / width, canvas.height / height);
    const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    for (let v = 0; v < height; ++v)
      for (let u = 0; u < width; ++u) {
        const x = Math.floor(canvas.width / 2 + zoom * (u - (width - 1) / 2));
        const y = Math.floor(canvas.height / 2 + zoom * (v - (height - 1) / 2));
        const at = 4 * (y * canvas.width + x);
        found.push(Math.abs(data[at] - data[at + 2]) > 40 ? 1 : 0);
      }
    return found;
"""
V, U = numpy.mgrid[:HEIGHT, :WIDTH].astype(float)


class MaskPage(XrayPage):
    def mask_file(self):
        return self.document()["views"][0].get("mask")

    def mask(self):
        return self.mask_file() and read_png(self.folder / self.mask_file())

    def masked(self):
        return self.until(self.mask_file, "no mask")

    def unmasked(self):
        self.until(lambda: self.mask_file() is None, "the mask is still there")


class MaskTest(MaskPage):
    def test_a_stroke_is_one_step_of_undo(self):
        self.begin()
        self.tool("brush")
        self.drag_pixel("frontal", [100, 100], [200, 100])
        self.masked()
        away = numpy.hypot(U - numpy.clip(U, 100, 200), V - 100)
        mask = self.mask()
        self.assertEqual(mask.shape, (HEIGHT, WIDTH))
        self.assertTrue((mask[away < 9.9] == 0).all())
        self.assertTrue((mask[away > 10.1] == 255).all())
        self.tool("eraser")
        self.drag_pixel("frontal", [150, 90], [150, 110])
        self.until(lambda: self.mask()[100, 150] == 255, "not erased")
        self.assertEqual(self.mask()[100, 110], 0)
        self.click('[data-do="undo"]')
        self.until(lambda: self.mask()[100, 150] == 0, "not undone")
        self.click('[data-do="undo"]')
        self.unmasked()
        self.tool("brush")
        self.drag_pixel("frontal", [100, 100], [110, 100])
        self.masked()
        self.tool("eraser")
        self.set("[data-do=brush-size]", 80, "input")
        self.drag_pixel("frontal", [95, 100], [115, 100])
        self.unmasked()
        self.no_faults()

    def test_a_box_and_a_brush_by_the_keyboard(self):
        self.begin()
        self.tool("rectangle")
        far, down = (Keys.SHIFT, Keys.ARROW_RIGHT), (Keys.SHIFT, Keys.ARROW_DOWN)
        self.keys("frontal", Keys.ENTER, far, far, far, down, Keys.ENTER)
        self.masked()
        expected = numpy.full((HEIGHT, WIDTH), 255)
        expected[120:131, 160:191] = 0
        self.assertTrue((self.mask() == expected).all())
        self.begin()
        self.tool("brush")
        self.keys("frontal", Keys.ENTER, far, far, far, far, Keys.ENTER)
        self.masked()
        self.assertEqual([int(self.mask()[120, u]) for u in (151, 180, 209, 214)], [0, 0, 0, 255])


class DistortedMaskTest(MaskPage):
    def setUp(self):
        """A view with a strong distortion; where the pixels of its straightened image are, by docs/method.md."""
        super().setUp()
        known = camera("frontal")
        placed = {"target": "camera", "source": "world", "matrix": known["camera_from_world"]}
        self.views = self.views[:1]
        self.views[0]["camera"] = {**known, "radial_distortion": [K1, K2, 0], "camera_from_world": placed}
        write_scan(self.folder)
        self.draft = {"ct": {"file": "scan.mha"}, "fragments": {"distal": {"seeds": [list(LOWER)], "register": True}}}
        (focal, _, u0), (_, _, v0), _ = known["intrinsics"]
        square = ((U - u0) ** 2 + (V - v0) ** 2) / focal**2
        factor = 1 + K1 * square + K2 * square * square
        self.seen_u, self.seen_v = factor * (U - u0) + u0, factor * (V - v0) + v0
        self.assertGreater(numpy.hypot(self.seen_u - U, self.seen_v - V).max(), 15, "the distortion is strong")

    def painted(self):
        """The pixels over which the page shows the colour of the mask, as an image of truth values."""
        return numpy.array(self.js(PAINTED, WIDTH, HEIGHT)).reshape(HEIGHT, WIDTH) > 0

    def saved_mask(self):
        """Saves the case, and returns the mask of the view that read.case gives."""
        self.click('[data-do="save"]')
        self.says("[data-saved]", "Saved in")
        pipeline, out = self.scratch / "read.yaml", self.scratch / "out"
        pipeline.write_text(PIPELINE)
        self.marrow("run", pipeline, "case=%s" % (self.folder / "mine"), "--out", out)
        return read_png(out / "outputs" / "view" / "mask.png")

    def test_what_is_painted_is_what_the_case_masks(self):
        self.begin(**self.draft)
        self.tool("rectangle")
        self.drag_pixel("frontal", [30, 40], [80, 70])
        first = self.masked()
        self.tool("brush")
        self.drag_pixel("frontal", [220, 200], [290, 200])
        self.until(lambda: self.mask_file() != first, "the stroke was not kept")
        wanted = (U > 30.5) & (U < 79.5) & (V > 40.5) & (V < 69.5)
        away = numpy.hypot(U - numpy.clip(U, 220, 290), V - 200)
        u, v = self.seen_u, self.seen_v
        inside = (u >= 0) & (v >= 0) & (u <= WIDTH - 1) & (v <= HEIGHT - 1)
        masked = self.saved_mask() == 0
        missed = numpy.argwhere((wanted | (away < 9.9)) & ~masked)
        self.assertEqual(missed.tolist(), [], "all that was painted is masked")
        near = (U >= 29) & (U <= 81) & (V >= 39) & (V <= 71) | (away < 11.5)
        self.assertFalse((masked & inside & ~near).any(), "nothing else is masked")
        self.no_faults()

    def test_the_page_shows_the_mask_of_the_case(self):
        """A mask that was drawn elsewhere, on the image as its file has it."""
        stored = numpy.full((HEIGHT, WIDTH), 255)
        stored[20:90, 200:300] = 0
        write_png(self.folder / "drawn.png", stored, 8)
        self.views[0]["mask"] = "drawn.png"
        self.begin(**self.draft)
        self.until(lambda: self.painted().any(), "no mask is shown")
        painted, u, v = self.painted(), self.seen_u, self.seen_v
        self.assertTrue(painted[(u > 201) & (u < 298) & (v > 21) & (v < 88)].all())
        self.assertFalse(painted[(u > 1) & (u < 198) & (v > 1) & (v < HEIGHT - 2)].any())
        self.assertTrue((painted == (self.saved_mask() == 0)).all(), "it shows what a pipeline gets")


SEEDS = {"distal": [[1, 2, 3]], "proximal": [[4, 5, 6], [7, 8, 9.5]]}
START = [[0, -1, 0, 4], [1, 0, 0, -5.5], [0, 0, 1, 6], [0, 0, 0, 1]]


class ExportTest(XrayPage):
    """Files for other programs, and their camera files."""

    def begin(self):
        fragments = {name: {"seeds": seeds, "register": True} for name, seeds in SEEDS.items()}
        fragments["distal"]["start"] = START
        seen = lambda at: {view: list(pixel(view, at)) for view in BETA_DEG}
        marks = [{"name": name, "model_mm": at, "fragment": "distal", "pixels": seen(at)} for name, at in MODEL.items()]
        super().begin(landmarks=marks, fragments=fragments)

    def export(self, what, ending, file, **fields):
        self.click('[data-export="%s"]' % what)
        for name, value in {"format": ending, **fields}.items():
            self.set("dialog [data-export-field=%s]" % name, value)
        self.assertTrue(self.the("dialog input", "one.value").endswith(ending))
        self.js("document.querySelector('dialog input').value = arguments[0]", file)
        self.click('dialog [data-do="ok"]')
        self.says(".notice", "Written: " + file)
        return self.folder / file

    def by_command(self, output):
        """The file that the command on the page writes."""
        command = shlex.split(self.text("[data-exported] code"))
        self.assertEqual(command[0], "marrow")
        self.marrow(*command[1:], "--out", self.scratch / "by-command")
        return (self.scratch / "by-command" / "outputs" / output).read_bytes()

    def test_landmarks_and_seeds(self):
        self.begin()
        file = self.export("landmarks", ".mrk.json", "a.mrk.json")
        points = json.loads(file.read_text())["markups"][0]["controlPoints"]
        self.assertEqual({one["label"]: one["position"] for one in points}, MODEL)
        self.assertEqual(self.by_command("markups/distal.mrk.json"), file.read_bytes())
        self.no_faults()
        file = self.export("seeds", ".fcsv", "seeds.fcsv", one="proximal")
        rows = [line.split(",") for line in file.read_text().splitlines() if not line.startswith("#")]
        self.assertEqual([[float(one) for one in row[1:4]] for row in rows], SEEDS["proximal"])
        self.assertIn("# CoordinateSystem = LPS", file.read_text())
        (self.folder / "a.fcsv").write_text("mine")
        for answer, is_kept in (("keep", True), ("replace", False)):
            self.click('[data-export="landmarks"]')
            self.set("dialog [data-export-field=format]", ".fcsv")
            self.the("dialog input", "one.value = 'a.fcsv'")
            self.click('dialog [data-do="ok"]')
            self.click('dialog [data-do="%s"]' % answer)
            self.wait("!document.getElementById('dialog').open")
            self.until(lambda: ((self.folder / "a.fcsv").read_text() == "mine") == is_kept, answer)

    def test_a_start_and_the_pose_of_a_run_for_itk(self):
        pose = {"marrow-pose": 1, "target": "world", "source": "ct", "matrix": START}
        (self.folder / "result.yaml").write_text(json.dumps(pose))
        self.begin()
        file = self.export("pose", ".tfm", "start.tfm")
        numbers = next(line for line in file.read_text().splitlines() if line.startswith("Parameters:"))
        rotation = numpy.array([float(one) for one in numbers.split()[1:10]]).reshape(3, 3)
        self.assertEqual(rotation.tolist(), numpy.array(START)[:3, :3].T.tolist(), "ITK maps the world to the CT")
        self.assertEqual(self.by_command("tfm.tfm"), file.read_bytes())
        self.click('[data-export="result"]')
        self.click('[data-choose="result.yaml"]')
        self.find("dialog [data-export-field=format]")
        self.assertEqual(self.the("dialog input", "one.value"), "result.tfm")
        self.click('dialog [data-do="ok"]')
        self.says(".notice", "Written: result.tfm")
        self.assertEqual((self.folder / "result.tfm").read_bytes(), file.read_bytes())

    def test_cameras_come_back_from_each_format(self):
        """Written for another program, chosen as the camera of the same image, and saved by the draft."""
        self.begin()
        for file, fields in (("c.h5", {}), ("c.xml", {}), ("c.txt", {"one": "lateral"})):
            self.export("cameras", file[1:], file, **fields)
        self.no_faults()
        lateral = camera("lateral")
        for file, projection, mirror in (("c.h5", 1, None), ("c.xml", 1, "upside_down"), ("c.txt", None, None)):
            self.click('[data-view-row="lateral"] [data-do="camera"]')
            self.click('dialog [data-camera="file"]')
            self.click('[data-choose="%s"]' % file)
            if projection is not None:
                self.fill("dialog [data-camera-file=projection]", str(projection))
                if mirror:
                    self.find("dialog [data-camera-file=pixel]").send_keys("1")
                self.click("dialog [data-camera-file=ok]")
            chosen = lambda document: document["views"][1]["camera"]
            given = chosen(self.saved_when(lambda document: chosen(document).get("file") == file))
            self.assertEqual((given.get("projection"), given.get("mirror")), (projection, mirror))
            about, _ = self.server.bytes("/api/xray/view", {"image": "lateral.png", "camera": given})
            self.assertNotIn("fault", about, file)
            for key, most, rows in (("intrinsics", 1e-6, 3), ("camera_from_world", 1e-5, 4)):
                off = numpy.abs(numpy.array(about["camera"][key]) - lateral[key])
                self.assertLess(off[:, :3].max(), 1e-6, file)
                self.assertLess(off.max(), most, file)

    def test_what_cannot_be_written_is_said(self):
        self.enter()
        (self.folder / "a.yaml").write_text("mine")
        (self.folder / "b.tfm").mkdir()
        pose = {"what": "pose", "content": {"matrix": START}}
        two = {"fragments": {name: {"seeds": seeds} for name, seeds in SEEDS.items()}}
        cameras = {"what": "cameras", "content": {"views": self.views, "pixel_width_mm": 0.5, "pixel_height_mm": 1}}
        several = "such a file holds one fragment, or one view; there are 2"
        for body, path, fault in (
            (pose, "a.yaml", "'a.yaml' is there already"),
            (pose, "b.tfm", "'b.tfm' is a folder; give another name"),
            (pose, "a.h5", "'a.h5': the name must end in one of .yaml, .tfm"),
            (pose, ".tfm", "'.tfm': the name must end in one of"),
            (pose, "../a.tfm", "leads out of the folder that is open"),
            ({"what": "x"}, "a.h5", "seeds, landmarks, a pose or cameras can be exported, not 'x'"),
            ({"what": "cameras"}, "a.h5", "give the size of a pixel on the detector, in mm"),
            (cameras, "a.txt", several),
            (cameras, "a.xml", "pixel"),
            ({"what": "seeds", "content": two}, "a.fcsv", several + ": choose one of them"),
        ):
            asked = {**body, "path": path}
            self.assertIn(fault, self.server.fault("/api/xray/export", asked, 409 if path == "a.yaml" else 400))
        self.assertEqual(sorted(one.name for one in self.folder.glob("a.*")), ["a.yaml"], "nothing was written")
        self.assertEqual((self.folder / "a.yaml").read_text(), "mine")


if __name__ == "__main__":
    main(part=2)
