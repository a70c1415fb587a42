# SPDX-License-Identifier: Apache-2.0
"""Programs of others as steps of a pipeline: what they are given, what is made of their output, and how they fail."""
import json
import os
import pathlib
import shutil
import signal
import struct
import subprocess
import sys
import unittest

from harness import MARROW
from harness.program import Case, main, wait_until
from other_programs import needs, nibabel, numpy, read_mha, vtk

VERSION = ["python3", "--version"]
# Copies its input to its output, and both to where the test looks at them.
COPY = "import shutil, sys\nfor to in sys.argv[2:]: shutil.copy(sys.argv[1], to)\n"
SIZE, SPACING, ORIGIN = (4, 3, 2), (0.5, 0.75, 2.0), (10.0, -20.0, 30.0)
AXES = ((0.6, 0.8, 0.0), (-0.8, 0.6, 0.0), (0.0, 0.0, 1.0))  # direction of each axis of the grid


class Programs(Case):
    def setUp(self):
        super().setUp()
        self.write("copied.py", COPY)

    def node(self, kind, command, inputs=None, **options):
        given = {"command": command, "version_command": VERSION, **options}
        return {"uses": "run.program_" + kind, "in": inputs or {}, "with": given}

    def pipeline(self, nodes, outputs=None):
        """JSON is YAML, too; its quotes need no care."""
        text = {"marrow": 1, "nodes": nodes, "outputs": outputs or {"it": "it"}}
        return self.write("p.yaml", json.dumps(text, indent=1))

    def run_it(self, nodes, code=0, outputs=None, **more):
        shutil.rmtree(self.scratch / "out", ignore_errors=True)
        result = self.marrow("run", self.pipeline(nodes, outputs), "--out", "out", "--quiet", **more)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result.stderr

    def failure(self, command, inputs=None, kind="volume", nodes=None, **options):
        told = self.run_it({**(nodes or {}), "it": self.node(kind, command, inputs, **options)}, code=1)
        self.assertIn(" failed: ", told)
        return told.split(" failed: ", 1)[1]

    def kept(self, name):
        return self.scratch / name


