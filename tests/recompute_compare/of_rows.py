# SPDX-License-Identifier: Apache-2.0
"""The rows of all cells: cells.csv, cells.jsonl and the table in report.html."""
import csv
import json
import math

NINE_DIGITS = 1e-8  # of numbers that are written with nine
EXACT = 1e-9


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


def check_row(checks, kind, row, told, values, number_of, seconds, relative):
    """`told`: variant, case, start, status, success and verdict; `number_of` gives a number by its name."""
    status = "failed" if row.failed else "done"
    expected = [row.variant, row.case, row.start, status, row.success, row.verdict]
    for name, got, right in zip(("variant", "case", "start", "status", "success", "verdict"), told, expected):
        checks.same(kind, row.id + " " + name, got, right)
    for m, (got, value) in enumerate(zip(values, row.values)):
        checks.close(kind, "%s value %d" % (row.id, m), got, as_float(value), relative)
    for key, value in numbers_of(row, seconds).items():
        checks.close(kind, row.id + " " + key, number_of(key), value, relative)


def check_csv(checks, folder, experiment, rows, seconds):
    with open(folder / "cells.csv", newline="") as stream:
        table = list(csv.DictReader(stream))
    checks.same("cells.csv", "rows", len(table), len(rows))
    for got, row in zip(table, rows):
        checks.same("cells.csv", row.id + " name", unquoted(got["cell"]), row.id)
        checks.that("cells.csv", row.id + " is a text", got["case"][0] not in "=+-@", got["case"])
        told = [unquoted(got[key]) for key in ("variant", "case", "start")]
        told += [got["status"], {"": None, "1": True, "0": False}.get(got["success"], "?"), got["verdict"] or None]
        values = [number(got[metric.path]) for metric in experiment.metrics]
        check_row(checks, "cells.csv", row, told, values, lambda key: number(got[key]), seconds, NINE_DIGITS)
        variant = next(one for one in experiment.variants if one.name == row.variant)
        for (name, levels), level in zip(experiment.factors, variant.levels):
            if name != "variants":
                checks.same("cells.csv", row.id + " " + name, unquoted(got[name]), levels[level])
        if variant.swept:
            checks.close("cells.csv", row.id + " main.at", number(got["main.at"]), float(variant.swept[0]), NINE_DIGITS)
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
        checks.same("cells.jsonl", row.id + " name", got["id"], row.id)
        told = [got.get(key) for key in ("variant", "case", "start", "status", "success", "verdict")]
        check_row(checks, "cells.jsonl", row, told, got["values"], got.get, seconds, EXACT)
        for m, (metric, value) in enumerate(zip(experiment.metrics, row.values)):
            checks.close("cells.jsonl", row.id + " " + metric.path, got[metric.path], as_float(value))
            unit = metric.unit if value is not None else ""
            checks.same("cells.jsonl", row.id + " unit %d" % m, got["units"][m], unit)


def pose_of(evaluations):
    """What plugins/given.cpp makes: the matrix, the deviations (None where none is known), and whether they are the
    bone's."""
    e = float(evaluations)
    rotation = [[0, -1, 0], [1, 0, 0], [0, 0, 1]] if evaluations % 2 else [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    matrix = [[*map(float, row), shift] for row, shift in zip(rotation, (e, -0.5 * e, 0.25))]
    if evaluations % 3:
        return matrix, [], False
    deviations = [math.degrees(0.001 * (e + i)) if i < 3 else 0.001 * (e + i) for i in range(6)]
    return matrix, deviations[:5] + [None if evaluations % 6 == 0 else deviations[5]], evaluations % 9 == 0


def check_poses(checks, folder, experiment, rows):
    """A row of both tables for each cell that is done."""
    with open(folder / "poses.csv", newline="") as stream:
        table = list(csv.DictReader(stream))
    lines = list(map(json.loads, (folder / "poses.jsonl").read_text().splitlines()))
    done = [row for row in rows if not row.failed]
    checks.same("poses", "rows", [len(table), len(lines)], [len(done)] * 2)
    for got, line, row in zip(table, lines, done):
        seed = row.case.partition("-")[2] if experiment.has_seeds else ""
        names = [row.id, row.case, row.variant, row.start, seed, "pose", "", "world", "ct", row.verdict or ""]
        keys = ["cell", "case", "variant", "start", "seed", "output", "item", "target", "source", "verdict"]
        checks.same("poses", row.id + " names", [unquoted(got[key]) for key in keys], names)
        in_line = ["" if line[key] is None else str(line[key]) for key in keys]
        checks.same("poses", row.id + " names in JSON", in_line, names)
        matrix, deviations, is_bone = pose_of(row.evaluations)
        in_csv = [[float(got["m%d%s" % (r, c)]) for c in ("1", "2", "3", "4_mm")] for r in (1, 2, 3)]
        checks.same("poses", row.id + " matrix", [in_csv, line["matrix"]], [matrix, [*matrix, [0, 0, 0, 1]]])
        checks.close("poses", row.id + " probability", number(got["failure_probability"]), row.failure_probability)
        checks.close("poses", row.id + " probability", line["failure_probability"], row.failure_probability)
        checks.same("poses", row.id + " axes", got["axes"], ("bone" if is_bone else "model") if deviations else "")
        axes = ["frontal_deg", "lateral_deg", "axial_deg", "along_frontal_mm", "along_lateral_mm", "along_mm"]
        predicted = line["predicted_deviation"] or {"rotation_deg": [], "translation_mm": [], "axes": ""}
        checks.same("poses", row.id + " axes in JSON", predicted["axes"], got["axes"])
        in_json = predicted["rotation_deg"] + predicted["translation_mm"]
        checks.same("poses", row.id + " deviations", len(in_json), len(deviations))
        for axis, seen, value in zip(axes, in_json, deviations):
            checks.close("poses", row.id + " " + axis, number(got["predicted_" + axis]), value, NINE_DIGITS)
            checks.close("poses", row.id + " " + axis, seen, value)


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
        told = [data["variants"][of(got, "variant")]["name"], data["cases"][of(got, "case")]]
        told += [data["starts"][of(got, "start")], text(got, "status"), of(got, "success"), text(got, "verdict")]
        values = got[len(fields) :]
        check_row(checks, "report cells", row, told, values, lambda key: of(got, key), seconds, NINE_DIGITS)
