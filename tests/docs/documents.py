# SPDX-License-Identifier: Apache-2.0
"""What the tests of the documents share: the documents with their blocks of code, and a folder to try them in."""
import os
import re
import subprocess
import sys

from harness import BUILD, MARROW, SOURCE

sys.path.insert(0, str(SOURCE / "tools" / "site"))
import blocks  # noqa: E402
import document_pages  # noqa: E402
from harness.program import IS_SANITIZED, Case, main  # noqa: F401
from harness.sample import ALL, sample  # noqa: F401

NOT_RUN = re.compile(r"<!-- not run: (.*) -->")


class Documents(Case):
    @classmethod
    def setUpClass(cls):
        cls.documents = document_pages.documents(SOURCE)
        cls.folder = cls.shared_folder()
        for name in ("pipelines", "docs", "tools", "tests", "schemas"):
            os.symlink(SOURCE / name, cls.folder / name)
        os.symlink(BUILD, cls.folder / "build")
        environment = {"MARROW_CACHE": str(cls.folder / "store"), "MARROW_PLUGIN_PATH": ""}
        cls.environment = {**os.environ, **environment}

    @classmethod
    def run_here(cls, *command, folder=None, **options):
        return subprocess.run(
            [*map(str, command)],
            cwd=folder or cls.folder,
            env=cls.environment,
            capture_output=True,
            text=True,
            **options
        )

    def blocks(self, *languages):
        """(place, block) of all documents."""
        for page, text in self.documents.items():
            for block in blocks.blocks_of(text):
                if block.language in languages:
                    yield "%s:%d" % (page, block.line), block

    @classmethod
    def reason_not_to_run(cls, page, block):
        """What a comment right in front of the block's fence says."""
        above = cls.documents[page].splitlines()[: block.line - 2]
        match = NOT_RUN.fullmatch(above[-1]) if above else None
        return match and match.group(1)
