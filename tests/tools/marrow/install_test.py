# SPDX-License-Identifier: Apache-2.0
"""The installed program works in any folder, and knows its plugins without describing them again."""
import gzip
import os
import subprocess

from harness import BUILD
from harness.program import SharedCase, main

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
