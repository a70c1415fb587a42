# SPDX-License-Identifier: Apache-2.0
"""A kind, nodes and a decorator that libraries outside the tree bring: docs/example-kind, used in every way."""
import json
import shutil
import subprocess
import unittest

from harness.cases import FEMUR, SMALL, simulate
from harness import BUILD, SOURCE
from harness.program import IS_SANITIZED, Case, main, marrow

WRONG = """
marrow::View unchanged(const marrow::View& view) { return view; }
marrow::View larger(const marrow::View& view) {
  marrow::View result = view;
  cv::resize(view.image.pixels, result.image.pixels = cv::Mat(), {}, 2, 2);
  return result;
}
marrow::Image picture(const marrow::View& view) { return view.image; }
}  // namespace
"""
WRONG_NODES = """
  plugin.node("denoise.unchanged", unchanged).summary("Nothing").in("view", "h").out("view", "h");
  plugin.node("denoise.larger", larger).summary("Another size").in("view", "h").out("view", "h");
}
"""
BROKEN_NODES = """
  plugin.node("denoise.picture", picture).summary("Another type").in("view", "h").out("view", "h");
}
"""
EXPERIMENT = """experiment: 1
pipeline: quiet.yaml
cases: {folders: [%s], input: case}
variants:
  median: {}
  mean: {quiet.uses: denoise.mean}
  inner: {optimizer.uses: optimizer.nelder_mead}
metrics: [errors.distal.final.mtre_mm]
"""


def without_ends(text):
    """nodes.cpp up to the end of its namespace, and its declarations."""
    algorithms, declarations = text.split("}  // namespace\n")
    return algorithms, declarations[: declarations.rindex("}")]


