# SPDX-License-Identifier: Apache-2.0
"""Libraries outside the tree: docs/example-kind, which brings a kind, nodes and a decorator and is used in every way,
docs/example-plugin, the smallest one, and one that builds on the toolbox."""
import json
import shutil
import subprocess
import unittest

from harness import BUILD, SOURCE
from harness.cases import FEMUR, SMALL, simulate
from harness.program import IS_SANITIZED, SharedCase, main

WRONG = """
marrow::View unchanged(const marrow::View& view) { return view; }
marrow::View larger(const marrow::View& view) {
  marrow::View result = view;
  cv::resize(view.image.pixels, result.image.pixels = cv::Mat(), {}, 2, 2);
  return result;
}
marrow::Image picture(const marrow::View& view) { return view.image; }
}  // namespace
MARROW_PLUGIN(plugin) {
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
ON_TOOLBOX = """cmake_minimum_required(VERSION 3.25)
project(mine CXX C)
find_package(marrow REQUIRED COMPONENTS toolbox)
marrow_add_plugin(edges_mine mine.cpp LINK marrow::edges)
"""
ALL = "cmake_minimum_required(VERSION 3.25)\nproject(all CXX C)\n"  # one project, so that packages are looked for once
EXPERIMENT = """experiment: 1
pipeline: quiet.yaml
cases: {folders: [%s], input: case}
variants:
  median: {}
  mean: {quiet.uses: denoise.mean}
  inner: {optimizer.uses: optimizer.nelder_mead}
