# SPDX-License-Identifier: Apache-2.0
"""What could stand in place of a node: list --fits, and what check says of the others."""
import functools
import json

from harness import SOURCE
from harness.program import Case, main, marrow
from harness.sample import sample
from harness.shipped import nodes_of, shipped

INTENSITY = SOURCE / "pipelines" / "femur" / "femur-intensity.yaml"
SIMULATE = SOURCE / "pipelines" / "simulate" / "simulate.yaml"
CAMERAS = SOURCE / "pipelines" / "wrist" / "wrist-cameras.yaml"
# Of pictures, the inputs by which poses go from one node to the next.
WAYS = ("starts", "initial", "pose", "poses", "stages", "start", "first", "second", "third", "fourth")


@functools.lru_cache(None)
def fits_of(pipeline, node):
    """{node: what is said of it} for each that could stand in place of this one."""
    result = marrow("list", "--fits", pipeline, node, "--json")
    assert result.returncode == 0, result.stderr
    return {fit["node"]: fit for fit in json.loads(result.stdout)}


def check(pipeline, node, other):
    return marrow("check", pipeline, "--set", "%s.uses=%s" % (node, other))


def places(nodes_of_files):
    """(pipeline, name of a node, what it uses) for each place that a node has in a shipped pipeline. Of places with the
    same node and the same inputs wired, only the first."""
    found, known = [], set()
    for pipeline, nodes in nodes_of_files.items():
        for name, node in nodes.items():
            if "repeat" in node:
                continue  # nothing takes the place of a body
            wiring = (node["uses"], tuple(sorted(node.get("in", {}))))
            if wiring not in known:
                known.add(wiring)
                found.append((pipeline, name, node["uses"]))
    return found


def kind_of(place):
    return place[2].split(".")[0]


def node_of(reference):
    return reference.split(".")[0] if isinstance(reference, str) else None


def before(nodes, name):
    """The nodes from which the poses of a node come."""
    found, waiting = set(), [name]
    while waiting:
        wires = nodes.get(waiting.pop(), {}).get("in", {})
        waiting += [node_of(wires[way]) for way in WAYS if way in wires and node_of(wires[way]) not in found]
        found.update(waiting)
    return found


class Shipped(Case):
    @classmethod
    def setUpClass(cls):
        cls.pipelines = {pipeline: nodes_of(pipeline) for pipeline in shipped()}

    def test_check_agrees_for_every_node_in_the_places_of_the_shipped_pipelines(self):
        verdicts = {"yes": 0, "with more": 0, "no": 0}
        for pipeline, name, _ in sample(places(self.pipelines), 16, key=kind_of):
            seen = set()
            for fit in fits_of(pipeline, name).values():
                verdicts[fit["fits"]] += 1
                if fit["fits"] in seen:
                    continue  # one of each verdict is tried at each place
                seen.add(fit["fits"])
                with self.subTest("%s %s.uses=%s" % (pipeline.name, name, fit["node"])):
                    checked = check(pipeline, name, fit["node"])
                    self.assertEqual(checked.returncode, 0 if fit["fits"] == "yes" else 2, checked.stderr)
                    for fault in fit["faults"]:
                        self.assertIn(fault, checked.stderr)
                    for missing in fit["missing"]:  # "wire volume: ..." or "give the option path: ..."
                        what = missing.split(":")[0].split()[-1]
                        said = "(input|option) '%s' of .* (is not wired|must be given)" % what
                        self.assertRegex(checked.stderr, said)
        print(verdicts)
        self.assertGreater(min(verdicts.values()), 10)

    def test_what_a_picture_calls_before_is_the_start_of_the_search_whose_result_it_calls_after(self):
        compared = 0
        for file, nodes in self.pipelines.items():
            for name, node in nodes.items():
                wires = node.get("in", {})
                if not node.get("uses", "").startswith("render.") or "start" not in wires:
                    continue
                compared += 1
                with self.subTest("%s: %s" % (file.name, name)):
                    self.assertIn(node_of(wires["start"]), before(nodes, node_of(wires["pose"])))
        self.assertGreater(compared, 10)


class Fits(Case):
    plugins = []

    def test_what_check_says_of_a_node_that_does_not_fit(self):
        not_written = "output 'case': no plugin writes values of type 'simulated_bone'"
        for pipeline, node, other, *said in (
            (
                *(INTENSITY, "outline", "project.joseph"),
                "input 'projector' of similarity.contour_distance expects outline_projector, but 'outline' is "
                "radiograph_projector",
                "project.silhouette, project.silhouette_edges fit in place of project.joseph",
            ),
            (
                *(INTENSITY, "grey_cost", "similarity.contour_distance"),
                "expects outline_projector, but 'drr' is radiograph_projector",
                "is not wired",
            ),
            (
                *(INTENSITY, "drr", "project.lightfield"),
                "input 'views' of project.lightfield is not wired",
                "or use project.joseph, project.opencl, project.ray_casting, project.siddon_jacobs",
            ),
            (SIMULATE, "case", "simulate.femur", not_written, "leave it out, or name a result of another type"),
        ):
            with self.subTest(other):
                self.refused(said, "check", pipeline, "--set", "%s.uses=%s" % (node, other))
        self.assertEqual(fits_of(SIMULATE, "case")["simulate.femur"]["faults"], [not_written])

    def test_what_would_have_to_be_wired(self):
        fits = fits_of(INTENSITY, "drr")
        nodes = ["project.siddon_jacobs", "project.lightfield", "project.silhouette"]
        self.assertEqual([fits[node]["fits"] for node in nodes], ["yes", "with more", "no"])
        self.assertIn("wire views: ", fits["project.lightfield"]["missing"][0])

    def test_a_node_that_needs_a_device_says_whether_one_is_there(self):
        devices = [name for name, fit in fits_of(INTENSITY, "drr").items() if "device" in fit]
        self.assertEqual(devices, ["project.opencl"])
        hidden = self.printed("list", "--fits", INTENSITY, "drr", extra_environment={"OCL_ICD_VENDORS": "/nonexistent"})
        self.assertIn(
            "no device with OpenCL is here; a driver for the graphics card, or Debian's package pocl-opencl-icd, "
            "provides one",
            " ".join(hidden.split()),
        )

    def test_an_output_that_only_the_replaced_node_has(self):
        self.assertEqual(
            fits_of(CAMERAS, "check")["camera.carm"]["faults"],
            ["node 'check' has no output 'metrics'", "node 'check' has no output 'picture'"],
        )

    def test_in_words(self):
        listed = self.printed("list", "--fits", INTENSITY, "drr")
        self.assertTrue(listed.startswith("In place of 'drr' in "))
        self.assertLess(listed.index("Fits\n"), listed.index("project.siddon_jacobs"))
        self.assertLess(listed.index("Fits when more is given\n"), listed.index("project.lightfield"))
        self.assertLess(listed.index("Does not fit\n"), listed.index("project.silhouette_edges"))

    def test_an_unknown_node_and_a_faulty_pipeline(self):
        unknown = ["the pipeline has no node 'outlines'", "did you mean 'outline'?"]
        self.refused(unknown, "list", "--fits", INTENSITY, "outlines")
        faulty = ["drr", "--set", "drr.uses=project.josef"]
        self.refused("unknown node 'project.josef'", "list", "--fits", INTENSITY, *faulty)


if __name__ == "__main__":
    main()
