#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The files that the page "Case" writes for other programs, and the camera files of these that it reads."""
import json
import shlex
import subprocess

import numpy

from bench import MARROW, main
from xray_bench import ANGLES, MODEL, XrayTest, camera_matrices, pixel

SEEDS = {"distal": [[1, 2, 3]], "proximal": [[4, 5, 6], [7, 8, 9.5]]}
START = [[0, -1, 0, 4], [1, 0, 0, -5.5], [0, 0, 1, 6], [0, 0, 0, 1]]


class ExportTest(XrayTest):
    def whole(self):
        fragments = {name: {"seeds": seeds, "register": True} for name, seeds in SEEDS.items()}
        fragments["distal"]["start"] = START
        marks = [
            {
                "name": name,
                "model_mm": at,
                "fragment": "distal",
                "pixels": {view: list(pixel(view, numpy.array(at))) for view in ANGLES},
            }
            for name, at in MODEL.items()
        ]
        return {"views": self.views, "landmarks": marks, "fragments": fragments}

    def set_field(self, name, value):
        script = (
            "const box = document.querySelector('dialog [data-export-field=%s]'); box.value = arguments[0];"
            " box.dispatchEvent(new Event('change'))"
        )
        self.browser.js(script % name, value)

    def export(self, what, ending, file, **fields):
        self.click('[data-export="%s"]' % what)
        self.find("dialog [data-export-field=format]")
        self.set_field("format", ending)
        for name, value in fields.items():
            self.set_field(name, value)
        self.assertTrue(self.find("dialog input").get_attribute("value").endswith(ending))
        self.browser.js("document.querySelector('dialog input').value = arguments[0]", file)
        self.click('dialog [data-do="ok"]')
        self.wait_text(".notice", "Written: " + file)
        return self.folder / file

    def by_command(self, output):
        """The file that the command on the page writes."""
        command = shlex.split(self.text("[data-exported] code"))
        self.assertEqual(command[0], "marrow")
        out = self.scratch / "by-command"
        ran = subprocess.run([MARROW, *command[1:], "--out", out], capture_output=True, text=True, timeout=600)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        return (out / "outputs" / output).read_bytes()

    def test_landmarks_for_3d_slicer(self):
        self.begin(self.whole())
        file = self.export("landmarks", ".mrk.json", "a.mrk.json")
        points = json.loads(file.read_text())["markups"][0]["controlPoints"]
        self.assertEqual({one["label"]: one["position"] for one in points}, MODEL)
        self.assertEqual(self.by_command("markups/distal.mrk.json"), file.read_bytes())
        self.no_faults()

    def test_seeds_of_one_fragment_of_several(self):
        self.begin(self.whole())
        file = self.export("seeds", ".fcsv", "seeds.fcsv", one="proximal")
        rows = [line.split(",") for line in file.read_text().splitlines() if not line.startswith("#")]
        self.assertEqual([[float(one) for one in row[1:4]] for row in rows], SEEDS["proximal"])
        self.assertIn("# CoordinateSystem = LPS", file.read_text())

    def test_a_start_and_the_pose_of_a_run_for_itk(self):
        pose = {"marrow-pose": 1, "target": "world", "source": "ct", "matrix": START}
        (self.folder / "result.yaml").write_text(json.dumps(pose))
        self.begin(self.whole())
        file = self.export("pose", ".tfm", "start.tfm")
        numbers = next(line for line in file.read_text().splitlines() if line.startswith("Parameters:"))
        rotation = numpy.array([float(one) for one in numbers.split()[1:10]]).reshape(3, 3)
        self.assertEqual(rotation.tolist(), numpy.array(START)[:3, :3].T.tolist(), "ITK maps the world to the CT")
        self.assertEqual(self.by_command("tfm.tfm"), file.read_bytes())
        self.click('[data-export="result"]')
        self.click('[data-choose="result.yaml"]')
        self.find("dialog [data-export-field=format]")
        self.assertEqual(self.find("dialog input").get_attribute("value"), "result.tfm")
        self.click('dialog [data-do="ok"]')
        self.wait_text(".notice", "Written: result.tfm")
        self.assertEqual((self.folder / "result.tfm").read_bytes(), file.read_bytes())

    def test_cameras_come_back_from_each_format(self):
        """Written for another program, chosen as the camera of the same image, and saved by the draft."""
        self.begin(self.whole())
        for ending, file in ((".h5", "c.h5"), (".xml", "c.xml"), (".txt", "c.txt")):
            fields = {"one": "lateral"} if ending == ".txt" else {}
            self.export("cameras", ending, file, **fields)
        self.no_faults()
        for file, projection, mirror in (("c.h5", 1, None), ("c.xml", 1, "upside_down"), ("c.txt", None, None)):
            self.click('[data-view-row="lateral"] [data-do="camera"]')
            self.click('dialog [data-camera="file"]')
            self.click('[data-choose="%s"]' % file)
            if projection is not None:
                self.find("dialog [data-camera-file=projection]").clear()
                self.find("dialog [data-camera-file=projection]").send_keys(str(projection))
                if mirror:
                    self.find("dialog [data-camera-file=pixel]").send_keys("1")
                self.click("dialog [data-camera-file=ok]")
            self.until(lambda: self.document()["views"][1]["camera"].get("file") == file, "not chosen: " + file)
            self.assertEqual(self.document()["views"][1]["camera"].get("projection"), projection)
            self.assertEqual(self.document()["views"][1]["camera"].get("mirror"), mirror)
            asked = {"image": "lateral.png", "camera": self.document()["views"][1]["camera"]}
            _, headers, _ = self.server.ask("POST", "/api/xray/view", asked)
            about = json.loads(headers["X-Marrow-About"])
            self.assertNotIn("fault", about, file)
            intrinsics, rotation, shift = camera_matrices(*ANGLES["lateral"])
            self.assertLess(numpy.abs(numpy.array(about["camera"]["intrinsics"]) - intrinsics).max(), 1e-6, file)
            placed = numpy.array(about["camera"]["camera_from_world"])
            self.assertLess(numpy.abs(placed[:3, :3] - rotation).max(), 1e-6, file)
            self.assertLess(numpy.abs(placed[:3, 3] - shift).max(), 1e-5, file)

    def test_an_existing_file_is_replaced_only_on_request(self):
        (self.folder / "a.fcsv").write_text("mine")
        self.begin(self.whole())
        for answer, expected in (("keep", True), ("replace", False)):
            self.click('[data-export="landmarks"]')
            self.find("dialog [data-export-field=format]")
            self.set_field("format", ".fcsv")
            self.browser.js("document.querySelector('dialog input').value = 'a.fcsv'")
            self.click('dialog [data-do="ok"]')
            self.click('dialog [data-do="%s"]' % answer)
            self.browser.wait("return !document.getElementById('dialog').open", 20)
            self.until(lambda: ((self.folder / "a.fcsv").read_text() == "mine") == expected, answer)

    def test_what_cannot_be_written_is_said(self):
        server = self.open()
        server.enter()
        (self.folder / "a.yaml").write_text("mine")
        (self.folder / "b.tfm").mkdir()
        pose = {"what": "pose", "content": {"matrix": START}}
        two = {name: {"seeds": seeds} for name, seeds in SEEDS.items()}
        cameras = {"what": "cameras", "content": {"views": self.views, "pixel_width_mm": 0.5, "pixel_height_mm": 1}}
        for body, status, fault in (
            ({**pose, "path": "a.yaml"}, 409, "'a.yaml' is there already"),
            ({**pose, "path": "b.tfm"}, 400, "'b.tfm' is a folder; give another name"),
            ({**pose, "path": "a.h5"}, 400, "'a.h5': the name must end in one of .yaml, .tfm"),
            ({**pose, "path": ".tfm"}, 400, "'.tfm': the name must end in one of"),
            ({**pose, "path": "../a.tfm"}, 400, "leads out of the folder that is open"),
            ({"what": "x", "path": "a.h5"}, 400, "seeds, landmarks, a pose or cameras can be exported, not 'x'"),
            ({"what": "cameras", "path": "a.h5"}, 400, "give the size of a pixel on the detector, in mm"),
            ({**cameras, "path": "a.txt"}, 400, "such a file holds one fragment, or one view; there are 2"),
            ({**cameras, "path": "a.xml"}, 400, "pixel"),
            (
                {"what": "seeds", "path": "a.fcsv", "content": {"fragments": two}},
                400,
                "such a file holds one fragment, or one view; there are 2: choose one of them",
            ),
        ):
            answer = server.ask("POST", "/api/xray/export", body)
            self.assertEqual(answer[0], status, body)
            self.assertIn(fault, json.loads(answer[2])["error"])
        self.assertEqual(sorted(one.name for one in self.folder.glob("a.*")), ["a.yaml"], "nothing was written")
        self.assertEqual((self.folder / "a.yaml").read_text(), "mine")


if __name__ == "__main__":
    main()
