# SPDX-License-Identifier: Apache-2.0
"""The places that tools/checks/mutate would change, and whether the sources still have the lines that tests/mutants.txt
explains."""
import subprocess
import sys
import unittest

from harness import SOURCE

sys.dont_write_bytecode = True
sys.path.insert(0, str(SOURCE / "tools" / "checks" / "mutation"))
from places import places_of  # noqa: E402


def changes(text):
    """Each changed text with its replacements."""
    return [(place.old, choice) for place in places_of("x.cpp", text) for choice in place.choices]


def body(statement):
    return "void f() {\n" + statement + "\n}\n"


class Places(unittest.TestCase):
    def test_operators_between_operands(self):
        self.assertEqual(changes("int x = a + b;"), [("+", "-")])
        self.assertEqual(changes("bool x = a < b && c;"), [("<", "<="), ("<", ">="), ("&&", "||")])
        self.assertEqual(changes("x = -a * !b;"), [("-", ""), ("*", "/"), ("!", "")])
        self.assertEqual(changes("T* const p; U&& q; std::vector<int>& v;"), [], "types")

    def test_numbers(self):
        self.assertEqual(changes("int x = 3;"), [("3", "4"), ("3", "2")])
        self.assertEqual(changes("int x = 0;"), [("0", "1")])
        self.assertEqual(changes("float x = 0.5f;"), [("0.5f", "1.0f"), ("0.5f", "0.25f")])
        self.assertEqual(changes("double x = 1e-6;"), [("1e-6", "0.001"), ("1e-6", "1e-09")])
        self.assertEqual(changes("unsigned x = 0xffu;"), [("0xffu", "0x100u")])

    def test_conditions(self):
        self.assertIn(("a", "false"), changes(body("if (a) b();")))
        self.assertIn(("x > y", "true"), changes(body("if (int x = f(); x > y) b();")))
        self.assertEqual([new for old, new in changes(body("while (a) {}")) if old == "a"], ["false"])
        self.assertEqual(
            [new for old, new in changes(body("for (int i = a; i < n; ++i) {}")) if old == "i < n"], ["false"]
        )
        self.assertEqual(changes(body("for (const auto& a : b) {}")), [])
        self.assertEqual(changes(body("if (const auto* a = b) {}")), [], "a declaration")

    def test_statements(self):
        self.assertEqual(
            changes(body("a = b;\nc.d(e);\nreturn x;\nint y;\nMatrix z(w);\nv.reserve(n);")),
            [("a = b", ""), ("c.d(e)", "")],
        )
        self.assertIn(("b()", ""), changes(body("if (a) b();")))
        self.assertIn(("g([] { h(); })", ""), changes(body("g([] { h(); });")))
        self.assertIn(("h()", ""), changes(body("g([] { h(); });")))
        self.assertEqual(changes("struct S { int a; void f(); };"), [])
        text = body("call(a,\n     b);")
        place = places_of("x.cpp", text)[0]
        changed = text[: place.start] + place.choices[0] + text[place.end :]
        self.assertEqual(changed.count("\n"), text.count("\n"), "lines keep their numbers")

    def test_what_is_no_behaviour_stays(self):
        for text in (
            "#include <a>\n#define B (1 + 2)\n",
            "// 1 + 2\n/* 3 * 4 */",
            'auto s = "1 + 2" + name;',
            'auto s = R"(1 + 2)";',
            "char c = '1';",
            "static_assert(a == 1);",
            "std::array<int, 3> a;",
            body("char text[32];"),
        ):
            self.assertEqual(changes(text), [], text)
        self.assertEqual(
            changes(body('throw Error("at " + std::to_string(i + 1));')),
            [('throw Error("at " + std::to_string(i + 1))', "")],
        )

    def test_of_a_registration_only_the_numbers_count(self):
        self.assertEqual(
            changes('MARROW_PLUGIN(plugin) {\n  plugin.node("a", f).option("b", &O::b, "c" + d, at_least(2));\n}\n'),
            [("2", "3"), ("2", "1")],
        )

    def test_the_draw_is_that_of_the_seed(self):
        def drawn(seed):
            return subprocess.run(
                [
                    str(SOURCE / "tools" / "checks" / "mutate"),
                    "--list",
                    "--in",
                    "plugins/fracture",
                    "--count",
                    "5",
                    "--seed",
                    str(seed),
                ],
                capture_output=True,
                text=True,
                check=True,
            ).stdout

        self.assertEqual(drawn(1), drawn(1))
        self.assertNotEqual(drawn(1), drawn(2))


class Explained(unittest.TestCase):
    def test_what_is_explained_stands_in_the_sources(self):
        for block in (SOURCE / "tests" / "mutants.txt").read_text().split("\n\n"):
            lines = [line for line in block.splitlines() if line and not line.startswith("#")]
            if lines:
                self.assertGreaterEqual(len(lines), 4, "path, source line, change, reason: " + block)
                self.assertIn(
                    lines[1],
                    [line.strip() for line in (SOURCE / lines[0]).read_text().splitlines()],
                    "gone from %s; remove it from tests/mutants.txt" % lines[0],
                )


if __name__ == "__main__":
    unittest.main()
