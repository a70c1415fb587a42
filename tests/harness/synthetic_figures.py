# SPDX-License-Identifier: Apache-2.0
"""The variants and metrics of a made-up comparison, and the figures that follow from its cells."""
import math
import statistics

METRICS = [
    {"name": "mtre_mm", "label": "mTRE", "unit": "mm", "success_below": 2.0},
    {"name": "rotation_deg", "label": "rotation error", "unit": "deg", "success_below": None},
    {"name": "axial_deg", "label": "axial rotation error", "unit": "deg", "success_below": None},
]
# name, options, range in which a start is captured (mm), median mTRE (mm), seconds, evaluations
VARIANTS = [
    ("adaptive relaxation", {}, 13.0, 0.42, 6.1, 1450),
    ("canny", {"edges.uses": "edges.canny"}, 9.5, 0.55, 4.4, 1380),
    ("gradient", {"edges.uses": "edges.gradient", "edges.high": 80}, 11.0, 0.47, 4.9, 1410),
    ("bobyqa", {"optimizer.uses": "optimizer.bobyqa"}, 11.5, 0.40, 3.2, 610),
]
for i in range(6):  # further ones, for large comparisons
    high, figures = 60 + 5 * i, (10.0 + 0.4 * i, 0.41 + 0.02 * i, 4.0 + 0.2 * i, 1400 - 20 * i)
    VARIANTS.append(("high %d" % high, {"edges.high": high}, *figures))


def quantile(values, fraction):
    values = sorted(values)
    position = fraction * (len(values) - 1)
    low = math.floor(position)
    return values[low] + (position - low) * (values[min(low + 1, len(values) - 1)] - values[low])


def wilson(count, of):
    z, rate = 1.959964, count / of
    centre, half = rate + z * z / (2 * of), z * math.sqrt(rate * (1 - rate) / of + z * z / (4 * of * of))
    return {
        "count": count,
        "of": of,
        "rate": rate,
        "low": max(0, (centre - half) / (1 + z * z / of)),
        "high": min(1, (centre + half) / (1 + z * z / of)),
    }


def capture_of(cells):
    """Success in bins of 2 mm, and up to where it is 95 % or more in each."""
    farthest = max(cell["initial_error"] for cell in cells)
    bins = []
    for low in range(0, int(farthest) + 1, 2):
        inside = [cell for cell in cells if low <= cell["initial_error"] < low + 2]
        success = (
            wilson(sum(cell["success"] for cell in inside), len(inside))
            if inside
            else {"count": 0, "of": 0, "low": 0, "high": 1}
        )
        bins.append({"from": low, "to": low + 2, **{key: success[key] for key in ("count", "of", "low", "high")}})
    fails = next((item["from"] for item in bins if item["count"] < 0.95 * item["of"]), None)
    return {"range": farthest if fails is None else fails, "is_open": fails is None, "unknown_starts": 0, "bins": bins}


def summary_of(cells):
    done = [cell for cell in cells if cell["status"] == "done"]
    column = lambda values: {
        "count": len(values),
        "of": len(cells),
        "median": quantile(values, 0.5),
        "q1": quantile(values, 0.25),
        "q3": quantile(values, 0.75),
        "p95": quantile(values, 0.95),
        "worst": max(values),
        "mean": statistics.fmean(values),
    }
    return {
        "runs": len(cells),
        "failed": len(cells) - len(done),
        "incomplete": 0,
        "success": wilson(sum(cell["success"] for cell in cells), len(cells)),
        "metrics": {metric["name"]: column([cell["values"][i] for cell in done]) for i, metric in enumerate(METRICS)},
        "seconds": column([cell["seconds"] for cell in done]),
        "evaluations": column([cell["evaluations"] for cell in done]),
        "capture": capture_of(cells),
    }


def comparison_of(cells, variant, metric):
    """Median of the pairs' differences with an interval of its order statistics, and the sign test."""
    of = lambda which: {
        (cell["case"], cell["start"]): cell["values"][metric]
        for cell in cells
        if cell["variant"] == which and cell["status"] == "done"
    }
    base, other = of(0), of(variant)
    differences = sorted(other[key] - base[key] for key in other if key in base)
    counts = {
        "cases": len({case for case, _ in base} | {case for case, _ in other}),
        "of_cases": len({cell["case"] for cell in cells}),
        "runs": len({(cell["case"], cell["start"]) for cell in cells}),
        "pairs": len(differences),
        "runs_variant_lost": len(set(base) - set(other)),
        "runs_baseline_lost": len(set(other) - set(base)),
    }
    count, spread = len(differences), 0.98 * math.sqrt(len(differences))
    worse = sum(value > 0 for value in differences)
    p = math.erfc(abs(worse - count / 2) / math.sqrt(count / 4) / math.sqrt(2))
    low, high = differences[max(0, int(count / 2 - spread))], differences[min(count - 1, int(count / 2 + spread))]
    name, what = VARIANTS[variant][0], METRICS[metric]
    middle = quantile(differences, 0.5)
    amount = lambda value: "%.2f %s %s" % (abs(value), what["unit"], "worse" if value > 0 else "better")
    bounds = sorted((low, high), key=lambda value: value if middle > 0 else -value)
    is_shown = low * high > 0 and 3 * p < 0.05
    interval = "%.2f to %.2f" % tuple(map(abs, bounds)) if low * high > 0 else " to ".join(map(amount, bounds))
    return {
        "variant": name,
        "metric": what["name"],
        **counts,
        "difference": middle,
        "fails_more": None,
        "has_interval": True,
        "is_shown": is_shown,
        "low": low,
        "high": high,
        "p": p,
        "p_holm": min(1, 3 * p),
        "sentence": "%s, %s: %s%s, 95 %% interval %s, 12 cases, p = %.2g"
        % (name, what["label"], "" if is_shown else "no difference shown: ", amount(middle), interval, min(1, 3 * p)),
    }
