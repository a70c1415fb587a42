# SPDX-License-Identifier: Apache-2.0
"""The network, the loop that trains it, and its export."""
import contextlib
import io
import pathlib
import tempfile
import unittest
import unittest.mock

import network_cases  # first: it looks for PyTorch

import cv2
import export
import images
import numpy as np
import simulated
import torch
import training
import yaml
from model import Head, UNet


def small(heads=None):
    torch.manual_seed(3)
    return UNet(1, heads or {"sum": Head(1)}, widths=(4, 8))


def batch(random):
    """The network is to find the mean of 3 x 3 pixels."""
    image = torch.from_numpy(random.normal(0.5, 0.3, (2, 1, 16, 16)).astype(np.float32))
    return image, torch.nn.functional.avg_pool2d(image, 3, 1, 1)


def loss(outputs, wanted):
    return ((outputs[0] - wanted) ** 2).mean()


def trained(folder, steps=40, seed=1, judge=lambda network: 0, network=None, loss_of=loss):
    network = network or small()
    with contextlib.redirect_stdout(io.StringIO()):
        losses = training.train(network, batch, loss_of, judge, steps=steps, seed=seed, out=folder, looks=4)
    return network, losses


def same(one, other):
    return all(torch.equal(a, b) for a, b in zip(one.state_dict().values(), other.state_dict().values()))


class Network(unittest.TestCase):
    def test_each_head_has_its_channels_and_stride(self):
        network = UNet(3, {"classes": Head(4), "points": Head(7, 4)}, widths=(4, 8, 12))
        shapes = [tuple(output.shape) for output in network(torch.zeros(2, 3, 32, 48))]
        self.assertEqual(shapes, [(2, 4, 32, 48), (2, 7, 8, 12)])

    def test_a_stride_that_no_level_has_is_refused(self):
        for stride in (3, 8):
            with self.assertRaisesRegex(ValueError, "head points: the stride must be 1, 2, 4 ... 4"):
                UNet(1, {"points": Head(1, stride)}, widths=(4, 8, 12))

    def test_values_beyond_the_limits_count_as_the_limits(self):
        network = small().eval()
        with torch.no_grad():
            far, limit = (network(torch.full((1, 1, 8, 8), value))[0] for value in (1000.0, 5.0))
        self.assertTrue(torch.equal(far, limit))


class Settling(unittest.TestCase):
    def test_batch_norms_take_the_mean_statistics_of_batches_under_todays_weights(self):
        network = small()
        first, norm = network.down[0][0], network.down[0][1]  # the limits add 1 to the image
        training.settle(network, batch, seed=1)
        images = [batch(np.random.default_rng([1, i, 1]))[0] for i in range(training.SETTLING)]
        with torch.no_grad():
            mean = torch.stack([first(image + 1).mean((0, 2, 3)) for image in images]).mean(0)
        self.assertTrue(torch.allclose(norm.running_mean, mean, atol=1e-5))
        training.settle(network, batch, seed=1)  # nothing is left of what was there before
        self.assertTrue(torch.allclose(norm.running_mean, mean, atol=1e-5))


class Loop(network_cases.InAFolder):
    def test_the_loss_falls_and_the_same_seed_gives_the_same_network(self):
        network, losses = trained(self.folder)
        self.assertLess(np.mean(losses[-5:]), 0.5 * np.mean(losses[:5]))
        with tempfile.TemporaryDirectory() as other:
            self.assertTrue(same(network, trained(pathlib.Path(other))[0]))
        with tempfile.TemporaryDirectory() as other:
            self.assertFalse(same(network, trained(pathlib.Path(other), seed=2)[0]))

    def test_goes_on_where_it_was_interrupted(self):
        with tempfile.TemporaryDirectory() as other:
            whole, losses = trained(pathlib.Path(other))
        calls = []

        def stops_at_the_third_look(network):
            calls.append(1)
            if len(calls) == 3:
                raise KeyboardInterrupt
            return 0

        with self.assertRaises(KeyboardInterrupt):
            trained(self.folder, judge=stops_at_the_third_look)
        network, rest = trained(self.folder)
        self.assertEqual(rest, losses[20:])
        self.assertTrue(same(network, whole))

    def test_keeps_the_weights_that_were_liked_best(self):
        liked, figures = {}, iter([1, 3, 2, 0])

        def judge(network):
            figure = next(figures)
            liked[figure] = {name: value.clone() for name, value in network.state_dict().items()}
            return figure

        network, _ = trained(self.folder, judge=judge)
        self.assertTrue(all(torch.equal(value, liked[3][name]) for name, value in network.state_dict().items()))

    def test_a_loss_that_is_not_finite_ends_it(self):
        with self.assertRaisesRegex(SystemExit, "train: the loss is not finite at step 0; try a smaller rate"):
            trained(self.folder, loss_of=lambda outputs, wanted: outputs[0].mean() * float("nan"))

    def test_rate_rises_and_falls(self):
        rates = [training.rate_at(step, 100, 2.0) for step in (0, 4, 5, 52, 99)]
        np.testing.assert_allclose(rates, [0.4, 2, 2, 1.0408, 0.0405], atol=0.02)


