# SPDX-License-Identifier: Apache-2.0
"""The tables that marrow compare prints."""
import re

NUMBER = r"-?\d[\d.]*(?:e[+-]\d+)?"


class Sections:
    """The printed text as its parts, which blank lines divide."""

    def __init__(self, text):
        parts = text.replace("\r", "").split("\n\n")
        self.parts = [part.strip("\n").split("\n") for part in parts]

    def starting(self, begin):
        return next((part for part in self.parts if part[0].startswith(begin)), None)


def cells_of(line):
    return re.split(r" {2,}", line.rstrip())


def check_rate(checks, what, text, rate):
    """ "2/60 (0.9 to 11.4 %)", or "-" of nothing."""
    if rate is None or not rate["of"]:
        return checks.same("terminal rates", what, text, "-")
    found = re.fullmatch(r"(\d+)/(\d+) \((%s) to (%s) %%\)" % (NUMBER, NUMBER), text)
    if not found:
        return checks.same("terminal rates", what, text, "COUNT/OF (LOW to HIGH %)")
    checks.same("terminal rates", what + " counts", [int(found[1]), int(found[2])], [rate["count"], rate["of"]])
    checks.percent("terminal rates", what + " low", found[3], rate["low"])
    checks.percent("terminal rates", what + " high", found[4], rate["high"])


def check_success(checks, what, text, success):
    if success is None:
        return checks.same("terminal success", what, text, "-")
    found = re.fullmatch(r"(%s) %% \((%s) to (%s)\)" % (NUMBER, NUMBER, NUMBER), text)
    if not found:
        return checks.same("terminal success", what, text, "RATE % (LOW to HIGH)")
    for shown, key in zip(found.groups(), ("rate", "low", "high")):
        checks.percent("terminal success", what + " " + key, shown, success[key])


def check_number(checks, kind, what, text, value):
    if value is None:
        return checks.same(kind, what, text, "-")
    checks.shown(kind, what, text, value)


def check_overview(checks, sections, tree):
    lines = sections.starting("variant")
    for line, variant in zip(lines[1:], tree["variants"]):
        name = variant["name"] + (" *" if variant["is_baseline"] else "")
        got = cells_of(line)
        counts = [str(variant[key]) for key in ("runs", "failed", "incomplete")]
        checks.same("terminal counts", name, got[:4], [name, *counts])
        check_success(checks, name, got[4], variant["success"])
        check_number(checks, "terminal seconds", name, got[5], variant["seconds"].get("median"))
        check_number(checks, "terminal evaluations", name, got[6], variant["evaluations"].get("median"))
    has_note = any("no limits under 'success'" in line for line in lines)
    checks.same("terminal counts", "note", has_note, tree["variants"][0]["success"] is None)


def check_figures(checks, sections, tree, metric):
    title = metric["label"] + (" [%s]" % metric["unit"] if metric["unit"] else "")
    title += "" if metric["label"] == metric["name"] else ", " + metric["name"]
    lines = sections.starting(title)
    if lines is None or lines[0] != title:
        return checks.same("terminal figures", "title", None, title)
    percentile = "5 %" if metric["higher_is_better"] else "95 %"
    head = ["", "runs", "median", "25 %", "75 %", percentile, "worst", "median, 95 % interval"]
    checks.same("terminal figures", title + " heading", cells_of(lines[1]), head)
    for line, variant in zip(lines[2:], tree["variants"]):
        figure, got = variant["metrics"][metric["name"]], cells_of(line)
        what = "%s of %s" % (metric["name"], variant["name"])
        checks.same("terminal figures", what, got[:2], [variant["name"], "%(count)d/%(of)d" % figure])
        keys = ("median", "q1", "q3", "p5" if metric["higher_is_better"] else "p95", "worst")
        for text, key in zip(got[2:7], keys):
            check_number(checks, "terminal figures", what + " " + key, text, figure.get(key))
        if "median_low" not in figure:
            checks.same("terminal figures", what + " interval", got[7], "-")
            continue
        low, _, high = got[7].partition(" to ")
        checks.shown("terminal figures", what + " low", low, figure["median_low"])
        checks.shown("terminal figures", what + " high", high, figure["median_high"])
    has_note = any(line.startswith("The variants have this figure in different runs") for line in lines)
    checks.same("terminal figures", title + " note", has_note, not metric["same_runs"])


def check_verdicts(checks, sections, tree):
    lines = sections.starting("Verdicts: ")
    has_any = any("verdicts" in variant for variant in tree["variants"])
    checks.same("terminal verdicts", "is there", lines is not None, has_any)
    for line, variant in zip((lines or [])[2:], tree["variants"]):
        of = variant.get("verdicts", {"cells": 0, "silent_failures": None, "caught": 0, "false_alarms": None})
        has_success = variant["success"] is not None
        caught = str(of["caught"] or 0) if has_success else "-"
        got = cells_of(line)
        checks.same(
            "terminal verdicts", variant["name"], [got[0], got[1], got[3]], [variant["name"], str(of["cells"]), caught]
        )
        check_rate(checks, variant["name"] + " silent", got[2], of["silent_failures"])
        check_rate(checks, variant["name"] + " alarms", got[4], of["false_alarms"])


