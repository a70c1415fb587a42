# SPDX-License-Identifier: Apache-2.0
"""A figure of a comparison that is changed is found, wherever it stands."""
import json
import random
import re
import unittest.mock

from harness import BUILD, need_scipy
from harness.program import Case, main

need_scipy()  # before the modules below
import files
import recompute_compare
from checks import Checks
from generator import generate

# With failures, missing figures, limits, verdicts, capture ranges and times; a sweep; tuning; a rule to stop.
SEEDS = (54, 65, 5, 17)
NOT_FIGURES = re.compile(r"seed-\d+|e\d+\b|95 %|25 %|75 %|\b5 %|p < 0\.05|p < 0\.001|with Holm")


def numbers_in(text):
    """Where numbers stand in a text, without those that are names or constants."""
    names = [found.span() for found in NOT_FIGURES.finditer(text)]
    for found in re.finditer(r"(?<![\w.])\d+(?:\.\d+)?(?![\w.])", text):
        if not any(begin <= found.start() < end for begin, end in names):
            yield found.span()


def leaves(tree, path=()):
    """The places of all numbers and truth values of a tree."""
    if isinstance(tree, dict):
        for key, value in tree.items():
            yield from leaves(value, path + (key,))
    elif isinstance(tree, list):
        for i, value in enumerate(tree):
            yield from leaves(value, path + (i,))
    elif isinstance(tree, (bool, int, float)):
        yield path


def changed(tree, path):
    """The tree with another value at one place."""
    tree = json.loads(json.dumps(tree))
    parent = tree
    for key in path[:-1]:
        parent = parent[key]
    value = parent[path[-1]]
    parent[path[-1]] = not value if isinstance(value, bool) else value + 0.001 * (1 + abs(value))
    return tree


class Wrong(Case):
    @classmethod
    def setUpClass(cls):
        cls.shared = cls.shared_folder()
        cls.made = {}
        for seed in SEEDS:
            experiment, folder = generate(seed), cls.shared / str(seed)
            files.write(experiment, folder)
            ended = files.run(experiment, folder, BUILD)
            assert ended.returncode == 0, ended.stderr
            cls.made[seed] = ended.stdout

        # A changed file changes nothing of what is right, which takes most of the time to find.
        known, find = {}, recompute_compare.answer.answer_tree

        def remembered(experiment, rows, seconds, cases):
            variants = [(variant.name, *variant.swept) for variant in experiment.variants]
            key = repr((experiment.name, variants, sorted(seconds.items()), cases))
            if key not in known:
                known[key] = find(experiment, rows, seconds, cases)
            return known[key]

        patched = unittest.mock.patch.object(recompute_compare.answer, "answer_tree", remembered)
        patched.start()
        cls.addClassCleanup(patched.stop)

    def setUp(self):
        super().setUp()
        self.chance = random.Random(1)

    def test_nothing_is_found_where_nothing_was_changed(self):
        for seed, printed in self.made.items():
            self.assertEqual(self.differences(seed, self.shared / str(seed) / "out", printed), [])

    def differences(self, seed, folder, printed):
        checks = Checks()
        recompute_compare.check(checks, generate(seed), folder, printed)
        return checks.differences

    def test_each_number_that_is_printed(self):
        missed, count = [], 0
        for seed, printed in self.made.items():
            begin, end = printed.index("\nvariant"), printed.index("\n* the baseline")
            for start, stop in self.chance.sample([s for s in numbers_in(printed) if begin < s[0] < end], 10):
                other = printed[:start] + str(float(printed[start:stop]) + 1) + printed[stop:]
                count += 1
                if not self.differences(seed, self.shared / str(seed) / "out", other):
                    missed.append(printed[max(0, start - 40) : stop + 20])
        print("%d printed numbers were changed" % count)
        self.assertEqual(missed, [])

    def changed_file(self, name, count, tree_of, text_of):
        """Changes `count` numbers of a file, one at a time; those that nobody noticed."""
        missed = []
        for seed, printed in self.made.items():
            out = self.shared / str(seed) / "out"
            text = (out / name).read_text()
            tree = tree_of(text)
            for path in self.chance.sample(sorted(leaves(tree), key=str), count):
                (out / name).write_text(text_of(text, changed(tree, path)))
                if not self.differences(seed, out, printed):
                    missed.append(path)
            (out / name).write_text(text)
        return missed

    def test_each_number_of_comparison_json(self):
        missed = self.changed_file("comparison.json", 15, json.loads, lambda _, tree: json.dumps(tree))
        self.assertEqual(missed, [])

    def test_numbers_in_sentences(self):
        missed = []
        for seed, printed in self.made.items():
            file = self.shared / str(seed) / "out/comparison.json"
            text = file.read_text()
            for i in range(len(json.loads(text)["comparisons"])):
                tree = json.loads(text)
                one = tree["comparisons"][i]
                before = one["sentence"]
                start, stop = self.chance.choice([s for s in numbers_in(before) if s[0] > before.index(": ")])
                one["sentence"] = before[:start] + str(float(before[start:stop]) + 1) + before[stop:]
                file.write_text(json.dumps(tree))
                if not self.differences(seed, file.parent, printed.replace(before, one["sentence"])):
                    missed.append(one["sentence"])
            file.write_text(text)
        self.assertEqual(missed, [])

    def test_figures_of_the_report(self):
        begin, end = '<script type="application/json" id="data">', "</script>"

        def data_of(text):
            data = json.loads(text[text.index(begin) + len(begin) :].partition(end)[0])
            return {key: data[key] for key in ("summary", "comparisons", "metrics")}

        def with_data(text, tree):
            head, _, rest = text.partition(begin)
            data, _, tail = rest.partition(end)
            return head + begin + json.dumps({**json.loads(data), **tree}) + end + tail

        self.assertEqual(self.changed_file("report.html", 6, data_of, with_data), [])

    def test_figures_of_cells(self):
        missed = []
        for seed, printed in self.made.items():
            out = self.shared / str(seed) / "out"
            for name in ("cells.csv", "cells.jsonl", "poses.csv", "poses.jsonl"):
                text = (out / name).read_text()
                places = [s for s in re.finditer(r"(?<=[,:\[])\d+\.\d+(?=[,}\]\n])", text)]
                # seconds and what a node's calls took are the clock's
                places = [s for s in places if '"seconds"' not in text[s.start() - 12 : s.start()]]
                for found in self.chance.sample(places, min(4, len(places))):
                    other = repr(float(found[0]) * 1.01 + 0.01)
                    (out / name).write_text(text[: found.start()] + other + text[found.end() :])
                    if not self.differences(seed, out, printed):
                        missed.append((name, text[found.start() - 60 : found.end() + 20]))
                (out / name).write_text(text)
        self.assertEqual(missed, [])


if __name__ == "__main__":
    main()
