#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs random experiments whose cells are known, and recomputes every figure that marrow says of them: in the terminal,
in sentences, in comparison.json, cells.csv, cells.jsonl, poses.csv, poses.jsonl and report.html.

    tests/recompute_compare/recompute_compare.py BUILD FIRST COUNT [--folder FOLDER]

The experiment of a seed is always the same; FIRST is the first seed. Nothing here comes from marrow: the plugin
test.given_figures makes what a table says, and the answers follow from the table by numpy, scipy, exact fractions and
enumeration. Prints how many figures of each kind were compared, and those that differ. Ends with 1 if one differs.
"""
import argparse
import pathlib
import shutil
import sys
import tempfile

sys.dont_write_bytecode = True

import answer
import files
import findings
import of_json
import of_rows
import of_sentences
import of_terminal
import of_words
from checks import Checks
from experiment import Variant
from generator import generate


def with_tuned(experiment, tuning):
    """The experiment on its held out cases, with the variant that the optimizer chose."""
    if tuning["best"] is not None:
        values = tuning["points"][tuning["best"]]["values"]
        base = experiment.variants[experiment.baseline]
        tuned = Variant("tuned+%.6g" % values[0], base.column, values)
        experiment.variants = experiment.variants + [tuned]


def check_tuning(checks, experiment, got):
    base = experiment.variants[experiment.baseline]
    untuned = answer.tuning_point(experiment, base, [])
    tried = [Variant("tuned+%.6g" % p["values"][0], base.column, p["values"]) for p in got["tuning"]["points"]]
    points = [answer.tuning_point(experiment, variant, variant.swept) for variant in tried]
    of_json.check_tuning(checks, "comparison.json", got["tuning"], untuned, points, experiment)
    is_known = any(point["mean"] is not None for point in [untuned, *points])
    unit = experiment.metrics[0].unit if is_known else ""
    of_words.check_tuning(checks, got["tuning"], untuned, points, experiment, unit)
    rows = experiment.rows(experiment.cases[: experiment.tune["training_cases"]], tried)
    of_variant = [answer.OfVariant(experiment, [r for r in rows if r.variant == v.name]) for v in tried]
    return answer.curve_trees(experiment, tried, of_variant, {"range": [-1, 2], "is_log": False})


def check_sentences(checks, experiment, rows, got, said):
    of_variant = answer.by_variant(experiment, rows)
    found = answer.comparisons(experiment, of_variant)
    units = answer.units_of(experiment, rows)
    checks.same("sentences", "in the terminal", said, [one["sentence"] for one in got["comparisons"]])
    with_baseline = [one for one in found if one[1] == experiment.baseline]
    for one, (m, _, v, compared, p) in zip(got["comparisons"], with_baseline):
        name, metric = experiment.variants[v].name, experiment.metrics[m]
        of_sentences.check_sentence(checks, one["sentence"], name, metric, units[m], compared, p, len(found))
    for one, (m, r, v, compared, p) in zip(got.get("all_pairs", []), found):
        names = [experiment.variants[i].name for i in (v, r)]
        metric = experiment.metrics[m]
        of_sentences.check_sentence(
            checks, one["sentence"], names[0], metric, units[m], compared, p, len(found), names[1]
        )


def check_pairs_and_effects(checks, experiment, rows, got, printed, expected):
    base = experiment.variants[experiment.baseline].name
    others = [one for one in got.get("all_pairs", []) if one["reference"] != base]
    in_order = sorted(others, key=lambda one: not one["is_shown"])
    shown = of_terminal.sentences_of_pairs(printed)
    checks.same("sentences", "of pairs, in the terminal", shown, [one["sentence"] for one in in_order] or None)
    of_terminal.check_rankings(checks, printed, expected)
    if not findings.has_effects(experiment):
        return
    units, found = answer.units_of(experiment, rows), findings.effects(experiment, answer.by_variant(experiment, rows))
    for m, metric in enumerate(experiment.metrics):
        own = [one for one in found if one[0] == m]
        title = metric.label + (" [%s]" % units[m] if units[m] else "")
        lines = of_terminal.effect_lines(printed, title)
        checks.same("sentences", "effects", len(lines), len(own))
        for (factor, said), (_, f, level, compared) in zip(lines, own):
            name, levels = experiment.factors[f]
            checks.same("sentences", "factor", factor, name)
            of_sentences.check_effect(checks, said, (levels[level], levels[0]), metric, units[m], compared)
    written = [one["factor"] + ": " + one["sentence"] for one in got["effects"]]
    checks.same("sentences", "effects in the terminal", all("  %s\n" % one in printed for one in written), True)


def check_look(checks, experiment, rows, got, printed, look):
    metric = next((m for m in experiment.metrics if m.path == look["figure"]), None)
    units = dict(zip((m.path for m in experiment.metrics), answer.units_of(experiment, rows)))
    of_sentences.check_look(
        checks,
        got["stop"]["sentence"],
        look,
        metric.label if metric else "the success rate",
        units[metric.path] if metric else "",
        experiment.variants[experiment.baseline].name,
        experiment.stop["look_every"],
        look.get("alpha", 0.05),
    )
    checks.that("look sentence", "in the terminal", got["stop"]["sentence"] in printed, "")


def check(checks, experiment, folder, printed):
    """All that marrow says of an experiment."""
    folder = pathlib.Path(folder)
    got = of_json.read_json(folder / "comparison.json")
    data = of_json.report_data(folder / "report.html")
    tuned_curves = None
    cases = experiment.cases
    if experiment.tune:
        tuned_curves = check_tuning(checks, experiment, got)
        with_tuned(experiment, got["tuning"])
        cases = experiment.cases[experiment.tune["training_cases"] :]
    if experiment.stop:
        cases = ["seed-%d" % (i + 1) for i in range(answer.last_look(experiment))]
    rows, seconds = experiment.rows(cases), of_rows.seconds_of(folder)
    expected = answer.answer_tree(experiment, rows, seconds, len(cases))
    if tuned_curves:
        expected["curves"] = tuned_curves
    of_rows.check_csv(checks, folder, experiment, rows, seconds)
    of_rows.check_jsonl(checks, folder, experiment, rows, seconds)
    of_rows.check_poses(checks, folder, experiment, rows)
    of_json.check_answer(checks, "comparison.json", got, expected, rows)
    in_page = {"variants": data["summary"], "experiment": data["experiment"]["name"]}
    in_page.update({key: data[key] for key in data if key in expected and key not in in_page})
    of_page = {key: value for key, value in expected.items() if key != "stop"}
    of_json.check_answer(checks, "report.html", in_page, of_page, rows)
    of_rows.check_report_rows(checks, data, experiment, rows, seconds)
    of_rows.check_timed(checks, experiment, rows, seconds, answer.places_of_all(experiment, rows))
    of_terminal.check_tables(checks, printed, expected)
    of_words.check_counts(checks, printed, experiment, rows)
    of_words.check_times(checks, got["times"], seconds, rows)
    of_words.check_success_rule(
        checks, data["experiment"]["success_rule"], experiment, answer.units_of(experiment, rows)
    )
    checks.same("words: times", "in the report", data["experiment"]["time_rule"], got["times"])
    number = of_terminal.number_of_comparisons(printed)
    asked = expected["all_pairs" if experiment.compare_all and len(experiment.variants) > 1 else "comparisons"]
    checks.same("terminal counts", "comparisons", number, len(asked) if number else None)
    check_sentences(checks, experiment, rows, got, of_terminal.sentences(printed))
    check_pairs_and_effects(checks, experiment, rows, got, printed, expected)
    if experiment.stop:
        check_look(checks, experiment, rows, got, printed, expected["stop"])


def run_and_check(checks, seed, folder, build, plugins=None):
    experiment = generate(seed)
    checks.where = "experiment %d" % seed
    files.write(experiment, folder)
    ended = files.run(experiment, folder, build, plugins)
    checks.same("exit code", ended.stderr[-2000:], ended.returncode, 0)
    if ended.returncode == 0:
        (folder / "printed.txt").write_text(ended.stdout)
        check(checks, experiment, folder / "out", ended.stdout)
    return experiment


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path, help="the build folder")
    parser.add_argument("first", type=int, help="the first seed")
    parser.add_argument("count", type=int, help="how many experiments")
    parser.add_argument("--folder", type=pathlib.Path, help="keep the experiments here")
    parser.add_argument("--plugins", type=pathlib.Path, help="folder of the plugin, if it is not in the build folder")
    arguments = parser.parse_args()
    base = arguments.folder or pathlib.Path(tempfile.mkdtemp(prefix="marrow-recompute-compare-"))
    checks = Checks()
    try:
        for seed in range(arguments.first, arguments.first + arguments.count):
            run_and_check(checks, seed, base / str(seed), arguments.build, arguments.plugins)
    finally:
        if not arguments.folder:
            shutil.rmtree(base, ignore_errors=True)
    print(checks.report())
    sys.exit(1 if checks.differences or not checks.counts else 0)


if __name__ == "__main__":
    main()