def check_capture(checks, sections, tree):
    lines = sections.starting("Capture range: ")
    captures = [variant.get("capture") for variant in tree["variants"]]
    has_bins = any(capture and capture["bins"] for capture in captures)
    checks.same("terminal capture", "is there", lines is not None, has_bins)
    if not has_bins or lines is None:
        return
    unit = tree["initial_error"]["unit"]
    checks.that("terminal capture", "unit", "[%s], in bins of 2 %s," % (unit, unit) in lines[0], lines[0])
    longest = max((capture["bins"] for capture in captures), key=len)
    checks.same("terminal capture", "variants", cells_of(lines[1])[1:], [v["name"] for v in tree["variants"]])
    for b, one in enumerate(longest):
        got = cells_of(lines[2 + b])
        begin, end = re.fullmatch(r"(%s) to (%s)" % (NUMBER, NUMBER), got[0]).groups()
        checks.shown("terminal capture", "from", begin, one["from"])
        checks.shown("terminal capture", "to", end, one["to"])
        for text, capture, variant in zip(got[1:], captures, tree["variants"]):
            bins = capture["bins"]
            check_rate(checks, "%s from %s" % (variant["name"], begin), text, bins[b] if b < len(bins) else None)
    got = cells_of(lines[2 + len(longest)])
    checks.same("terminal capture", "last line", got[0], "95 % or more to")
    for text, capture in zip(got[1:], captures):
        if capture["range"] is None:
            checks.same("terminal capture", "range", text, "-")
            continue
        checks.same("terminal capture", "open", text.startswith("at least "), capture["is_open"])
        checks.shown("terminal capture", "range", text.replace("at least ", ""), capture["range"])
    unknown = sum(capture["unknown_starts"] for capture in captures)
    said = [line for line in lines if "do not count here" in line]
    checks.same(
        "terminal capture", "unknown starts", [line.split()[0] for line in said], [str(unknown)] * (unknown > 0)
    )


def check_tables(checks, text, tree):
    sections = Sections(text)
    check_overview(checks, sections, tree)
    for metric in tree["metrics"]:
        check_figures(checks, sections, tree, metric)
    check_verdicts(checks, sections, tree)
    check_capture(checks, sections, tree)


def sentences(text):
    """The sentences about the variants that are printed below the tables."""
    lines = Sections(text).starting("* the baseline")
    return [line.strip() for line in lines[1:] if line.startswith("  ")]


def sentences_of_pairs(text):
    """Those about pairs without the baseline; None if there are none."""
    lines = Sections(text).starting("The other pairs, ")
    return lines and [line.strip() for line in lines[1:]]


def check_rankings(checks, text, tree):
    for ranking in tree.get("rankings", []):
        metric = next(one for one in tree["metrics"] if one["name"] == ranking["metric"])
        title = metric["label"] + (" [%s]" % metric["unit"] if metric["unit"] else "")
        begin = "Ranking by %s; a lost run" % title
        lines = Sections(text).starting(begin)
        if lines is None:
            checks.same("terminal ranking", "title", None, begin)
            continue
        for line, place in zip(lines[2:], ranking["places"]):
            rank, name, *rest = cells_of(line.strip())
            checks.same("terminal ranking", title, [int(rank), name], [place["rank"], place["variant"]])
            median, lost, group = rest
            if place["median"] is None:
                checks.same("terminal ranking", name + " median", median, "a failure")
            else:
                checks.shown("terminal ranking", name + " median", median, place["median"])
            checks.same("terminal ranking", name, [int(lost), group], [place["lost"], place["group"] or "-"])
        checks.same("terminal ranking", title + " rows", len(lines) - 3, len(ranking["places"]))
        said = "best in %s: %s" % (metric["label"], ranking["places"][0]["variant"])
        said += "; %d of %d pairs differ" % (ranking["different"], ranking["pairs"])
        if ranking["better_than_best"]:
            said += "; shown to be better than it, compared case by case: " + ", ".join(ranking["better_than_best"])
        said += "; not told apart from it: " + (", ".join(ranking["like_best"]) or "none")
        checks.same("terminal ranking", title + " sentence", lines[-1], said)


def effect_lines(text, title):
    """The factor and the sentence of each effect on one figure."""
    lines = Sections(text).starting("What each factor does to %s, averaged" % title) or [""]
    return [line.strip().partition(": ")[::2] for line in lines[1:]]


def number_of_comparisons(text):
    found = re.search(r"with Holm's correction over all (\d+):", text)
    return int(found[1]) if found else None
