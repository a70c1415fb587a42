# SPDX-License-Identifier: Apache-2.0
"""Nodes that are not there: options of CMake leave out those of large libraries, and a method may be a choice of
another node."""
import json
import subprocess

from harness import SOURCE
from harness.program import Case, main, marrow

PIPELINE = """marrow: 1
nodes:
  surface: {uses: %s}
outputs: {surface: surface}
"""
# A project that adds plugins as marrow does. Those of options that are off are no targets, so it needs no compiler.
PROJECT = """cmake_minimum_required(VERSION 3.25)
project(plugins LANGUAGES NONE)
include(%s/framework/cmake/MarrowPlugin.cmake)
set(MARROW_LEFT_OUT OFF)
foreach(name ${LEFT_OUT})
  marrow_add_plugin(${name} ${name}.cpp $<TARGET_OBJECTS:nothing> ONLY_WITH MARROW_CAD LINK absent)
endforeach()
marrow_write_not_built(${CMAKE_BINARY_DIR}/not_built.json)
"""


class NotBuilt(Case):
    @classmethod
    def setUpClass(cls):
        cls.folder = cls.shared_folder()
        cls.plugins = [cls.folder]
        # The second one is there after all, from another folder.
        nodes = {"mesh.voronoi": "MARROW_CAD", "mesh.marching_cubes": "MARROW_CAD"}
        (cls.folder / "not_built.json").write_text(json.dumps(nodes))

    def fault(self, node):
        result = self.marrow("check", self.write("p.yaml", PIPELINE % node))
        self.assertEqual(result.returncode, 2)
        (error,) = [line.split("error: ")[1] for line in result.stderr.splitlines() if "error: " in line]
        (hint,) = [line.strip() for line in result.stderr.splitlines() if line.strip().startswith("hint: ")]
        return error, hint

    def test_a_pipeline_with_one_names_the_option(self):
        self.assertEqual(
            self.fault("mesh.voronoi"),
            (
                "unknown node 'mesh.voronoi'",
                "hint: this build of marrow leaves it out; configure it with -DMARROW_CAD=ON",
            ),
        )

    def test_other_commands_say_the_same(self):
        for command, what in (("inspect", "node"), ("conformance", "node, kind or library")):
            told = self.marrow(command, "mesh.voronoi").stderr
            start = "marrow: error: there is no %s 'mesh.voronoi'; " % what
            self.assertTrue(told.startswith(start + "this build of marrow leaves it out; configure it with -D"), told)

    def test_doctor_lists_them(self):
        told = self.marrow("doctor")
        self.assertEqual(told.returncode, 0, told.stdout)
        self.assertIn(
            "\n\nNot built (configure marrow with the option to have them):\n  mesh.voronoi: MARROW_CAD\n\n",
            told.stdout,
        )
        listed = json.loads(self.marrow("doctor", "--json").stdout)
        self.assertEqual(listed["not_built"], [{"node": "mesh.voronoi", "option": "MARROW_CAD"}])

    def test_what_is_no_such_list_tells_nothing(self):
        file = self.scratch / "not_built.json"
        for text in ("", "[1]", '"mesh.voronoi"', '{"mesh.voronoi": 1}'):
            file.write_text(text)
            told = json.loads(self.marrow("doctor", "--json", plugins=[self.scratch]).stdout)
            self.assertEqual(told["not_built"], [], text)
        file.unlink()
        file.mkdir()
        self.assertEqual(self.marrow("doctor", plugins=[self.scratch]).returncode, 0)

    def test_the_build_writes_the_list(self):
        self.write("CMakeLists.txt", PROJECT % SOURCE)
        for left_out, nodes in (
            ("mesh_voronoi;read_cad_file", {"mesh.voronoi": "MARROW_CAD", "read.cad_file": "MARROW_CAD"}),
            ("", None),
        ):
            command = ["cmake", "-B", "build", "-DMARROW_CAD=OFF", "-DLEFT_OUT=" + left_out]
            made = subprocess.run(command, cwd=self.scratch, capture_output=True, text=True)
            self.assertEqual(made.returncode, 0, made.stderr)
            file = self.scratch / "build" / "not_built.json"
            self.assertEqual(json.loads(file.read_text()) if file.exists() else None, nodes)

    def test_a_method_that_is_a_choice_of_another_node(self):
        for method in ("sobel", "prewitt", "roberts"):
            self.assertEqual(
                self.fault("edges." + method),
                ("unknown node 'edges.%s'" % method, "hint: use edges.gradient_mask with mask: " + method),
            )
        self.assertEqual(self.fault("edges.sobl")[1][:12], "hint: known:")
        told = marrow("inspect", "edges.sobel").stderr
        self.assertEqual(
            told, "marrow: error: there is no node 'edges.sobel'; use edges.gradient_mask with mask: sobel\n"
        )


if __name__ == "__main__":
    main()
