# SPDX-License-Identifier: Apache-2.0
"""The tables of docs/vocabulary.md: ports and options whose names several nodes have, and those that only one has."""
import collections

from markdown import code, plain, section, sections, table

TOLD = "The type of a port, and the type and unit of an option, are in brackets."


def ports_of(node):
    """(name, type, "", help) of each input and output."""
    return [(one["name"], one["type"].replace("_", " "), "", one["help"]) for one in node["inputs"] + node["outputs"]]


def options_of(node):
    """(name, type, unit, help) of each option; the unit is empty if there is none."""
    return [
        (one["name"], one["type"], "" if one["unit"] == "1" else one["unit"], one["help"]) for one in node["options"]
    ]


def by_name(nodes, of_node):
    """{name: [(node, type, unit, help)]}. A name may be that of an input and an output of one node."""
    found = collections.defaultdict(list)
    for node, told in nodes.items():
        for name, *what in of_node(told):
            found[name].append((node, *what))
    return found


def shared(nodes, of_node):
    """{name: (types, units, helps)} of the names that several nodes have."""
    found = {name: list(zip(*users)) for name, users in by_name(nodes, of_node).items()}
    return {name: tuple(map(set, what)) for name, (users, *what) in found.items() if len(set(users)) > 1}


def shared_part(nodes, of_node, title):
    """What a name is, the node that says it most briefly tells."""
    rows = []
    for name, (types, units, helps) in sorted(shared(nodes, of_node).items()):
        brief = min(helps, key=lambda text: (len(text), text))
        rows.append([code(name), " or ".join(sorted(types)), ", ".join(sorted(units)), plain(brief)])
    return section(title, table(["name", "type", "unit", "what it is"], rows))


def own_names(nodes, of_node):
    """{node: [(name, type, unit)]} of the names that no other node has."""
    known = shared(nodes, of_node)
    own = {name: [one[:3] for one in of_node(node) if one[0] not in known] for name, node in nodes.items()}
    return {name: list(dict.fromkeys(ones)) for name, ones in own.items()}


def in_a_cell(own):
    return ", ".join("%s (%s)" % (code(name), ", ".join(filter(None, what))) for name, *what in own)


def own_names_part(nodes):
    """The section with the table. Each node leads to its page."""
    ports, options = own_names(nodes, ports_of), own_names(nodes, options_of)
    rows = [
        ["[%s](../nodes/%s.md)" % (code(name), name), in_a_cell(ports[name]), in_a_cell(options[name])]
        for name in nodes
        if ports[name] or options[name]
    ]
    return section("Names of one node", TOLD + "\n\n" + table(["node", "ports", "options"], rows))


def tables(nodes):
    of_several = (ports_of, "Ports of several nodes"), (options_of, "Options of several nodes")
    return sections(*(shared_part(nodes, *one) for one in of_several), own_names_part(nodes))
