# SPDX-License-Identifier: Apache-2.0
"""A page for each kind: its contract, and its nodes side by side."""
from markdown import block, code, plain, section, sections, table, toctree
from node_pages import checks_table, type_text, value_text


def short(name):
    return name.split(".", 1)[1]


def link(node):
    return "[%s](../nodes/%s.md)" % (short(node["name"]), node["name"])


def contract_part(kind):
    rows = []
    for way, ports in (("input", kind["inputs"]), ("output", kind["outputs"])):
        for port in ports:
            types = " or ".join(type_text(name, port["axis"]) for name in port["types"])
            rows.append([code(port["name"]), way, types, plain(port["help"])])
    if not rows:
        return "The kind names no ports: each node has its own."
    told = "Each node has these outputs, and may have these inputs. So one line of a pipeline replaces one by another."
    return sections(told, table(["name", "", "type", "meaning"], rows))


def notes_part(kind):
    notes = []
    if kind["sees_truth"]:
        notes.append("Its nodes may be given the truth.")
    if kind["apart"]:
        notes.append("Nodes whose options name files run in a process of their own.")
    return " ".join(notes)


def nodes_table(nodes):
    return table(["node", "what it does"], [[link(node), plain(node["summary"])] for node in nodes])


def ports_differ_part(kind, nodes):
    """The ports beyond the contract, by node."""
    known = {port["name"] for port in kind["inputs"] + kind["outputs"]}
    rows = []
    for node in nodes:
        cells = []
        for ports in (node["inputs"], node["outputs"]):
            names = [
                code(port["name"]) + (" (optional)" if port.get("optional") else "")
                for port in ports
                if port["name"] not in known
            ]
            cells.append(", ".join(names))
        if any(cells):
            rows.append([link(node), *cells])
    return table(["node", "further inputs", "further outputs"], rows)


def option_owners(nodes):
    """{option: {node: option's description}} in the order of the first node that has it."""
    owners = {}
    for node in nodes:
        for option in node["options"]:
            owners.setdefault(option["name"], {})[node["name"]] = option
    return owners


def default_cell(option):
    if option is None:
        return ""
    return "given" if option["required"] else code(value_text(option["default"]).replace("`", "'"))


def shared_options_part(nodes):
    """Options that several nodes have: one column a node, with its default."""
    shared = {name: by_node for name, by_node in option_owners(nodes).items() if len(by_node) > 1}
    with_some = [node for node in nodes if any(node["name"] in by_node for by_node in shared.values())]
    rows = []
    for name, by_node in shared.items():
        rows.append([code(name), *(default_cell(by_node.get(node["name"])) for node in with_some)])
    return table(["option", *(link(node) for node in with_some)], rows)


def own_options_part(nodes):
    owners = option_owners(nodes)
    lines = []
    for node in nodes:
        own = [o["name"] for o in node["options"] if len(owners[o["name"]]) == 1]
        if own:
            lines.append([link(node), ", ".join(code(name) for name in own)])
    return table(["node", "options that no other has"], lines)


def traits_part(kind, nodes):
    rows = []
    for trait in kind["traits"]:
        having = [link(node) for node in nodes if trait["name"] in node["traits"]]
        rows.append([code(trait["name"]), plain(trait["help"]), ", ".join(having)])
    return table(["trait", "meaning", "nodes that have it"], rows)


def kind_page(kind, catalogue, facts):
    nodes = catalogue.nodes_of(kind["name"])
    options = sections(
        shared_options_part(nodes) and "Defaults of the options that several nodes have:",
        shared_options_part(nodes),
        own_options_part(nodes),
    )
    return sections(
        "# " + kind["name"],
        plain(kind["summary"][:1].upper() + kind["summary"][1:]) + ". " + notes_part(kind),
        nodes_table(nodes),
        facts.pictures_of_kind(kind["name"]),
        section("Contract", contract_part(kind)),
        section("Ports that only some have", ports_differ_part(kind, nodes)),
        section("Options side by side", options),
        section("Traits", traits_part(kind, nodes)),
        section("Conformance", kind["checks"] and checks_table(kind)),
        section("On the command line", block("marrow list %s" % kind["name"], "bash")),
    )


def write(catalogue, facts, folder):
    """Writes kinds/NAME.md for each kind, and kinds/index.md."""
    (folder / "kinds").mkdir(parents=True)
    rows = []
    for name, kind in catalogue.kinds.items():
        (folder / "kinds" / (name + ".md")).write_text(kind_page(kind, catalogue, facts))
        rows.append(["[%s](%s.md)" % (name, name), plain(kind["summary"]), len(catalogue.nodes_of(name))])
    text = "A kind is the part of a node's name before the dot. A pipeline can replace a node by another of its kind by"
    text += " changing one line. There are %d kinds and %d nodes." % (len(catalogue.kinds), len(catalogue.nodes))
    page = sections("# Kinds and nodes", text, table(["kind", "what its nodes do", "nodes"], rows))
    (folder / "kinds" / "index.md").write_text(sections(page, toctree(catalogue.kinds)))
