# SPDX-License-Identifier: Apache-2.0
"""The suites catch nodes that are wrong in one way each, by name, and pass a plain right one."""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
import unittest

from harness.sample import sample

from harness import BUILD, MARROW

WRONG = {  # node: checks of which at least one must fail
    "camera.silent": {"mirrored", "wrong_unit"},
    "camera.anxious": {"right_cameras"},
    "camera.careless": {"nan_camera"},
    "camera.changing": {"determinism", "threads"},
    "camera.trusting": {"flipped_axis"},
    "camera.left_handed": {"contract"},
    "edges.shifted": {"disc_bias", "bar_bias"},
    "edges.turned": {"disc_direction", "bar_direction"},
    "edges.changing": {"determinism", "threads"},
    "edges.unsorted": {"contract"},
    "edges.crashing": {"one_pixel", "empty_image"},
    "initial.one_sided": {"mirrored"},
    "initial.aside": {"position"},
    "initial.upright": {"turned_world"},
    "initial.without_axes": {"long_axis"},
    "initial.trusting": {"nothing_compared"},
    "mesh.inward": {"sphere_topology", "torus_topology"},
    "mesh.open": {"contract"},
    "mesh.pinched": {"contract"},
    "mesh.hasty": {"random_fields"},
    "mesh.fat": {"sphere_distance", "torus_distance"},
    "mesh.unturned": {"turned_sphere_distance", "blobs_distance"},
    "mesh.endless": {"nothing_inside"},
    "optimizer.lazy": {"sphere", "rosenbrock"},
    "optimizer.spending": {"budget"},
    "optimizer.unbounded": {"bounds"},
    "optimizer.fooled": {"not_a_number"},
    "optimizer.changing": {"repeated"},
    "optimizer.tireless": {"tolerance"},
    "optimizer.trusting": {"nonsense"},
    "optimizer.inventive": {"nothing_finite"},
    "project.shifted_outline": {"outline"},
    "project.shifted_radiograph": {"ball"},
    "project.dense": {"ball"},
    "project.narrow": {"region"},
    "project.behind": {"out_of_view"},
    "project.silent": {"contract"},
    "project.coarse": {"sub_sampled"},
    "project.everything": {"other_fragment"},
    "project.changing": {"any_threads"},
    "project.inward": {"outline_direction"},
    "project.gaps": {"outline_complete"},
    "project.slanted": {"outline_direction"},
    "register.idle": {"truth", "starts_mean"},
    "register.near_sighted": {"starts_worst"},
    "segment.fat": {"wall_bias"},
    "segment.swapped": {"dice"},
    "segment.merged": {"overlap"},
    "segment.changing": {"determinism", "threads"},
    "segment.careless": {"no_points"},
    "shaft.inner": {"right_pair"},
    "shaft.turned": {"angle"},
    "shaft.swapped": {"contract"},
    "shaft.sure": {"width"},
    "shaft.crashing": {"empty_map", "one_pixel"},
    "similarity.shifted": {"minimum"},
    "similarity.careless": {"contract"},
    "similarity.moved": {"gain"},
    "similarity.changing": {"any_threads"},
    "similarity.unordered": {"contract"},
    "similarity.unmasked": {"mask"},
    "similarity.flat": {"six_axes", "truth"},
    "similarity.levels": {"coarse_level"},
    "similarity.steep": {"slope"},
    "similarity.alone": {"beside_another"},
    "track.lagging": {"no_worse"},
    "track.drifting": {"still"},
    "read.taking_anything": {"damaged"},
    "read.nameless": {"damaged"},
    "read.shifted": {"pose"},
    "track.shaking": {"still_no_worse", "still"},
    "track.renamed": {"contract"},
    "track.careless": {"nan_pose", "not_rigid"},
    "track.changing": {"determinism", "threads"},
    "track.averaging": {"outlier"},
    "track.rounding": {"moved_world"},
    "track.one_sided": {"reversed"},
    "verdict.trusting": {"mistakes_trusted"},
    "verdict.doubting": {"right_not_trusted"},
    "verdict.denying": {"right_wrong"},
    "volume.another_grid": {"contract"},
    "volume.brighter": {"inside", "outside"},
    "volume.by_place": {"moved_inside"},
    "volume.blurred": {"inside"},
    "volume.careless": {"nan_voxel"},
    "volume.changing": {"determinism", "threads"},
    "volume.metal": {"metal"},
    "volume.larger": {"surface_volume"},
    "volume.shifted": {"surface_place"},
    "volume.other_frame": {"contract"},
}
KINDS = subprocess.run([MARROW, "list", "--kinds", "--json"], stdout=subprocess.PIPE, text=True, check=True).stdout
CHECKS = {kind["name"]: {check["name"] for check in kind["checks"]} for kind in json.loads(KINDS)}


