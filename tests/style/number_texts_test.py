# SPDX-License-Identifier: Apache-2.0
"""Numbers become texts in one place, marrow/base/number_text.hpp, which is the same in every locale."""
import re
import unittest

from harness import SOURCE

OWN_WAYS = re.compile(r"std::to_string\(|snprintf\(|\bostringstream\b|std::to_chars\(|std::setprecision\(")
MAY = {
    "framework/marrow/base/number_text.cpp": "the one place",
    "plugins/toolbox/files/tiff_reader.cpp": "libtiff gives its messages as a format of C and its values",
}


class NumberTexts(unittest.TestCase):
    def test_no_file_has_its_own_way(self):
        found = set()
        for room in ("framework", "plugins", "tools", "python"):
            for path in (SOURCE / room).rglob("*.[ch]pp"):
                if OWN_WAYS.search(path.read_text()):
                    found.add(str(path.relative_to(SOURCE)))
        self.assertEqual(found, set(MAY), "use formatted(), short_number() or exact_number() of number_text.hpp")


if __name__ == "__main__":
    unittest.main()