@unittest.skipIf(IS_SANITIZED, "a plugin outside the tree is built without the sanitizer, which marrow would refuse")
class Kinds(Case):
    @classmethod
    def setUpClass(cls):
        cls.shared = cls.shared_folder()
        folder = cls.shared / "mine"
        shutil.copytree(SOURCE / "docs" / "example-kind", folder)
        cls.lines = sum(len(path.read_text().splitlines()) for path in folder.iterdir())
        algorithms, declarations = without_ends((folder / "nodes.cpp").read_text())
        (folder / "wrong.cpp").write_text(algorithms + WRONG + "MARROW_PLUGIN(plugin) {" + WRONG_NODES)
        (folder / "broken.cpp").write_text(algorithms + WRONG + "MARROW_PLUGIN(plugin) {" + BROKEN_NODES)
        with open(folder / "CMakeLists.txt", "a") as cmake:
            cmake.write("marrow_add_plugin(wrong wrong.cpp LINK opencv_imgproc FOLDER ${CMAKE_BINARY_DIR}/wrong)\n")
            cmake.write("marrow_add_plugin(broken broken.cpp LINK opencv_imgproc FOLDER ${CMAKE_BINARY_DIR}/broken)\n")
        cls.build = cls.shared / "build"
        configure = ["cmake", "-S", folder, "-B", cls.build, "-G", "Ninja", "-Dmarrow_DIR=%s" % BUILD]
        subprocess.run(configure, check=True, stdout=subprocess.DEVNULL)
        subprocess.run(["cmake", "--build", cls.build], check=True, stdout=subprocess.DEVNULL)

    def marrow(self, *arguments, more=(), **options):
        return marrow(*arguments, plugins=[self.build, *(self.build / name for name in more)], **options)

    def pipeline(self):
        """femur.yaml with less noise in its views, and an optimizer that starts another one."""
        text = FEMUR.read_text().replace("../", "%s/" % FEMUR.parents[1])
        text = text.replace("in: {view: case.views}, with: {low: 50, high: 75}}", "in: {view: quiet}}")
        text = text.replace(
            "  optimizer: {uses: optimizer.levenberg_marquardt}\n",
            "  quiet: {uses: denoise.median, in: {view: case.views}}\n"
            "  inner: {uses: optimizer.levenberg_marquardt}\n"
            "  optimizer: {uses: optimizer.restarts, in: {inner: inner}}\n",
        )
        return self.write("quiet.yaml", text)

    def test_its_size(self):
        self.assertLessEqual(self.lines, 120)

    def test_it_is_listed_like_any_other(self):
        listed = self.marrow("list", "denoise").stdout
        self.assertEqual(listed.splitlines()[0], "denoise: less noise in an X-ray view")
        self.assertIn("denoise.median", listed)
        inspected = self.marrow("inspect", "denoise.median").stdout
        self.assertIn("denoise: less noise in an X-ray view", inspected)
        self.assertIn("noise left of 10: at most 6 grey", inspected)
        self.assertIn("marrow_denoise.so: the kind denoise", self.marrow("doctor").stdout)
        schema = json.loads(self.marrow("schema").stdout)
        self.assertIn("denoise.median", json.dumps(schema))

    def test_its_contract_is_listed(self):
        self.assertIn("  denoise        less noise in an X-ray view\n", self.marrow("list", "--kinds").stdout)
        kinds = {kind["name"]: kind for kind in json.loads(self.marrow("list", "--kinds", "--json").stdout)}
        self.assertEqual([port["types"] for port in kinds["denoise"]["inputs"]], [["view"]])
        limits = {check["name"]: check.get("limit") for check in kinds["denoise"]["checks"]}
        self.assertEqual((limits["noise"], limits["contract"]), (6, None))
        self.assertEqual(
            [port["types"] for port in kinds["project"]["outputs"]], [["outline_projector", "radiograph_projector"]]
        )
        self.assertTrue(kinds["evaluate"]["sees_truth"])
        self.assertFalse(kinds["denoise"]["sees_truth"])
        result = self.marrow("list", "--kinds", "edges")
        self.assertEqual(result.returncode, 2)

    def test_check_says_what_a_decorator_needs(self):
        checked = self.marrow("check", FEMUR, "--set", "optimizer.uses=optimizer.restarts")
        self.assertEqual(checked.returncode, 2)
        self.assertIn("node 'optimizer': input 'inner' of optimizer.restarts is not wired", checked.stderr)
        self.assertIn("add  in: {inner: ...}  with an optimizer (the optimizer that is started)", checked.stderr)
        fits = json.loads(self.marrow("list", "--fits", FEMUR, "optimizer", "--json").stdout)
        missing = {fit["node"]: fit["missing"] for fit in fits if fit["fits"] == "with more"}
        self.assertEqual(missing, {"optimizer.restarts": ["wire inner: optimizer (the optimizer that is started)"]})
        checked = self.marrow("check", self.pipeline())
        self.assertEqual(checked.returncode, 0, checked.stderr)

    def test_conformance(self):
        result = self.marrow("conformance", "denoise")
        self.assertEqual(result.returncode, 0, result.stdout)
        self.assertEqual(result.stdout.count("pass noise"), 2)
        result = self.marrow("conformance", "optimizer.restarts", "--in", "inner=optimizer.nelder_mead")
        self.assertEqual(result.returncode, 0, result.stdout)
        result = self.marrow("conformance", "optimizer.restarts", "--check", "contract")
        self.assertEqual(result.returncode, 1)
        self.assertIn(
            "it needs the input 'inner', which its kind does not have; give an input with --in", result.stdout
        )
        for given, said in (
            ("outer=optimizer.powell", "it has no input 'outer'"),
            ("inner=optimizer.powel", "there is no node 'optimizer.powel'"),
            ("inner=denoise.median", "denoise.median gives no optimizer for the input 'inner'"),
        ):
            result = self.marrow("conformance", "optimizer.restarts", "--check", "contract", "--in", given)
            self.assertEqual(result.returncode, 1)
            self.assertIn(said, result.stdout)

    def test_wrong_nodes_are_caught(self):
        result = self.marrow("conformance", "denoise.unchanged", "denoise.larger", more=["wrong"])
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stdout, r"FAIL noise +(9\.|10)")
        self.assertRegex(result.stdout, r"FAIL contract +the image has another size")

    def test_a_node_that_breaks_the_contract_is_refused_wherever_it_lies(self):
        result = self.marrow("doctor", more=["broken"])
        self.assertEqual(result.returncode, 1)
        self.assertIn(
            "declares its nodes wrongly: denoise.picture: output 'view': the kind 'denoise' has it as view, not image",
            result.stdout,
        )
        self.assertNotIn("denoise.picture", self.marrow("list", more=["broken"]).stdout)

    def test_without_its_kind_nothing_can_be_checked(self):
        alone = self.scratch / "alone"
        alone.mkdir()
        shutil.copy(self.build / "marrow_denoise_nodes.so", alone)
        result = marrow("conformance", "denoise.median", plugins=[alone])
        self.assertEqual(result.returncode, 1)
        self.assertIn("nothing was checked: no library brings the kind 'denoise'", result.stdout)
        result = marrow("conformance", "write.tfm")
        self.assertEqual(result.returncode, 1)
        self.assertIn("nothing was checked: the kind 'write' has no suite", result.stdout)

    def test_in_a_comparison(self):
        case = simulate(self.scratch / "simulated", *SMALL)
        self.pipeline()
        experiment = self.write("experiment.yaml", EXPERIMENT % case)
        result = self.marrow("compare", experiment, "--out", self.scratch / "out")
        self.assertEqual(result.returncode, 0, result.stderr)
        cells = (self.scratch / "out" / "cells.csv").read_text()
        self.assertEqual([cells.count("\n%s/case/0," % name) for name in ("median", "mean", "inner")], [1, 1, 1], cells)
        self.assertNotIn("failed", cells)


if __name__ == "__main__":
    main()