def conformance(*subjects, seconds=10, **variables):
    """Exit code, and {node: {check: (passed, text)}}."""
    environment = {
        **os.environ,
        "MARROW_PLUGIN_PATH": str(BUILD / "tests" / "conformance_plugins"),
        "MARROW_CHECK_SECONDS": str(seconds),
        **variables,
    }
    result = subprocess.run([str(MARROW), "conformance", *subjects], capture_output=True, text=True, env=environment)
    nodes, checks = {}, {}
    for line in result.stdout.splitlines():
        if re.fullmatch(r"[a-z_]+\.[a-z_0-9]+", line):
            checks = nodes.setdefault(line, {})
        found = re.match(r"  (pass|FAIL|n/a ) (\S+)\s*(.*)", line)
        if found:
            checks[found.group(2)] = (found.group(1) != "FAIL", found.group(3))
    return result, nodes


class Conformance(unittest.TestCase):
    def test_each_wrong_node_is_caught_by_name(self):
        for node, expected in WRONG.items():
            with self.subTest(node):
                seconds = 2 if node == "mesh.endless" else 10
                result, nodes = conformance(node, *("--check=" + check for check in expected), seconds=seconds)
                self.assertLessEqual(set(nodes[node]), expected)
                failed = {name for name, (passed, _) in nodes[node].items() if not passed}
                self.assertEqual(result.returncode, 1)
                self.assertTrue(failed & expected, "failed: %s, expected one of %s" % (failed, expected))

    def test_a_fault_in_one_place_fails_there_alone(self):
        for node in sample(("edges.shifted", "mesh.hasty", "mesh.unturned"), 1):
            checks = conformance(node, seconds=900)[1][node]
            self.assertEqual({name for name, (passed, _) in checks.items() if not passed}, WRONG[node])

    def test_what_happened_is_said(self):
        for node, check, seconds, said in (
            ("edges.crashing", "one_pixel", 900, r"it crashed: Aborted"),
            ("mesh.endless", "nothing_inside", 2, r"it took longer than 2 s"),
            ("mesh.fat", "sphere_distance", 900, r"0\.(29|30)\d* mm, limit 0\.15"),
        ):
            _, nodes = conformance(node, "--check", check, seconds=seconds)
            self.assertRegex(nodes[node][check][1], "^%s$" % said)

    def test_files_lie_in_a_folder_that_nobody_foresees_and_are_removed(self):
        with tempfile.TemporaryDirectory() as folder:
            victim = pathlib.Path(folder) / "victim"
            victim.write_text("mine")
            temporary = pathlib.Path(folder) / "temporary"
            for number in range(os.getpid(), os.getpid() + 300):
                (temporary / ("marrow-conformance-%d" % number)).mkdir(parents=True)
                (temporary / ("marrow-conformance-%d" % number) / "board.yaml").symlink_to(victim)
            before = set(temporary.iterdir())
            for node in ("camera.plain", "edges.crashing"):
                conformance(node, seconds=300, TMPDIR=str(temporary))
                self.assertEqual(victim.read_text(), "mine")
                self.assertEqual(set(temporary.iterdir()), before)
            result, _ = conformance("camera.plain", TMPDIR=str(victim))
            self.assertEqual(result.returncode, 2)
            self.assertIn("error: ", result.stderr)

    def test_what_is_stopped_leaves_nothing(self):
        with tempfile.TemporaryDirectory() as folder:
            environment = dict(
                os.environ, MARROW_PLUGIN_PATH=str(BUILD / "tests" / "conformance_plugins"), TMPDIR=folder
            )
            process = subprocess.Popen(
                [str(MARROW), "conformance", "mesh.endless"],
                env=environment,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
            process.stdout.readline()
            self.assertEqual(len(os.listdir(folder)), 1)
            self.assertEqual(os.stat(os.path.join(folder, os.listdir(folder)[0])).st_mode & 0o777, 0o700)
            process.send_signal(signal.SIGINT)
            self.assertEqual(
                (process.communicate(timeout=300)[1], process.returncode), ("marrow: stopped by Ctrl-C\n", 130)
            )
            self.assertEqual(os.listdir(folder), [])

    def test_right_ones_pass(self):
        plain = {kind: ["plain"] for kind in CHECKS if any(node.startswith(kind + ".") for node in WRONG)}
        plain.update(project=["plain_outline", "plain_radiograph"], volume=["plain_ct", "plain_surface"])
        del plain["read"]  # not each of its checks applies to the node
        for node in [kind + "." + name for kind, names in plain.items() for name in names]:
            checks = sample(sorted(CHECKS[node.split(".")[0]] - {"contract"}), 5)
            result, nodes = conformance(node, "--check=contract", *("--check=" + name for name in checks), seconds=300)
            self.assertEqual(result.returncode, 0, result.stdout)
            self.assertEqual(set(nodes[node]), {"contract", *checks})

    def test_a_node_without_inputs_passes_what_applies_to_it(self):
        result, nodes = conformance("read.plain")
        self.assertEqual(result.returncode, 0, result.stdout)
        self.assertEqual(set(nodes["read.plain"]), {"damaged", "image", "mesh", "pose", "volume"})
        self.assertIn("it gives no mesh", nodes["read.plain"]["mesh"][1])

    def test_unknown(self):
        result, _ = conformance("edges.cany")
        self.assertEqual(result.returncode, 2)
        self.assertIn("there is no node, kind or library 'edges.cany'; did you mean 'edges.canny'?", result.stderr)

    def test_checks_by_their_names(self):
        result, nodes = conformance("edges", "--check", "one_pixel", "--check", "contract")
        self.assertEqual(set(map(tuple, nodes.values())), {("contract", "one_pixel")})
        self.assertIn("edges.crashing", nodes)
        result, _ = conformance("edges.plain", "--check", "one_pixels", "--check", "contract")
        self.assertEqual((result.returncode, result.stdout), (2, ""))
        self.assertIn("there is no check 'one_pixels'; did you mean 'one_pixel'?", result.stderr)

    def test_a_library_means_its_nodes(self):
        result, nodes = conformance("marrow_wrong_edges.so", "--check", "contract")
        self.assertEqual(
            sorted(nodes),
            ["edges.changing", "edges.crashing", "edges.plain", "edges.shifted", "edges.turned", "edges.unsorted"],
        )

    def test_a_library_of_any_folder(self):
        with tempfile.TemporaryDirectory() as folder:
            library = pathlib.Path(folder) / "marrow_alone.so"
            shutil.copy(BUILD / "tests" / "conformance_plugins" / "marrow_wrong_cameras.so", library)
            result, nodes = conformance(str(library), seconds=60, MARROW_PLUGIN_PATH="")
            self.assertIn("camera.plain", nodes, result.stderr)
            library.write_bytes(library.read_bytes()[:1000])
            result, _ = conformance(str(library), MARROW_PLUGIN_PATH="")
            self.assertEqual(result.returncode, 2)
            self.assertIn("the library %s is not used: " % library, result.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