class Export(network_cases.InAFolder):
    CARD = {
        "file": "sums",
        "marrow-network": 1,
        "input": {"size_px": [16, 24]},
        "outputs": {"classes": {"layer": "classes", "names": ["a", "b"]}},
    }

    def write(self, network=None):
        network = network or small({"classes": Head(2), "points": Head(3, 2)})
        with contextlib.redirect_stdout(io.StringIO()) as said:
            worst = export.write(network, self.CARD, self.folder)
        return worst, said.getvalue()

    def test_opencv_gives_the_values_of_pytorch(self):
        network = small({"classes": Head(2), "points": Head(3, 2)})
        trained(self.folder, network=network, steps=5, loss_of=lambda outputs, wanted: (outputs[0] ** 2).mean())
        worst, said = self.write(network)
        self.assertLess(worst, 1e-4)
        self.assertRegex(said, r"sums.onnx: 0.0\d MB, sha256 [0-9a-f]{16}; OpenCV differs from PyTorch by \d")
        card = yaml.safe_load((self.folder / "sums.yaml").read_text())
        self.assertEqual(card, {key: value for key, value in self.CARD.items() if key != "file"})

    def test_other_values_are_found(self):
        network, _ = trained(self.folder, steps=5)
        self.CARD = {**self.CARD, "input": {"size_px": [16, 16]}}
        self.write(network)
        with torch.no_grad():
            network.out["sum"].bias += 0.01
        self.assertGreater(export.difference(network, self.folder / "sums.onnx", (1, 16, 16)), 5e-3)

    def test_a_network_that_is_too_large_or_not_what_opencv_computes_is_refused(self):
        with unittest.mock.patch.object(export, "LARGEST_MB", 0.001):
            with self.assertRaisesRegex(SystemExit, "sums.onnx has 0.0 MB, but a network has at most 0.*fewer maps"):
                self.write()
        with unittest.mock.patch.object(export, "difference", lambda *_: 0.5):
            with self.assertRaisesRegex(
                SystemExit, "values of .*sums.onnx differ from PyTorch's by 0.5, more than 0.0001"
            ):
                self.write()


class Command(network_cases.InAFolder):
    def test_says_which_packages_are_missing(self):
        for module in ("torch", "cv2"):
            (self.folder / (module + ".py")).write_text("raise ImportError")
        done = network_cases.train("bones", "--data", "d", "--out", "o", PYTHONPATH=str(self.folder))
        self.assertEqual(done.returncode, 1)
        wanted = "train: a training needs packages that are not there: apt install python3-torch python3-opencv\n"
        self.assertEqual(done.stderr, wanted)

    def test_help_names_the_networks(self):
        done = network_cases.train("--help", PYTHONPATH="")
        self.assertEqual(done.returncode, 0)
        self.assertIn("networks: bones", done.stdout)


# Images as a network sees them, against values computed by hand.


class Images(unittest.TestCase):
    def test_line_integrals(self):
        grey = np.array([[1000, 500], [0, 1]], np.uint16)
        darkest = -np.log(0.005)
        np.testing.assert_allclose(images.line_integrals(grey), [[0, np.log(2)], [darkest, darkest]], rtol=1e-6)

    def test_normalised(self):
        values = np.arange(101, dtype=np.float32)
        np.testing.assert_allclose(images.normalised(values, 10, 60), (values - 10) / 50, rtol=1e-6)
        self.assertTrue((images.normalised(np.full(9, 3.0), 10, 60) == 0).all())

    def test_resized_is_the_mean_of_pixels(self):
        values = np.arange(16, dtype=np.float32).reshape(4, 4)
        np.testing.assert_allclose(images.resized(values, 2), [[2.5, 4.5], [10.5, 12.5]])

    def test_scaled(self):
        np.testing.assert_allclose(images.scaled(np.array([0, 1, 5])), [0, 0.5, 2.5])

    def test_a_random_motion_keeps_the_middle_and_the_zoom(self):
        for seed in range(20):
            matrix = images.random_motion(np.random.default_rng(seed), (64, 32), (10, 20), zoom=1.25)
            np.testing.assert_allclose(matrix @ [10, 20, 1], [15.5, 31.5], atol=1e-9)
            lengths = np.linalg.norm(matrix[:, :2], axis=0)
            self.assertAlmostEqual(lengths[0], lengths[1])
            self.assertTrue(0.79 < lengths[0] < 1.26)

    def test_a_round_field_covers_what_is_outside_of_a_disc(self):
        for seed in range(20):
            random = np.random.default_rng(seed)
            outside = images.outside_of_round_field(random, (120, 160))
            values = random.uniform(0, 2, (120, 160)).astype(np.float32)
            shown = images.covered(random, values, outside)
            from_rim = cv2.distanceTransform((~outside).astype(np.uint8), cv2.DIST_L2, 5)
            v, u = np.unravel_index(np.argmax(from_rim), from_rim.shape)
            self.assertGreater(from_rim[v, u], 40)  # the disc's middle is deep inside
            np.testing.assert_allclose(shown[from_rim > 12], values[from_rim > 12], atol=1e-4)
            far = cv2.distanceTransform(outside.astype(np.uint8), cv2.DIST_L2, 5) > 12
            if far.any():
                self.assertLess(np.ptp(shown[far]), 1e-4)

    def test_changes_depend_on_the_random_numbers_alone_and_stay_finite(self):
        values = np.linspace(0, 3, 400, dtype=np.float32).reshape(20, 20)
        likeness = []
        for seed in range(30):
            one, again = (images.changed(np.random.default_rng(seed), values) for _ in range(2))
            self.assertTrue(np.isfinite(one).all())
            self.assertTrue((one == again).all())
            likeness.append(np.corrcoef(one.ravel(), values.ravel())[0, 1])
        self.assertGreater(min(likeness), 0.5)
        self.assertGreater(np.median(likeness), 0.9)