metrics: [errors.distal.final.mtre_mm]
"""


def lines_of(folder):
    return sum(len(path.read_text().splitlines()) for path in folder.iterdir() if path.suffix != ".py")


@unittest.skipIf(IS_SANITIZED, "a plugin outside the tree is built without the sanitizer, which marrow would refuse")
class Kinds(SharedCase):
    plugins = []

    def make(self):
        for name in ("kind", "plugin"):
            shutil.copytree(SOURCE / "docs" / ("example-" + name), self.scratch / name)
        self.lines = {name: lines_of(self.scratch / name) for name in ("kind", "plugin")}
        algorithms = self.read("kind/nodes.cpp").split("}  // namespace\n")[0]
        cmake = self.read("kind/CMakeLists.txt")
        for name, nodes in (("wrong", WRONG_NODES), ("broken", BROKEN_NODES)):
            self.write("kind/%s.cpp" % name, algorithms + WRONG + nodes)
            added = "marrow_add_plugin({0} {0}.cpp LINK opencv_imgproc FOLDER ${{CMAKE_BINARY_DIR}}/{0})\n"
            cmake += added.format(name)
        self.write("kind/CMakeLists.txt", cmake)
        masks = (SOURCE / "plugins" / "edges" / "gradient_mask.cpp").read_text()
        self.write("toolbox/mine.cpp", masks.replace("edges.gradient_mask", "edges.mine"))
        self.write("toolbox/CMakeLists.txt", ON_TOOLBOX)
        self.write("CMakeLists.txt", ALL + "".join("add_subdirectory(%s)\n" % n for n in ("kind", "plugin", "toolbox")))
        self.build = self.scratch / "build"
        configure = ["cmake", "-S", self.scratch, "-B", self.build, "-G", "Ninja", "-Dmarrow_DIR=%s" % BUILD]
        subprocess.run(configure, check=True, capture_output=True)
        subprocess.run(["cmake", "--build", self.build], check=True, stdout=subprocess.DEVNULL)
        self.plugins = [self.build / "kind"]
        # femur.yaml with less noise in its views, and an optimizer that starts another one
        text = FEMUR.read_text().replace("../", "%s/" % FEMUR.parents[1])
        text = text.replace("in: {view: case.views}, with: {low: 50, high: 75}}", "in: {view: quiet}}")
        text = text.replace(
            "  optimizer: {uses: optimizer.levenberg_marquardt}\n",
            "  quiet: {uses: denoise.median, in: {view: case.views}}\n"
            "  inner: {uses: optimizer.levenberg_marquardt}\n"
            "  optimizer: {uses: optimizer.restarts, in: {inner: inner}}\n",
        )
        self.write("quiet.yaml", text)

    def test_the_smallest_plugin_and_one_on_the_toolbox(self):
        self.assertLessEqual(self.lines["plugin"], 40)
        self.assertTrue((self.build / "plugin" / "marrow_steepest.json").exists())
        for folder, node in (("plugin", "edges.steepest"), ("toolbox", "edges.mine")):
            plugins = [self.build / folder]
            self.assertIn(node, self.printed("list", "edges", plugins=plugins))
            self.expect(0, "check", FEMUR, "--set", "edges.uses=" + node, plugins=plugins)

    def test_its_size(self):
        self.assertLessEqual(self.lines["kind"], 120)

    def test_it_is_listed_like_any_other(self):
        listed = self.printed("list", "denoise")
        self.assertEqual(listed.splitlines()[0], "denoise: less noise in an X-ray view")
        self.assertIn("denoise.median", listed)
        inspected = self.printed("inspect", "denoise.median")
        self.assertIn("denoise: less noise in an X-ray view", inspected)
        self.assertIn("noise left of 10: at most 6 grey", inspected)
        self.assertIn("marrow_denoise.so: the kind denoise", self.marrow("doctor").stdout)
        self.assertIn("denoise.median", json.dumps(json.loads(self.printed("schema"))))

    def test_its_contract_is_listed(self):
        self.assertIn("  denoise        less noise in an X-ray view\n", self.printed("list", "--kinds"))
        kinds = {kind["name"]: kind for kind in self.json_of("list", "--kinds")}
        types = lambda kind, ports: [port["types"] for port in kinds[kind][ports]]
        self.assertEqual(types("denoise", "inputs"), [["view"]])
        self.assertEqual(types("project", "outputs"), [["outline_projector", "radiograph_projector"]])
        limits = {check["name"]: check.get("limit") for check in kinds["denoise"]["checks"]}
        self.assertEqual((limits["noise"], limits["contract"]), (6, None))
        self.assertTrue(kinds["evaluate"]["sees_truth"])
        self.assertFalse(kinds["denoise"]["sees_truth"])
        self.expect(2, "list", "--kinds", "edges")

    def test_check_says_what_a_decorator_needs(self):
        needed = [
            "node 'optimizer': input 'inner' of optimizer.restarts is not wired",
            "add  in: {inner: ...}  with an optimizer (the optimizer that is started)",
        ]
        self.refused(needed, "check", FEMUR, "--set", "optimizer.uses=optimizer.restarts")
        fits = self.json_of("list", "--fits", FEMUR, "optimizer")
        missing = {fit["node"]: fit["missing"] for fit in fits if fit["fits"] == "with more"}
        self.assertEqual(missing, {"optimizer.restarts": ["wire inner: optimizer (the optimizer that is started)"]})
        self.expect(0, "check", "quiet.yaml")

    def test_conformance(self):
        self.assertEqual(self.printed("conformance", "denoise").count("pass noise"), 2)
        self.expect(0, "conformance", "optimizer.restarts", "--in", "inner=optimizer.nelder_mead")
        contract = ["conformance", "optimizer.restarts", "--check", "contract"]
        for given, said in (
            ([], "it needs the input 'inner', which its kind does not have; give an input with --in"),
            (["--in", "outer=optimizer.powell"], "it has no input 'outer'"),
            (["--in", "inner=optimizer.powel"], "there is no node 'optimizer.powel'"),
            (["--in", "inner=denoise.median"], "denoise.median gives no optimizer for the input 'inner'"),
        ):
            self.assertIn(said, self.expect(1, *contract, *given).stdout)

    def test_wrong_nodes_are_caught(self):
        plugins = [*self.plugins, self.build / "wrong"]
        said = self.expect(1, "conformance", "denoise.unchanged", "denoise.larger", plugins=plugins).stdout
        self.assertRegex(said, r"FAIL noise +(9\.|10)")
        self.assertRegex(said, r"FAIL contract +the image has another size")

    def test_a_node_that_breaks_the_contract_is_refused_wherever_it_lies(self):
        plugins = [*self.plugins, self.build / "broken"]
        self.assertIn(
            "declares its nodes wrongly: denoise.picture: output 'view': the kind 'denoise' has it as view, not image",
            self.expect(1, "doctor", plugins=plugins).stdout,
        )
        self.assertNotIn("denoise.picture", self.marrow("list", plugins=plugins).stdout)

    def test_without_its_kind_nothing_can_be_checked(self):
        alone = self.scratch / "alone"
        alone.mkdir()
        shutil.copy(self.build / "kind" / "marrow_denoise_nodes.so", alone)
        for node, said in (
            ("denoise.median", "no library brings the kind 'denoise'"),
            ("write.tfm", "the kind 'write' has no suite"),
        ):
            told = self.expect(1, "conformance", node, plugins=[alone]).stdout
            self.assertIn("nothing was checked: " + said, told)

    def test_in_a_comparison(self):
        case = simulate(self.scratch / "simulated", *SMALL)
        self.write("experiment.yaml", EXPERIMENT % case)
        self.expect(0, "compare", "experiment.yaml", "--out", "out")
        cells = self.rows()
        self.assertEqual(sorted(cells), ["inner/case/0", "mean/case/0", "median/case/0"])
        self.assertNotIn("failed", self.read("out/cells.csv"))


if __name__ == "__main__":
    main()
