# SPDX-License-Identifier: Apache-2.0
"""The answer of an experiment, recomputed from what its plugin was given, with the keys of comparison.json."""
import itertools
import math

from scipy import stats

import findings
import intervals
import ranks

ALPHA = 0.05


class OfVariant:
    """The rows of one variant."""

    def __init__(self, experiment, rows):
        self.experiment, self.rows = experiment, rows

    def values(self, metric):
        return [float(row.values[metric]) for row in self.rows if row.values[metric] is not None]

    def values_by_case(self, metric):
        cases = {}
        for row in self.rows:
            if row.values[metric] is not None:
                cases.setdefault(row.case, []).append(float(row.values[metric]))
        return list(cases.values())

    def places(self, metric):
        return {(row.case, row.start) for row in self.rows if row.values[metric] is not None}

    def success(self):
        return intervals.Rate([(row.case, row.success) for row in self.rows])


def by_variant(experiment, rows):
    return [OfVariant(experiment, [r for r in rows if r.variant == v.name]) for v in experiment.variants]


def finite(value):
    return None if value is None or math.isinf(value) else float(value)


def figure(values, of, higher_is_better=False, interval=None):
    tree = {"count": len(values), "of": of}
    if values:
        tree.update(intervals.summary(values, higher_is_better))
    if interval:
        tree.update(median_low=interval[0], median_high=interval[1])
    return tree


def rate(one):
    return {
        "count": one.count,
        "of": one.of,
        "rate": one.rate if one.of else None,
        "low": one.low if one.of else None,
        "high": one.high if one.of else None,
    }


def verdicts(own):
    judged = [row for row in own.rows if row.verdict]
    if not judged:
        return None
    tree = {"cells": len(judged), "silent_failures": None, "caught": None, "false_alarms": None}
    if own.experiment.has_limits:
        silent = intervals.Rate([(row.case, row.verdict == "trusted") for row in judged if not row.success])
        alarms = intervals.Rate([(row.case, row.verdict != "trusted") for row in judged if row.success])
        tree.update(silent_failures=rate(silent), caught=silent.of - silent.count, false_alarms=rate(alarms))
    return tree


def capture(own, rows):
    if not own.experiment.has_limits:
        return None
    known = {(row.case, row.start): row.initial_error for row in rows if row.initial_error is not None}
    starts = [
        (float(known[row.case, row.start]), row.success, row.case) for row in own.rows if (row.case, row.start) in known
    ]
    bins, reached, is_open = intervals.capture_range(starts)
    return {
        "range": reached if bins else None,
        "is_open": is_open,
        "unknown_starts": len(own.rows) - len(starts),
        "bins": [{**rate(one), "from": begin, "to": end} for begin, end, one in bins],
    }


def place(row):
    return row.case, row.start


def is_whole(row):
    return not row.failed and None not in row.values


def places_of_all(experiment, rows):
    """The cases and starts in which every variant was done and no node failed; a variant that was so in none does not
    count. Only over these are amounts of work compared."""
    whole = [{place(row) for row in rows if row.variant == v.name and is_whole(row)} for v in experiment.variants]
    return set.intersection(*(places for places in whole if places)) if any(whole) else set()


def variant_tree(own, variant, is_baseline, rows, seconds):
    experiment, runs = own.experiment, len(own.rows)
    compared = places_of_all(experiment, rows)
    incomplete = sum(not row.failed and None in row.values for row in own.rows)
    success = own.success() if experiment.has_limits else None
    tree = {
        "name": variant.name,
        "is_baseline": is_baseline,
        "runs": runs,
        "failed": sum(row.failed for row in own.rows),
        "incomplete": incomplete,
        "success": {**rate(success), "effective_runs": success.effective} if success else None,
        "metrics": {
            metric.path: figure(
                own.values(m), runs, metric.higher_is_better, intervals.median_interval(own.values_by_case(m))
            )
            for m, metric in enumerate(experiment.metrics)
        },
        "seconds": figure([seconds[row.id] for row in own.rows if row.id in seconds], runs),
        "evaluations": figure([row.evaluations for row in own.rows if is_whole(row) and place(row) in compared], runs),
    }
    judged = verdicts(own)
    if judged:
        tree["verdicts"] = judged
    if experiment.has_initial_error:
        tree["capture"] = capture(own, rows)
    return tree


def pairs(baseline, variant, metric):
    cases = {}
    other = {(row.case, row.start): row.values[metric] for row in variant.rows}
    for row in baseline.rows:
        cases.setdefault(row.case, []).append((row.values[metric], other[row.case, row.start]))
    return cases


