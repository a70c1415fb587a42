# SPDX-License-Identifier: Apache-2.0
"""Other values of an option, from what its node declares."""


def alternatives(option, now):
    """Values within the range, the nearest to `now` first. None for a text or a path: nobody can guess those."""
    kind = option["type"]
    if kind == "boolean":
        return [not now]
    if option["choices"]:
        return [choice for choice in option["choices"] if choice != now]
    if kind in ("number", "integer"):
        return numbers(option, now)
    if kind == "numbers" and now:
        return [[within(option, one) for one in changed] for changed in lists(now)]
    return []


def numbers(option, now):
    tried = [now * 1.4, now * 0.6, now + 1, now - 1, now * 4, now * 0.1, now + 20, option["minimum"], option["maximum"]]
    if option["type"] == "integer":
        tried = [int(round(one)) for one in tried if one is not None and abs(one) < 1e6]
    values = [within(option, one) for one in tried if one is not None and abs(one) < 1e6]
    return [one for i, one in enumerate(values) if one != now and one not in values[:i]]


def lists(now):
    yield [one * 1.3 for one in now]
    yield [one * 0.7 + 1 for one in now]
    yield [one - 0.5 for one in now]


def within(option, value):
    if option["minimum"] is not None:
        value = max(value, option["minimum"])
    if option["maximum"] is not None:
        value = min(value, option["maximum"])
    return value
