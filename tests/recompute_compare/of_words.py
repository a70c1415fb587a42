# SPDX-License-Identifier: Apache-2.0
"""Numbers in the words around the tables: how many cells there are, which failed, how many were timed, what tuning
found, what a success is, and how many cases a difference takes."""
import re

from ranks import fewest_cases

MOST_LISTED = 20


def check_counts(checks, printed, experiment, rows):
    cases = len({row.case for row in rows})
    begin = "%d cells: %d variants, %d cases, %d starts;" % (
        len(rows),
        len(experiment.variants),
        cases,
        len(experiment.starts),
    )
    checks.that("words: cells", begin, begin in printed, printed[:200])
    for title, ids in (
        ("failed cells", [row.id for row in rows if row.failed]),
        ("cells in which a node failed that may fail", [r.id for r in rows if not r.failed and None in r.values]),
    ):
        part = printed.partition("\n%s\n" % title)[2].partition("\n\n")[0]
        lines = part.splitlines()
        listed = [line.strip().partition(": ")[0] for line in lines if not line.startswith("  and ")]
        checks.same("words: cells", title, listed, ids[:MOST_LISTED])
        more = re.search(r"  and (\d+) more, in cells.csv", part)
        rest = len(ids) - MOST_LISTED
        checks.same("words: cells", title + " more", more and int(more[1]), rest if rest > 0 else None)


def check_times(checks, sentence, seconds, rows):
    timed = len({(row.case, row.start) for row in rows if row.id in seconds})
    found = re.match(r"Times: (\d+) runs? of each variant", sentence)
    checks.same("words: times", sentence, found and int(found[1]), timed or None)


def check_success_rule(checks, sentence, experiment, units):
    for metric, unit in zip(experiment.metrics, units):
        if metric.limit is None:
            continue
        side = "above" if metric.higher_is_better else "below"
        found = re.search(re.escape(metric.label) + r" %s (\S+?)(?: %s)?(?: and|;)" % (side, re.escape(unit)), sentence)
        checks.shown("words: success", metric.path, found[1] if found else "", metric.limit)
    checks.same("words: success", "limits", sentence.startswith("A run is a success with"), experiment.has_limits)


def check_score(checks, text, point, unit, bad):
    """ "0.41 mm (mean 0.5 mm of 18 of 20 runs, 2 failed or without the figure, 1 worse than 8 mm)"."""
    kind, number = "words: tuning", r"([^\s),]+)" + (" " + re.escape(unit) if unit else "")
    score = re.match(number + r" \(", text)
    checks.shown(kind, "score", score[1] if score else "", point["score"])
    if point["mean"] is None:
        return checks.that(kind, "mean", "no figure in any of %d runs" % point["runs"] in text, text)
    mean = re.search("mean " + number + r" of (?:(\d+) of )?(\d+) runs?", text)
    if not mean:
        return checks.same(kind, "mean", text, "mean")
    checks.shown(kind, "mean", mean[1], point["mean"])
    has = point["runs"] - point["failed"]
    checks.same(kind, "runs", [int(mean[2] or mean[3]), int(mean[3])], [has, point["runs"]])
    lost = re.search(r", (\d+) failed or without the figure", text)
    checks.same(kind, "failed", int(lost[1]) if lost else 0, point["failed"])
    worse = re.search(r", (\d+) worse than " + number, text)
    checks.same(kind, "capped", int(worse[1]) if worse else 0, point["capped"])
    if worse:
        checks.shown(kind, "failed_as", worse[2], bad, may_be_zero=bad == 0)


def check_tuning(checks, tuning, untuned, points, experiment, unit):
    sentence, bad = tuning["sentence"], experiment.tune["failed_as"]
    begin = "tuned on %d cases by %s, %d points" % (experiment.tune["training_cases"], tuning["optimizer"], len(points))
    checks.that("words: tuning", begin, sentence.startswith(begin), sentence)
    base = experiment.variants[experiment.baseline].name
    parts = sentence.split("; ")
    own = next((part for part in parts if part.startswith(base + ": ")), "")
    check_score(checks, own.partition(": ")[2], untuned, unit, bad)
    if tuning["best"] is None:
        return checks.that("words: tuning", "none", "no point is better than failed runs" in sentence, sentence)
    best = points[tuning["best"]]
    check_score(checks, parts[-1].partition(": ")[2], best, unit, bad)
    sign = -1 if experiment.metrics[0].higher_is_better else 1
    is_better = sign * best["score"] < sign * untuned["score"]
    checks.same("words: tuning", "no better", sentence.endswith(", which is no better"), not is_better)


def check_dry_run(checks, printed, experiment):
    """How many cases a difference takes, said before anything runs."""
    variants = len(experiment.variants) + (experiment.tune is not None)  # the tuned one is still to be found
    pairs = variants * (variants - 1) // 2 if experiment.compare_all else variants - 1
    comparisons, which = (
        pairs * len(experiment.metrics),
        "of all pairs" if experiment.compare_all else "with the baseline",
    )
    found = re.search(r"(\d+) comparisons? %s, for which a difference takes at least (\d+) cases" % which, printed)
    wanted = [comparisons, fewest_cases(0.05, comparisons)] if comparisons else None
    checks.same("words: dry run", "cases", found and [int(found[1]), int(found[2])], wanted)
