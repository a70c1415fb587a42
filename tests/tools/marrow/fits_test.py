# SPDX-License-Identifier: Apache-2.0
"""What could stand in place of a node: list --fits, and what check says of the others."""
import json
import unittest

from harness import SOURCE
from harness.program import Case, main, marrow
from harness.sample import sample
from harness.shipped import nodes_of, shipped

INTENSITY = SOURCE / "pipelines" / "femur" / "femur-intensity.yaml"


def fits_of(pipeline, node):
    result = marrow("list", "--fits", pipeline, node, "--json")
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout)


def check(pipeline, node, other):
    return marrow("check", pipeline, "--set", "%s.uses=%s" % (node, other))


def places():
    """(pipeline, name of a node, what it uses) for each place that a node has in a shipped pipeline. Of places with the
    same node and the same inputs wired, only the first."""
    found, known = [], set()
    for pipeline in shipped():
        for name, node in nodes_of(pipeline).items():
            if "repeat" in node:
                continue  # nothing takes the place of a body
            wiring = (node["uses"], tuple(sorted(node.get("in", {}))))
            if wiring not in known:
                known.add(wiring)
                found.append((pipeline, name, node["uses"]))
    return found


def kind_of(place):
    return place[2].split(".")[0]


class Fits(Case):
    def test_check_agrees_for_every_node_in_the_places_of_the_shipped_pipelines(self):
        verdicts = {"yes": 0, "with more": 0, "no": 0}
        for pipeline, name, _ in sample(places(), 16, key=kind_of):
            seen = set()
            for fit in fits_of(pipeline, name):
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
                        self.assertRegex(
                            checked.stderr, "(input|option) '%s' of .* (is not wired|must be given)" % what
                        )
        print(verdicts)
        self.assertGreater(min(verdicts.values()), 10)

    def test_a_projector_of_the_other_type_is_refused_with_one_that_fits(self):
        checked = check(INTENSITY, "outline", "project.joseph")
        self.assertEqual(checked.returncode, 2)
        self.assertIn(
            "input 'projector' of similarity.contour_distance expects outline_projector, but 'outline' is "
            "radiograph_projector",
            checked.stderr,
        )
        self.assertIn("project.silhouette, project.silhouette_edges fit in place of project.joseph", checked.stderr)

    def test_a_cost_that_takes_another_projector(self):
        checked = check(INTENSITY, "grey_cost", "similarity.contour_distance")
        self.assertEqual(checked.returncode, 2)
        self.assertIn("expects outline_projector, but 'drr' is radiograph_projector", checked.stderr)
        self.assertIn("is not wired", checked.stderr)

    def test_what_would_have_to_be_wired(self):
        fits = {fit["node"]: fit for fit in fits_of(INTENSITY, "drr")}
        self.assertEqual(fits["project.siddon_jacobs"]["fits"], "yes")
        self.assertEqual(fits["project.lightfield"]["fits"], "with more")
        self.assertIn("wire views: ", fits["project.lightfield"]["missing"][0])
        self.assertEqual(fits["project.silhouette"]["fits"], "no")
        checked = check(INTENSITY, "drr", "project.lightfield")
        self.assertIn("input 'views' of project.lightfield is not wired", checked.stderr)
        self.assertIn(
            "or use project.joseph, project.opencl, project.ray_casting, project.siddon_jacobs", checked.stderr
        )

    def test_a_node_that_needs_a_device_says_whether_one_is_there(self):
        fits = {fit["node"]: fit for fit in fits_of(INTENSITY, "drr")}
        self.assertEqual([name for name, fit in fits.items() if "device" in fit], ["project.opencl"])
        hidden = marrow("list", "--fits", INTENSITY, "drr", extra_environment={"OCL_ICD_VENDORS": "/nonexistent"})
        self.assertIn(
            "no device with OpenCL is here; a driver for the graphics card, or Debian's package pocl-opencl-icd, "
            "provides one",
            " ".join(hidden.stdout.split()),
        )

    def test_a_result_that_nothing_writes(self):
        fits = {fit["node"]: fit for fit in fits_of(SOURCE / "pipelines" / "simulate" / "simulate.yaml", "case")}
        fault = "output 'case': no plugin writes values of type 'simulated_bone'"
        self.assertEqual(fits["simulate.femur"]["faults"], [fault])
        checked = check(SOURCE / "pipelines" / "simulate" / "simulate.yaml", "case", "simulate.femur")
        self.assertEqual(checked.returncode, 2)
        self.assertIn(fault, checked.stderr)
        self.assertIn("leave it out, or name a result of another type", checked.stderr)

    def test_an_output_that_only_the_replaced_node_has(self):
        fits = {fit["node"]: fit for fit in fits_of(SOURCE / "pipelines" / "wrist" / "wrist-cameras.yaml", "check")}
        self.assertEqual(
            fits["camera.carm"]["faults"],
            ["node 'check' has no output 'metrics'", "node 'check' has no output 'picture'"],
        )

    def test_in_words(self):
        listed = marrow("list", "--fits", INTENSITY, "drr").stdout
        self.assertTrue(listed.startswith("In place of 'drr' in "))
        self.assertLess(listed.index("Fits\n"), listed.index("project.siddon_jacobs"))
        self.assertLess(listed.index("Fits when more is given\n"), listed.index("project.lightfield"))
        self.assertLess(listed.index("Does not fit\n"), listed.index("project.silhouette_edges"))

    def test_an_unknown_node_and_a_faulty_pipeline(self):
        result = marrow("list", "--fits", INTENSITY, "outlines")
        self.assertEqual(result.returncode, 2)
        self.assertIn("the pipeline has no node 'outlines'", result.stderr)
        self.assertIn("did you mean 'outline'?", result.stderr)
        result = marrow("list", "--fits", INTENSITY, "drr", "--set", "drr.uses=project.josef")
        self.assertEqual(result.returncode, 2)
        self.assertIn("unknown node 'project.josef'", result.stderr)


if __name__ == "__main__":
    main()
