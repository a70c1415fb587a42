# SPDX-License-Identifier: Apache-2.0
"""The manual pages say what the help says, and are good troff."""
import re
import shutil
import subprocess
import unittest

from harness import BUILD, SOURCE
from harness.program import SharedCase, main

VERSION = re.search(r"project\(marrow VERSION ([0-9.]+)", (SOURCE / "CMakeLists.txt").read_text()).group(1)


class Manual(SharedCase):
    def make(self):
        self.folder = self.scratch / "man"
        self.expect(0, "manual", "--out", self.folder)
        subprocess.run([BUILD / "bin" / "marrow-workbench", "manual", "--out", self.folder], check=True)
        self.helps = {}
        self.add_help()

    def add_help(self, *words):
        """Keeps the help of a command and of those below it, as (part, name, text) of each line."""
        lines, part = [], ""
        for line in self.printed(*words, "--help").splitlines():
            part = line if line.endswith(":") else part
            match = re.match(r"  (\S+).*?(?:\s{2,}(\S.*))?$", line)
            if match and not line.startswith("   "):
                lines.append((part, match.group(1), match.group(2) or ""))
        self.helps["-".join(["marrow", *words]) + ".1"] = lines
        for part, name, _ in lines:
            if part == "Subcommands:":
                self.add_help(*words, name)

    def shown(self, page, *options):
        command = ["groff", "-man", "-Tutf8", "-P-cbou", "-ww", *options, page]
        done = subprocess.run(command, capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""), page.name)
        return done.stdout

    def test_a_page_for_each_command(self):
        self.assertEqual({path.name for path in self.folder.iterdir()}, set(self.helps))
        self.assertIn("marrow-cache-gc.1", self.helps)

    @unittest.skipUnless(shutil.which("groff"), "groff is not installed")
    def test_each_option_with_its_help(self):
        for page, lines in self.helps.items():
            shown = self.shown(self.folder / page, "-rLL=500n")
            text = " ".join(shown.split()).replace("‐", "-").replace("−", "-")
            self.assertIn("marrow %s" % VERSION, text)
            for part, name, said in lines:
                if part in ("Options:", "Positionals:"):
                    self.assertIn(name.split("=")[0].replace(",", ", "), text, page)
                    self.assertIn(" ".join(said.split()), text, page)

    @unittest.skipUnless(shutil.which("groff"), "groff is not installed")
    def test_what_holds_for_all(self):
        text = self.shown(self.folder / "marrow.1", "-rLL=78n")
        self.assertRegex(text, r"(?m)^EXIT STATUS\n +0 +success")
        self.assertIn("MARROW_PLUGIN_PATH", text)
        self.assertLess(max(map(len, text.splitlines())), 80)

    @unittest.skipUnless(shutil.which("lexgrog"), "man-db is not installed")
    def test_apropos_finds_each(self):
        command = ["lexgrog", *sorted(self.folder.iterdir())]
        done = subprocess.run(command, capture_output=True, text=True, env={"LC_ALL": "C.UTF-8"})
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("marrow-plan - show what a run would compute", done.stdout)


if __name__ == "__main__":
    main()
