# SPDX-License-Identifier: Apache-2.0
"""A plugin outside the tree, and libraries that are refused."""
import json
import os
import resource
import shutil
import socket
import subprocess
import unittest

from harness import BUILD, MARROW, SOURCE, TEST_PLUGINS
from harness.program import IS_SANITIZED, Case, main, marrow

BAD = BUILD / "tests" / "bad_plugins"


class Plugins(Case):
    @unittest.skipIf(
        IS_SANITIZED, "a plugin outside the tree is built without the sanitizer, which marrow would refuse"
    )
    def test_smallest_plugin_outside_the_tree(self):
        folder = self.scratch / "mine"
        shutil.copytree(SOURCE / "docs" / "example-plugin", folder)
        self.assertLessEqual(
            sum(len(path.read_text().splitlines()) for path in folder.iterdir() if path.suffix != ".py"), 40
        )
        subprocess.run(
            ["cmake", "-S", folder, "-B", folder / "build", "-G", "Ninja", "-Dmarrow_DIR=%s" % BUILD],
            check=True,
            stdout=subprocess.DEVNULL,
        )
        subprocess.run(["cmake", "--build", folder / "build"], check=True, stdout=subprocess.DEVNULL)
        self.assertTrue((folder / "build" / "marrow_steepest.json").exists())
        self.assertIn("edges.steepest", marrow("list", "edges", plugins=[folder / "build"]).stdout)
        checked = marrow(
            "check",
            SOURCE / "pipelines" / "femur" / "femur.yaml",
            "--set",
            "edges.uses=edges.steepest",
            plugins=[folder / "build"],
        )
        self.assertEqual(checked.returncode, 0, checked.stderr)

    @unittest.skipIf(IS_SANITIZED, "as above")
    def test_a_plugin_outside_the_tree_builds_on_the_toolbox(self):
        folder = self.scratch / "mine"
        folder.mkdir()
        text = (SOURCE / "plugins" / "edges" / "gradient_mask.cpp").read_text()
        (folder / "mine.cpp").write_text(text.replace("edges.gradient_mask", "edges.mine"))
        (folder / "CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.25)\nproject(mine CXX C)\n"
            "find_package(marrow REQUIRED COMPONENTS toolbox)\n"
            "marrow_add_plugin(edges_mine mine.cpp LINK marrow::edges)\n"
        )
        configure = ["cmake", "-S", folder, "-B", folder / "build", "-G", "Ninja", "-Dmarrow_DIR=%s" % BUILD]
        subprocess.run(configure, check=True, capture_output=True)
        subprocess.run(["cmake", "--build", folder / "build"], check=True, stdout=subprocess.DEVNULL)
        listed = marrow("list", "edges", plugins=[folder / "build"])
        self.assertIn("edges.mine", listed.stdout)
        checked = marrow(
            "check",
            SOURCE / "pipelines" / "femur" / "femur.yaml",
            "--set",
            "edges.uses=edges.mine",
            plugins=[folder / "build"],
        )
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
        self.assertIn(
            "was built for plugin interface 7.2, this marrow has 1.0",
            self.refused("a.so", lambda path: shutil.copy(BAD / "other_api.so", path)),
        )

    def test_other_headers(self):
        self.assertIn(
            "was built against other headers; rebuild it with this marrow's headers",
            self.refused("a.so", lambda path: shutil.copy(BAD / "other_headers.so", path)),
        )

    def test_debug_mode(self):
        self.assertIn(
            "_GLIBCXX_DEBUG (debug mode) on",
            self.refused("a.so", lambda path: shutil.copy(BAD / "debug_mode.so", path)),
        )

    def test_other_eigen_alignment(self):
        if not (BAD / "other_alignment.so").exists():
            self.skipTest("only where -mavx changes the alignment")
        self.assertIn(
            "EIGEN_MAX_ALIGN_BYTES 32, this marrow with 16",
            self.refused("a.so", lambda path: shutil.copy(BAD / "other_alignment.so", path)),
        )

    def test_truncated(self):
        whole = (BUILD / "lib" / "marrow" / "marrow_mesh_marching_cubes.so").read_bytes()
        self.assertIn("is truncated", self.refused("a.so", lambda path: path.write_bytes(whole[: len(whole) // 2])))

    def test_text_file(self):
        self.assertIn("is not a shared library", self.refused("a.so", lambda path: path.write_text("hello\n")))

    def test_crash_while_loading(self):
        self.assertIn(
            "crashed while being loaded", self.refused("a.so", lambda path: shutil.copy(BAD / "crashes.so", path))
        )

    def own(self, **more):
        return {"XDG_CACHE_HOME": str(self.scratch / "cache"), **more}

    def unknown_library(self):
        """A folder with a library that nothing is known of."""
        folder = self.scratch / "plugins"
        folder.mkdir()
        shutil.copy(TEST_PLUGINS / "marrow_test_numbers.so", folder)
        return folder

    def test_what_is_no_file_does_not_hang(self):
        folder = self.unknown_library()
        os.mkfifo(folder / "pipe.so")
        os.mkfifo(folder / "marrow_test_numbers.json")
        os.symlink("/dev/tty", folder / "terminal.so")
        with socket.socket(socket.AF_UNIX) as end:
            end.bind(str(folder / "socket.so"))
            for command in (
                ["list"],
                ["inspect", "test.add"],
                ["schema"],
                ["check", SOURCE / "pipelines" / "femur" / "femur.yaml"],
            ):
                result = marrow(*command, plugins=[folder], extra_environment=self.own(), timeout=240)
                self.assertEqual(result.returncode, 0, result.stderr)
            text = marrow("doctor", plugins=[folder], extra_environment=self.own(), timeout=240).stdout
        self.assertIn("REFUSED  %s/pipe.so: it is a named pipe, not a regular file" % folder, text)
        self.assertIn("REFUSED  %s/socket.so: it is a socket, not a regular file" % folder, text)
        self.assertIn(
            "note: its manifest is not used (it is a named pipe, not a regular file), so it was described again", text
        )
        self.assertIn("test.add", text, "the others still work")
        result = marrow("describe", folder / "pipe.so", timeout=240)
        self.assertEqual(
            (result.returncode, result.stderr),
            (1, "marrow: error: %s/pipe.so is a named pipe, not a regular file\n" % folder),
        )

    def test_an_unknown_library_is_only_loaded_in_a_process_of_its_own(self):
        folder = self.unknown_library()
        pipeline = self.write("p.yaml", "marrow: 1\nnodes:\n  c: {uses: test.constant}\noutputs: {number: c}\n")
        for command in (
            ["list"],
            ["check", pipeline],
            ["inspect", "test.add"],
            ["graph", pipeline],
            ["plan", pipeline],
            ["schema"],
            ["doctor"],
            ["conformance", "test.add"],
        ):
            shutil.rmtree(self.scratch / "cache", ignore_errors=True)
            environment = dict(os.environ, MARROW_PLUGIN_PATH=str(folder), LD_DEBUG="files", **self.own())
            with subprocess.Popen(
                [MARROW, *command], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
            ) as program:
                _, messages = program.communicate(timeout=240)
            has_no_suite = command[0] == "conformance"
            self.assertEqual(program.returncode, 1 if has_no_suite else 0, messages[-300:])
            loads = [
                int(line.split(":")[0])
                for line in messages.splitlines()
                if "calling init: %s/marrow_test" % folder in line
            ]
            self.assertEqual(len(loads), 1, command)
            self.assertNotIn(program.pid, loads, command)
            told = " ".join(marrow(command[0], "--help").stdout.split())
            self.assertIn(
                "A plugin library that marrow does not know yet is loaded once in a separate process, which describes "
                "it. ",
                told,
            )

    def test_a_folder_that_others_may_write_is_refused(self):
        folder = self.unknown_library()
        folder.chmod(0o777)
        text = marrow("doctor", plugins=[folder], extra_environment=self.own()).stdout
        self.assertIn("it is not trusted, because others may write to '%s' (owner " % folder, text)
        self.assertIn("mode 0777); chmod go-w '%s', or set MARROW_TRUST_ALL_PLUGINS=1" % folder, text)
        self.assertNotIn("test.add", text)
        self.assertIn(
            "test.add",
            marrow("doctor", plugins=[folder], extra_environment=self.own(MARROW_TRUST_ALL_PLUGINS="1")).stdout,
        )
        folder.chmod(0o755)
        self.assertIn(
            "test.add",
            marrow("doctor", plugins=[folder], extra_environment=self.own()).stdout,
            "the verdict is not kept",
        )

    def test_what_was_checked_is_loaded_wherever_a_link_leads_by_then(self):
        # Others may turn a link in an open folder between the check and the load: the link is not used twice.
        folder, opened = self.unknown_library(), self.scratch / "open"
        opened.mkdir()
        opened.chmod(0o777)
        (opened / "link").symlink_to(folder)
        pipeline = self.write("p.yaml", "marrow: 1\nnodes:\n  c: {uses: test.constant}\noutputs: {number: c}\n")
        for command in (
            ["describe", opened / "link" / "marrow_test_numbers.so"],
            ["run", pipeline, "--out", self.scratch / "out"],
        ):
            result = marrow(
                *command, plugins=[opened / "link"], extra_environment=self.own(LD_DEBUG="files"), timeout=240
            )
            loads = [
                line.split("calling init: ")[1]
                for line in result.stderr.splitlines()
                if "calling init: " in line and "marrow_test" in line
            ]
            self.assertEqual(set(loads), {str(folder / "marrow_test_numbers.so")}, command)

    def test_manifests_are_written_whole(self):
        folder = self.unknown_library()
        library, manifest = folder / "marrow_test_numbers.so", folder / "marrow_test_numbers.json"
        programs = [subprocess.Popen([MARROW, "describe", library, "--write"]) for _ in range(6)]
        self.assertEqual([program.wait(timeout=240) for program in programs], [0] * 6)
        self.assertEqual(len(json.loads(manifest.read_text())["nodes"]), 20)
        self.assertEqual(
            sorted(path.name for path in folder.iterdir()), [manifest.name, library.name], "no temporary file is left"
        )
        self.assertEqual(manifest.stat().st_mode & 0o777, 0o644)

    def test_a_manifest_replaces_no_other_file(self):
        folder = self.unknown_library()
        library, manifest = folder / "marrow_test_numbers.so", folder / "marrow_test_numbers.json"
        describe = lambda file: marrow("describe", file, "--write", extra_environment=self.own())
        for foreign in ("my own notes", "", "[1]", '{"a": 1}'):
            manifest.write_text(foreign)
            result = describe(library)
            self.assertEqual(result.returncode, 2, foreign)
            self.assertEqual(
                result.stderr,
                "marrow: error: %s exists and is not a manifest that marrow wrote; move it away, or rename %s\n"
                % (manifest, library),
            )
            self.assertEqual(manifest.read_text(), foreign)
        manifest.write_text('{"marrow_manifest": 0}')  # of another version
        for _ in range(2):
            self.assertEqual(describe(library).returncode, 0)
            self.assertEqual(len(json.loads(manifest.read_text())["nodes"]), 20)
        for name in ("library.json", "library", "library.so.1"):
            other = folder / name
            other.write_bytes(library.read_bytes())
            result = describe(other)
            self.assertEqual(result.returncode, 2, name)
            self.assertIn(
                "a manifest is written only beside a library whose name ends in .so, got %s; rename it" % other,
                result.stderr,
            )
            self.assertEqual(other.read_bytes(), library.read_bytes())

    def test_a_manifest_on_a_full_disk(self):
        folder = self.unknown_library()
        limited = subprocess.run(
            [MARROW, "describe", folder / "marrow_test_numbers.so", "--write"],
            capture_output=True,
            text=True,
            restore_signals=False,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000)),
        )
        self.assertEqual(limited.returncode, 2)
        self.assertEqual(
            limited.stderr, "marrow: error: cannot write %s/marrow_test_numbers.json: File too large\n" % folder
        )
        self.assertEqual([path.name for path in folder.iterdir()], ["marrow_test_numbers.so"])


if __name__ == "__main__":
    main()
