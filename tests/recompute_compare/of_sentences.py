# SPDX-License-Identifier: Apache-2.0
"""What is said of each variant in a sentence, and of a look at the cases so far: every number and every word that
follows from numbers."""
import math
import re

from answer import ALPHA
from checks import unit_of_last_place
from ranks import fewest_cases

KIND = "sentences"


def check_p(checks, what, text, p):
    if p < 0.001 or p >= 0.995:
        return checks.same(KIND, what, text, "p < 0.001" if p < 0.001 else "p = 1")
    number = text.partition("p = ")[2]
    checks.shown(KIND, what, number, p)
    if p != ALPHA and re.fullmatch(r"[\d.]+", number):
        checks.that(KIND, what + ", which side", (float(number) < ALPHA) == (p < ALPHA), text)


class Directed:
    """Numbers in the direction that the sentence names."""

    def __init__(self, compared, difference, higher_is_better):
        self.sign = -1 if difference < 0 else 1
        self.difference = abs(difference)
        self.is_worse = (difference >= 0) != higher_is_better
        self.low, self.high = sorted((self.sign * compared.low, self.sign * compared.high))

    @property
    def word(self):
        return "worse" if self.is_worse else "better"


def check_amount(checks, what, text, directed, unit):
    """ "0.12 mm worse", or "0.0 mm" of a difference that is rounded to 0."""
    number, *words = text.split()
    checks.shown(KIND, what, number, directed.difference, may_be_zero=True)
    is_zero = float(number) == 0
    checks.same(KIND, what + " words", words, ([unit] if unit else []) + ([] if is_zero else [directed.word]))
    return number


def check_bound(checks, what, text, value, directed, unit, names, amount):
    if math.isinf(value):
        who = names[0] if (value > 0) == directed.is_worse else names[1]
        return checks.same(KIND, what, text, "a failure of " + who)
    number, *words = text.split()
    contains_zero = directed.low <= 0 <= directed.high
    checks.shown(KIND, what, number, abs(value), may_be_zero=contains_zero)
    has_failure = math.isinf(directed.low) or math.isinf(directed.high)
    has_direction = directed.low >= 0 and amount is not None and float(amount) != 0
    expected = [unit] if unit and (has_failure or not has_direction) else []
    if not has_direction and float(number) != 0:
        expected.append("worse" if (value > 0) == directed.is_worse else "better")
    checks.same(KIND, what + " words", words, expected)


def check_interval(checks, what, text, directed, unit, names, amount):
    """`amount`: the shown difference; None where that is a failure. `names`: of the variant and the other one."""
    found = re.fullmatch(r"95 % interval (.*) to (.*)", text)
    if not found:
        return checks.same(KIND, what, text, "95 % interval LOW to HIGH")
    has_failure = math.isinf(directed.low) or math.isinf(directed.high)
    bounds = (found[1], directed.low), (found[2], directed.high)
    for name, (shown, value) in zip((" low", " high"), bounds):
        check_bound(checks, what + name, shown, value, directed, unit, names, amount)
    width = directed.high - directed.low
    if not has_failure and width > 1e-9 * directed.difference:
        checks.that(
            KIND, what + " digits", unit_of_last_place(amount) <= width / 4 * (1 + 1e-6) or width < 1e-14, amount
        )


def failures(names, runs):
    if sum(runs.values()) == runs["both"]:
        return None
    return "of %d run%s, only %s failed in %d, only %s in %d, both in %d" % (
        sum(runs.values()),
        "" if sum(runs.values()) == 1 else "s",
        names[0],
        runs["variant_lost"],
        names[1],
        runs["reference_lost"],
        runs["neither"],
    )


def doubts(compared, p, comparisons):
    fewest = fewest_cases(ALPHA, comparisons)
    if compared.is_shown(p):
        return None
    if compared.count < fewest:
        with_so_many = " with %d comparisons" % comparisons if comparisons > 1 else ""
        without = "" if compared.has_interval else ", and no interval is given"
        return "fewer than %d cases cannot reach p < 0.05%s%s" % (fewest, with_so_many, without)
    if p >= ALPHA:
        return None
    is_around_zero = compared.low <= 0 <= compared.high
    why = "the interval contains 0" if is_around_zero else "the ranks and the median do not agree"
    return why + ", look at the single cases"


def cases_text(count):
    return "%d case%s" % (count, "" if count == 1 else "s")


def check_sentence(checks, text, variant, metric, unit, compared, p, comparisons, reference=None):
    """`reference`: the name of another variant than the baseline."""
    begin = variant if reference is None else "%s against %s" % (variant, reference)
    begin, what = "%s, %s: " % (begin, metric.label), "%s, %s" % (begin, metric.path)
    checks.same(KIND, what + " names", text[: len(begin)], begin)
    names = variant, reference or "the baseline"
    head, *clauses = text[len(begin) :].split("; ")
    denial = "no difference shown: "
    if compared.count:
        checks.same(KIND, what + " shown", not head.startswith(denial), compared.is_shown(p))
        head, _, said = head.removeprefix(denial).rpartition(", ")
        check_p(checks, what + " p", said, p)
    doubt = doubts(compared, p, comparisons) if compared.count else None
    check_found(checks, what, head, clauses, names, metric, unit, compared, [doubt] if doubt else [])


