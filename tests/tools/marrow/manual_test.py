# SPDX-License-Identifier: Apache-2.0
"""The manual pages say what the help says, and are good troff."""
import re
import shutil
import subprocess
import unittest

from harness import BUILD, SOURCE
from harness.program import Case, main, marrow

VERSION = re.search(r"project\(marrow VERSION ([0-9.]+)", (SOURCE / "CMakeLists.txt").read_text()).group(1)


class Manual(Case):
    @classmethod
    def setUpClass(cls):
        cls.folder = cls.shared_folder() / "man"
        done = marrow("manual", "--out", cls.folder)
        assert done.returncode == 0, done.stderr
        workbench = subprocess.run([BUILD / "bin" / "marrow-workbench", "manual", "--out", cls.folder])
        assert workbench.returncode == 0

    def commands(self, words=()):
        """The words of each command, as the help names them."""
        found, part = [list(words)], ""
        for line in marrow(*words, "--help").stdout.splitlines():
            part = line if line.endswith(":") else part
            match = re.match(r"  (\S+)", line)
            if match and part == "Subcommands:" and not line.startswith("   "):
                found += self.commands([*words, match.group(1)])
        return found

    def shown(self, page, *options):
        command = ["groff", "-man", "-Tutf8", "-P-cbou", "-ww", *options, page]
        done = subprocess.run(command, capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""), page.name)
        return done.stdout

    def test_a_page_for_each_command(self):
        pages = {"-".join(["marrow", *words]) + ".1" for words in self.commands()}
        self.assertEqual({path.name for path in self.folder.iterdir()}, pages)
        self.assertIn("marrow-cache-gc.1", pages)

    @unittest.skipUnless(shutil.which("groff"), "groff is not installed")
    def test_each_option_with_its_help(self):
        for words in self.commands():
            page = self.folder / ("-".join(["marrow", *words]) + ".1")
            text = " ".join(self.shown(page, "-rLL=500n").split()).replace("‐", "-").replace("−", "-")
            self.assertIn("marrow %s" % VERSION, text)
            part = ""
            for line in marrow(*words, "--help").stdout.splitlines():
                part = line if line.endswith(":") else part
                match = re.match(r"  (\S+).*?(?:\s{2,}(\S.*))?$", line)
                if match and part in ("Options:", "Positionals:") and not line.startswith("   "):
                    self.assertIn(match.group(1).split("=")[0].replace(",", ", "), text, page.name)
                    self.assertIn(" ".join((match.group(2) or "").split()), text, page.name)

    @unittest.skipUnless(shutil.which("groff"), "groff is not installed")
    def test_what_holds_for_all(self):
        text = self.shown(self.folder / "marrow.1", "-rLL=78n")
        self.assertRegex(text, r"(?m)^EXIT STATUS\n +0 +success")
        self.assertIn("MARROW_PLUGIN_PATH", text)
        self.assertLess(max(map(len, text.splitlines())), 80)

    @unittest.skipUnless(shutil.which("lexgrog"), "man-db is not installed")
    def test_apropos_finds_each(self):
        done = subprocess.run(
            ["lexgrog", *sorted(self.folder.iterdir())], capture_output=True, text=True, env={"LC_ALL": "C.UTF-8"}
        )
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("marrow-plan - show what a run would compute", done.stdout)


if __name__ == "__main__":
    main()
