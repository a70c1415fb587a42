# SPDX-License-Identifier: Apache-2.0
"""The tutorials, followed as a reader follows them: each block is run, or becomes the file that it is."""
import concurrent.futures
import os
import pathlib
import re
import unittest

from documents import ALL, BUILD, IS_SANITIZED, SOURCE, Documents, blocks, sample, main

AT_ONCE = 2
# The comparison of a tutorial goes through fewer of its cases than its reader does, but for MARROW_TEST_ALL=1.
SEEDS = ("seeds: 1..8", "seeds: 1..8" if ALL else "seeds: 1..3")


class Tutorials(Documents):
    """Each tutorial in a folder of its own, with one store for all."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        pages = [page for page in cls.documents if page.startswith("docs/tutorials/")]
        if IS_SANITIZED:  # a plugin outside the tree is built without the sanitizer; there are no nodes in Python
            pages.remove("docs/tutorials/first-node")
            pages.remove("docs/tutorials/first-hour")
        assert len(pages) > 3, pages
        pages = sample(pages, 3)
        with concurrent.futures.ThreadPoolExecutor(AT_ONCE) as pool:
            cls.followed = dict(zip(pages, pool.map(cls.follow, pages)))

    @classmethod
    def script(cls, page):
        """All that the reader does, as one script."""
        lines = ["set -euo pipefail", "export PATH=%s/bin:$PATH" % BUILD]
        for block in blocks.blocks_of(cls.documents[page]):
            reason = cls.reason_not_to_run(page, block)
            if block.about and block.language != "shell":
                parent = pathlib.Path(block.about).parent
                lines.append("mkdir -p %s; cat > %s <<'END_OF_FILE'" % (parent, block.about))
                lines.append(block.text.replace(*SEEDS) + "\nEND_OF_FILE")
            elif block.language == "shell" and reason:
                print("%s:%d not run: %s" % (page, block.line, reason))
            elif block.language == "shell":  # two runs that differ are what diff is for: it ends with 1
                lines.append(re.sub(r"^(marrow diff .*)$", r"\1 || [ $? = 1 ]", block.text, flags=re.M))
        return "\n".join(lines)

    @classmethod
    def follow(cls, page):
        folder = cls.folder / pathlib.Path(page).name
        folder.mkdir()
        for name in ("pipelines", "docs", "tools", "build"):
            os.symlink(cls.folder / name, folder / name)
        return folder, cls.run_here("bash", "-c", cls.script(page), folder=folder, timeout=900)

    def told(self, name):
        """(folder, what was printed) of a tutorial, all of whose commands ended well. Skips one that is not in the
        sample."""
        if "docs/tutorials/" + name not in self.followed:
            self.skipTest("it is not in the sample; MARROW_TEST_ALL=1 follows all")
        folder, result = self.followed["docs/tutorials/" + name]
        self.assertEqual(result.returncode, 0, name + "\n" + result.stdout[-3000:] + result.stderr[-3000:])
        return folder, result.stdout

    def test_every_tutorial_can_be_followed(self):
        for page in self.followed:
            self.told(pathlib.Path(page).name)

    def test_first_registration(self):
        folder, told = self.told("first-registration")
        self.assertIn("verdict  distal: TRUSTED", told)
        self.assertIn("edges.canny", told)
        self.assertTrue((folder / "runs" / "femur" / "report.html").exists())
        self.assertIn("First difference: node 'edges' (edges.canny)", told)

    @unittest.skipIf(IS_SANITIZED, "there are no nodes in Python")
    def test_first_hour(self):
        folder, told = self.told("first-hour")
        self.assertIn("edges.canny  ", told.split("In place of 'edges' in mine.yaml")[1].split("\n\n")[1])
        self.assertRegex(
            told, r"why: it uses edges.canny, used edges.adaptive_relaxation \(--set edges.uses=edges.canny"
        )
        self.assertIn("input 'cost' is wired to near (there was no node 'near'), was wired to contour_cost", told)
        table = (folder / "runs/compare/patients/poses.csv").read_text().splitlines()
        self.assertEqual([line.split(",")[1] for line in table], ["case", "1", "2", "3", "4", "5"])
        self.assertIn("trusted", table[1])
        self.assertIn("failed again, with the same error: view 'frontal': no shaft pair found", told)

    def test_own_data(self):
        folder, told = self.told("own-data")
        self.assertIn("verdict  distal: TRUSTED", told)
        self.assertNotIn("errors distal", told)
        self.assertTrue((folder / "runs" / "femur" / "outputs" / "model" / "distal.ply").exists())

    @unittest.skipIf(
        IS_SANITIZED, "a plugin outside the tree is built without the sanitizer, which marrow would refuse"
    )
    def test_first_node(self):
        folder, told = self.told("first-node")
        self.assertIn("share_percent", told)
        self.assertIn("edges.strongest", (folder / "runs" / "femur" / "pipeline.yaml").read_text())

    def test_first_comparison(self):
        _, told = self.told("first-comparison")
        self.assertIn("16 cells: 2 variants, 8 cases" if ALL else "6 cells: 2 variants, 3 cases", told)

    def test_reading_a_report(self):
        folder, _ = self.told("reading-a-report")
        page = (folder / "runs" / "femur" / "report.html").read_text()
        told = self.documents["docs/tutorials/reading-a-report"]
        of_a_run, of_a_comparison = told.split("## The page of a comparison")
        named = re.findall(r"^- \*\*([A-Z][A-Za-z0-9 ]+)\.\*\*", of_a_run, re.M)
        self.assertGreater(len(named), 6)
        for title in named + re.findall(r"^- \*\*([A-Z][A-Za-z0-9 ]+)\.\*\*", of_a_comparison, re.M):
            self.assertRegex(page, "['\">]%s['\"<]" % title, "the page has no part of this name")


if __name__ == "__main__":
    main()
