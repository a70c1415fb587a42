#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Starts two runs or comparisons at the same moment: into the same folder, with the same store, beside a tidying of the
store. Each folder must hold the results of exactly one of them, all bytes right, and who comes second is told so in a
sentence."""
import collections
import concurrent.futures
import random
import shutil
import subprocess
import sys
import time

from starting import ALL, arguments_parser, conclude, program_of
from subjects import SENTENCE, Collect, Compare, Run

Pair = collections.namedtuple("Pair", "number kind gap_s")
Ended = collections.namedtuple("Ended", "code out err")
EXPERIMENTS = ("small-experiment.yaml", "other/small-experiment.yaml")  # of one name, with other values


class Pairs:
    def __init__(self, program, seed):
        self.program, self.chance = program, random.Random(seed)
        self.run, self.compare, self.collect = Run(program), Compare(program), Collect(program)
        self.kinds = {
            "two runs, default folder": self.default_folder,
            "two runs, one --out": self.one_out,
            "two runs, one store": self.one_store,
            "a run and gc": self.run_and_gc,
            "two comparisons, one folder": self.one_comparison,
            "two experiments, default folder": self.two_experiments,
            "two comparisons, one store": self.comparisons_one_store,
            "a comparison and gc": self.comparison_and_gc,
            "a comparison and a run": self.comparison_and_run,
        }
        for seed in (1, 2):
            self.run.reference(seed)
        for experiment in EXPERIMENTS:
            self.compare.reference(experiment)

    def pairs(self, count):
        names = list(self.kinds)
        for number in range(count):  # as many of each kind, most of them at once, some a little later
            gap_s = self.chance.choice([0, 0, 0, self.chance.uniform(0, 0.05), self.chance.uniform(0, 0.4)])
            yield Pair(number, names[number % len(names)], gap_s)

    def both(self, folder, first, second, gap_s):
        how = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        how.update(env=self.program.environment_of(folder), cwd=folder, text=True, errors="replace")
        processes = []
        for arguments in (first, second):
            processes.append(subprocess.Popen([str(self.program.marrow), *map(str, arguments)], **how))
            time.sleep(gap_s if arguments is first else 0)
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            texts = list(pool.map(lambda process: process.communicate(timeout=400), processes))
        return [Ended(process.returncode, *text) for process, text in zip(processes, texts)]

    def try_pair(self, pair):
        folder = self.program.scratch / ("pair-%d" % pair.number)
        folder.mkdir()
        try:
            complaints = list(self.kinds[pair.kind](folder, pair.gap_s))
        except subprocess.TimeoutExpired:
            complaints = ["they did not end"]
        complaints += self.program.damaged_entries(folder)
        shutil.rmtree(folder)
        return complaints

    @staticmethod
    def both_went_well(ended):
        return ["one ended with code %d: %s" % (one.code, one.err[-300:]) for one in ended if one.code != 0]

    @staticmethod
    def one_was_told(ended):
        """One went well; the other either too, or it says in a sentence why not."""
        if all(one.code != 0 for one in ended):
            yield "both failed: " + " | ".join(one.err[-200:] for one in ended)
        for one in ended:
            if one.code != 0 and (one.code != 2 or len(SENTENCE.findall(one.err)) != 1):
                yield "the second one ended with code %d and said: %s" % (one.code, one.err[-300:])

    def default_folder(self, folder, gap_s):
        ended = self.both(folder, self.run.arguments(None, 1), self.run.arguments(None, 2), gap_s)
        yield from self.both_went_well(ended)
        for seed, one in zip((1, 2), ended):
            out = one.out.partition("results in ")[2].partition("\n")[0]
            if one.code == 0:
                yield from self.run.complaints_of(folder / out, True, seed)
        found = sorted(path.name for path in (folder / "runs").iterdir() if not path.name.startswith("."))
        if found != ["small", "small-2"]:
            yield "the folders are " + ", ".join(found)

    def one_out(self, folder, gap_s):
        ended = self.both(folder, self.run.arguments(folder / "out", 1), self.run.arguments(folder / "out", 2), gap_s)
        if all(one.code == 0 for one in ended):
            yield "both wrote to one folder"
        yield from self.one_was_told(ended)
        for seed, one in zip((1, 2), ended):
            if one.code == 0:
                yield from self.run.complaints_of(folder / "out", True, seed)

    def one_store(self, folder, gap_s):
        ended = self.both(folder, self.run.arguments(folder / "one"), self.run.arguments(folder / "two"), gap_s)
        yield from self.both_went_well(ended)
        for name in ("one", "two"):
            yield from self.run.complaints_of(folder / name, True)

    def run_and_gc(self, folder, gap_s):
        self.collect.prepare(folder)
        ended = self.both(folder, self.run.arguments(folder / "out"), self.collect.command(folder), gap_s)
        yield from self.both_went_well(ended)
        yield from self.run.complaints_of(folder / "out", True)

    def one_comparison(self, folder, gap_s):
        ended = self.both(folder, self.compare.command(folder), self.compare.command(folder), gap_s)
        yield from self.one_was_told(ended)
        yield from self.compare.complaints_of(folder / "out", True, True)

    def two_experiments(self, folder, gap_s):
        ended = self.both(folder, *(self.compare.arguments(None, experiment) for experiment in EXPERIMENTS), gap_s)
        yield from self.one_was_told(ended)
        out = folder / "runs" / "compare" / "small-experiment"
        # Where both went well, one of them had ended when the other came, which goes on with its name, as after an
        # edit.
        good = [experiment for experiment, one in zip(EXPERIMENTS, ended) if one.code == 0]
        held = (out / "experiment.yaml").read_bytes() if good else b""
        whose = [experiment for experiment in good if (self.program.data / experiment).read_bytes() == held]
        if good and not whose:
            yield "experiment.yaml is that of the other one"
        for experiment in whose:
            yield from self.compare.complaints_of(out, True, True, experiment)

    def comparisons_one_store(self, folder, gap_s):
        both = [self.compare.arguments(folder / str(i), experiment) for i, experiment in enumerate(EXPERIMENTS)]
        ended = self.both(folder, *both, gap_s)
        yield from self.both_went_well(ended)
        for i, experiment in enumerate(EXPERIMENTS):
            yield from self.compare.complaints_of(folder / str(i), True, True, experiment)

    def comparison_and_gc(self, folder, gap_s):
        self.collect.prepare(folder)
        ended = self.both(folder, self.compare.command(folder), self.collect.command(folder), gap_s)
        yield from self.both_went_well(ended)
        yield from self.compare.complaints_of(folder / "out", True, True)

    def comparison_and_run(self, folder, gap_s):
        ended = self.both(folder, self.compare.command(folder), self.run.arguments(folder / "run"), gap_s)
        yield from self.both_went_well(ended)
        yield from self.compare.complaints_of(folder / "out", True, True)
        yield from self.run.complaints_of(folder / "run", True)


def main():
    parser = arguments_parser(__doc__)
    parser.add_argument("--trials", type=int, help="how many pairs (default: 10, with --all 1000)")
    parser.add_argument("--only", help="only pairs of this kind")
    options = parser.parse_args()
    failures, counts = [], collections.Counter()
    with program_of(options) as program:
        pairs = Pairs(program, options.seed)
        chosen = list(pairs.pairs(options.trials or (1000 if options.all else 30 if ALL else 10)))
        chosen = [pair for pair in chosen if options.only in (None, pair.kind)]
        with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            for pair, complaints in zip(chosen, pool.map(pairs.try_pair, chosen)):
                counts[(pair.kind, "failed" if complaints else "good")] += 1
                if complaints:
                    what = (pair.number, pair.kind, pair.gap_s, "; ".join(complaints))
                    failures.append("%d: %s, %.3f s apart: %s" % what)
                    print(failures[-1], flush=True)
    for (kind, end), count in sorted(counts.items()):
        print("%5d  %-32s %s" % (count, kind, end))
    return conclude("%d pairs" % len(chosen), failures)


if __name__ == "__main__":
    sys.exit(main())
