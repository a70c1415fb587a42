# SPDX-License-Identifier: Apache-2.0
"""The installed program works in any folder, and knows its plugins without describing them again."""
import gzip
import os
import subprocess

from harness import BUILD
from harness.program import Case, main


class Install(Case):
    def setUp(self):
        super().setUp()
        subprocess.run(
            ["cmake", "--install", BUILD, "--prefix", self.scratch / "first"], check=True, stdout=subprocess.DEVNULL
        )
        (self.scratch / "first").rename(self.scratch / "moved")
        self.root = self.scratch / "moved"

    def marrow(self, *arguments):
        # With a separate cache, it uses nothing from earlier runs.
        environment = {**os.environ, "XDG_CACHE_HOME": str(self.scratch / "cache")}
        result = subprocess.run(
            [self.root / "bin" / "marrow", *arguments],
            env=environment,
            cwd=self.scratch,
            capture_output=True,
            text=True,
        )
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def test_it_may_be_moved(self):
        said = self.marrow("doctor")
        self.assertIn("moved/lib", said)
        self.assertNotIn("note:", said, "no manifest is stale")
        self.assertIn("edges.canny", self.marrow("list", "edges"))
        pipelines = self.root / "share" / "marrow" / "pipelines"
        self.marrow("check", pipelines / "femur" / "femur.yaml")
        self.assertTrue((self.root / "share" / "marrow" / "schemas" / "pipeline.schema.json").is_file())

    def test_manual_pages_and_completion(self):
        share = self.root / "share"
        pages = {path.name for path in (share / "man" / "man1").iterdir()}
        self.assertLessEqual(
            {"marrow.1.gz", "marrow-run.1.gz", "marrow-cache-gc.1.gz", "marrow-open.1.gz", "marrow-workbench.1.gz"},
            pages,
        )
        page = gzip.decompress((share / "man" / "man1" / "marrow-plan.1.gz").read_bytes()).decode()
        self.assertIn("marrow\\-plan \\- show what a run would compute", page)
        for shell, file in (
            ("bash", "bash-completion/completions/marrow"),
            ("fish", "fish/vendor_completions.d/marrow.fish"),
            ("zsh", "zsh/vendor-completions/_marrow"),
        ):
            self.assertEqual((share / file).read_text(), self.marrow("completion", shell))


if __name__ == "__main__":
    main()
