# SPDX-License-Identifier: Apache-2.0
"""Calls of nodes written in Python: what they get, what they may return, and that results repeat."""
import gc
import os
import pathlib

import numpy
from all_values import values
from harness.package import main, marrow
from written_nodes import Written, processes, view

FIRST_PIXELS = """
def edges_at(*pixels):
    return marrow.EdgeMap(numpy.array([[u, v, 1, 0, 1] for u, v in pixels], float).reshape(-1, 5),
                          width_px=60, height_px=40)
"""


class Called(Written):
    def test_inputs_options_and_context_arrive(self):
        self.plugin(
            """
from pathlib import Path
from typing import List

@marrow.node("own.got", summary="got", random=True)
def got(
    view: Annotated[marrow.View, "view"],
    views: Annotated[Optional[marrow.Items[marrow.View]], marrow.over("view"), "views"] = None,
    pose: Annotated[Optional[marrow.Pose], "pose"] = None,
    *,
    context: marrow.Context,
    low: Annotated[float, "low"] = 2,
    count: Annotated[int, "count"] = 3,
    place: Annotated[Path, "place"] = Path(""),
    axis: Annotated[List[float], "axis"] = [],
) -> Annotated[marrow.Metrics, marrow.named("figures")]:
    context.progress(0.5, "half")
    context.info("a line")
    context.warn("beware")
    assert pose is None and isinstance(place, Path) and isinstance(count, int) and isinstance(low, float)
    return marrow.Metrics({
        "mean": float(view.image.array.mean()), "low": low, "count": count, "views": len(views) if views else 0,
        "axis": sum(axis), "place": float(place.name == "x"), "seed": float(context.seed % 1000003),
        "name": float(bool(views) and list(views) == ["a", "b"] and views.axis == "view")}, {"low": "mm"})
"""
        )
        told = []
        one = view()
        (self.scratch / "x").write_text("x")
        with_settings = marrow.own.got.using(seed=5, progress=told.append)
        figures = with_settings(one, views={"a": one, "b": one}, low=4, count=7, place=self.scratch / "x", axis=[1, 2])
        expected = {"mean": one.image.array.mean(), "low": 4, "count": 7, "views": 2, "axis": 3, "place": 1, "name": 1}
        for name, value in expected.items():
            self.assertEqual(figures[name], value, name)
        self.assertEqual(figures.units["low"], "mm")
        self.assertEqual(marrow.own.got(one)["views"], 0)
        seeds = {marrow.own.got.using(seed=seed)(one)["seed"] for seed in (1, 1, 2)}
        self.assertEqual(len(seeds), 2)
        texts = [event.get("text") for event in told]
        self.assertIn("half", texts)
        self.assertIn("a line", texts)
        self.assertIn("beware", texts)

    def test_several_outputs(self):
        self.plugin(
            """
class Found(NamedTuple):
    pose: Annotated[marrow.Pose, "pose"]
    none: Annotated[Optional[marrow.Pose], "none"]

@marrow.node("own.tuple", summary="tuple")
def of_tuple(view: Annotated[marrow.View, "view"]) -> Found:
    return Found(marrow.Pose(numpy.eye(4)), None)

@marrow.node("own.dict", summary="dict")
def of_dict(view: Annotated[marrow.View, "view"]) -> {
    "many": Annotated[marrow.Items[marrow.View], marrow.over("view"), "many"], "other": Annotated[marrow.View, "one"]
}:
    return {"many": {"a": view, "b": view}, "other": view}
"""
        )
        found = marrow.node("own.tuple")(view())
        self.assertTrue(numpy.array_equal(found.pose.matrix, numpy.eye(4)))
        self.assertIsNone(found.none)
        found = marrow.node("own.dict")(view())
        self.assertEqual((found.many.axis, list(found.many)), ("view", ["a", "b"]))
        self.assertTrue(numpy.array_equal(found.other.image.array, view().image.array))

    def test_values_go_through_a_node_unchanged(self):
        types = ("Volume", "SignedField", "Mesh", "Camera", "Pose", "Seeds", "View", "Image", "EdgeMap", "ShaftLines")
        self.plugin(
            "".join(
                """
@marrow.node("own.same_%s", summary="the same")
def same_%s(value: Annotated[marrow.%s, "value"]) -> Annotated[marrow.%s, marrow.named("value")]:
    return value
"""
                % (name.lower(), name.lower(), name, name)
                for name in types
            )
        )
        made = {type(value).__name__: value for value in values().values()}
        large = numpy.random.default_rng(3).normal(size=(70, 80, 90)).astype("float32")
        made["Volume"] = marrow.Volume(large, spacing_mm=(1, 2, 3), origin_mm=(4, 5, 6))
        made["SignedField"] = marrow.SignedField(large, spacing_mm=(1, 2, 3))
        made["EdgeMap"] = marrow.EdgeMap([[3, 4, 1, 0, 9], [1, 2, 0, 1, 8]], width_px=60, height_px=40)
        for name in types:
            value = made[name]
            with self.subTest(name):
                same = marrow.node("own.same_" + name.lower())(value)
                members = [one for one in dir(value) if not one.startswith("_") and one != "type"]
                for member in members:
                    before, after = getattr(value, member), getattr(same, member)
                    if not repr(before).startswith("<"):
                        self.assertTrue(numpy.array_equal(before, after), member)
        self.assertEqual(made["EdgeMap"].pixels[0, 0], 1, "in the order of rows")

    def test_inputs_are_read_only(self):
        self.plugin(
            """
@marrow.node("own.writes", summary="writes")
def writes(volume: Annotated[marrow.Volume, "ct"], view: Annotated[marrow.View, "view"]) -> Annotated[
        marrow.Metrics, marrow.named("figures")]:
    refused = 0
    for array in (volume.array, numpy.asarray(volume), view.image.array):
        try:
            array[0] = 1
        except ValueError:
            refused += 1
        try:
            array.flags.writeable = True
        except ValueError:
            refused += 1
    return marrow.Metrics({"refused": refused, "mean": float(volume.array.mean())})
"""
        )
        volume = marrow.Volume(numpy.full((30, 30, 30), 7, "float32"), spacing_mm=(1, 1, 1))
        figures = marrow.own.writes(volume, view())
        self.assertEqual((figures["refused"], figures["mean"]), (6, 7))

    def test_a_mapped_volume_can_be_given_to_a_node_in_cpp(self):
        self.plugin(
            """
@marrow.node("own.calls", summary="calls another node")
def calls(field: Annotated[marrow.SignedField, "field"]) -> Annotated[marrow.Mesh, marrow.named("mesh")]:
    return marrow.mesh.marching_cubes(field)
"""
        )
        z, y, x = numpy.mgrid[-30:31, -30:31, -30:31]
        ball = marrow.SignedField(numpy.sqrt(x**2 + y**2 + z**2) - 20, spacing_mm=(1, 1, 1))
        found, wanted = marrow.own.calls(ball), marrow.mesh.marching_cubes(ball)
        self.assertTrue(numpy.array_equal(found.vertices_mm, wanted.vertices_mm))

    def test_a_process_stays_for_the_next_call(self):
        file = self.plugin(
            FIRST_PIXELS
            + """
calls = []

@marrow.node("edges.counts", summary="counts its calls")
def counts(view: marrow.View) -> marrow.EdgeMap:
    calls.append(1)
    return edges_at((len(calls), 0))
"""
        )
        counted = [marrow.edges.counts(view(seed)).pixels[0, 0] for seed in range(5)]
        self.assertEqual(counted, [1, 2, 3, 4, 5])
        self.assertEqual(len(processes(file)), 1)
        marrow.find_plugins_again()
        self.assertEqual(processes(file), [])

    def test_the_same_bytes_with_any_number_of_threads_and_each_time(self):
        self.plugin(
            """
@marrow.node("own.hash", summary="hash and draw", random=True)
def hashed(view: Annotated[marrow.View, "view"], *, context: marrow.Context) -> Annotated[
        marrow.Metrics, marrow.named("figures")]:
    image = view.image.array.astype(float)
    return marrow.Metrics({
        "hash": float(hash("text") % 1000003), "draw": float(numpy.random.default_rng(context.seed).random()),
        "order": float(hash(tuple({"a", "b", "c"})) % 1000003), "norm": float(numpy.linalg.norm(image @ image.T))})
"""
        )
        views = {"item%d" % i: view(i) for i in range(6)}
        results = [[dict(one.values) for one in marrow.own.hash.using(threads=n)(views).values()] for n in (1, 2)]
        self.assertEqual(results[0], results[1])
        again = {str(dict(marrow.own.hash(view(1)).values)) for _ in range(100)}
        self.assertEqual(len(again), 1)

    def test_a_comparison_with_a_variant_in_python(self):
        self.plugin(
            """
@marrow.node("test.add_python", summary="adds")
def add(a: Annotated[marrow.Metrics, "first"], b: Annotated[marrow.Metrics, "second"]) -> Annotated[
        marrow.Metrics, marrow.named("value")]:
    return marrow.Metrics({"value": a["value"] + b["value"]})
"""
        )
        self.write(
            "p.yaml",
            "marrow: 1\ninputs:\n  number: {type: integer, default: 1, help: a number}\nnodes:\n"
            "  one: {uses: test.constant, with: {value: $number}}\n"
            "  both: {uses: test.add, in: {a: one, b: one}}\noutputs: {sum: both}\n",
        )
        experiment = self.write(
            "e.yaml",
            "experiment: 1\npipeline: p.yaml\ncases: {seeds: 1..2, seed_input: [number]}\n"
            "variants:\n  cpp: {}\n  python: {both.uses: test.add_python}\nbaseline: cpp\n"
            "metrics: [sum.value]\ntimed_cells: 0\n",
        )
        compared = marrow.compare(experiment, folder=self.scratch / "out")
        values = {}
        for cell in compared.cells:
            values.setdefault(cell["variant"], []).append(cell["sum.value"])
        self.assertEqual({name: sorted(found) for name, found in values.items()}, {"cpp": [2, 4], "python": [2, 4]})


