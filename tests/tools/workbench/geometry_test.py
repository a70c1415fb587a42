#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The geometry of the X-rays on the page "Case": clicks, projections and triangulations with random cameras and random
ways to show an image. Expected values are computed with numpy by the formulas of docs/case.md, and by marrow."""
import json
import subprocess

import numpy

from bench import MARROW, SOURCE, PageTest, main
from harness.modules import modules
from xray_bench import write_png

COUNT = 1000


def rotation(random):
    matrix, _ = numpy.linalg.qr(random.normal(size=(3, 3)))
    return matrix if numpy.linalg.det(matrix) > 0 else -matrix


def random_camera(random, target_mm):
    """A camera that looks obliquely at a place: its image is not square, and its pixels are a little skewed."""
    width, height = (int(random.integers(16, 3000)) for _ in range(2))
    focal = max(width, height) * random.uniform(1.5, 6)
    intrinsics = numpy.array(
        [
            [focal, random.uniform(-0.01, 0.01) * focal, width * random.uniform(0.3, 0.7)],
            [0, focal * random.uniform(0.95, 1.05), height * random.uniform(0.3, 0.7)],
            [0, 0, 1],
        ]
    )
    turn = rotation(random)
    in_camera = numpy.array([*random.uniform(-20, 20, 2), random.uniform(400, 1200)])
    motion = numpy.eye(4)
    motion[:3, :3] = turn
    motion[:3, 3] = in_camera - turn @ target_mm
    return {
        "intrinsics": intrinsics.tolist(),
        "camera_from_world": motion.tolist(),
        "width_px": width,
        "height_px": height,
    }


def pixel(camera, world_mm):
    seen = numpy.array(camera["intrinsics"]) @ (numpy.array(camera["camera_from_world"]) @ [*world_mm, 1])[:3]
    return seen[:2] / seen[2]


def ray(camera, at):
    """(source, unit direction) in the world."""
    motion = numpy.array(camera["camera_from_world"])
    direction = motion[:3, :3].T @ numpy.linalg.solve(camera["intrinsics"], [*at, 1])
    return -motion[:3, :3].T @ motion[:3, 3], direction / numpy.linalg.norm(direction)


class GeometryTest(PageTest):
    def js(self, body, argument):
        """The value of a function's body with modules of the page in front. It calls its argument `given`."""
        scripts = modules(
            Geometry="workbench/page/geometry.js",
            Viewport="workbench/page/viewport.js",
            Sight="workbench/page/sight.js",
        )
        self.browser.driver.get("about:blank")
        text = scripts + "const given = JSON.parse(arguments[0]);\n" + body
        return json.loads(self.browser.js(text, json.dumps(argument)))

    def test_what_is_clicked_comes_back(self):
        random = numpy.random.default_rng(1)
        cases = []
        for _ in range(COUNT):
            width, height = (int(value) for value in random.integers(16, 4000, 2))
            cases.append(
                {
                    "size": [width, height],
                    "frame": random.uniform(100, 1500, 2).tolist(),
                    "factor": random.uniform(0.2, 30),
                    "around": random.uniform(0, 1, 2).tolist(),
                    "by": random.uniform(-300, 300, 2).tolist(),
                    "flips": random.integers(0, 2, 2).tolist(),
                    "pixel": [random.uniform(-0.5, width - 0.5), random.uniform(-0.5, height - 0.5)],
                }
            )
        back = self.js(
            """
            return JSON.stringify(given.map(({size, frame, factor, around, by, flips, pixel}) => {
              let port = {...Viewport.fitted(...size, ...frame), flip_u: !!flips[0], flip_v: !!flips[1]};
              const place = [around[0] * frame[0], around[1] * frame[1]], under = Viewport.toPixel(port, place);
              port = Viewport.zoomed(port, factor, place);
              const stays = Viewport.toPixel(port, place);
              port = Viewport.panned(port, by);
              const moved = Viewport.toPixel(port, [place[0] + by[0], place[1] + by[1]]);
              port = Viewport.resized(port, frame[0] * 0.7, frame[1] * 1.1);
              const [a, b, c, d, e, f] = Viewport.canvasTransform(port, 1);
              return {
                back: Viewport.toPixel(port, Viewport.toScreen(port, pixel)), under, stays, moved, factor: port.zoom,
                drawn: [a * (pixel[0] + 0.5) + e, d * (pixel[1] + 0.5) + f], screen: Viewport.toScreen(port, pixel)};
            }));""",
            cases,
        )
        worst = {"clicked": 0, "zoomed": 0, "panned": 0, "drawn": 0}
        for case, got in zip(cases, back):
            off = lambda a, b: float(numpy.max(numpy.abs(numpy.subtract(a, b))))
            worst["clicked"] = max(worst["clicked"], off(got["back"], case["pixel"]))
            worst["zoomed"] = max(worst["zoomed"], off(got["under"], got["stays"]))
            worst["panned"] = max(worst["panned"], off(got["moved"], got["stays"]))
            worst["drawn"] = max(worst["drawn"], off(got["drawn"], got["screen"]))
        print("largest differences over %d ways to show an image:" % COUNT, worst)
        for what, value in worst.items():
            self.assertLess(value, 0.01, what)

    def test_flips_and_corners(self):
        got = self.js(
            """
            const port = Viewport.fitted(200, 100, 400, 400);
            const turned = {...port, flip_u: true};
            return JSON.stringify([[0, 0], [199, 99]].map((at) => [port, turned].map((p) => Viewport.toScreen(p, at))));
            """,
            None,
        )
        # Two CSS pixels for each pixel; the centre of the first is one CSS pixel inside the image.
        self.assertEqual(got, [[[1, 101], [399, 101]], [[399, 299], [1, 299]]])

    def test_projection_and_triangulation(self):
        random = numpy.random.default_rng(2)
        cases = []
        for _ in range(COUNT):
            place = random.uniform(-80, 80, 3)
            count = int(random.integers(2, 5))
            cameras = [random_camera(random, place) for _ in range(count)]
            cases.append({"world": place.tolist(), "cameras": cameras, "off": random.normal(size=2).tolist()})
        got = self.js(
            """
            return JSON.stringify(given.map(({world, cameras, off}) => {
              const pixels = cameras.map((camera) => Geometry.pixel(camera, world));
              const seen = cameras.map((camera, i) => ({camera, pixel: pixels[i]}));
              const wrong = seen.slice(0, 2).map((one, i) =>
                  (i ? one : {...one, pixel: [one.pixel[0] + off[0], one.pixel[1] + off[1]]}));
              return {pixels, exact: Sight.triangulated(seen), wrong: Sight.triangulated(wrong),
                      line: Sight.epipolarLine(cameras[0], pixels[0], cameras[1]),
                      angle: Sight.angle_deg(cameras[0], cameras[1])};
            }));""",
            cases,
        )
        lines = 0
        worst = {"pixel": 0, "world_mm": 0, "rays_mm": 0, "line_px": 0, "angle_deg": 0}
        for case, answer in zip(cases, got):
            cameras, world = case["cameras"], numpy.array(case["world"])
            rays = [ray(camera, pixel(camera, world)) for camera in cameras]
            if abs(rays[0][1] @ rays[1][1]) > 0.998:
                continue  # nearly parallel: nothing is determined
            for camera, at in zip(cameras, answer["pixels"]):
                worst["pixel"] = max(worst["pixel"], float(numpy.abs(pixel(camera, world) - at).max()))
            worst["world_mm"] = max(worst["world_mm"], float(numpy.linalg.norm(answer["exact"]["world_mm"] - world)))
            moved = ray(cameras[0], pixel(cameras[0], world) + case["off"])
            normal = numpy.cross(moved[1], rays[1][1])
            distance = abs((rays[1][0] - moved[0]) @ normal) / numpy.linalg.norm(normal)
            worst["rays_mm"] = max(worst["rays_mm"], abs(answer["wrong"]["distance_mm"] - distance))
            other = pixel(cameras[1], world)
            if (other > 0).all() and (other < [cameras[1]["width_px"] - 1, cameras[1]["height_px"] - 1]).all():
                a, b = (numpy.array(end) for end in answer["line"])
                along, apart = (b - a) / numpy.linalg.norm(b - a), other - a
                worst["line_px"] = max(worst["line_px"], abs(float(apart[0] * along[1] - apart[1] * along[0])))
                lines += 1
            axes = [numpy.array(camera["camera_from_world"])[2, :3] for camera in cameras[:2]]
            central = [ray(camera, numpy.array(camera["intrinsics"])[:2, 2])[1] for camera in cameras[:2]]
            self.assertTrue(numpy.allclose(axes, central))
            expected = numpy.degrees(numpy.arccos(numpy.clip(central[0] @ central[1], -1, 1)))
            worst["angle_deg"] = max(worst["angle_deg"], abs(answer["angle"] - expected))
        self.assertGreater(lines, COUNT / 2)
        print("largest differences over %d pairs of oblique cameras:" % COUNT, worst)
        for what, value in worst.items():
            self.assertLess(value, 0.01, what)

    def test_what_cannot_be_triangulated(self):
        camera = random_camera(numpy.random.default_rng(3), numpy.zeros(3))
        got = self.js(
            """
            const one = {camera: given, pixel: [4, 5]};
            return JSON.stringify([Sight.triangulated([one]), Sight.triangulated([one, one])]);""",
            camera,
        )
        self.assertEqual(got, [None, None])

    def test_marrow_projects_the_same_way(self):
        """The page's pixels are given to marrow as places where points are seen, and marrow says how far it is off."""
        random = numpy.random.default_rng(4)
        world = random.uniform(-10, 10, (5, 3))
        cameras = [random_camera(random, world.mean(axis=0)) for _ in range(60)]
        pixels = self.js(
            "return JSON.stringify(given.cameras.map((c) => given.world.map((w) => Geometry.pixel(c, w))));",
            {"cameras": cameras, "world": world.tolist()},
        )
        names = ["v%d" % i for i in range(len(cameras))]
        for name, camera in zip(names, cameras):
            write_png(
                self.scratch / (name + ".png"), numpy.zeros((camera["height_px"], camera["width_px"]), int), bits=8
            )
            transform = {"target": "camera", "source": "world", "matrix": camera["camera_from_world"]}
            text = {"marrow-camera": 1, **camera, "camera_from_world": transform}
            (self.scratch / (name + ".yaml")).write_text(json.dumps(text))
        points = [
            {"name": str(k), "at_mm": place.tolist(), "seen_px": {n: p[k] for n, p in zip(names, pixels)}}
            for k, place in enumerate(world)
        ]
        (self.scratch / "points.yaml").write_text(json.dumps({"marrow-points": 1, "points": points}))
        files = lambda ending: json.dumps([str(self.scratch / (name + ending)) for name in names])
        told = subprocess.run(
            [MARROW, "run", SOURCE / "pipelines/workbench/check-cameras.yaml", "--out", self.scratch / "out"]
            + ["--only", "metrics", "--set", "check.known_points=%s" % (self.scratch / "points.yaml")]
            + ["--set", "views.names=" + json.dumps(names), "--set", "views.images=" + files(".png")]
            + ["--set", "views.cameras=" + files(".yaml")],
            capture_output=True,
            text=True,
        )
        self.assertEqual(told.returncode, 0, told.stderr)
        metrics = json.loads((self.scratch / "out" / "outputs" / "metrics.json").read_text())["metrics"]
        error = next(one for one in metrics if one["name"] == "error")
        print("marrow and the page differ by %.2g px over %d views" % (error["value"], len(cameras)))
        self.assertLess(error["value"], 0.01)


if __name__ == "__main__":
    main()
