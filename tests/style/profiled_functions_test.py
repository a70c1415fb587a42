# SPDX-License-Identifier: Apache-2.0
"""A profiled run must do the same as another. So the functions that `--profile` puts before those of nodes pass on
every method, and no code looks behind them."""
import re
import unittest

from harness import SOURCE

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


class ProfiledFunctionsTest(unittest.TestCase):
    def test_each_method_is_passed_on(self):
        functions = (SOURCE / "framework/marrow/domain/functions.hpp").read_text()
        profiled = (SOURCE / "framework/marrow/runtime/run/profiled_functions.cpp").read_text()
        for name, wrapper in PROFILED.items():
            wanted = methods(functions, name, "virtual")
            self.assertTrue(wanted, name)
            self.assertEqual(methods(profiled, wrapper, "override"), wanted, wrapper + " must pass on all of " + name)

    def test_nothing_looks_behind_them(self):
        found = set()
        for path in (SOURCE / "plugins").rglob("*.[ch]pp"):
            for name in re.findall(r"dynamic_(?:pointer_)?cast<\s*(?:const )?([\w:]+)", path.read_text()):
                found.add(name.split("::")[-1])
        self.assertEqual(found, LOOKED_FOR, "a profiled function must not hide what is looked for; see show_calls()")


if __name__ == "__main__":
    unittest.main()