# Simulated cases: what is drawn, and whether images, labels, borders, cameras and surfaces agree.


class Drawing(unittest.TestCase):
    def test_anatomies_of_the_parts_and_of_experiments_differ(self):
        parts = [set(seeds) for seeds in simulated.SEEDS.values()] + [set(range(1, 51))]
        self.assertEqual(len(set().union(*parts)), sum(map(len, parts)))

    def test_depends_on_the_seed_alone(self):
        one, again, other = (simulated.settings_of("femur", seed, 2, 64) for seed in (1000, 1000, 1001))
        self.assertEqual(one, again)
        self.assertNotEqual(one, other)

    def test_half_of_the_metal_is_off(self):
        drawn = [simulated.settings_of("femur", seed, 2, 64)[0] for seed in range(1000, 1400)]
        for name in ("pin", "plate", "clamp", "cable", "table"):
            off = np.mean([one["clutter." + name] == "off" for one in drawn])
            self.assertTrue(0.45 < off < 0.65, (name, off))


class Case(unittest.TestCase):
    """One small case of each bone, made with marrow."""

    def case(self, kind, seed=1003, size_px=128):
        with tempfile.TemporaryDirectory() as data, contextlib.redirect_stderr(io.StringIO()):
            simulated.make_cases(data, kind, [seed], views=2, size_px=size_px, surfaces=True)
            case = simulated.read_case(data, kind, seed)
            vertices = {fragment.name: fragment.vertices_mm() for fragment in case.fragments}
        return case, vertices

    def check(self, case, vertices):
        self.assertEqual([view.name for view in case.views], ["v0", "v1"])
        for view in case.views:
            self.assertEqual(view.grey.shape, (128, 128))
            self.assertEqual(view.classes.shape, (128, 128))
            self.assertLess(view.classes.max(), len(simulated.CLASSES))
            np.testing.assert_allclose(view.project([[0, 0, 0]]), [[63.5, 63.5]], atol=1e-6)
            bone = (view.classes == 1) | (view.classes == 2)  # metal may hide it
            shown = cv2.dilate((view.classes > 0).astype(np.uint8), np.ones((3, 3), np.uint8))
            # The projected surface covers the bone of the fragments, and borders lie beside pixels that are not bone.
            for fragment in case.fragments:
                world = vertices[fragment.name] @ fragment.world_from_model[:3, :3].T + fragment.world_from_model[:3, 3]
                at = np.rint(view.project(world)).astype(int)
                at = at[((at >= 0) & (at < 128)).all(axis=1)]
                if len(at) > 100:  # one of a broken bone may be out of view
                    self.assertGreater(np.mean(shown[at[:, 1], at[:, 0]]), 0.99)
            at = view.borders_px.astype(int)
            self.assertTrue((view.classes[at[:, 1], at[:, 0]] < 2).all())
            near = cv2.dilate(bone.astype(np.uint8), np.ones((3, 3), np.uint8))
            self.assertTrue(near[at[:, 1], at[:, 0]].all())
        self.assertGreater(sum(len(view.borders_px) for view in case.views), 50)

    def test_broken_femur(self):
        case, vertices = self.case("femur")
        self.assertEqual([fragment.name for fragment in case.fragments], ["distal", "proximal"])
        self.check(case, vertices)

    def test_vertebra(self):
        case, vertices = self.case("vertebra")
        self.assertEqual([fragment.name for fragment in case.fragments], ["bone"])
        self.check(case, vertices)


class Messages(unittest.TestCase):
    def test_a_build_is_needed(self):
        with unittest.mock.patch.object(simulated, "ROOT", pathlib.Path("/nowhere")):
            with self.assertRaisesRegex(SystemExit, "^train: build marrow first, with tools/setup$"):
                simulated.make_case(pathlib.Path("/nowhere/1"), "femur", 1)

    def test_a_simulation_that_fails_is_named(self):
        drawn = ({"bone.uses": "simulate.femur", "bone.no_such_option": 1}, "off")
        with tempfile.TemporaryDirectory() as data, unittest.mock.patch.object(
            simulated, "settings_of", lambda *_: drawn
        ):
            with self.assertRaisesRegex(SystemExit, "simulation of femur, seed 7, failed:\n.*no_such_option"):
                simulated.make_case(pathlib.Path(data) / "7", "femur", 7)


if __name__ == "__main__":
    unittest.main()
