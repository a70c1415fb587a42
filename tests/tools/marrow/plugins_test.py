# SPDX-License-Identifier: Apache-2.0
"""Libraries that are refused, and what becomes of one that marrow does not know yet."""
import gzip
import json
import os
import resource
import shutil
import socket
import subprocess

from harness import BUILD, SOURCE, TEST_PLUGINS
from harness.program import Case, main, marrow, SharedCase

BAD = BUILD / "tests" / "bad_plugins"
REFUSED = {
    "other_api.so": "was built for plugin interface 7.2, this marrow has 1.0",
    "other_headers.so": "was built against other headers; rebuild it with this marrow's headers",
    "debug_mode.so": "_GLIBCXX_DEBUG (debug mode) on",
    "other_alignment.so": "EIGEN_MAX_ALIGN_BYTES 32, this marrow with 16",  # only where -mavx changes the alignment
    "crashes.so": "crashed while being loaded",
    "truncated.so": "is truncated",
    "text.so": "is not a shared library",
}
PIPELINE = "marrow: 1\nnodes:\n  c: {uses: test.constant}\noutputs: {number: c}\n"
FEMUR = SOURCE / "pipelines" / "femur" / "femur.yaml"
DESCRIBED = "A plugin library that marrow does not know yet is loaded once in a separate process, which describes it. "


