#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Functions of the pages by themselves. Of their geometry: slices of CTs, ways to show an image, cameras and
triangulation, each with many random values, and poses between others. Expected values are computed with numpy by the
formulas of docs/case.md, and by marrow, or written down."""
import json
import math
import pathlib
import shutil
import tempfile
import unittest

import made_cases
import numpy
from harness import SOURCE
from harness.modules import value
from harness.program import marrow
from made_cases import ARM, BETA_DEG, MODEL, SHIFT, angle_deg, at, camera, pixel, ray, write_png

COUNT = 1000


def random_grid(random):
    """Any size of voxels, turned and flipped in any way; axes in any order."""
    rows = numpy.array(made_cases.turned(random.uniform(-180, 180, 3)))
    if random.random() < 0.5:  # as most scanners: along the patient's axes, but in any order and direction
        rows = (numpy.eye(3) * random.choice([-1, 1], 3))[random.permutation(3)]
    return {
        "size": random.integers(8, 513, 3).tolist(),
        "spacing_mm": random.uniform(0.2, 3, 3).tolist(),
        "origin_mm": random.uniform(-500, 500, 3).tolist(),
        "direction": rows.tolist(),
    }


def random_camera(random, target_mm):
    """A camera that looks obliquely at a place: its image is not square, and its pixels are a little skewed."""
    width, height = (int(random.integers(16, 3000)) for _ in range(2))
    focal = max(width, height) * random.uniform(1.5, 6)
    turn, _ = numpy.linalg.qr(random.normal(size=(3, 3)))
    motion = numpy.eye(4)
    motion[:3, :3] = turn if numpy.linalg.det(turn) > 0 else -turn
    motion[:3, 3] = [*random.uniform(-20, 20, 2), random.uniform(400, 1200)] - motion[:3, :3] @ target_mm
    return {
        "intrinsics": [
            [focal, random.uniform(-0.01, 0.01) * focal, width * random.uniform(0.3, 0.7)],
            [0, focal * random.uniform(0.95, 1.05), height * random.uniform(0.3, 0.7)],
            [0, 0, 1],
        ],
        "camera_from_world": motion.tolist(),
        "width_px": width,
        "height_px": height,
    }


def off(a, b):
    return float(numpy.max(numpy.abs(numpy.subtract(a, b))))


class GeometryTest(unittest.TestCase):
    def expect_small(self, worst):
        print("largest differences over %d random values:" % COUNT, worst)
        for what, largest in worst.items():
            self.assertLess(largest, 0.01, what)

    def test_a_voxel_that_is_clicked_comes_back(self):
        """A voxel's centre that is drawn somewhere is what a click there means."""
        random = numpy.random.default_rng(7)
        cases = []
        for _ in range(COUNT):
            grid = random_grid(random)
            index = [int(random.integers(n)) for n in grid["size"]]
            view = {"centre": [random.uniform(0, n) for n in grid["size"]], "scale": random.uniform(0.2, 20)}
            view.update(width=int(random.integers(100, 901)), height=int(random.integers(100, 901)))
            cases.append([grid, index, view, str(random.choice(["axial", "coronal", "sagittal"]))])
        answers = value(
            """given.map(([ct, index, view, name]) => {
              const G = SliceGeometry, plane = G.planes(ct)[name], place = G.place(ct, plane, view, index);
              const back = G.indexAt(ct, plane, view, place, index[plane.across]);
              const numbers = G.pictureTransform(ct, plane, view);
              const [low, high] = [0, 1, 2].filter((axis) => axis !== plane.across);
              const [u, v] = [index[low] + 0.5, index[high] + 0.5];  // the middle of its pixel in the picture
              return {plane, point: G.point(ct, back), place, drawn: [numbers[0] * u + numbers[2] * v + numbers[4],
                numbers[1] * u + numbers[3] * v + numbers[5]], back: G.index(ct, G.point(ct, index))};
            })""",
            cases,
            SliceGeometry="workbench/page/slice_geometry.js",
        )
        for (grid, index, view, name), answer in zip(cases, answers):
            self.assertLess(math.dist(answer["point"], made_cases.point_of(grid, index)), 0.01)
            self.assertLess(math.dist(answer["drawn"], answer["place"]), 1e-6, "the picture lies where points lie")
            self.assertLess(math.dist(answer["back"], index), 1e-6)
            plane = answer["plane"]
            axes = [plane["across"], plane["right"]["axis"], plane["down"]["axis"]]
            self.assertEqual(sorted(axes), [0, 1, 2], (grid, name))
            # On the screen: to the right the patient's left (sagittal: back), down the back (others: feet).
            along = lambda one, row: one["sign"] * grid["direction"][row][one["axis"]]
            self.assertGreater(along(plane["right"], 1 if name == "sagittal" else 0), 0)
            self.assertGreater(along(plane["down"], 1) if name == "axial" else -along(plane["down"], 2), 0)

    def test_a_pixel_that_is_clicked_comes_back(self):
        random = numpy.random.default_rng(1)
        cases = []
        for _ in range(COUNT):
            width, height = (int(side) for side in random.integers(16, 4000, 2))
            case = {"size": [width, height], "frame": random.uniform(100, 1500, 2).tolist()}
            case.update(factor=random.uniform(0.2, 30), around=random.uniform(0, 1, 2).tolist())
            case.update(by=random.uniform(-300, 300, 2).tolist(), flips=random.integers(0, 2, 2).tolist())
            case["pixel"] = [random.uniform(-0.5, width - 0.5), random.uniform(-0.5, height - 0.5)]
            cases.append(case)
        answers = value(
            """given.map(({size, frame, factor, around, by, flips, pixel}) => {
              let port = {...Viewport.fitted(...size, ...frame), flip_u: !!flips[0], flip_v: !!flips[1]};
              const place = [around[0] * frame[0], around[1] * frame[1]], under = Viewport.toPixel(port, place);
              port = Viewport.zoomed(port, factor, place);
              const stays = Viewport.toPixel(port, place);
              port = Viewport.panned(port, by);
              const moved = Viewport.toPixel(port, [place[0] + by[0], place[1] + by[1]]);
              port = Viewport.resized(port, frame[0] * 0.7, frame[1] * 1.1);
              const [a, b, c, d, e, f] = Viewport.canvasTransform(port, 1);
              return {
                back: Viewport.toPixel(port, Viewport.toScreen(port, pixel)), under, stays, moved,
                drawn: [a * (pixel[0] + 0.5) + e, d * (pixel[1] + 0.5) + f], screen: Viewport.toScreen(port, pixel)};
            })""",
            cases,
            Viewport="workbench/page/viewport.js",
        )
        worst = {"clicked": max(off(got["back"], case["pixel"]) for case, got in zip(cases, answers))}
        for what, (a, b) in {
            "zoomed": ("under", "stays"),
            "panned": ("moved", "stays"),
            "drawn": ("drawn", "screen"),
        }.items():
            worst[what] = max(off(got[a], got[b]) for got in answers)
        self.expect_small(worst)
        corners = value(
            """[[0, 0], [199, 99]].map((at) => [false, true].map(
              (flip_u) => Viewport.toScreen({...Viewport.fitted(200, 100, 400, 400), flip_u}, at)))""",
            Viewport="workbench/page/viewport.js",
        )
        # Two CSS pixels for each pixel; the centre of the first is one CSS pixel inside the image.
        self.assertEqual(corners, [[[1, 101], [399, 101]], [[399, 299], [1, 299]]])

    def test_projection_and_triangulation(self):
        random = numpy.random.default_rng(2)
        cases = []
        for _ in range(COUNT):
            place = random.uniform(-80, 80, 3)
            cameras = [random_camera(random, place) for _ in range(int(random.integers(2, 5)))]
            cases.append({"world": place.tolist(), "cameras": cameras, "off": random.normal(size=2).tolist()})
        answers = value(
            """given.map(({world, cameras, off}) => {
              const pixels = cameras.map((camera) => Geometry.pixel(camera, world));
              const seen = cameras.map((camera, i) => ({camera, pixel: pixels[i]}));
              const wrong = seen.slice(0, 2).map((one, i) =>
                  (i ? one : {...one, pixel: [one.pixel[0] + off[0], one.pixel[1] + off[1]]}));
              return {pixels, exact: Sight.triangulated(seen), wrong: Sight.triangulated(wrong),
                      line: Sight.epipolarLine(cameras[0], pixels[0], cameras[1]),
                      angle: Sight.angle_deg(cameras[0], cameras[1]),
                      none: [Sight.triangulated([seen[0]]), Sight.triangulated([seen[0], seen[0]])]};
            })""",
            cases,
            Geometry="workbench/page/geometry.js",
            Sight="workbench/page/geometry.js",
        )
        worst = {name: [0] for name in ("pixel", "world_mm", "rays_mm", "line_px", "angle_deg")}
        for case, answer in zip(cases, answers):
            self.assertEqual(answer["none"], [None, None], "this cannot be triangulated")
            cameras, world = case["cameras"], case["world"]
            rays = [ray(camera, pixel(camera, world)) for camera in cameras]
            if abs(rays[0][1] @ rays[1][1]) > 0.998:
                continue  # nearly parallel: nothing is determined
            worst["pixel"] += [off(pixel(camera, world), at) for camera, at in zip(cameras, answer["pixels"])]
            worst["world_mm"].append(math.dist(answer["exact"]["world_mm"], world))
            moved = ray(cameras[0], pixel(cameras[0], world) + case["off"])
            normal = numpy.cross(moved[1], rays[1][1])
            distance = abs((rays[1][0] - moved[0]) @ normal) / numpy.linalg.norm(normal)
            worst["rays_mm"].append(abs(answer["wrong"]["distance_mm"] - distance))
            other = pixel(cameras[1], world)
            if (other > 0).all() and (other < [cameras[1]["width_px"] - 1, cameras[1]["height_px"] - 1]).all():
                a, b = (numpy.array(end) for end in answer["line"])
                along, apart = (b - a) / numpy.linalg.norm(b - a), other - a
                worst["line_px"].append(abs(float(apart[0] * along[1] - apart[1] * along[0])))
            axes = [numpy.array(camera["camera_from_world"])[2, :3] for camera in cameras[:2]]
            central = [ray(camera, numpy.array(camera["intrinsics"])[:2, 2])[1] for camera in cameras[:2]]
            self.assertTrue(numpy.allclose(axes, central))
            expected = numpy.degrees(numpy.arccos(numpy.clip(central[0] @ central[1], -1, 1)))
            worst["angle_deg"].append(abs(answer["angle"] - expected))
        self.assertGreater(len(worst["line_px"]), COUNT / 2)
        self.expect_small({what: max(differences) for what, differences in worst.items()})

    def test_marrow_projects_the_same_way(self):
        """The page's pixels are given to marrow as places where points are seen, and marrow says how far it is off."""
        folder = pathlib.Path(tempfile.mkdtemp(prefix="marrow-geometry-"))
        self.addCleanup(shutil.rmtree, folder)
        random = numpy.random.default_rng(4)
        world = random.uniform(-10, 10, (5, 3))
        cameras = {"v%d" % i: random_camera(random, world.mean(axis=0)) for i in range(60)}
        pixels = value(
            "given.cameras.map((c) => given.world.map((w) => Geometry.pixel(c, w)))",
            {"cameras": list(cameras.values()), "world": world.tolist()},
            Geometry="workbench/page/geometry.js",
        )
        for name, camera in cameras.items():
            write_png(folder / (name + ".png"), numpy.zeros((camera["height_px"], camera["width_px"]), int), bits=8)
            transform = {"target": "camera", "source": "world", "matrix": camera["camera_from_world"]}
            text = {"marrow-camera": 1, **camera, "camera_from_world": transform}
            (folder / (name + ".yaml")).write_text(json.dumps(text))
        points = [
            {"name": str(k), "at_mm": place.tolist(), "seen_px": {n: p[k] for n, p in zip(cameras, pixels)}}
            for k, place in enumerate(world)
        ]
        (folder / "points.yaml").write_text(json.dumps({"marrow-points": 1, "points": points}))
        files = lambda ending: json.dumps([str(folder / (name + ending)) for name in cameras])
        told = marrow(
            *["run", SOURCE / "pipelines/workbench/check-cameras.yaml", "--out", folder / "out", "--only", "metrics"],
            *["--set", "check.known_points=%s" % (folder / "points.yaml")],
            *["--set", "views.names=" + json.dumps(list(cameras)), "--set", "views.images=" + files(".png")],
            *["--set", "views.cameras=" + files(".yaml")],
        )
        self.assertEqual(told.returncode, 0, told.stderr)
        metrics = json.loads((folder / "out" / "outputs" / "metrics.json").read_text())["metrics"]
        error = next(one for one in metrics if one["name"] == "error")
        print("marrow and the page differ by %.2g px over %d views" % (error["value"], len(cameras)))
        self.assertLess(error["value"], 0.01)

    def test_large_turns_take_the_shorter_way(self):
        turns = ((0, 178, 0.5, 89), (100, 260, 0.25, 140), (170, -170, 0.5, 180), (3, 3, 0.5, 3))
        answers = value(
            """given.map(([begin, end, share, wanted]) => {
              const turn = (deg) => Geometry.rotation([1, 2, 3], deg * Math.PI / 180, [5, 6, 7]);
              const between = (a, b, share) => PlaceBetween.between(turn(a), turn(b), share, [5, 6, 7]);
              return [between(begin, end, share), between(wanted, wanted, 0)];
            })""",
            turns,
            Geometry="workbench/page/geometry.js",
            PlaceBetween="workbench/page/place_sequence.js",
        )
        for found, wanted in answers:
            self.assertLess(angle_deg(found, wanted), 1e-4)
            self.assertLess(math.dist(at(found, [5, 6, 7]), [5, 6, 7]), 1e-9)


