# SPDX-License-Identifier: Apache-2.0
"""The digest of the public headers, by which a plugin that was built with other headers is refused (plugins_test.py):
each change of one of them changes it."""
import re
import subprocess

from harness import SOURCE
from harness.program import Case, main

# A project with some headers, whose digest is made as marrow's own build makes it.
PROJECT = """cmake_minimum_required(VERSION 3.25)
project(digest LANGUAGES NONE)
add_library(marrow INTERFACE)
target_sources(marrow PUBLIC FILE_SET HEADERS BASE_DIRS framework FILES %s)
include(%s)
"""
CHANGE = ("  virtual ~Cost();\n", "  virtual ~Cost();\n  virtual int number() const;\n")


class Digest(Case):
    def setUp(self):
        super().setUp()
        self.headers = {}
        for name in ("functions.hpp", "pose.hpp"):
            self.headers["framework/" + name] = (SOURCE / "framework" / "marrow" / "domain" / name).read_text()
        (self.scratch / "framework").mkdir()

    def digest(self, *names):
        for name, text in self.headers.items():
            self.write(name, text)
        digest_of_build = SOURCE / "framework" / "cmake" / "HeadersDigest.cmake"
        self.write("CMakeLists.txt", PROJECT % (" ".join(names or self.headers), digest_of_build))
        made = subprocess.run(["cmake", "-B", "build"], cwd=self.scratch, capture_output=True, text=True)
        self.assertEqual(made.returncode, 0, made.stderr)
        header = self.scratch / "build" / "include" / "marrow" / "runtime" / "node" / "headers_digest.hpp"
        return re.search("MARROW_HEADERS_DIGEST (0x[0-9a-f]{16})ull", header.read_text()).group(1)

    def test_a_new_virtual_function_is_another_digest(self):
        before = self.digest()
        self.assertEqual(self.digest(*reversed(self.headers)), before, "the order does not count")
        functions = self.headers["framework/functions.hpp"]
        self.assertIn(CHANGE[0], functions)
        self.headers["framework/functions.hpp"] = functions.replace(*CHANGE)
        self.assertNotEqual(self.digest(), before)
        self.headers["framework/functions.hpp"] = functions
        self.assertEqual(self.digest(), before)

    def test_another_name_and_another_header_are_other_digests(self):
        before = self.digest()
        self.assertNotEqual(self.digest("framework/pose.hpp"), before)
        self.headers["framework/poses.hpp"] = self.headers.pop("framework/pose.hpp")
        self.assertNotEqual(self.digest(), before)


if __name__ == "__main__":
    main()
