# SPDX-License-Identifier: Apache-2.0
"""comparison.json and the data of report.html against the recomputed answer."""
import json
import re

# Keys whose values are texts, the optimizer's choices or the clock's: other checks look at them.
ELSEWHERE = {"sentence", "times", "tuning"}


def read_json(path):
    return json.loads(path.read_text(), parse_constant=lambda name: float("nan"))


def report_data(path):
    text = path.read_text()
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S).group(1))


def check_tree(checks, kind, got, expected, noise, path=""):
    """`noise`: how far apart numbers may be that are differences of others."""
    if isinstance(expected, dict):
        if not isinstance(got, dict):
            return checks.same(kind, path, got, sorted(expected))
        checks.same(kind + " keys", path, sorted(set(got) - ELSEWHERE), sorted(expected))
        for key in expected:
            if key in got:
                check_tree(checks, kind, got[key], expected[key], noise, path + "." + key)
    elif isinstance(expected, list):
        if not isinstance(got, list) or len(got) != len(expected):
            return checks.same(kind, path, got, expected)
        for i, one in enumerate(expected):
            name = one.get("name", i) if isinstance(one, dict) else i
            check_tree(checks, kind, got[i], one, noise, "%s[%s]" % (path, name))
    elif expected is None or isinstance(expected, (str, bool)):
        checks.same(kind, path, got, expected)
    elif isinstance(got, (str, bool)) or got is None:
        checks.same(kind, path, got, expected)
    else:
        is_exact = path.endswith((".p", ".p_holm", ".level"))
        relative = 1e-7 if path.endswith(".level") else 1e-9  # of which both sides find the root of an integral
        checks.close(kind, path, got, expected, relative, 0 if is_exact else noise)


def check_answer(checks, kind, got, expected, rows):
    """Noise is a billionth of a thousandth of a figure's largest number: what is left where equal numbers are taken
    from another. It is taken for each figure by itself, because figures may be of very different sizes."""
    by_metric = {metric["name"]: m for m, metric in enumerate(expected["metrics"])}

    def noise(name):
        sizes = [abs(float(row.values[by_metric[name]])) for row in rows if row.values[by_metric[name]] is not None]
        return 1e-12 * max(sizes, default=0)

    for key in expected:
        if key not in got:
            checks.same(kind, key, "missing", key)
    for key in set(expected) - {"variants", "comparisons", "all_pairs", "effects", "curves", "stop"}:
        check_tree(checks, kind + " " + key, got.get(key), expected[key], 0)
    by_name = [(key, lambda one: one["metric"]) for key in ("comparisons", "all_pairs", "effects")]
    for key, name_of in (*by_name, ("curves", lambda one: one["figure"])):
        if key not in expected:
            continue
        checks.same(kind + " " + key, "number", len(got.get(key, [])), len(expected[key]))
        for one, right in zip(got.get(key, []), expected[key]):
            allowed = noise(name_of(right)) if name_of(right) in by_metric else 0
            where = "%s %s" % (right["variant"], name_of(right))
            check_tree(checks, kind + " " + key, one, right, allowed, where)
    for one, right in zip(got["variants"], expected["variants"]):
        figures = dict(right)
        for name, figure in figures.pop("metrics").items():
            what = right["name"] + " " + name
            check_tree(checks, kind + " figures", one["metrics"].get(name), figure, noise(name), what)
        rest = {key: value for key, value in one.items() if key != "metrics"}
        check_tree(checks, kind + " variants", rest, figures, 0, right["name"])
    if "stop" in expected:
        name = expected["stop"]["figure"]
        check_tree(checks, kind + " stop", got.get("stop"), expected["stop"], noise(name) if name in by_metric else 0)


def check_tuning(checks, kind, got, untuned, points, experiment):
    """`untuned` and `points`: recomputed, at the values that the optimizer chose."""
    check_tree(checks, kind + " tuning", got["untuned"], untuned, 0, "untuned")
    checks.same(kind + " tuning", "points", len(got["points"]), len(points))
    for i, (one, right) in enumerate(zip(got["points"], points)):
        check_tree(checks, kind + " tuning", one, right, 0, "point %d" % i)
    is_higher, bad = experiment.metrics[0].higher_is_better, experiment.tune["failed_as"]
    sign = -1 if is_higher else 1
    found = [(sign * p["score"], i) for i, p in enumerate(points) if p["mean"] is not None]
    found = [one for one in found if one[0] < sign * bad]
    best = min(found)[1] if found else None
    ties = {i for score, i in found if score == min(found)[0]} if found else {None}
    checks.that(kind + " tuning", "best", got["best"] in ties, (got["best"], best))
    checks.same(kind + " tuning", "higher_is_better", got["higher_is_better"], is_higher)
    checks.close(kind + " tuning", "failed_as", got["failed_as"], bad)
    checks.same(
        kind + " tuning", "options", got["options"], [{"option": "main.at", "range": [-1.0, 2.0], "scale": "linear"}]
    )
    checks.same(kind + " tuning", "training_cases", got["training_cases"], experiment.tune["training_cases"])
