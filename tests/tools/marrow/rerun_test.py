# SPDX-License-Identifier: Apache-2.0
"""Whether a run, computed again from its folder, gives the same."""
import json
import struct

from diff_cases import CHAIN, Runs
from harness import TEST_PLUGINS
from harness.program import CACHE, IS_SANITIZED, main

READS = "marrow: 1\nnodes:\n  r: {uses: read.mesh, with: {path: a.ply}}\noutputs: {r: r}\n"
SCALES = "marrow: 1\nnodes:\n  c: {uses: test.constant}\n  n: {uses: test.scale, in: {a: c}}\noutputs: {n: n}\n"
FAILS = (
    "marrow: 1\nnodes:\n  c: {uses: test.constant}\n"
    "  f: {uses: test.fail_above, in: {a: c}, with: {value: 0}}\noutputs: {c: c, f: f}\n"
)
CELLS = """marrow: 1
inputs: {case: {type: path}}
nodes:
  n: {uses: test.constant, with: {path: $case}}
  unused: {uses: test.letters}
outputs: {number: n, letters: unused}
"""
EXPERIMENT = """experiment: 1
pipeline: p.yaml
cases: {folders: [cases/*]}
metrics: [number.value]
variants:
  a: {}
  b: {n.value: 5}
"""
CORNERS, FACES = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def tetrahedron(more_corners=()):
    """A binary PLY, with further corners that no face has."""
    corners = [*CORNERS, *more_corners]
    header = "ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % len(corners)
    header += "".join("property double %s\n" % axis for axis in "xyz")
    header += "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    values = [struct.pack("<3d", *corner) for corner in corners] + [struct.pack("<B3i", 3, *face) for face in FACES]
    return header.encode() + b"".join(values)


class Rerun(Runs):
    def rerun(self, code, *arguments, **more):
        return self.expect(code, "rerun", *arguments, "--quiet", **more)

    def test_the_same_again_from_another_folder(self):
        self.write("data $1/ct", "1")
        text = CHAIN.replace("word: one", "word: one, path: $data")
        text = text.replace("nodes:", "inputs: {data: {type: path}}\nnodes:")
        self.run_into("a", text, "data=data $1", "--seed", 7, "--set", "other.path=data $$1/ct")
        (self.scratch / "p.yaml").unlink()
        (self.scratch / "else" / "where").mkdir(parents=True)
        self.assertEqual(
            self.rerun(0, "../../a", cwd=self.scratch / "else" / "where").stdout,
            "first run (was): ../../a\nsecond run (is): runs/p-rerun\n\nidentical: all 5 nodes came out the same\n",
        )
        again = "else/where/runs/p-rerun"
        self.assertEqual([node["calls"] for node in self.nodes(again).values()], [1] * 5, "nothing is read back")
        before, now = self.json("a/run.json"), self.json(again + "/run.json")
        for name in ("seed", "inputs", "overrides"):
            self.assertEqual(before[name], now[name])
        self.assertEqual(self.read("a/pipeline.yaml"), self.read(again + "/pipeline.yaml"))
        told = json.loads(self.rerun(0, again, "--out", "twice", "--json").stdout)
        self.assertEqual((told["identical"], told["now"], told["nodes"]["same"]), (True, "twice", 5))
        self.assertIn("identical", self.diff(0, "a", "twice"))

    def test_after_a_plugin_changed(self):
        self.use_version(1)
        self.run_into("a", SCALES)
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
        self.refused("unknown node 'test.scale'", "rerun", "a", "--out", "c")
        self.assertFalse((self.scratch / "c").exists())

    def test_after_data_were_changed_or_deleted(self):
        text = READS.replace("nodes:", "inputs: {data: {type: path}}\nnodes:").replace("a.ply", "$data")
        file = self.write("a.ply", tetrahedron())
        self.run_into("a", text, "data=a.ply")
        file.write_bytes(tetrahedron().replace(struct.pack("<3d", *CORNERS[1]), struct.pack("<3d", 1, 0, 0.5), 1))
        told = self.rerun(1, "a", "--out", "b").stdout
        self.assertIn(
            "  why: the content of the file %s (option 'path') differs\n"
            "  mesh  1 of 4 vertices lie elsewhere, by at most 0.5 mm\n" % file,
            told,
        )
        file.unlink()
        told = self.rerun(1, "a", "--out", "c").stdout
        for said in (
            "  in the first run it was done\n  in the second run it failed: ",
            "  why: %s (option 'path') is not there any more\n" % file,
            "Outputs that only the first run has: r\n",
        ):
            self.assertIn(said, told)

    def test_a_node_that_does_not_give_the_same_each_time(self):
        self.use_version(1)
        self.run_into("a", "marrow: 1\nnodes:\n  n: {uses: test.clock}\noutputs: {n: n}\n")
        stored = lambda: sorted(path.name for path in CACHE.rglob("*"))
        before = stored()
        told = self.rerun(1, "a", "--out", "b").stdout
        self.assertIn(
            "First difference: node 'n' (test.clock)\n  why: nothing that it was made from differs (plugin, options, "
            "contents of files, inputs, seed): it does not give the same result each time\n  number  value",
            told,
        )
        self.assertNotIn("(by the files in outputs/)", told)
        self.assertEqual(stored(), before, "the first result is still kept, the second is not")

    def test_with_the_limits_of_the_run(self):
        # More corners than a process has left over before its first limit.
        self.write("a.ply", tetrahedron([(i % 100, i // 100, 0) for i in range(4, 200_000)]))
        self.run_into("plain", READS)
        self.run_into("a", READS, "--file-memory", 900, "--file-seconds", "7.5")
        limits = lambda name: [self.json(name + "/run.json").get(limit) for limit in ("file_memory_mb", "file_seconds")]
        self.assertEqual([limits("plain"), limits("a")], [[None, None], [900, 7.5]])
        self.rerun(0, "a", "--out", "b")
        self.rerun(0, "a", "--out", "c", "--file-memory", 800)
        self.assertEqual([limits("b"), limits("c")], [[900, 7.5], [800, 7.5]])
        record = self.json("a/run.json")
        for wrong in (-1, 0, "900", 1e30):
            self.write("a/run.json", json.dumps({**record, "file_memory_mb": wrong}))
            self.refused("its 'file_memory_mb' is no number from 0.001 to 1000000000", "rerun", "a")
        if IS_SANITIZED:
            return  # memory has no limit there
        self.write("a/run.json", json.dumps({**record, "file_memory_mb": 1}))
        self.assertIn("raise the limit with --file-memory", self.rerun(1, "a", "--out", "d").stdout)
        self.rerun(0, "a", "--out", "e", "--file-memory", 900)

    def test_a_failed_run(self):
        self.run_into("a", FAILS, code=1)
        self.assertIn(
            "identical: all 2 nodes came out the same\nnode 'f' failed in both: the number is too large; give a "
            "smaller one\n",
            self.rerun(1, "a", "--out", "b").stdout,
        )

    def test_a_cell_of_a_comparison(self):
        self.write("p.yaml", CELLS)
        self.write("cases/0/data", "0")
        self.write("e.yaml", EXPERIMENT)
        self.expect(0, "compare", "e.yaml", "--out", "out", "--quiet")
        told = self.rerun(0, "out/cells/b/0/0").stdout
        self.assertIn("identical: the only node came out the same\n", told)
        self.assertIn(
            "  why: option 'value' is 5, was 1 (e.yaml:7, was the default)\n",
            self.diff(1, "out/cells/a/0/0", "out/cells/b/0/0"),
        )


if __name__ == "__main__":
    main()
