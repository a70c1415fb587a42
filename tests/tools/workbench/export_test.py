#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The files that the page "Case" writes for other programs, and the camera files of these that it reads."""
import json
import shlex

import numpy

from harness.page import main
from made_cases import BETA_DEG, MODEL, camera, pixel
from xray_bench import XrayPage

SEEDS = {"distal": [[1, 2, 3]], "proximal": [[4, 5, 6], [7, 8, 9.5]]}
START = [[0, -1, 0, 4], [1, 0, 0, -5.5], [0, 0, 1, 6], [0, 0, 0, 1]]


class ExportTest(XrayPage):
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