class Compared:
    """Pairs of values of each case: those of a variant against another one in one figure."""

    def __init__(self, pairs_of_cases, higher_is_better, level=ALPHA):
        found = ranks.case_differences(pairs_of_cases, higher_is_better)
        self.runs, self.cases, self.of_both = found["runs"], found["cases"], found["of_both"]
        values = found["values"]
        self.count = len(values)
        self.p, self.is_positive = ranks.signed_rank_p(values) if values else (1.0, False)
        self.difference = ranks.median(values) if values else None
        bounds = intervals.order_statistics(values, level) if values else None
        self.has_interval = bounds is not None
        self.low, self.high = map(float, bounds or (-math.inf, math.inf))
        self.median_of_both = ranks.median(self.of_both) if self.of_both else None
        variant_lost, baseline_lost = self.cases["variant_lost"], self.cases["reference_lost"]
        lost = variant_lost + baseline_lost
        self.failures_differ = lost > 0 and stats.binomtest(variant_lost, lost).pvalue < level
        self.failures_are_positive = (variant_lost > baseline_lost) != higher_is_better

    def is_shown(self, p, level=ALPHA):
        by_failures = self.failures_differ and self.failures_are_positive == self.is_positive
        return bool(p < level and (by_failures or (self.low > 0 if self.is_positive else self.high < 0)))


def all_pairs(experiment):
    """The pairs that the experiment asks for, as (reference, variant)."""
    baseline, count = experiment.baseline, len(experiment.variants)
    asked = [(baseline, v) for v in range(count) if v != baseline]
    if experiment.compare_all:
        asked += [pair for pair in itertools.combinations(range(count), 2) if baseline not in pair]
    return asked


def comparisons(experiment, of_variant):
    """[(metric, reference, variant, Compared, p after Holm)]"""
    found = [
        (m, r, v, Compared(pairs(of_variant[r], of_variant[v], m), metric.higher_is_better))
        for m, metric in enumerate(experiment.metrics)
        for r, v in all_pairs(experiment)
    ]
    corrected = ranks.holm([one[-1].p for one in found]) if found else []
    return [(*one, p) for one, p in zip(found, corrected)]


def fails_more(compared, higher_is_better, other):
    if compared.difference is None or not math.isinf(compared.difference):
        return None
    return "variant" if (compared.difference > 0) != higher_is_better else other


def numbers_tree(compared, metric, unit, other):
    """Also of a comparison that is not tested. `other`: the word for what the variant is compared with."""
    return {
        "metric": metric.path,
        "unit": unit,
        "cases": compared.count,
        "of_cases": sum(compared.cases.values()),
        "cases_variant_lost": compared.cases["variant_lost"],
        "cases_%s_lost" % other: compared.cases["reference_lost"],
        "runs": sum(compared.runs.values()),
        "pairs": compared.runs["both"],
        "runs_variant_lost": compared.runs["variant_lost"],
        "runs_%s_lost" % other: compared.runs["reference_lost"],
        "runs_both_lost": compared.runs["neither"],
        "difference": finite(compared.difference),
        "fails_more": fails_more(compared, metric.higher_is_better, other),
        "difference_of_pairs": compared.median_of_both,
        "has_interval": compared.has_interval and compared.low < math.inf and compared.high > -math.inf,
        "low": finite(compared.low),
        "high": finite(compared.high),
    }


def comparison_tree(experiment, units, found, other="baseline"):
    m, r, v, compared, p_holm = found
    tree = numbers_tree(compared, experiment.metrics[m], units[m], other)
    tree["variant"] = experiment.variants[v].name
    if other == "reference":
        tree["reference"] = experiment.variants[r].name
    return {**tree, "p": compared.p, "p_holm": p_holm, "is_shown": compared.is_shown(p_holm)}


def units_of(experiment, rows):
    has = lambda m: any(row.values[m] is not None for row in rows)
    return [metric.unit if has(m) else "" for m, metric in enumerate(experiment.metrics)]


def metric_trees(experiment, of_variant, units):
    return [
        {
            "name": metric.path,
            "label": metric.label,
            "unit": units[m],
            "success_above" if metric.higher_is_better else "success_below": metric.limit,
            "higher_is_better": metric.higher_is_better,
            "same_runs": len({frozenset(own.places(m)) for own in of_variant}) < 2,
        }
        for m, metric in enumerate(experiment.metrics)
    ]


def curve_point(experiment, variants, of_variant, metric):
    values = [variant.swept[0] for variant in variants]
    rows = [row for own in of_variant for row in own.rows]
    together = OfVariant(experiment, rows)
    tree = {"value": sum(values) / len(values), "runs": len(rows), "of": len(rows)}
    if metric is None:
        success = together.success()
        return {**tree, "middle": success.rate, "low": success.low, "high": success.high}
    found = together.values(metric)
    tree["runs"] = len(found)
    interval = intervals.median_interval(together.values_by_case(metric))
    if found:
        tree["middle"] = intervals.summary(found)["median"]
    return {**tree, "low": interval[0], "high": interval[1]} if interval else tree


def place_on_curve(sweep, value):
    if "grid" in sweep:
        return value
    low, high = sweep["range"]
    scaled = math.log if sweep["is_log"] else float
    return min(max(math.floor(8 * (scaled(value) - scaled(low)) / (scaled(high) - scaled(low))), 0), 7)


