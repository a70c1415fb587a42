# SPDX-License-Identifier: Apache-2.0
"""A module that others could change is not imported by a node written in Python: nothing of it runs."""
import os
import subprocess

from harness.package import MARROW, main, marrow
from written_nodes import Written, view

THEIRS = "import sys\nsys.path.insert(0, %r)\n"


class Trust(Written):
    def setUp(self):
        super().setUp()
        self.open = self.scratch / "open"
        self.open.mkdir()
        self.mark = self.scratch / "mark"
        (self.open / "theirs.py").write_text("open(%r, 'w').close()\n" % str(self.mark))
        self.open.chmod(0o777)
        os.environ.pop("MARROW_TRUST_ALL_PLUGINS", None)
        self.addCleanup(os.environ.pop, "MARROW_TRUST_ALL_PLUGINS", None)

    def untrusted(self, path):
        return (
            "cannot be loaded, because it needs '%s', which is not trusted, because others may write to '%s' (owner "
            % (path, self.open)
        )

    def doctor(self):
        return subprocess.run([str(MARROW), "doctor"], capture_output=True, text=True, cwd=self.scratch).stdout

    def test_what_the_file_imports(self):
        self.node(THEIRS % str(self.open) + "import theirs\nVALUE = 5")
        self.assertIn("module 'theirs' " + self.untrusted(self.open / "theirs.py"), self.doctor())
        self.assertFalse(self.mark.exists())
        self.open.chmod(0o755)  # as the message says
        self.assertEqual(marrow.own.value(view())["value"], 5)
        self.assertTrue(self.mark.exists())
        self.mark.unlink()
        self.open.chmod(0o777)
        self.assertIn(self.untrusted(self.open / "theirs.py"), self.doctor(), "a kept description is no trust")
        self.assertFalse(self.mark.exists())
        os.environ["MARROW_TRUST_ALL_PLUGINS"] = "1"
        marrow.find_plugins_again()
        self.assertEqual(marrow.own.value(view())["value"], 5)

    def test_an_import_whose_error_is_caught(self):
        self.node(THEIRS % str(self.open) + "try:\n    import theirs\nexcept ImportError:\n    VALUE = 5\n")
        self.assertIn("module 'theirs' " + self.untrusted(self.open / "theirs.py"), self.doctor())
        self.assertFalse(self.mark.exists())

    def test_an_import_in_a_call(self):
        self.node(THEIRS % str(self.open), "import theirs\nVALUE = 5")
        said = str(self.fault_of(lambda: marrow.own.value(view()), marrow.RunError))
        self.assertIn("module 'theirs' " + self.untrusted(self.open / "theirs.py"), said)
        self.assertFalse(self.mark.exists())

    def test_a_folder_of_the_search_path(self):
        """The interpreter itself runs sitecustomize.py of such a folder."""
        (self.open / "theirs.py").rename(self.open / "sitecustomize.py")
        with self.with_variables(PYTHONPATH=self.open):
            self.node("VALUE = 5")
            self.assertIn(self.untrusted(self.open), self.doctor())
            self.assertFalse(self.mark.exists())


if __name__ == "__main__":
    main()