PLACES = """
import os

@marrow.node("own.place", summary="where the samples are")
def place(volume: Annotated[marrow.Volume, "ct"], view: Annotated[Optional[marrow.View], "view"] = None) -> Annotated[
        marrow.Metrics, marrow.named("figures")]:
    address = volume.array.ctypes.data
    for line in open("/proc/self/maps"):
        begin, end = (int(part, 16) for part in line.split()[0].split("-"))
        if begin <= address < end:
            inode, shared = int(line.split()[4]), "s" in line.split()[1] and "w" not in line.split()[1]
    return marrow.Metrics({"process": os.getpid(), "address": address, "inode": inode, "shared": shared,
                           "sum": float(volume.array[3, 2, 1]), "aligned": volume.array.flags.aligned})
"""


def shared_megabytes():
    """What this process holds in memory without a name."""
    total = 0
    for entry in pathlib.Path("/proc/self/fd").iterdir():
        try:
            if "memfd:marrow" in os.readlink(entry):
                total += os.stat(entry).st_size / 1e6
        except OSError:
            pass
    return total


class Shared(Written):
    """Inputs are packed once and mapped, not copied for each call."""

    def test_samples_are_mapped_once(self):
        file = self.plugin(PLACES)
        samples = numpy.arange(100 * 200 * 200, dtype="float32").reshape(100, 200, 200)  # 16 MB
        volume = marrow.Volume(samples, spacing_mm=(1, 1, 1))
        found = [marrow.own.place(volume, view(seed)) for seed in range(4)]
        self.assertEqual(len({(one["process"], one["address"], one["inode"]) for one in found}), 1)
        self.assertEqual((found[0]["shared"], found[0]["aligned"]), (1, 1))
        self.assertEqual(found[0]["sum"], samples[3, 2, 1])
        self.assertAlmostEqual(shared_megabytes(), 16, delta=1)
        views = {"item%d" % seed: view(seed) for seed in range(8)}
        of_two = marrow.own.place.using(threads=2)(volume, views)
        self.assertEqual({one["inode"] for one in of_two.values()}, {found[0]["inode"]}, "all processes map the same")
        self.assertLessEqual(len(processes(file)), 2)

    def test_memory_is_given_back(self):
        self.plugin(PLACES)
        for size in (100, 120, 140):
            marrow.own.place(marrow.Volume(numpy.ones((size, 200, 200), "float32"), spacing_mm=(1, 1, 1)))
            gc.collect()
            self.assertLess(shared_megabytes(), 0.17 * size, "only the last one is there")


if __name__ == "__main__":
    main()
