# SPDX-License-Identifier: Apache-2.0
"""Comparisons of figures that a test plugin reads from tables, so that their values are known."""
from harness import BUILD
from harness.program import Case

GIVEN_PLUGINS = BUILD / "tests" / "given_plugins"
PIPELINE = """marrow: 1
inputs: {case: {type: path}}
nodes:
  s: {uses: test.given_start}
  n: {uses: test.given_figures, in: {start: s}, with: {table: $case, column: a, names: [%s]}, may_fail: true}
outputs: {figures: n}
"""


class GivenCase(Case):
    """values: for each variant and case a text such as "1.25 mm", or "fail"; or one for each figure's name."""

    plugins = [GIVEN_PLUGINS]

    def write_cases(self, values, start="0"):
        """A folder for each case, with the texts of all variants."""
        lines = {}
        for variant, texts in values.items():
            for number, text in enumerate(texts):
                named = text if isinstance(text, dict) else {"err": text}
                lines.setdefault(number, []).extend("0,%s,%s,%s,%s" % (variant, start, *item) for item in named.items())
        for number, own in lines.items():
            self.write("cases/%03d/figures.csv" % number, "\n".join(own) + "\n")

    def experiment(self, variants, more="", metrics="[figures.err]", pipeline=PIPELINE % "err"):
        self.write("p.yaml", pipeline)
        text = "experiment: 1\nname: e\npipeline: p.yaml\ncases: {folders: [cases/*]}\nmetrics: %s\n" % metrics
        text += "variants:\n" + "".join("  %s: {n.column: %s}\n" % (name, name) for name in variants)
        return self.write("e.yaml", text + ("" if "timed_cells" in more else "timed_cells: 0\n") + more)

    def compare_file(self, *arguments, code=0):
        """What the terminal shows of the comparison of the experiment that is written."""
        self.result = self.expect(code, "compare", "e.yaml", "--out", "out", "--quiet", *arguments)
        return self.result.stdout

    def compare(self, values, more="", code=0, arguments=(), **others):
        self.write_cases(values)
        self.experiment(list(values), more, **others)
        return self.compare_file(*arguments, code=code)