def check_effect(checks, text, names, metric, unit, compared):
    """ "powell against nelder_mead: 0.12 mm worse, 95 % interval 0.08 to 0.17, 20 cases": not tested."""
    begin = "%s against %s: " % names
    checks.same(KIND, begin, text[: len(begin)], begin)
    head, *clauses = text[len(begin) :].split("; ")
    check_found(checks, begin + metric.path, head, clauses, names, metric, unit, compared, [])


def check_found(checks, what, head, clauses, names, metric, unit, compared, doubt):
    """The difference, its interval and the cases in `head`; in the other clauses the failures, and then `doubt`."""
    expected = [clause for clause in (failures(names, compared.runs),) if clause]
    if not compared.count:
        checks.same(KIND, what, [head, *clauses], ["no case can be compared", *expected])
        return
    parts = head.split(", ")
    directed = Directed(compared, compared.difference, metric.higher_is_better)
    all_cases = sum(compared.cases.values())
    of_cases = cases_text(all_cases)
    if compared.cases["neither"]:
        of_cases = "%d of %s" % (compared.count, of_cases)
    is_failure = math.isinf(directed.difference)
    if not is_failure or compared.cases["neither"]:
        checks.same(KIND, what + " cases", parts.pop(), of_cases)
    if is_failure:
        who = "fails more often than " + names[1] if directed.is_worse else names[1] + " fails more often"
        lost = compared.cases["variant_lost" if directed.is_worse else "reference_lost"]
        checks.same(KIND, what, parts[:2], [who, "in %d of %s" % (lost, cases_text(compared.count))])
        amount, parts = None, parts[2:]
    else:
        amount = check_amount(checks, what, parts.pop(0), directed, unit)
    has_interval = compared.has_interval and directed.low < math.inf  # none between two failures
    checks.same(KIND, what + " has an interval", bool(parts), has_interval)
    if parts:
        check_interval(checks, what + " interval", parts[0], directed, unit, names, amount)
    if is_failure and compared.of_both:
        middle = Directed(compared, compared.median_of_both, metric.higher_is_better)
        before = "where both have a value, in %s, the median is " % cases_text(len(compared.of_both))
        said = clauses.pop(len(expected)) if len(clauses) > len(expected) else ""
        checks.same(KIND, what + " of both", said[: len(before)], before)
        if said.startswith(before):
            check_amount(checks, what + " of both", said[len(before) :], middle, unit)
    checks.same(KIND, what + " clauses", clauses, expected + doubt)


def check_look(checks, text, look, label, unit, baseline, look_every, alpha):
    """The sentence about the last look; its numbers have three digits."""
    kind, with_unit = "look sentence", " " + unit if unit else ""
    begin = "look %d of %d, %d cases: " % (look["look"], look["looks"], look["cases"])
    checks.same(kind, "counts", text[: len(begin)], begin)
    is_last = look["look"] == look["looks"]
    end = "the rule says stop" if look["is_met"] else "this was the last look" if is_last else "--more-cases goes on"
    checks.that(kind, "end", "; " + end in text, text)
    bound = r"(a failure|\S+?)(?:%s)?" % re.escape(with_unit)  # of a difference, one bound may be a failure
    found = re.search(bound + " to " + bound + ", which holds with %g %% confidence over" % (100 * (1 - alpha)), text)
    known = [look[name] is not None for name in ("low", "high")]
    checks.same(kind, "has an interval", found is not None, any(known) if "p" in look else all(known))
    for shown, name in zip(found.groups() if found else (), ("low", "high")):
        if look[name] is None:
            checks.same(kind, name, shown, "a failure")
        else:
            checks.shown(kind, name, shown, look[name])
    if "p" in look:
        verb = "differs from" if look["is_met"] else "is not shown to differ from"
        start = "%s %s %s in %s: p = " % (look["variant"], verb, baseline, label)
        rest = text[len(begin) :]
        checks.same(kind, "who", rest[: len(start)], start)
        said = re.search(r"p = ([\d.e+-]+)", rest)
        checks.shown(kind, "p", said[1] if said else "", look["p"])
        return
    width = re.search(r"is (\S+)%s wide, (not more|more) than (\S+?)%s" % ((re.escape(with_unit),) * 2), text)
    checks.same(kind, "has a width", width is not None, all(known))
    if width:
        checks.shown(kind, "width", width[1], look["high"] - look["low"])
        checks.same(kind, "met", width[2] == "not more", look["is_met"])
    checks.that(kind, "who", look["variant"] in text, text)
