# SPDX-License-Identifier: Apache-2.0
"""Statements of the documents, each shown by a command: claims.yaml. A statement that is gone from its page, or that
its command does not show, fails. And the README's short pipeline is a part of the shipped one."""
import pathlib
import re
import shutil

import yaml

from documents import BUILD, SOURCE, Documents, blocks, main
from harness import formats
from harness.cases import SMALL, copy_case, simulate

SURFACE = """marrow: 1
inputs: {surface: {type: path}}
nodes: {surface: {uses: read.mesh, with: {path: $surface}}}
outputs: {surface: surface}
"""
# Only to read the images: the camera belongs to none of them.
SEQUENCE = """marrow: 1
inputs: {images: {type: path}}
nodes:
  camera: {uses: camera.carm, with: {names: [a], alpha_deg: [0], beta_deg: [0], width_px: 16, height_px: 16}}
  frames: {uses: read.sequence, in: {camera: camera}, with: {names: [a], images: [$images]}}
  views: {uses: track.views, in: {frame: frames}}
  edges: {uses: edges.canny, in: {view: views}}
outputs: {edges: edges}
"""
# The seeds of a case as a viewer shows them that counts in RAS.
RAS = """marrow: 1
inputs: {case: {type: path}}
nodes:
  case: {uses: read.case, with: {path: $case}}
  seeds: {uses: read.seeds, with: {path: ras.seeds.yaml}}
  bone: {uses: segment.level_set, in: {volume: case.ct, seeds: seeds}}
outputs: {bone: bone}
"""
# The keys of the Citation File Format 1.2.0 that a software has.
CITATION_KEYS = set(
    """abstract authors cff-version commit contact date-released doi identifiers keywords license license-url message
    preferred-citation references repository repository-artifact repository-code title type url version""".split()
)
L = [(0, 0), (20, 0), (20, 10), (10, 10), (10, 20), (0, 20)]
U = [(0, 0), (30, 0), (30, 30), (20, 30), (20, 10), (10, 10), (10, 30), (0, 30)]


def prism(outline, height=10):
    """An OBJ whose bottom and top are one face each."""
    count = len(outline)
    lines = ["v %g %g %g" % (x, y, z) for z in (0, height) for x, y in outline]
    lines.append("f " + " ".join(str(i + 1) for i in reversed(range(count))))
    lines.append("f " + " ".join(str(count + i + 1) for i in range(count)))
    for i in range(count):
        j = (i + 1) % count
        lines.append("f %d %d %d %d" % (i + 1, j + 1, count + j + 1, count + i + 1))
    return "\n".join(lines) + "\n"


def plain(text):
    return " ".join(text.split())


class Claims(Documents):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        folder = cls.folder
        case = simulate(folder / "simulated", *SMALL)
        shutil.copytree(case, folder / "case")
        copy_case(case, folder / "one_view", lambda told: told.update(views=told["views"][:1]))
        seeds = yaml.safe_load((case / "case.yaml").read_text())["fragments"]
        ras = {name: {"seeds": [[-x, -y, z] for x, y, z in one["seeds"]]} for name, one in seeds.items()}
        (folder / "ras.seeds.yaml").write_text(yaml.safe_dump({"marrow-seeds": 1, "fragments": ras}))
        for numbers in ("789", "135", "124"):
            (folder / "pixels" / numbers).mkdir(parents=True)
            for number in numbers:
                (folder / "pixels" / numbers / (number + ".png")).write_bytes(
                    formats.grey_png(16, 16, lambda u, v: 50 + 10 * u)
                )
        for name, text in (("surface", SURFACE), ("sequence", SEQUENCE), ("ras", RAS)):
            (folder / (name + ".yaml")).write_text(text)
        (folder / "l.obj").write_text(prism(L))
        (folder / "u.obj").write_text(prism(U))
        cls.environment["PATH"] = "%s:%s" % (BUILD / "bin", cls.environment["PATH"])
        cls.claims = yaml.safe_load((pathlib.Path(__file__).parent / "claims.yaml").read_text())

    def test_each_claim_stands_in_its_page(self):
        self.assertGreater(len(self.claims), 20)
        pages = {**self.documents, "README": self.documents["index"]}
        for claim in self.claims:
            with self.subTest(claim["says"]):
                self.assertLessEqual(set(claim), {"page", "says", "run", "ends", "shows", "lacks"})
                self.assertTrue(claim.get("shows") or claim.get("lacks"), "a claim that nothing could refute")
                self.assertIn(plain(claim["says"]), plain(pages[claim["page"]]), claim["page"])

    def test_each_claim_is_shown(self):
        for claim in self.claims:
            with self.subTest(claim["says"]):
                result = self.run_here("bash", "-c", claim["run"])
                told = result.stdout + result.stderr
                self.assertEqual(result.returncode, claim.get("ends", 0), told)
                for text in claim.get("shows", ()):
                    self.assertIn(text, told)
                for text in claim.get("lacks", ()):
                    self.assertNotIn(text, told)

    def test_the_short_pipeline_is_a_part_of_the_shipped_one(self):
        text = next(block.text for block in blocks.blocks_of(self.documents["index"]) if block.language == "yaml")
        short, whole = yaml.safe_load(text), yaml.safe_load((SOURCE / "pipelines" / "femur" / "femur.yaml").read_text())
        self.assertGreater(len(short["nodes"]), 10)
        for part in ("inputs", "nodes", "outputs"):
            for name, value in short[part].items():
                self.assertEqual(value, whole[part].get(name), name)

    def test_the_citation_is_of_this_version(self):
        told = yaml.safe_load((SOURCE / "CITATION.cff").read_text())
        self.assertLessEqual({"cff-version", "message", "title", "authors"}, set(told), "the format demands these")
        self.assertLessEqual(set(told), CITATION_KEYS)
        self.assertEqual(told["cff-version"], "1.2.0")
        project = re.search(r"project\(marrow VERSION ([\d.]+)", (SOURCE / "CMakeLists.txt").read_text())
        self.assertEqual(told["version"], project.group(1))
        self.assertIn("License: %s." % told["license"], self.documents["index"])


if __name__ == "__main__":
    main()