class Files(Programs):
    """Each input in each format, read by another program, and read back."""

    def setUp(self):
        super().setUp()
        count = SIZE[0] * SIZE[1] * SIZE[2]
        listed = lambda numbers: " ".join(map(repr, numbers))
        self.values = [1.5 * i - 7 for i in range(count)]
        header = (
            "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
            "TransformMatrix = %s\nOffset = %s\nElementSpacing = %s\nDimSize = %s\nElementType = MET_FLOAT\n"
            "ElementDataFile = LOCAL\n" % (listed(sum(AXES, ())), listed(ORIGIN), listed(SPACING), listed(SIZE))
        )
        (self.scratch / "ct.mha").write_bytes(header.encode() + struct.pack("<%df" % count, *self.values))
        self.ct = {"uses": "read.volume", "with": {"path": "ct.mha"}}

    def copied(self, kind, of, extension, source, extra=None, **options):
        """Runs a program that copies {of.extension}; returns the file that it was given."""
        kept = self.kept("kept." + extension)
        command = ["python3", "{files.1}", "{%s.%s}" % (of, extension), "{output.%s}" % extension, str(kept)]
        node = self.node(kind, command, {of: "source"}, files=["copied.py"], **options)
        self.run_it({"source": source, "it": node, **(extra or {})})
        return kept

    def expect_grid(self, keys):
        """NIfTI has 32 bits for these numbers."""
        for key, expected in (("Offset", ORIGIN), ("ElementSpacing", SPACING), ("TransformMatrix", sum(AXES, ()))):
            numpy.testing.assert_allclose([float(word) for word in keys[key].split()], expected, atol=1e-5)

    @needs("numpy")
    def test_volumes(self):
        for of in ("volume", "second_volume"):
            for extension in ("mha", "nrrd", "nii", "nii.gz"):
                with self.subTest(of + "." + extension):
                    self.copied("volume", of, extension, self.ct)
                    values, keys = read_mha(self.scratch / "out/outputs/it.mha")
                    self.assertEqual(values.ravel().tolist(), self.values)
                    self.expect_grid(keys)

    @needs("numpy", "nibabel")
    def test_nifti_as_nibabel_reads_it(self):
        affine = numpy.eye(4)
        affine[:3, :3] = (numpy.array(AXES) * numpy.array(SPACING)[:, None]).T
        affine[:3, 3] = ORIGIN
        affine = numpy.diag([-1, -1, 1, 1]) @ affine  # RAS
        image = nibabel.load(self.copied("volume", "volume", "nii.gz", self.ct))
        for transform, code in (image.get_sform(coded=True), image.get_qform(coded=True)):
            self.assertEqual(code, 1)
            numpy.testing.assert_allclose(transform, affine, atol=1e-5)
        self.assertEqual(image.header.get_xyzt_units()[0], "mm")
        self.assertEqual(image.get_fdata().ravel(order="F").tolist(), self.values)

    @needs("vtk", "numpy")
    def test_mha_as_vtk_reads_it(self):
        reader = vtk.vtkMetaImageReader()
        reader.SetFileName(str(self.copied("volume", "volume", "mha", self.ct)))
        reader.Update()
        image = reader.GetOutput()
        self.assertEqual(image.GetDimensions(), SIZE)
        got = [image.GetScalarComponentAsDouble(x, y, z, 0) for z in range(2) for y in range(3) for x in range(4)]
        self.assertEqual(got, self.values)

    @needs("numpy", "nibabel")
    def test_labels_become_a_field(self):
        """A box of 4 x 3 x 2 voxels of label 7, and one voxel of label 2."""
        self.write(
            "labels.py",
            "import nibabel, numpy, sys\nlabels = numpy.zeros((12, 11, 10), dtype=numpy.uint8)\n"
            "labels[4:8, 4:7, 4:6] = 7\nlabels[1, 1, 1] = 2\n"
            "nibabel.save(nibabel.Nifti1Image(labels, numpy.diag([-2.0, -1.0, 3.0, 1])), sys.argv[1])\n",
        )
        command = ["/usr/bin/python3", "{files.1}", "{output.nii.gz}"]
        field = self.node("field", command, files=["labels.py"], labels=[7], band_mm=6)
        mesh = {"uses": "mesh.marching_cubes", "in": {"field": "it"}}
        self.run_it({"it": field, "mesh": mesh}, outputs={"it": "it", "mesh": "mesh"})
        values, keys = read_mha(self.scratch / "out/outputs/it.mha")
        at = lambda x, y, z: float(values[z, y, x])
        # Beside the surface, half a voxel of 2 x 1 x 3 mm; further away, along one axis, whole voxels more.
        self.assertEqual([at(4, 5, 4), at(3, 5, 4), at(5, 4, 4), at(5, 3, 4)], [-1, 1, -0.5, 0.5])
        numpy.testing.assert_allclose([at(5, 2, 4), at(5, 1, 4), at(2, 5, 4)], [1.5, 2.5, 3], atol=1e-6)
        self.assertEqual(at(1, 1, 1), 6, "another label is outside")
        points = ply_points(self.scratch / "out/outputs/mesh.ply")
        numpy.testing.assert_allclose(points.min(axis=0), [7, 3.5, 10.5], atol=1e-9)
        numpy.testing.assert_allclose(points.max(axis=0), [15, 6.5, 16.5], atol=1e-9)
        told = self.failure(command, kind="field", files=["labels.py"], labels=[5, 6])
        self.assertIn("the labels that the program made have no voxel of these labels: there are 2, 7", told)

    @needs("numpy", "nibabel")
    def test_a_field_is_given_as_a_mask(self):
        threshold = {"uses": "segment.threshold", "in": {"volume": "ct"}, "with": {"threshold_hu": 10}}
        kept = self.kept("kept.nii.gz")
        command = ["python3", "{files.1}", "{field.nii.gz}", "{output.nii.gz}", str(kept)]
        node = self.node("volume", command, {"field": "bone.bone"}, files=["copied.py"])
        self.run_it({"ct": self.ct, "bone": threshold, "it": node})
        mask = nibabel.load(kept)
        self.assertEqual(mask.get_data_dtype(), numpy.uint8)
        self.assertEqual(mask.get_fdata().ravel(order="F").tolist(), [float(value >= 10) for value in self.values])

    @needs("numpy", "vtk")
    def test_meshes(self):
        corners = [(0.1, 0, 0), (1, 0, 0.25), (0, 1, 0), (0, 0, 1)]
        faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
        lines = ["v %r %r %r" % corner for corner in corners] + ["f %d %d %d" % tuple(i + 1 for i in f) for f in faces]
        self.write("solid.obj", "\n".join(lines) + "\n")
        source = {"uses": "read.mesh", "with": {"path": "solid.obj"}}
        readers = {"stl": vtk.vtkSTLReader, "ply": vtk.vtkPLYReader, "obj": vtk.vtkOBJReader,
                   "vtp": vtk.vtkXMLPolyDataReader}  # fmt: skip
        for extension, make in readers.items():
            with self.subTest(extension):
                file = self.copied("mesh", "mesh", extension, source)
                reader = make()
                reader.SetFileName(str(file))
                reader.Update()
                read = reader.GetOutput()
                self.assertEqual(read.GetNumberOfCells(), 4)
                seen = sorted(read.GetPoint(i) for i in range(4))
                numpy.testing.assert_allclose(seen, sorted(corners), atol=1e-7)
                back = ply_points(self.scratch / "out/outputs/it.ply")
                numpy.testing.assert_allclose(sorted(map(tuple, back)), sorted(corners), atol=1e-7)

    @needs("numpy", "tifffile", "PIL")
    def test_images(self):
        import PIL.Image
        import tifffile

        grey = numpy.arange(12, dtype=numpy.uint16).reshape(3, 4) * 5000
        PIL.Image.fromarray(grey).save(self.scratch / "grey.png")
        source = {"uses": "read.image", "with": {"path": "grey.png"}}
        for extension, read in (("png", PIL.Image.open), ("tif", tifffile.imread)):
            with self.subTest(extension):
                file = self.copied("image", "image", extension, source)
                self.assertEqual(numpy.array(read(file)).tolist(), grey.tolist())
        tifffile.imwrite(self.scratch / "grey.tif", (grey / 7).astype(numpy.float32))
        source["with"]["path"] = "grey.tif"
        file = self.copied("image", "image", "tif", source)
        self.assertEqual(tifffile.imread(file).tolist(), (grey / 7).astype(numpy.float32).tolist())
        told = self.failure(["true", "{image.png}", "{output.png}"], {"image": "i"}, "image", {"i": source})
        self.assertIn(
            "has grey values that are no whole numbers, and PNG has no place for them; write {image.tif}", told
        )

    def test_figures(self):
        self.write(
            "figures.py",
            "import json, sys\ngiven = json.load(open(sys.argv[1]))\n"
            "json.dump({'plain': given['value']['value'] + 0.5, 'length': {'value': 2, 'unit': 'mm'}},"
            " open(sys.argv[2], 'w'))\n",
        )
        command = ["python3", "{files.1}", "{metrics.json}", "{output.json}"]
        node = self.node("metrics", command, {"metrics": "c"}, files=["figures.py"])
        self.run_it({"c": {"uses": "test.constant", "with": {"value": 3}}, "it": node})
        made = json.loads((self.scratch / "out/outputs/it.json").read_text())["metrics"]
        self.assertEqual(
            made, [{"name": "plain", "value": 3.5, "unit": ""}, {"name": "length", "value": 2, "unit": "mm"}]
        )
        for text, why in (
            ("[1]", "holds no JSON object"),
            ("{}", "holds no figure"),
            ('{"a": "b"}', "has no number for 'a'"),
        ):
            self.write("figures.txt", text)
            copy = ["python3", "{files.1}", "{files.2}", "{output.json}"]
            told = self.failure(copy, kind="metrics", files=["copied.py", "figures.txt"])
            self.assertIn("output.json " + why + '; expected figures as {"name": 1.5} or', told)

    @unittest.skipUnless(shutil.which("plastimatch"), "not installed here: plastimatch")
    @needs("numpy")
    def test_plastimatch(self):
        """Twice the volume and three times the volume, by plastimatch, from two inputs."""
        version = ["plastimatch", "--version"]
        twice = ["plastimatch", "add", "--weight", "2", "--output", "{output.mha}", "{volume.mha}"]
        double = self.node("volume", twice, {"volume": "ct"}, version_command=version)
        both = ["plastimatch", "add", "--output", "{output.nrrd}", "{volume.nrrd}", "{second_volume.mha}"]
        triple = self.node("volume", both, {"volume": "ct", "second_volume": "double"}, version_command=version)
        self.run_it({"ct": self.ct, "double": double, "it": triple}, outputs={"it": "it", "double": "double"})
        for name, factor in (("double", 2), ("it", 3)):
            values, keys = read_mha(self.scratch / ("out/outputs/%s.mha" % name))
            numpy.testing.assert_allclose(values.ravel(), [factor * value for value in self.values], rtol=1e-6)
            self.expect_grid(keys)  # by MetaImage and by NRRD
        record = json.loads((self.scratch / "out/run.json").read_text())
        printed = subprocess.run(version, capture_output=True, text=True).stdout.strip()
        self.assertEqual([node.get("program_version") for node in record["nodes"]], [None, printed, printed])


