# SPDX-License-Identifier: Apache-2.0
"""The last table of docs/vocabulary.md: the ports and options whose names only one node has."""
import collections

from markdown import code, section, table

TOLD = "The type of a port, and the type and unit of an option, are in brackets."


def ports_of(node):
    """(name, type) of each input and output."""
    return [(port["name"], port["type"].replace("_", " ")) for port in node["inputs"] + node["outputs"]]


def options_of(node):
    """(name, type, unit) of each option; the unit is empty if there is none."""
    return [(one["name"], one["type"], "" if one["unit"] == "1" else one["unit"]) for one in node["options"]]


def own_names(nodes, of_node):
    """{node: what of_node() gives}, of the names that no other node has."""
    users = collections.Counter(name for node in nodes.values() for name in {one[0] for one in of_node(node)})
    return {name: [one for one in of_node(node) if users[one[0]] == 1] for name, node in nodes.items()}


def in_a_cell(own):
    # A name may be that of an input and an output; it is told once.
    return ", ".join(dict.fromkeys("%s (%s)" % (code(name), ", ".join(filter(None, what))) for name, *what in own))


def own_names_part(nodes):
    """The section with the table. Each node leads to its page."""
    ports, options = own_names(nodes, ports_of), own_names(nodes, options_of)
    rows = [
        ["[%s](../nodes/%s.md)" % (code(name), name), in_a_cell(ports[name]), in_a_cell(options[name])]
        for name in nodes
        if ports[name] or options[name]
    ]
    return section("Names of one node", TOLD + "\n\n" + table(["node", "ports", "options"], rows))
