# SPDX-License-Identifier: Apache-2.0
"""What the sources must keep to. Numbers become texts in one place, marrow/base/number_text.hpp, which is the same in
every locale. And a profiled run must do the same as another: the functions that `--profile` puts before those of nodes
pass on every method, and no code looks behind them."""
import re
import unittest

from harness import SOURCE

OWN_WAYS = re.compile(r"std::to_string\(|snprintf\(|\bostringstream\b|std::to_chars\(|std::setprecision\(")
MAY = {
    "framework/marrow/base/number_text.cpp": "the one place",
    "plugins/toolbox/files/tiff_pages.cpp": "libtiff gives its messages as a format of C and its values",
}
PROFILED = {
    "OutlineProjector": "ProfiledOutlines",
    "RadiographProjector": "ProfiledRadiographs",
    "Optimizer": "ProfiledOptimizer",
}
# What code looks for by dynamic_cast: none is a class that profiled_functions.cpp replaces. BonesTogether has a name
# that other files know, and the others are costs, which are not replaced.
LOOKED_FOR = {"BonesTogether", "CostAmongOthers", "ViewsCost"}


def methods(text, name, mark):
    """How often each virtual method is in a class, by name."""
    body = re.search(r"\nclass (?:\w+ )?%s\b.*?\n};" % name, text, re.S).group()
    found = re.findall(r"virtual [^;~]*?(\w+)\(" if mark == "virtual" else r"(\w+)\([^{};]*\) const override", body)
    return sorted(found)


class Sources(unittest.TestCase):
    def test_no_file_has_its_own_way_to_write_numbers(self):
        found = set()
        for room in ("framework", "plugins", "tools", "python"):
            for path in (SOURCE / room).rglob("*.[ch]pp"):
                if OWN_WAYS.search(path.read_text()):
                    found.add(str(path.relative_to(SOURCE)))
        self.assertEqual(found, set(MAY), "use formatted(), short_number() or exact_number() of number_text.hpp")

    def test_each_method_of_a_profiled_function_is_passed_on(self):
        functions = (SOURCE / "framework/marrow/domain/functions.hpp").read_text()
        profiled = (SOURCE / "framework/marrow/runtime/run/profiled_functions.cpp").read_text()
        for name, wrapper in PROFILED.items():
            wanted = methods(functions, name, "virtual")
            self.assertTrue(wanted, name)
            self.assertEqual(methods(profiled, wrapper, "override"), wanted, wrapper + " must pass on all of " + name)

    def test_nothing_looks_behind_profiled_functions(self):
        found = set()
        for path in (SOURCE / "plugins").rglob("*.[ch]pp"):
            for name in re.findall(r"dynamic_(?:pointer_)?cast<\s*(?:const )?([\w:]+)", path.read_text()):
                found.add(name.split("::")[-1])
        self.assertEqual(found, LOOKED_FOR, "a profiled function must not hide what is looked for; see show_calls()")


if __name__ == "__main__":
    unittest.main()