class Words(Programs):
    """What reaches the program: its words, its folder, its standard input."""

    def said(self, command, **options):
        """What a Python script says about itself, as a file that the test finds."""
        self.write(
            "a 'b\" $HOME; c.py",
            "import json, os, sys\njson.dump([sys.argv[3:], os.getcwd(), sys.stdin.read()], open(sys.argv[1], 'w'))\n"
            "json.dump({'a': 1}, open(sys.argv[2], 'w'))\n",
        )
        kept = self.kept("kept 'it' \"now\".json")
        words = ["python3", "{files.1}", str(kept), "{output.json}", *command]
        self.run_it({"it": self.node("metrics", words, files=["a 'b\" $$HOME; c.py"], **options)})
        return json.loads(kept.read_text())

    def test_words_are_what_they_are(self):
        odd = [
            "a b",
            "; touch x",
            "`id`",
            "$$(id)",
            "'",
            '"',
            "*",
            "\\n",
            "",
            "{{volume}}",
            "ü",
            "--help",
            "|",
            ">f",
            "&",
        ]
        words, folder, stdin = self.said(odd)
        plain = [word.replace("{{", "{").replace("}}", "}").replace("$$", "$") for word in odd]
        self.assertEqual(words, plain)
        self.assertEqual(stdin, "", "the standard input is empty")
        self.assertNotEqual(folder, str(self.scratch))
        self.assertFalse(os.path.exists(folder), "its folder is gone")
        self.assertFalse((self.scratch / "x").exists())

    def test_a_program_that_names_its_output_itself(self):
        script = (
            "import os, sys\nos.makedirs(sys.argv[1] + '/sub')\n"
            "open(sys.argv[1] + '/sub/b.json', 'w').write('{{\"a\": 4}}')\n"
        )
        command = ["python3", "-c", script, "{output_folder}"]
        self.run_it({"it": self.node("metrics", command, output_file="sub/b.json")})
        made = json.loads((self.scratch / "out/outputs/it.json").read_text())["metrics"]
        self.assertEqual(made[0]["value"], 4)
        told = self.failure(command, kind="metrics", output_file="sub/c.json")
        self.assertIn(
            "the program 'python3' ended well, but made no file 'c.json' in {output_folder}; did you mean "
            "'sub/b.json'?",
            told,
        )
        told = self.failure(command, kind="metrics", output_file="../c.json")
        self.assertIn("output_file is '../c.json', but must be a name below {output_folder}", told)

    def test_places_that_nothing_fills(self):
        for word, why in (
            ("{volum.mha}", "the command has the place '{volum.mha}', which nothing fills ({{ stands for a brace); did"
             " you mean 'volume'?"),
            ("{volume.mh}", "the place '{volume.mh}' of the command has an unknown format; did you mean 'mha'?"),
            ("{volume}", "the place '{volume}' of the command has no format; known: mha, nrrd, nii, nii.gz"),
            ("{output.png}", "the place '{output.png}' of the command has an unknown format; known: mha, nrrd, nii,"
             " nii.gz"),
            ("{mesh.stl}", "the command has '{mesh.stl}', but nothing is wired to the input 'mesh'"),
            ("{mesh.stl", "the word '{mesh.stl' of the command has a { without a }; write {{ for the character {"),
            ("{files.2}", "the command has the place '{files.2}', but the option files has 1 path: {files.1}"),
            ("{files.x}", "the command has the place '{files.x}', but the option files has 1 path: {files.1}"),
            ("{output.nrrd}", "the command has two outputs, 'output.mha' and 'output.nrrd'; a node makes one"),
        ):  # fmt: skip
            with self.subTest(word):
                self.assertIn(why, self.failure(["true", "{output.mha}", word], files=["copied.py"]))
        told = self.failure(["true"])
        self.assertIn(
            "the command does not say where its output goes; write {output.mha}, or {output_folder} and", told
        )
        told = self.failure(["true", "{output.mha}"], output_file="a.mha")
        self.assertIn("the command has {output...}, and there is an output_file, too; give one of them", told)
        told = self.failure(["true"], output_file="a.mha")
        self.assertIn("but the command does not name the folder that it is in; write {output_folder}", told)
        told = self.failure(["true", "{output.mha}", "{files.1}"], files=["nothing.txt"])
        self.assertIn("nothing.txt is not there; the option files names it", told)

    def test_what_a_pipeline_must_give(self):
        pipeline = self.pipeline({"it": self.node("volume", [])})
        told = self.marrow("check", pipeline).stderr
        self.assertIn("command", told)
        self.assertIn("1 error", told)
        node = self.node("volume", ["true", "{output.mha}"])
        del node["with"]["version_command"]
        self.assertIn("'version_command'", self.marrow("check", self.pipeline({"it": node})).stderr)


