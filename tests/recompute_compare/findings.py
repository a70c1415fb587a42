# SPDX-License-Identifier: Apache-2.0
"""Rankings with letters, and the main effects of a matrix, recomputed."""
import math

import answer
import ranks


def rounded(value):
    """Rounding noise makes no order."""
    return float("%.9g" % value)


def places(experiment, of_variant, m):
    """[(variant, median of all runs with lost ones as worst, lost runs)], best first."""
    sign = -1 if experiment.metrics[m].higher_is_better else 1
    found = []
    for v, own in enumerate(of_variant):
        values = [sign * math.inf if row.values[m] is None else row.values[m] for row in own.rows]
        found.append((v, ranks.median(values), sum(row.values[m] is None for row in own.rows)))
    return sorted(found, key=lambda one: (sign * rounded(one[1]), one[2]))


def largest_groups(things, different):
    """The largest sets without a pair that differs (Bron and Kerbosch 1973)."""
    near = {i: {j for j in range(things) if j != i and frozenset((i, j)) not in different} for i in range(things)}
    groups = []

    def extend(group, candidates, excluded):
        if not candidates and not excluded:
            groups.append(sorted(group))
        for thing in sorted(candidates):
            extend(group | {thing}, candidates & near[thing], excluded & near[thing])
            candidates, excluded = candidates - {thing}, excluded | {thing}

    extend(set(), set(range(things)), set())
    return sorted(groups)


def ranking_tree(experiment, of_variant, unit, found, m):
    ordered = places(experiment, of_variant, m)
    position = {v: i for i, (v, _, _) in enumerate(ordered)}
    names = [variant.name for variant in experiment.variants]
    own = [(r, v, compared, compared.is_shown(p)) for metric, r, v, compared, p in found if metric == m]
    different = {frozenset((position[r], position[v])) for r, v, _, is_shown in own if is_shown}
    groups = largest_groups(len(ordered), different)
    keys = [(rounded(median), lost) for _, median, lost in ordered]
    best = ordered[0][0]
    beside = [(v if r == best else r, compared, is_shown) for r, v, compared, is_shown in own if best in (r, v)]
    first_is_reference = {v if r == best else r: r == best for r, v, _, _ in own if best in (r, v)}
    higher = experiment.metrics[m].higher_is_better
    is_better = lambda other, compared: (compared.is_positive == higher) == first_is_reference[other]
    return {
        "metric": experiment.metrics[m].path,
        "unit": unit,
        "pairs": len(own),
        "different": len(different),
        "like_best": [names[other] for other, _, is_shown in beside if not is_shown],
        "better_than_best": [names[other] for other, c, is_shown in beside if is_shown and is_better(other, c)],
        "places": [
            {
                "variant": names[v],
                "rank": keys.index(keys[i]) + 1,
                "median": answer.finite(median),
                "lost": lost,
                "group": "".join(chr(ord("a") + g) for g, group in enumerate(groups) if i in group)
                if len(groups) <= 26
                else None,
            }
            for i, (v, median, lost) in enumerate(ordered)
        ],
    }


def ranking_trees(experiment, of_variant, units, found):
    return [ranking_tree(experiment, of_variant, units[m], found, m) for m in range(len(experiment.metrics))]


def has_effects(experiment):
    return sum(len(levels) > 1 for _, levels in experiment.factors) > 1


def effects(experiment, of_variant):
    """[(metric, factor, level, Compared)]: each run beside that with the factor's first level and all else alike."""
    found = []
    for m, metric in enumerate(experiment.metrics):
        for f, (_, levels) in enumerate(experiment.factors):
            for level in range(1, len(levels)):
                cases = {}
                for variant, own in zip(experiment.variants, of_variant):
                    if not variant.levels or variant.levels[f] != level:
                        continue
                    first = [0 if g == f else at for g, at in enumerate(variant.levels)]
                    beside = next(o for v, o in zip(experiment.variants, of_variant) if v.levels == first)
                    for case, both in answer.pairs(beside, own, m).items():
                        cases.setdefault(case, []).extend(both)
                found.append((m, f, level, answer.Compared(cases, metric.higher_is_better)))
    return found


def effect_trees(experiment, of_variant, units):
    return [
        {
            **answer.numbers_tree(compared, experiment.metrics[m], units[m], "reference"),
            "factor": experiment.factors[f][0],
            "variant": experiment.factors[f][1][level],
            "reference": experiment.factors[f][1][0],
        }
        for m, f, level, compared in effects(experiment, of_variant)
    ]
