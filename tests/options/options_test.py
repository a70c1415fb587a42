# SPDX-License-Identifier: Apache-2.0
"""Each option of each node changes an output, or is refused, or is listed with the reason why it does neither."""
import keyword
import unittest

import calls_of_bones
import calls_of_files
import calls_of_simulation
from alternatives import alternatives
from digests import digest_of
from harness.package import main, marrow
from harness.sample import sample
from scene import Scene
from tries import TRIES
from untried import UNTRIED

SCENE = Scene()
CALLS = {}
for module in (calls_of_bones, calls_of_simulation, calls_of_files):
    CALLS.update(module.calls(SCENE))
# Options that change no output, each with the reason.
BESIDE_BONE = "squares that do not show the bone do not count, and a margin of one is always there"
NO_EFFECT = {
    "similarity.patch_correlation.margin_px": BESIDE_BONE,
    "similarity.patch_gradient_correlation.margin_px": BESIDE_BONE,
}
OF_TESTS = ("test.", "parse.test_")
NODES = {name: marrow._core.node_info(name) for name in marrow._core.node_names() if not name.startswith(OF_TESTS)}


def result_of(name, inputs, options):
    """The digest of what a node gives, or the words in which it refuses."""
    kind, _, node = name.partition(".")
    wired = {**inputs, **{key[3:]: value for key, value in options.items() if key.startswith("in.")}}
    given = {key: value for key, value in options.items() if not key.startswith("in.")}
    named = {key + "_" if keyword.iskeyword(key) else key: value for key, value in given.items()}
    try:
        return digest_of(getattr(getattr(marrow, kind), node)(**wired, **named), SCENE)
    except marrow.PipelineError:
        raise  # a value out of range, or lists of different lengths, say nothing of an effect
    except marrow.Error as error:
        return "refused: " + str(error)


def tries_of(name, option, options):
    """Options to try: those written for this option, else values that the declaration suggests."""
    key = "%s.%s" % (name, option["name"])
    if key in TRIES:
        return [{**options, **one} for one in TRIES[key](SCENE, option["name"])]
    now = options.get(option["name"], option["default"])
    return [{**options, option["name"]: value} for value in alternatives(option, now)]


def has_effect(name, option, known):
    """True, or why not. `known` keeps the results of the node's calls, as most tries are compared with the same one."""
    given, ports = CALLS[name](), {port["name"] for port in NODES[name]["inputs"]}
    # An input and an option may have one name: a text is a path, and no input.
    options = {key: value for key, value in given.items() if key not in ports or isinstance(value, str)}
    inputs = {key: value for key, value in given.items() if key not in options}

    def result(tried):
        key = repr(sorted(tried.items(), key=str))
        if key not in known:
            known[key] = result_of(name, inputs, tried)
        return known[key]

    found = tries_of(name, option, options)
    if not found:
        return "there is no value to try; add one to tries.py"
    for changed in found:
        before = {**changed, option["name"]: options.get(option["name"], option["default"])}
        try:
            if result(changed) != result(before):
                return True
        except marrow.PipelineError:
            continue
    return "no output changed with %s" % [one.get(option["name"]) for one in found]


class Options(unittest.TestCase):
    def test_each_node_is_called(self):
        with_options = {name for name, info in NODES.items() if info["options"]}
        self.assertEqual(with_options - set(CALLS) - set(UNTRIED), set())
        known = {"%s.%s" % (name, option["name"]) for name, info in NODES.items() for option in info["options"]}
        self.assertEqual(set(NO_EFFECT) - known, set(), "these are listed, and not there any more")
        self.assertEqual(set(TRIES) - known, set(), "these are listed, and not there any more")
        self.assertEqual(set(UNTRIED) - known - with_options, set(), "these are listed, and not there any more")

    def test_each_option_changes_something(self):
        names = sample([name for name in NODES if NODES[name]["options"] and name not in UNTRIED], 40)
        for name in names:
            known = {}
            for option in NODES[name]["options"]:
                key = "%s.%s" % (name, option["name"])
                if key in NO_EFFECT or key in UNTRIED:
                    continue
                with self.subTest(key):
                    self.assertIs(has_effect(name, option, known), True)

    def test_what_is_listed_has_no_effect(self):
        for key in sample(sorted(NO_EFFECT), 10):
            name, _, option = key.rpartition(".")
            with self.subTest(key):
                info = next(one for one in NODES[name]["options"] if one["name"] == option)
                self.assertIsNot(has_effect(name, info, {}), True, "it has an effect now: %s" % NO_EFFECT[key])


if __name__ == "__main__":
    main()
