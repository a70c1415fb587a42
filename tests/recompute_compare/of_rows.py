# SPDX-License-Identifier: Apache-2.0
"""The rows of all cells: cells.csv, cells.jsonl and the table in report.html."""
import csv
import json

NINE_DIGITS = 1e-8  # of numbers that are written with nine


def number(text):
    return float(text) if text else None


def as_float(value):
    return None if value is None else float(value)


def seconds_of(folder):
    """What the clock said, by cell."""
    rows = map(json.loads, (folder / "cells.jsonl").read_text().splitlines())
    return {row["id"]: row["seconds"] for row in rows if row["seconds"] is not None}


def unquoted(text):
    """Without the mark of a text that a spreadsheet would compute."""
    return text[1:] if text[:1] == "'" else text


def check_csv(checks, folder, experiment, rows, seconds):
    with open(folder / "cells.csv", newline="") as stream:
        table = list(csv.DictReader(stream))
    checks.same("cells.csv", "rows", len(table), len(rows))
    for got, row in zip(table, rows):
        names = [unquoted(got[key]) for key in ("cell", "variant", "case", "start")]
        checks.that("cells.csv", row.id + " is a text", got["case"][0] not in "=+-@", got["case"])
        checks.same("cells.csv", row.id + " names", names, [row.id, row.variant, row.case, row.start])
        checks.same("cells.csv", row.id + " status", got["status"], "failed" if row.failed else "done")
        is_good = "" if row.success is None else "1" if row.success else "0"
        checks.same("cells.csv", row.id + " success", got["success"], is_good)
        checks.same("cells.csv", row.id + " verdict", got["verdict"], row.verdict or "")
        for metric, value in zip(experiment.metrics, row.values):
            what = row.id + " " + metric.path
            checks.close("cells.csv", what, number(got[metric.path]), as_float(value), NINE_DIGITS)
        for key, value in numbers_of(row, seconds).items():
            checks.close("cells.csv", row.id + " " + key, number(got[key]), value, NINE_DIGITS)
        has_reason = row.failed or None in row.values
        checks.same("cells.csv", row.id + " has a reason", got["reason"] != "", has_reason)


def numbers_of(row, seconds):
    numbers = {
        "initial_error": as_float(row.initial_error),
        "failure_probability": row.failure_probability,
        "seconds": seconds.get(row.id),
        "tries": row.tries,
    }
    if not row.failed:
        numbers["evaluations"] = row.evaluations
    return numbers


def check_jsonl(checks, folder, experiment, rows, seconds):
    table = list(map(json.loads, (folder / "cells.jsonl").read_text().splitlines()))
    checks.same("cells.jsonl", "rows", len(table), len(rows))
    for got, row in zip(table, rows):
        names = [got[key] for key in ("id", "variant", "case", "start")]
        checks.same("cells.jsonl", row.id + " names", names, [row.id, row.variant, row.case, row.start])
        checks.same("cells.jsonl", row.id + " status", got["status"], "failed" if row.failed else "done")
        checks.same("cells.jsonl", row.id + " success", got["success"], row.success)
        checks.same("cells.jsonl", row.id + " verdict", got.get("verdict"), row.verdict)
        for m, (metric, value) in enumerate(zip(experiment.metrics, row.values)):
            checks.close("cells.jsonl", row.id + " " + metric.path, got[metric.path], as_float(value))
            checks.close("cells.jsonl", row.id + " value %d" % m, got["values"][m], as_float(value))
            unit = metric.unit if value is not None else ""
            checks.same("cells.jsonl", row.id + " unit %d" % m, got["units"][m], unit)
        for key, value in numbers_of(row, seconds).items():
            checks.close("cells.jsonl", row.id + " " + key, got.get(key), value)


def check_timed(checks, experiment, rows, seconds, places):
    """`places`: the cases and starts in which every variant was done. Each is timed for all variants or for none."""
    timed = {}
    for row in rows:
        if row.id in seconds:
            timed.setdefault((row.case, row.start), set()).add(row.variant)
    able = {row.variant for row in rows if (row.case, row.start) in places and not row.failed}
    checks.same("timed cells", "places", len(timed), min(experiment.timed_cells, len(places)))
    for place, variants in timed.items():
        checks.same("timed cells", place, sorted(variants), sorted(able))
        checks.that("timed cells", place, place in places, place)


def check_report_rows(checks, data, experiment, rows, seconds):
    """The page's table, as tools/report/page/data.js describes it."""
    table = data["cell_table"]
    fields, texts = table["fields"], table["texts"]
    checks.same("report cells", "rows", len(table["rows"]), len(rows))
    checks.that("report cells", "fields", "initial_error" in fields, fields)
    of = lambda got, name: dict(zip(fields, got)).get(name)
    text = lambda got, name: None if of(got, name) is None else texts[of(got, name)]
    for got, row in zip(table["rows"], rows):
        names = [data["variants"][of(got, "variant")]["name"], data["cases"][of(got, "case")]]
        names.append(data["starts"][of(got, "start")])
        checks.same("report cells", row.id + " names", names, [row.variant, row.case, row.start])
        checks.same("report cells", row.id + " status", text(got, "status"), "failed" if row.failed else "done")
        checks.same("report cells", row.id + " success", of(got, "success"), row.success)
        checks.same("report cells", row.id + " verdict", text(got, "verdict"), row.verdict)
        for metric, value, seen in zip(experiment.metrics, row.values, got[len(fields) :]):
            checks.close("report cells", row.id + " " + metric.path, seen, as_float(value), NINE_DIGITS)
        for key, value in numbers_of(row, seconds).items():
            checks.close("report cells", row.id + " " + key, of(got, key), value, NINE_DIGITS)