class Failures(Programs):
    def python(self, script, **options):
        """The failure of a Python script that is to make a volume."""
        return self.failure(["python3", "-c", script, "{output.mha}"], **options)

    def test_an_exit_code(self):
        told = self.python("import sys; print('one'); sys.stdout.flush(); print('two', file=sys.stderr); sys.exit(3)")
        self.assertIn("the program 'python3' ended with exit code 3; it printed:\n  one\n  two\n", told)
        self.assertIn(
            "the program 'false' ended with exit code 1; it printed nothing", self.failure(["false", "{output.mha}"])
        )
        told = self.python("for i in range(100): print('line', i)\nraise SystemExit(1)")
        self.assertNotIn("line 79\n", told)
        self.assertIn("line 80\n  line 81\n", told)
        self.assertIn("line 99\n", told)

    def test_a_crash(self):
        told = self.python("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
        self.assertIn("the program 'python3' crashed: Segmentation fault; it printed nothing", told)

    def test_too_long(self):
        told = self.python("import time; time.sleep(1000)", max_time_s=0.2)
        self.assertIn("the program 'python3' took longer than 0.2 s; it printed nothing", told)

    def test_too_much_memory(self):
        told = self.python("x = bytearray(400_000_000)\nimport time; time.sleep(1000)", max_memory_mb=200)
        self.assertIn("the program 'python3' used more than 200 MB of memory", told)

    def test_no_output(self):
        told = self.python("print('all is well')")
        self.assertIn(
            "the program 'python3' ended well, but made no file 'output.mha'; it printed:\n  all is well\n", told
        )
        told = self.python("import sys; open(sys.argv[1], 'w').write('nonsense')")
        self.assertIn("output.mha", told)

    def test_no_program(self):
        told = self.failure(["pyton3", "{output.mha}"])
        self.assertIn(
            "there is no program 'pyton3' on the PATH; did you mean 'python3'? Or install it, or write its whole path",
            told,
        )
        self.assertIn(
            "there is no program /no/where; install it, or name another", self.failure(["/no/where", "{output.mha}"])
        )
        told = self.failure(["./copied.py", "{output.mha}"])
        self.assertIn("the program './copied.py' is neither a whole path nor a name on the PATH", told)
        told = self.failure(["{files.1}", "{output.mha}"], files=["copied.py"])
        self.assertIn("copied.py is no program: it may not be executed; make it so with chmod +x", told)

    def test_a_failed_program_is_replayed(self):
        self.python("raise SystemExit(3)")
        told = self.marrow("replay", "out")
        self.assertEqual(told.returncode, 1, told.stderr)
        self.assertIn("failed again, with the same error: the program 'python3' ended with exit code 3", told.stdout)

    def alive(self, file):
        process = int(pathlib.Path(file).read_text())
        try:
            return pathlib.Path("/proc/%d/stat" % process).read_text().rsplit(") ", 1)[1][0] not in "ZX"
        except FileNotFoundError:
            return False

    def test_what_a_program_leaves_running_ends_with_it(self):
        script = (
            "import subprocess, sys\nchild = subprocess.Popen(['sleep', '1000'], start_new_session=False)\n"
            "open(sys.argv[2], 'w').write(str(child.pid))\nopen(sys.argv[1], 'w').write('{{\"a\": 1}}')\n"
        )
        self.run_it({"it": self.node("metrics", ["python3", "-c", script, "{output.json}", str(self.kept("pid"))])})
        self.assertFalse(self.alive(self.kept("pid")))

    def test_stopped_by_a_signal(self):
        """Its child has a session of its own, as those that a shell starts with setsid."""
        script = (
            "import os, subprocess, sys, time\nchild = subprocess.Popen(['sleep', '1000'], start_new_session=True)\n"
            "open(sys.argv[1], 'w').write(str(os.getpid()))\nopen(sys.argv[2] + 'x', 'w').write(str(child.pid))\n"
            "os.rename(sys.argv[2] + 'x', sys.argv[2])\ntime.sleep(1000)\n"
        )
        parent, child = self.kept("parent"), self.kept("child")
        node = self.node("volume", ["python3", "-c", script, str(parent), str(child), "{output.mha}"])
        environment = {**os.environ, "MARROW_CACHE": str(self.scratch / "cache")}
        for sent in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(sent.name):
                shutil.rmtree(self.scratch / "out", ignore_errors=True)
                child.unlink(missing_ok=True)
                run = subprocess.Popen(
                    [MARROW, "run", self.pipeline({"it": node}), "--out", self.scratch / "out"],
                    env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                )  # fmt: skip
                wait_until(child.exists, "it has not started its child")
                run.send_signal(sent)
                _, told = run.communicate(timeout=300)
                self.assertEqual(run.returncode, 130, told)
                self.assertEqual([self.alive(parent), self.alive(child)], [False, False])


class Versions(Programs):
    def setUp(self):
        super().setUp()
        (self.scratch / "bin").mkdir()
        self.environment = {"PATH": "%s:%s" % (self.scratch / "bin", os.environ["PATH"])}
        self.use("1.0")

    def use(self, version, ends="exit 0"):
        """Installs a version of a program."""
        text = '#!/bin/sh\nif [ "$1" = --version ]; then echo "tool %s"; %s; fi\necho "{\\"a\\": 1}" > "$1"\n' % (
            version,
            ends,
        )
        tool = self.write("bin/tool", text)
        tool.chmod(0o755)

    def calls(self, **more):
        node = self.node("metrics", ["tool", "{output.json}"], version_command=["tool", "--version"])
        told = self.run_it({"it": node}, extra_environment=self.environment, **more)
        record = json.loads((self.scratch / "out/run.json").read_text())["nodes"][0]
        return record["calls"], record.get("program_version"), told

    def test_another_version_has_another_key(self):
        self.assertEqual(self.calls()[:2], (1, "tool 1.0"))
        self.assertEqual(self.calls()[:2], (0, "tool 1.0"))
        self.use("1.1")
        told = self.marrow("plan", "p.yaml", extra_environment=self.environment).stdout
        self.assertIn("(prints 'tool 1.1'), was [tool, --version] (prints 'tool 1.0')", told)
        self.assertEqual(self.calls()[:2], (1, "tool 1.1"))
        self.use("1.0")
        self.assertEqual(self.calls()[:2], (0, "tool 1.0"), "what the old version made is still there")

    def test_a_version_that_is_not_told(self):
        self.use("1.0", "exit 4")
        told = self.calls(code=1)[2]
        self.assertIn("version_command: the program 'tool' ended with exit code 4; it printed:\n  tool 1.0\n", told)
        node = self.node("metrics", ["tool", "{output.json}"], version_command=["true"])
        told = self.run_it({"it": node}, code=1, extra_environment=self.environment)
        self.assertIn("version_command: the program 'true' printed nothing; name a command that prints the", told)

    def test_a_script_counts_by_its_content(self):
        script = self.write("script.py", "import sys\nopen(sys.argv[1], 'w').write('{\"a\": 1}')\n")
        node = self.node("metrics", ["python3", "{files.1}", "{output.json}"], files=["script.py"])
        for text, value in ((script.read_text(), 1), (script.read_text().replace("1}", "2}"), 2)):
            script.write_text(text)
            self.run_it({"it": node})
            made = json.loads((self.scratch / "out/outputs/it.json").read_text())["metrics"]
            self.assertEqual(made[0]["value"], value)


def ply_points(file):
    """The vertices of a binary PLY as marrow writes it."""
    data = file.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    count = int(data[:end].split(b"element vertex ")[1].split()[0])
    return numpy.frombuffer(data[end:], dtype="<f8", count=3 * count).reshape(-1, 3)


if __name__ == "__main__":
    sys.exit(main())
