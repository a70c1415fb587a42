#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Lets one call of the system after the other fail (tests/faults/fault_library.c) in a run, a comparison and a tidying
of the store. Each must end with a code and a sentence, leave nothing half under a final name, and succeed when it is
started again."""
import collections
import concurrent.futures
import random
import shutil
import signal
import struct
import subprocess
import sys

from starting import ALL, arguments_parser, conclude, program_of
from subjects import SENTENCE, Collect, Compare, Run

CALLS = """open read write close rename mkdir remove truncate fsync lock mmap malloc loader_malloc thread fork exec pipe
dup poll""".split()
Fault = collections.namedtuple("Fault", "subject where call n times below")
HELP = (
    "SUBJECT/main|children/CALL/N/1|forever/PLACE: only this fault, as the list of failures names it; PLACE is"
    " everywhere, out or store"
)


class Injector:
    def __init__(self, program, seed):
        self.program, self.seed, self.chance, self.number = program, seed, random.Random(seed), 0
        self.subjects = {subject.name: subject for subject in (Run(program), Compare(program), Collect(program))}
        for subject in self.subjects.values():
            if subject.name != "gc":
                subject.reference()
            else:
                subject.prepare(self.new_folder())

    def new_folder(self):
        self.number += 1
        folder = self.program.scratch / ("trial-%d" % self.number)
        folder.mkdir()
        return folder

    def counts(self, subject):
        """{(where, call): how often it is called when nothing fails}"""
        folder = self.new_folder()
        subject.prepare(folder)
        counting = {"LD_PRELOAD": str(self.program.fault_library), "FAULT_COUNT_FILE": str(folder / "counts")}
        result = self.program.run(subject.command(folder), folder, **counting)
        assert result.returncode == 0, result.stderr
        table = struct.unpack("<%dQ" % (2 * len(CALLS)), (folder / "counts").read_bytes())
        return dict(zip([(where, call) for where in ("main", "children") for call in CALLS], table))

    def groups(self, names, calls):
        """Lists of faults that differ in n alone."""
        for name in names:
            for (where, call), count in self.counts(self.subjects[name]).items():
                if not count or (calls and call not in calls):
                    continue
                for times in ("1", "forever") if call != "poll" else ("1",):
                    yield [Fault(name, where, call, n, times, "everywhere") for n in range(1, count + 1)]
                if call in ("open", "write", "close", "rename", "mkdir") and name != "gc":
                    for below in ("out", "store"):
                        yield [Fault(name, where, call, n, "forever", below) for n in range(1, count + 1)]

    def try_fault(self, fault):
        """What was wrong, and the program's own words."""
        subject, folder = self.subjects[fault.subject], self.new_folder()
        subject.prepare(folder)
        settings = {
            "LD_PRELOAD": str(self.program.fault_library),
            "FAULT_CALL": fault.call,
            "FAULT_N": str(fault.n),
            "FAULT_TIMES": fault.times,
            "FAULT_IN": fault.where,
            "FAULT_MARK": str(folder / "mark"),
        }
        if fault.below != "everywhere":
            settings["FAULT_BELOW"] = str(folder / fault.below)
        try:
            result = self.program.run(subject.command(folder), folder, **settings)
        except subprocess.TimeoutExpired:
            return ["it did not end"], ""
        code, complaints = result.returncode, []
        if code not in (0, 1, 2, 130):
            ended_by = "it was ended by %s" % signal.Signals(-code).name if code < 0 else ""
            complaints.append(ended_by or "its exit code is %d" % code)
        elif code != 0 and not SENTENCE.search(result.stderr):
            complaints.append("exit code %d without a sentence" % code)
        if fault.below == "store" and fault.subject == "run" and code != 0:
            complaints.append("a run needs no store, but its exit code is %d" % code)
        if (folder / "mark").exists() or code != 0:
            complaints += subject.complaints(folder, code) + self.second_try(subject, folder)
        shutil.rmtree(folder)
        return complaints, result.stderr[-600:]

    def second_try(self, subject, folder):
        second = self.program.run(subject.second_command(folder), folder)
        if second.returncode != 0:
            return ["the second try ends with code %d: %s" % (second.returncode, second.stderr[-300:])]
        return ["the second try: " + complaint for complaint in subject.second_complaints(folder)]


def chosen_faults(injector, options):
    names = options.subjects or list(injector.subjects)
    if options.only:
        subject, where, call, n, times, below = options.only.split("/")
        return [Fault(subject, where, call, int(n), times, below)]
    faults = []
    for group in injector.groups(names, options.calls):
        if not options.all:
            # A draw of its own: how often a call is made may differ, and must not change which of the others fails.
            faults.append(random.Random("%d %s" % (injector.seed, group[0])).choice(group))
            continue
        slow = group[0].times == "forever" or group[0].subject == "compare"
        rare = group[0].call == "loader_malloc" or (group[0].call == "malloc" and slow)
        most = options.most if rare else len(group)
        faults += group if len(group) <= most else injector.chance.sample(group, most)
    if options.all:
        return faults
    return injector.chance.sample(faults, min(len(faults), options.trials))


def main():
    parser = arguments_parser(__doc__)
    trials = "faults of a sample, each of another kind (default: 25; 70 with MARROW_TEST_ALL=1)"
    parser.add_argument("--trials", type=int, default=70 if ALL else 25, help=trials)
    most = "with --all: most allocations that fail of a comparison, of a loader, or for ever (default: 1000)"
    parser.add_argument("--most", type=int, default=1000, help=most)
    parser.add_argument("--subjects", nargs="*", help="run, compare, gc (default: all)")
    parser.add_argument("--calls", nargs="*", choices=CALLS, metavar="CALL", help="only these: " + " ".join(CALLS))
    parser.add_argument("--only", help=HELP)
    options = parser.parse_args()
    failures, kinds, done = [], collections.Counter(), 0
    with program_of(options) as program:
        injector = Injector(program, options.seed)
        faults = chosen_faults(injector, options)
        with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            for fault, (complaints, words) in zip(faults, pool.map(injector.try_fault, faults)):
                done += 1
                if options.only:
                    print(words)
                if complaints:
                    failures.append("/".join(map(str, fault)) + ": " + "; ".join(complaints))
                    kinds["%s/%s/%s: %s" % (fault.subject, fault.where, fault.call, complaints[0][:60])] += 1
                    print(failures[-1], flush=True)
                if done % 1000 == 0:
                    print("%d of %d faults, %d failures" % (done, len(faults), len(failures)), flush=True)
    for kind, count in kinds.most_common():
        print("%6d  %s" % (count, kind))
    return conclude("%d faults" % len(faults), failures)


if __name__ == "__main__":
    sys.exit(main())
