# SPDX-License-Identifier: Apache-2.0
"""A part of many trials that are alike, the same part in each run, for tests that would take minutes to try them all.

    sample.py COUNT TRIAL ...    prints the sample, one a line
"""
import os
import random
import sys

ALL = os.environ.get("MARROW_TEST_ALL") == "1"
SEED = os.environ.get("MARROW_TEST_SEED") or "marrow"


def sample(trials, count, key=None):
    """At least `count` of the trials, in their order; all of them if MARROW_TEST_ALL is 1.

    With `key`, at least one trial of each key is among them. The draw depends only on MARROW_TEST_SEED. Without it,
    it is the same in each run; another seed gives another sample.
    """
    trials = list(trials)
    if ALL or count >= len(trials):
        return trials
    order = random.Random(SEED).sample(range(len(trials)), len(trials))
    chosen, met = [], set()
    for index in order if key else []:
        if key(trials[index]) not in met:
            met.add(key(trials[index]))
            chosen.append(index)
    chosen += [index for index in order if index not in set(chosen)][: max(0, count - len(chosen))]
    print("a sample of %d of %d; MARROW_TEST_ALL=1 tries all" % (len(chosen), len(trials)), file=sys.stderr)
    return [trials[index] for index in sorted(chosen)]


if __name__ == "__main__":
    print(*sample(sys.argv[2:], int(sys.argv[1])), sep="\n")