class ModulesTest(unittest.TestCase):
    """The greys of X-rays, sizes of pictures, what the costs and the check of the cameras say."""

    def ranges(self, image):
        """The windows for an image of 200 x 200 pixels."""
        numbers = numpy.clip(numpy.round(image), 0, 65535).astype(int).ravel().tolist()
        return value(
            "Picture.rangesOf({numbers: Uint16Array.from(given), width_px: 200, height_px: 200})",
            numbers,
            Picture="workbench/page/xray_picture.js",
        )

    def test_the_window_is_that_of_the_body(self):
        """The collimator is 0, air is about 60000, and the body has 4000 to 30000."""
        random = numpy.random.default_rng(3)
        image = random.normal(60000, 200, (200, 200))
        image[60:140] = random.uniform(4000, 30000, (80, 200))
        image[:, :40] = image[:, 160:] = 0
        ranges = self.ranges(image)
        self.assertAlmostEqual(ranges["body"][0], 4000, delta=600)
        self.assertAlmostEqual(ranges["body"][1], 30000, delta=600)
        self.assertEqual(ranges["all"][0], 0)
        self.assertGreater(ranges["all"][1], 59000)
        ranges = self.ranges(numpy.random.default_rng(4).integers(1000, 50000, 40000))
        self.assertEqual(ranges["body"], ranges["all"], "an image that is all body is shown whole")
        limb = numpy.full((200, 200), 60000)  # dark, in the middle, which no corner shows: thick bone is no collimator
        limb[:, 60:140] = numpy.linspace(5000, 30000, 80)
        limb[:, 60:90] = 5000
        low, high = self.ranges(limb)["body"]
        self.assertEqual(low, 5000)
        self.assertLess(high, 31000)

    def test_equalised_contrast_is_the_same_in_dark_and_bright_regions(self):
        """Sixteen greys on a dark and on a bright half."""
        random = numpy.random.default_rng(5)
        grey = numpy.where(numpy.arange(128) < 64, 30, 200) + random.integers(0, 16, (128, 128))
        equalised = "[...Equalise.equalised(Uint8Array.from(given), 128, 128)]"
        shown = value(equalised, grey.ravel().tolist(), Equalise="workbench/page/xray_picture.js")
        shown = numpy.array(shown).reshape(128, 128)
        for columns in (slice(8, 56), slice(72, 120)):
            self.assertGreater(shown[:, columns].std(), 2.5 * grey[:, columns].std())

    def test_a_picture_keeps_its_size_against_its_frame(self):
        got = value(
            """(() => {
              const port = Viewport.zoomed(Viewport.fitted(200, 100, 400, 400), 3, [200, 200]);
              const wide = Viewport.resized(port, 800, 400), back = Viewport.resized(wide, 400, 400);
              const ct = {size: [40, 30, 20], spacing_mm: [1, 1, 2], origin_mm: [0, 0, 0],
                          direction: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]};
              const plane = Slices.planes(ct).axial, whole = Slices.whole(ct, plane, 400, 400);
              const small = Slices.resized(ct, plane, whole, 200, 300);
              return [port.zoom, wide.zoom, back.zoom, whole.scale, small.scale];
            })()""",
            Viewport="workbench/page/viewport.js",
            Slices="workbench/page/slice_geometry.js",
        )
        self.assertEqual(got, [6, 12, 6, 10, 5], "3 times the whole image stays 3 times the whole image")

    def test_pictures_are_arranged_as_large_as_possible(self):
        sizes = [(2, 1, 400, 800), (2, 1, 800, 400), (4, 1, 800, 800), (20, 1, 430, 600)]
        got = value("given.map((one) => Tiles.columnsFor(...one))", sizes, Tiles="workbench/page/viewport.js")
        found = [(one["columns"], one["is_scrolled"]) for one in got]
        self.assertEqual(found, [(1, False), (2, False), (2, False), (2, True)])

    def test_a_small_probability_is_not_nothing(self):
        got = value("given.map(Place.failureText)", [0, 0.0004, 0.0523, 0.4, 1], Place="workbench/page/place_steps.js")
        self.assertEqual(got, ["less than 0.1 %", "less than 0.1 %", "5.2 %", "40 %", "more than 99.9 %"])

    def advice(self, **typed_mm):
        """What the check says if these sizes of a pixel were typed; the true one is 1 mm."""
        views = [
            {"view": {"name": name, "camera": {"c_arm": {**ARM, "pixel_mm": size_mm}}}, "camera": camera(name, size_mm)}
            for name, size_mm in typed_mm.items()
        ]
        landmarks = [
            {
                "name": name,
                "model_mm": place,
                "pixels": {view: pixel(view, place + SHIFT).tolist() for view in BETA_DEG},
            }
            for name, place in MODEL.items()
        ]
        return value("Size.advice(...given)", [views, landmarks], Size="workbench/page/xray_views.js")

    def test_the_pixel_size_that_makes_the_views_agree(self):
        self.assertEqual(self.advice(frontal=1.0, lateral=1.0), "")
        both = "With pixels of 1.00 mm instead of 0.5 mm in frontal and 1.00 mm instead of 0.5 mm in lateral"
        self.assertIn(both, self.advice(frontal=0.5, lateral=0.5))
        one = self.advice(frontal=1.0, lateral=0.7)
        self.assertIn("With pixels of 1.00 mm instead of 0.7 mm in lateral it would be 0.0 mm", one)
        self.assertNotIn("frontal", one)

    def test_what_a_case_lacks(self):
        draft = {"is_saved": False, "document": {"fragments": {"distal": {"seeds": []}}, "views": [{"name": "a"}]}}
        lacks = "Steps.STEPS.map(({lacks}) => lacks(given))"
        got = value(lacks, draft, Steps="workbench/page/case.js")
        self.assertEqual(got, ["no CT yet", "no seed in distal", "no camera: a", "needs X-rays", "not saved yet"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
