# SPDX-License-Identifier: Apache-2.0
"""Whether a run, computed again from its folder, gives the same."""
import json
import struct

from diff_cases import CHAIN, Runs
from harness import TEST_PLUGINS
from harness.program import CACHE, IS_SANITIZED, main


class Rerun(Runs):
    def rerun(self, code, *arguments, **more):
        result = self.marrow("rerun", *arguments, "--quiet", **more)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result

    def test_the_same_again_from_another_folder(self):
        (self.scratch / "data $1").mkdir()
        self.write("data $1/ct", "1")
        text = CHAIN.replace("word: one", "word: one, path: $data").replace(
            "nodes:", "inputs: {data: {type: path}}\nnodes:"
        )
        self.run_into("a", text, "data=data $1", "--seed", 7, "--set", "other.path=data $$1/ct")
        (self.scratch / "p.yaml").unlink()
        (self.scratch / "else" / "where").mkdir(parents=True)
        told = self.rerun(0, "../../a", cwd=self.scratch / "else" / "where").stdout
        self.assertEqual(
            told,
            "first run (was): ../../a\nsecond run (is): runs/p-rerun\n\nidentical: all 5 nodes came out the same\n",
        )
        before, now = (
            json.loads((folder / "run.json").read_text())
            for folder in (self.scratch / "a", self.scratch / "else" / "where" / "runs" / "p-rerun")
        )
        self.assertEqual([node["calls"] for node in now["nodes"]], [1] * 5, "nothing is read back")
        for name in ("seed", "inputs", "overrides"):
            self.assertEqual(before[name], now[name])
        self.assertEqual(
            (self.scratch / "a" / "pipeline.yaml").read_text(),
            (self.scratch / "else" / "where" / "runs" / "p-rerun" / "pipeline.yaml").read_text(),
        )
        self.rerun(0, "else/where/runs/p-rerun", "--out", "twice")
        self.assertIn("identical", self.diff(0, "a", "twice"))

    def test_after_a_plugin_changed(self):
        self.use_version(1)
        self.run_into(
            "a", "marrow: 1\nnodes:\n  c: {uses: test.constant}\n  n: {uses: test.scale, in: {a: c}}\noutputs: {n: n}\n"
        )
        self.use_version(2)
        told = self.rerun(1, "a", "--out", "b").stdout
        before, now = self.build_ids()
        self.assertEqual(told, self.diff(1, "a", "b").replace(" (by the files in outputs/)", ""), "the same text")
        self.assertIn(
            "  why: its plugin marrow_versions.so is another build (build id %s, was %s)\n  scaled  value              "
            "      2.5 mm, was 2 (+0.5)\n" % (now, before),
            told,
        )
        self.assertIn("Of another build: marrow_versions.so (build id %s, was %s)\n" % (now, before), told)
        self.plugins = [TEST_PLUGINS]
        result = self.rerun(2, "a", "--out", "c")
        self.assertIn("unknown node 'test.scale'", result.stderr)
        self.assertFalse((self.scratch / "c").exists())

    def test_after_data_were_deleted(self):
        text = (
            "marrow: 1\ninputs: {data: {type: path}}\nnodes:\n  r: {uses: read.mesh, with: {path: $data}}\noutputs: {r:"
            " r}\n"
        )
        self.write(
            "tetrahedron.ply",
            (
                "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double"
                " z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3"
                " 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"
            ),
        )
        self.run_into("a", text, "data=tetrahedron.ply")
        self.write(
            "tetrahedron.ply", (self.scratch / "tetrahedron.ply").read_text().replace("\n1 0 0\n", "\n1 0 0.5\n")
        )
        told = self.rerun(1, "a", "--out", "b").stdout
        self.assertIn(
            "  why: the content of the file %s/tetrahedron.ply (option 'path') differs\n"
            "  mesh  1 of 4 vertices lie elsewhere, by at most 0.5 mm\n" % self.scratch,
            told,
        )
        (self.scratch / "tetrahedron.ply").unlink()
        result = self.rerun(1, "a", "--out", "c")
        self.assertIn("  in the first run it was done\n  in the second run it failed: ", result.stdout)
        self.assertIn("  why: %s/tetrahedron.ply (option 'path') is not there any more\n" % self.scratch, result.stdout)
        self.assertIn("Outputs that only the first run has: r\n", result.stdout)

    def test_a_node_that_does_not_give_the_same_each_time(self):
        self.use_version(1)
        self.run_into("a", "marrow: 1\nnodes:\n  n: {uses: test.clock}\noutputs: {n: n}\n")
        stored = sorted(path.name for path in CACHE.rglob("*"))
        told = self.rerun(1, "a", "--out", "b").stdout
        self.assertIn(
            (
                "First difference: node 'n' (test.clock)\n  why: nothing that it was made from differs (plugin,"
                " options, contents of files, inputs, seed): it does not give the same result each time\n  number "
                " value"
            ),
            told,
        )
        self.assertNotIn("(by the files in outputs/)", told)
        self.assertEqual(
            sorted(path.name for path in CACHE.rglob("*")), stored, "the first result is still kept, the second is not"
        )

    def test_with_the_limits_of_the_run(self):
        text = "marrow: 1\nnodes:\n  r: {uses: read.mesh, with: {path: a.ply}}\noutputs: {r: r}\n"
        count = 200_000  # more than a process has left over before its first limit
        header = (
            "ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty double x\nproperty double y\nproperty"
            " double z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n" % count
        )
        corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)] + [(i % 100, i // 100, 0) for i in range(4, count)]
        faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
        (self.scratch / "a.ply").write_bytes(
            header.encode()
            + b"".join(struct.pack("<3d", *corner) for corner in corners)
            + b"".join(struct.pack("<B3i", 3, *face) for face in faces)
        )
        self.run_into("plain", text)
        self.run_into("a", text, "--file-memory", 900, "--file-seconds", "7.5")
        limits = lambda name: [
            json.loads((self.scratch / name / "run.json").read_text()).get(limit)
            for limit in ("file_memory_mb", "file_seconds")
        ]
        self.assertEqual([limits("plain"), limits("a")], [[None, None], [900, 7.5]])
        self.rerun(0, "a", "--out", "b")
        self.rerun(0, "a", "--out", "c", "--file-memory", 800)
        self.assertEqual([limits("b"), limits("c")], [[900, 7.5], [800, 7.5]])
        record = json.loads((self.scratch / "a" / "run.json").read_text())
        for wrong in (-1, 0, "900", 1e30):
            self.write("a/run.json", json.dumps({**record, "file_memory_mb": wrong}))
            self.assertIn("its 'file_memory_mb' is no number from 0.001 to 1000000000", self.rerun(2, "a").stderr)
        if IS_SANITIZED:
            return  # memory has no limit there
        self.write("a/run.json", json.dumps({**record, "file_memory_mb": 1}))
        self.assertIn("raise the limit with --file-memory", self.rerun(1, "a", "--out", "d").stdout)
        self.rerun(0, "a", "--out", "e", "--file-memory", 900)

    def test_a_failed_run(self):
        self.run_into(
            "a",
            (
                "marrow: 1\nnodes:\n  c: {uses: test.constant}\n  f: {uses: test.fail_above, in: {a: c}, with: {value:"
                " 0}}\noutputs: {c: c, f: f}\n"
            ),
            code=1,
        )
        told = self.rerun(1, "a", "--out", "b").stdout
        self.assertIn(
            (
                "identical: all 2 nodes came out the same\nnode 'f' failed in both: the number is too large; give a"
                " smaller one\n"
            ),
            told,
        )

    def test_a_cell_of_a_comparison(self):
        self.write(
            "p.yaml",
            (
                "marrow: 1\ninputs: {case: {type: path}}\nnodes:\n  n: {uses: test.constant, with: {path: $case}}\n "
                " unused: {uses: test.letters}\noutputs: {number: n, letters: unused}\n"
            ),
        )
        (self.scratch / "cases" / "0").mkdir(parents=True)
        self.write("cases/0/data", "0")
        self.write(
            "e.yaml",
            (
                "experiment: 1\npipeline: p.yaml\ncases: {folders: [cases/*]}\nmetrics: [number.value]\nvariants:\n  a:"
                " {}\n  b: {n.value: 5}\n"
            ),
        )
        result = self.marrow("compare", "e.yaml", "--out", "out", "--quiet")
        self.assertEqual(result.returncode, 0, result.stderr)
        told = self.rerun(0, "out/cells/b/0/0").stdout
        self.assertIn("identical: the only node came out the same\n", told)
        self.assertIn(
            "  why: option 'value' is 5, was 1 (e.yaml:7, was the default)\n",
            self.diff(1, "out/cells/a/0/0", "out/cells/b/0/0"),
        )

    def test_for_scripts(self):
        self.run_into("a", CHAIN)
        told = json.loads(self.rerun(0, "a", "--out", "b", "--json").stdout)
        self.assertEqual((told["identical"], told["now"], told["nodes"]["same"]), (True, "b", 5))


if __name__ == "__main__":
    main()