class Plugins(Case):
    has_own_store = False

    def setUp(self):
        """A folder with a library that nothing is known of."""
        super().setUp()
        self.folder = self.scratch / "plugins"
        self.folder.mkdir()
        self.library, self.manifest = (self.folder / ("marrow_test_numbers" + end) for end in (".so", ".json"))
        shutil.copy(TEST_PLUGINS / "marrow_test_numbers.so", self.folder)
        self.plugins = [self.folder]
        self.environment = {"XDG_CACHE_HOME": str(self.scratch / "cache")}

    def loads(self, command, code=0):
        """(process, library) of each load of the library, and the process of the program itself."""
        self.environment["LD_DEBUG"] = "files"
        program = self.start(*command)
        _, messages = program.communicate(timeout=240)
        self.assertEqual(program.returncode, code, messages[-300:])
        lines = [line.split("calling init: ") for line in messages.splitlines() if "calling init: " in line]
        return [(int(at.split(":")[0]), file) for at, file in lines if "/marrow_test_numbers" in file], program.pid

    def test_bad_libraries_are_refused_beside_a_good_one(self):
        refused = dict(REFUSED)
        whole = (BUILD / "lib" / "marrow" / "marrow_mesh.so").read_bytes()
        (self.folder / "truncated.so").write_bytes(whole[: len(whole) // 2])
        (self.folder / "text.so").write_text("hello\n")
        for name in ("other_api.so", "other_headers.so", "debug_mode.so", "other_alignment.so", "crashes.so"):
            if (BAD / name).exists():
                shutil.copy(BAD / name, self.folder)
            else:
                self.assertEqual(name, "other_alignment.so")
                del refused[name]
        first, again = (self.expect(1, "doctor").stdout for _ in range(2))
        self.assertIn("test.add", first, "the others still work")
        lines = [line for line in first.splitlines() if "REFUSED" in line]
        self.assertEqual(len(lines), len(refused), first)
        for name, said in refused.items():
            (line,) = (line for line in lines if "/%s: " % name in line)
            self.assertIn(said, line)
            self.assertIn(line, again, "the verdict is kept with its reason")

    def test_what_is_no_file_does_not_hang(self):
        os.mkfifo(self.folder / "pipe.so")
        os.mkfifo(self.manifest)
        os.symlink("/dev/tty", self.folder / "terminal.so")
        with socket.socket(socket.AF_UNIX) as end:
            end.bind(str(self.folder / "socket.so"))
            for command in (["list"], ["inspect", "test.add"], ["schema"], ["check", FEMUR]):
                self.expect(0, *command, timeout=240)
            text = self.marrow("doctor", timeout=240).stdout
        for said in (
            "REFUSED  %s/pipe.so: it is a named pipe, not a regular file" % self.folder,
            "REFUSED  %s/socket.so: it is a socket, not a regular file" % self.folder,
            "note: its manifest is not used (it is a named pipe, not a regular file), so it was described again",
            "test.add",
        ):
            self.assertIn(said, text)
        said = "marrow: error: %s/pipe.so is a named pipe, not a regular file\n" % self.folder
        self.assertEqual(self.expect(1, "describe", self.folder / "pipe.so", timeout=240).stderr, said)

    def test_an_unknown_library_is_only_loaded_in_a_process_of_its_own(self):
        self.write("p.yaml", PIPELINE)
        for command, *more in (
            *(["list"], ["check", "p.yaml"], ["inspect", "test.add"], ["graph", "p.yaml"], ["plan", "p.yaml"]),
            *(["schema"], ["doctor"], ["conformance", "test.add"]),
        ):
            shutil.rmtree(self.scratch / "cache", ignore_errors=True)
            # The tests' kind has no suite.
            loads, program = self.loads([command, *more], code=1 if command == "conformance" else 0)
            ((process, _),) = loads
            self.assertNotEqual(process, program, command)
            del self.environment["LD_DEBUG"]
            self.assertIn(DESCRIBED, " ".join(self.printed(command, "--help").split()))

    def test_a_folder_that_others_may_write_is_refused(self):
        self.folder.chmod(0o777)
        text = self.marrow("doctor").stdout
        self.assertIn("it is not trusted, because others may write to '%s' (owner " % self.folder, text)
        self.assertIn("mode 0777); chmod go-w '%s', or set MARROW_TRUST_ALL_PLUGINS=1" % self.folder, text)
        self.assertNotIn("test.add", text)
        trusting = self.marrow("doctor", extra_environment={"MARROW_TRUST_ALL_PLUGINS": "1"}).stdout
        self.assertIn("test.add", trusting)
        self.folder.chmod(0o755)
        self.assertIn("test.add", self.marrow("doctor").stdout, "the verdict is not kept")

    def test_what_was_checked_is_loaded_wherever_a_link_leads_by_then(self):
        # Others may turn a link in an open folder between the check and the load: the link is not used twice.
        link = self.scratch / "open" / "link"
        link.parent.mkdir()
        link.parent.chmod(0o777)
        link.symlink_to(self.folder)
        self.plugins = [link]
        self.write("p.yaml", PIPELINE)
        for command in (["describe", link / self.library.name], ["run", "p.yaml", "--out", "out"]):
            loads, _ = self.loads(command)
            self.assertEqual({file for _, file in loads}, {str(self.library)}, command)

    def test_manifests_are_written_whole(self):
        programs = [self.start("describe", self.library, "--write") for _ in range(6)]
        self.assertEqual([program.wait(timeout=240) for program in programs], [0] * 6)
        self.assertEqual(len(json.loads(self.manifest.read_text())["nodes"]), 20)
        left = sorted(path.name for path in self.folder.iterdir())
        self.assertEqual(left, [self.manifest.name, self.library.name], "no temporary file is left")
        self.assertEqual(self.manifest.stat().st_mode & 0o777, 0o644)

    def test_a_manifest_replaces_no_other_file(self):
        foreign = "marrow: error: %s exists and is not a manifest that marrow wrote; move it away, or rename %s\n"
        for text in ("my own notes", "", "[1]", '{"a": 1}'):
            self.manifest.write_text(text)
            said = self.expect(2, "describe", self.library, "--write").stderr
            self.assertEqual(said, foreign % (self.manifest, self.library), text)
            self.assertEqual(self.manifest.read_text(), text)
        self.manifest.write_text('{"marrow_manifest": 0}')  # of another version
        for _ in range(2):
            self.expect(0, "describe", self.library, "--write")
            self.assertEqual(len(json.loads(self.manifest.read_text())["nodes"]), 20)
        for name in ("library.json", "library", "library.so.1"):
            other = shutil.copyfile(self.library, self.folder / name)
            said = "a manifest is written only beside a library whose name ends in .so, got %s; rename it" % other
            self.refused(said, "describe", other, "--write")
            self.assertEqual(other.read_bytes(), self.library.read_bytes())

    def test_a_manifest_on_a_full_disk(self):
        most = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
        limited = self.start("describe", self.library, "--write", restore_signals=False, preexec_fn=most)
        said = limited.communicate()[1]
        self.assertEqual(
            (limited.returncode, said), (2, "marrow: error: cannot write %s: File too large\n" % self.manifest)
        )
        self.assertEqual([path.name for path in self.folder.iterdir()], [self.library.name])


# Nodes that are not there: options of CMake leave out those of large libraries, and a method may be a choice of another
# node.
PIPELINE_OF_BUILT = """marrow: 1
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
        result = self.marrow("check", self.write("p.yaml", PIPELINE_OF_BUILT % node))
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


# The installed program works in any folder, and knows its plugins without describing them again.
PAGES = {"marrow.1.gz", "marrow-run.1.gz", "marrow-cache-gc.1.gz", "marrow-open.1.gz", "marrow-workbench.1.gz"}


class Install(SharedCase):
    def make(self):
        install = ["cmake", "--install", BUILD, "--prefix", self.scratch / "first"]
        subprocess.run(install, check=True, stdout=subprocess.DEVNULL)
        self.root = (self.scratch / "first").rename(self.scratch / "moved")

    def installed(self, *arguments):
        # With a separate cache, it uses nothing from earlier runs.
        environment = {**os.environ, "XDG_CACHE_HOME": str(self.scratch / "cache")}
        command = [self.root / "bin" / "marrow", *arguments]
        result = subprocess.run(command, env=environment, cwd=self.scratch, capture_output=True, text=True)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def test_it_may_be_moved(self):
        said = self.installed("doctor")
        self.assertIn("moved/lib", said)
        self.assertNotIn("note:", said, "no manifest is stale")
        self.assertIn("edges.canny", self.installed("list", "edges"))
        share = self.root / "share" / "marrow"
        self.installed("check", share / "pipelines" / "femur" / "femur.yaml")
        self.assertTrue((share / "schemas" / "pipeline.schema.json").is_file())

    def test_manual_pages_and_completion(self):
        share = self.root / "share"
        self.assertLessEqual(PAGES, {path.name for path in (share / "man" / "man1").iterdir()})
        page = gzip.decompress((share / "man" / "man1" / "marrow-plan.1.gz").read_bytes()).decode()
        self.assertIn("marrow\\-plan \\- show what a run would compute", page)
        for shell, file in (
            ("bash", "bash-completion/completions/marrow"),
            ("fish", "fish/vendor_completions.d/marrow.fish"),
            ("zsh", "zsh/vendor-completions/_marrow"),
        ):
            self.assertEqual((share / file).read_text(), self.installed("completion", shell))


if __name__ == "__main__":
    main()
