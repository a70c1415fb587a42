# SPDX-License-Identifier: Apache-2.0
"""Single nodes as Python functions."""
import inspect

import numpy
from harness.package import PackageCase, main, marrow


class Nodes(PackageCase):
    def test_a_node_gives_what_it_gives_in_a_pipeline(self):
        pipeline = self.pipeline.set({"edges.uses": "edges.canny", "edges.noise_high": 8})
        expected = pipeline.run(only=["edges"])["edges"]["lateral"].pixels
        views = marrow.read.case(path=self.folder).views
        self.assertTrue(numpy.array_equal(marrow.edges.canny(views["lateral"], noise_high=8).pixels, expected))
        found = marrow.node("edges.canny")(view=views["lateral"], noise_high=8)
        self.assertTrue(numpy.array_equal(found.pixels, expected))
        self.assertFalse(len(marrow.edges.canny(views["lateral"]).pixels) == len(expected))

    def test_a_list_means_one_call_for_each_item(self):
        edges = marrow.edges.canny(self.case.views)
        self.assertEqual((edges.axis, list(edges)), ("view", ["frontal", "lateral"]))
        of_list = marrow.edges.canny([self.case.views["lateral"]])
        self.assertTrue(numpy.array_equal(of_list["lateral"].pixels, edges["lateral"].pixels))
        of_dict = marrow.edges.canny({"one": self.case.views["lateral"]})
        self.assertEqual(list(of_dict), ["one"])

    def test_functions_go_from_node_to_node(self):
        adder = marrow.test.adder(marrow.test.constant(value=2))
        self.assertEqual((adder.type, repr(adder)), ("adder", "<marrow adder>"))
        self.assertEqual(marrow.test.apply(adder, marrow.test.constant(value=3))["value"], 5)

    def test_a_whole_pipeline_as_functions(self):
        case = marrow.read.case(path=self.folder)
        model = marrow.mesh.marching_cubes(marrow.segment.level_set(volume=case.ct, seeds=case.seeds))
        edges = marrow.edges.adaptive_relaxation(case.views, low=50, high=75)
        shaft = marrow.shaft.hough_pairs(edges=edges, view=case.views)
        start = marrow.initial.shaft_axis(model=model, lines=shaft, views=case.views)
        outline = marrow.project.silhouette_edges(model=model, volume=case.ct)
        cost = marrow.similarity.contour_distance(projector=outline, views=case.views, edges=edges)
        least = marrow.optimizer.levenberg_marquardt()
        found = marrow.register.multiresolution(cost=cost, optimizer=least, start=start)
        expected = self.pipeline.run(only=["pose"], keep=False)["pose"]
        self.assertEqual(found.pose["distal"].matrix.tolist(), expected["distal"].matrix.tolist())

    def test_it_explains_itself(self):
        canny = marrow.edges.canny
        self.assertIn("Canny's edge detector", canny.__doc__)
        self.assertIn("    view (view): X-ray view", canny.__doc__)
        self.assertIn("    edges (edge_map): edge pixels at sub-pixel positions", canny.__doc__)
        self.assertIn(
            "    sigma_px (number in px, at least 0.7, at most 10, default 1.5): standard deviation", canny.__doc__
        )
        signature = inspect.signature(canny)
        names = ["view", "sigma_px", "logarithm", "window_px", "noise_low", "noise_high"]
        self.assertEqual(list(signature.parameters), names)
        self.assertEqual(signature.parameters["noise_high"].default, 5)
        self.assertEqual(signature.parameters["noise_high"].kind, inspect.Parameter.KEYWORD_ONLY)
        self.assertIn("canny", dir(marrow.edges))
        self.assertIn("edges", dir(marrow))
        self.assertEqual(marrow.edges.__doc__, "edge pixels of an X-ray view")

    def test_wrong_calls(self):
        view, canny = self.case.views["lateral"], marrow.edges.canny
        unknown = "edges.canny has no input or option 'noise_hihg'; did you mean 'noise_high'?"
        self.refuses(
            (unknown, lambda: canny(view, noise_hihg=5)),
            ("edges.canny takes 1 input, got 2; options are given by name", lambda: canny(view, 5)),
            ("edges.canny: the input 'view' is given twice", lambda: canny(view, view=view)),
            ("edges.canny needs the input 'view', of type view", canny),
            ("input 'view': the list is empty", lambda: canny([])),
            ("input 'view': expected view, got int", lambda: canny(7)),
            ('expected a number, got the quoted text "much"', lambda: canny(view, noise_high="much")),
            ("-1 is below the least allowed, 0", lambda: canny(view, noise_high=-1)),
            ("low", lambda: canny(view, noise_low=9, noise_high=5)),
            ("input 'view' of edges.canny expects view, got image", lambda: canny(view.image)),
            (
                r"expected view, got ndarray; an array has no camera: give marrow.View\(array, camera\)",
                lambda: canny(view.image.array),
            ),
            (
                r"an array has no spacing: give marrow.Volume\(array, spacing_mm=\(x, y, z\)\)",
                lambda: marrow.segment.threshold(self.case.ct.array),
            ),
            ("unknown node 'edges.cany'; did you mean 'edges.canny'?", lambda: marrow.node("edges.cany")),
        )
        error = self.fault_of(lambda: canny(view, noise_high=-1))
        self.assertEqual((error.node, error.option), ("edges.canny", "noise_high"))
        error = self.fault_of(lambda: canny(view.image))
        self.assertEqual((error.node, error.port), ("edges.canny", "view"))
        self.refuses(
            ("no node 'edges.cany'; did you mean 'canny'?", lambda: marrow.edges.cany),
            ("marrow has no attribute or kind of nodes 'egdes'; did you mean 'edges'", lambda: marrow.egdes),
            kind=AttributeError,
        )

    def test_a_node_that_fails(self):
        error = self.fault_of(lambda: marrow.read.case(path="/nowhere"), marrow.RunError)
        self.assertEqual((error.node, error.file), ("read.case", None))
        self.assertRegex(str(error), "^read.case failed: /nowhere: expected the folder of a case")

    def test_settings_of_a_call(self):
        draw = marrow.test.draw
        self.assertEqual(draw.using(seed=3)()["value"], draw.using(seed=3)()["value"])
        self.assertNotEqual(draw.using(seed=3)()["value"], draw.using(seed=4)()["value"])
        with self.assertRaisesRegex(marrow.Error, "threads: expected a whole number from 0 to 1024, got 1.5"):
            draw.using(threads=1.5)
        told = []
        marrow.edges.canny.using(progress=told.append)(self.case.views)
        self.assertIn("finished", {event["event"] for event in told})

    def test_an_input_and_an_option_of_one_name(self):
        image = self.scratch / "image.png"
        image.write_bytes(marrow.display.png(numpy.zeros((8, 8), "uint8")))
        with self.assertRaisesRegex(marrow.RunError, "nowhere.yaml"):
            marrow.read.view(image=image, camera="nowhere.yaml")
        camera = marrow.Camera(8, 8, [[1000, 0, 4], [0, 1000, 4], [0, 0, 1]], numpy.eye(4))
        self.assertEqual(marrow.read.view(camera, image=image).view.image.width, 8)
        with self.assertRaisesRegex(marrow.PipelineError, "expects camera, got view"):
            marrow.read.view(image="nowhere.png", camera=self.case.views["frontal"])
        self.assertEqual(list(inspect.signature(marrow.read.view).parameters).count("camera"), 1)

    def test_several_outputs_are_a_named_tuple(self):
        sides = marrow.test.sides(with_maybe=False)
        self.assertEqual(sides._fields, ("left", "right", "both", "maybe"))
        self.assertIsNone(sides.maybe)
        self.assertEqual(sides.both.axis, "side")
        self.assertEqual(sides.left["value"], 1)
        self.assertEqual(marrow.test.add(sides.left, sides.right)["value"], 3)


if __name__ == "__main__":
    main()