def curve_trees(experiment, variants, of_variant, sweep):
    trees = []
    for base in dict.fromkeys(variant.swept_from for variant in variants):
        own = [(v, rows) for v, rows in zip(variants, of_variant) if v.swept_from == base]
        places = sorted({place_on_curve(sweep, v.swept[0]) for v, _ in own})
        for m in [*range(len(experiment.metrics)), *([None] if experiment.has_limits else [])]:
            groups = [[one for one in own if place_on_curve(sweep, one[0].swept[0]) == place] for place in places]
            points = [curve_point(experiment, *map(list, zip(*group)), m) for group in groups]
            name = "success" if m is None else experiment.metrics[m].path
            scale = "log" if sweep["is_log"] else "linear"
            trees.append({"variant": base, "option": "main.at", "scale": scale, "figure": name, "points": points})
    return trees


def look_tree(experiment, of_variant, cases):
    """What the rule under `stop` says after so many cases."""
    stop = experiment.stop
    numbers = ranks.looks(len(experiment.cases), stop["look_every"], stop["most_cases"])
    alpha, is_width = stop.get("alpha", 0.05), "width" in stop
    number = numbers.index(cases)
    level = ranks.levels([n / stop["most_cases"] for n in numbers], alpha, is_width)[number]
    tree = {"look": number + 1, "looks": len(numbers), "cases": cases, "most_cases": stop["most_cases"]}
    paths = [metric.path for metric in experiment.metrics]
    figure_name = stop.get("figure", stop.get("difference"))
    tree.update(figure=figure_name, level=level)
    if not is_width:
        m, v = paths.index(figure_name), stop["variant"]
        both = pairs(of_variant[experiment.baseline], of_variant[v], m)
        compared = Compared(both, experiment.metrics[m].higher_is_better, level)
        return {
            **tree,
            "is_met": compared.is_shown(compared.p, level),
            "variant": experiment.variants[v].name,
            "low": finite(compared.low),
            "high": finite(compared.high),
            "p": compared.p,
            "difference": finite(0.0 if compared.difference is None else compared.difference),
            "alpha": alpha,
        }
    bounds = []
    for own in of_variant:
        if figure_name == "success":
            bounds.append(own.success().exact(1 - level))
        else:
            bounds.append(intervals.median_interval(own.values_by_case(paths.index(figure_name)), 1 - level))
    widths = [high - low for low, high in (interval or (-math.inf, math.inf) for interval in bounds)]
    widest = max(range(len(widths)), key=lambda i: (widths[i], -i))
    return {
        **tree,
        "is_met": bool(widths[widest] <= stop["width"]),
        "variant": experiment.variants[widest].name,
        "low": bounds[widest][0] if bounds[widest] else None,
        "high": bounds[widest][1] if bounds[widest] else None,
        "width": stop["width"],
    }


def last_look(experiment):
    """The cases at which the comparison ends if it may add as many as it wants."""
    stop = experiment.stop
    for cases in ranks.looks(len(experiment.cases), stop["look_every"], stop["most_cases"]):
        rows = experiment.rows(["seed-%d" % (i + 1) for i in range(cases)])
        if look_tree(experiment, by_variant(experiment, rows), cases)["is_met"]:
            return cases
    return stop["most_cases"]


def tuning_point(experiment, variant, values):
    """The score of a variant on the training cases."""
    tune, metric = experiment.tune, experiment.metrics[0]
    rows = experiment.rows(experiment.cases[: tune["training_cases"]], [variant])
    found = [float(row.values[0]) for row in rows if row.values[0] is not None]
    bad = tune["failed_as"]
    capped = [value for value in found if (value < bad if metric.higher_is_better else value > bad)]
    counted = [bad if value in capped else value for value in found] + [bad] * (len(rows) - len(found))
    return {
        "values": values,
        "score": math.fsum(counted) / len(rows),
        "mean": math.fsum(found) / len(found) if found else None,
        "runs": len(rows),
        "failed": len(rows) - len(found),
        "capped": len(capped),
    }


def answer_tree(experiment, rows, seconds, cases=None):
    """All of comparison.json but the sentences and what the optimizer and the clock decide."""
    of_variant = by_variant(experiment, rows)
    units, found = units_of(experiment, rows), comparisons(experiment, of_variant)
    tree = {
        "experiment": experiment.name,
        "metrics": metric_trees(experiment, of_variant, units),
        "variants": [
            variant_tree(own, variant, v == experiment.baseline, rows, seconds)
            for v, (own, variant) in enumerate(zip(of_variant, experiment.variants))
        ],
        "comparisons": [comparison_tree(experiment, units, one) for one in found if one[1] == experiment.baseline],
    }
    if experiment.compare_all:
        if found:
            tree["all_pairs"] = [comparison_tree(experiment, units, one, "reference") for one in found]
        tree["rankings"] = findings.ranking_trees(experiment, of_variant, units, found)
    if findings.has_effects(experiment):
        tree["effects"] = findings.effect_trees(experiment, of_variant, units)
    if experiment.has_initial_error:
        unit = "mm" if any(row.initial_error is not None for row in rows) else ""
        tree["initial_error"] = {"name": "main.start_error", "unit": unit}
    if experiment.sweep:
        tree["curves"] = curve_trees(experiment, experiment.variants, of_variant, experiment.sweep)
    if experiment.stop:
        tree["stop"] = look_tree(experiment, of_variant, cases)
    return tree
