# SPDX-License-Identifier: Apache-2.0
"""A plugin outside the tree, and libraries that are refused."""
import shutil
import subprocess

from marrow_cli import BUILD, SOURCE, TEST_PLUGINS, Case, main, marrow

BAD = BUILD / "tests" / "bad_plugins"


class Plugins(Case):
    def test_smallest_plugin_outside_the_tree(self):
        folder = self.scratch / "mine"
        shutil.copytree(SOURCE / "docs" / "example-plugin", folder)
        self.assertLessEqual(sum(len(path.read_text().splitlines()) for path in folder.iterdir()), 40)
        subprocess.run(["cmake", "-S", folder, "-B", folder / "build", "-G", "Ninja", "-Dmarrow_DIR=%s" % BUILD], check=True, stdout=subprocess.DEVNULL)
        subprocess.run(["cmake", "--build", folder / "build"], check=True, stdout=subprocess.DEVNULL)
        self.assertTrue((folder / "build" / "marrow_steepest.json").exists())
        self.assertIn("edges.steepest", marrow("list", "edges", plugins=[folder / "build"]).stdout)
        checked = marrow("check", SOURCE / "pipelines" / "femur.yaml", "--set", "edges.uses=edges.steepest", plugins=[folder / "build"])
        self.assertEqual(checked.returncode, 0, checked.stderr)

    def refused(self, name, make):
        folder = self.scratch / "plugins"
        folder.mkdir()
        shutil.copy(TEST_PLUGINS / "marrow_test_numbers.so", folder)
        make(folder / name)
        result = marrow("doctor", plugins=[folder], extra_environment={"XDG_CACHE_HOME": str(self.scratch / "cache")})
        self.assertEqual(result.returncode, 1)
        self.assertIn("test.add", result.stdout, "the others still work")
        lines = [line for line in result.stdout.splitlines() if "REFUSED" in line]
        self.assertEqual(len(lines), 1, result.stdout)
        again = marrow("doctor", plugins=[folder], extra_environment={"XDG_CACHE_HOME": str(self.scratch / "cache")})
        self.assertIn(lines[0], again.stdout, "the verdict is kept with its reason")
        return lines[0]

    def test_other_api_version(self):
        self.assertIn("was built for plugin interface 7.2, this marrow has 1.0", self.refused("a.so", lambda path: shutil.copy(BAD / "other_api.so", path)))

    def test_debug_mode(self):
        self.assertIn("_GLIBCXX_DEBUG (debug mode) on", self.refused("a.so", lambda path: shutil.copy(BAD / "debug_mode.so", path)))

    def test_other_eigen_alignment(self):
        if not (BAD / "other_alignment.so").exists():
            self.skipTest("only where -mavx changes the alignment")
        self.assertIn("EIGEN_MAX_ALIGN_BYTES 32, this marrow with 16", self.refused("a.so", lambda path: shutil.copy(BAD / "other_alignment.so", path)))

    def test_truncated(self):
        whole = (BUILD / "lib" / "marrow" / "marrow_mesh_marching_cubes.so").read_bytes()
        self.assertIn("is truncated", self.refused("a.so", lambda path: path.write_bytes(whole[: len(whole) // 2])))

    def test_text_file(self):
        self.assertIn("is not a shared library", self.refused("a.so", lambda path: path.write_text("hello\n")))

    def test_crash_while_loading(self):
        self.assertIn("crashed while being loaded", self.refused("a.so", lambda path: shutil.copy(BAD / "crashes.so", path)))


if __name__ == "__main__":
    main()
