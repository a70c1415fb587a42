# SPDX-License-Identifier: Apache-2.0
"""A page for each node, made from its manifest and from what the repository tells of it."""
import itertools
import json
import re

from markdown import ORPHAN, block, code, entry, plain, section, sections, table


def type_text(type_name, axis):
    return "list of %s over %s" % (type_name, axis) if axis else type_name


def value_text(value):
    """A default as it is written in a pipeline."""
    if isinstance(value, str):
        return value if value else '""'
    if isinstance(value, list):
        return "[%s]" % ", ".join(value_text(item) for item in value)
    return "%.10g" % value if isinstance(value, float) else json.dumps(value)


def default_text(option):
    return "must be given" if option["required"] else "default " + value_text(option["default"])


def ports_table(ports):
    rows = []
    for port in ports:
        optional = "optional: " if port.get("optional") else ""
        type_name = plain(type_text(port["type"], port["axis"]))
        rows.append([code(port["name"]) + "<br>" + type_name, optional + plain(port["help"])])
    return table(["name and type", "meaning"], rows)


def options_part(node):
    """Each option as an entry of its own, then what must hold between them."""
    entries = []
    for option in node["options"]:
        told = "%s; %s" % (option["range"], default_text(option))
        help_text = plain(option["help"])
        if "replaces" in option:
            help_text += "; " + re.sub(r"'([^']*)'", r"`\1`", option["replaces"])
        entries.append(entry("node-option", node["name"] + "." + option["name"], told, help_text))
    relations = ["- " + re.sub(r"'(?:in\.)?([^']*)'", r"`\1`", relation) for relation in node["relations"]]
    return sections(*entries, relations and "What must hold:", "\n".join(relations))


def checks_table(kind):
    rows = []
    for check in kind["checks"]:
        limit = "%.3g %s" % (check["limit"], plain(check["unit"])) if "limit" in check else ""
        rows.append([code(check["name"]), plain(check["what"]), limit])
    return table(["check", "what it checks", "at most"], rows)


def conformance_part(node, kind):
    if not kind["checks"]:
        return ""
    return sections(
        "Each node of the kind must pass these checks. They run in a process of their own, wherever the node was"
        " compiled.",
        block("marrow conformance " + node["name"], "bash"),
        checks_table(kind),
    )


def traits_part(node, kind):
    helps = {trait["name"]: trait["help"] for trait in kind["traits"]}
    return "\n".join("- %s: %s" % (code(name), plain(helps.get(name, ""))) for name in node["traits"])


def comment_part(comment):
    if not comment or not comment[1]:
        return ""
    path, text = comment
    return sections(comment_text(text), "The source is %s." % code(path))


def is_set_off(paragraph):
    return any(line.startswith("  ") for line in paragraph.splitlines())


def with_code(text):
    """Plain text, but what stands between backticks is code."""
    parts = text.split("`")
    if len(parts) % 2 == 0:
        return plain(text)
    return "".join("`%s`" % part if i % 2 else plain(part, keeps_ends=True) for i, part in enumerate(parts))


def comment_text(text):
    """A comment of a source file as Markdown: lines that are set off stay as they are, all else is text."""
    parts = []
    for set_off, paragraphs in itertools.groupby(text.split("\n\n"), is_set_off):
        if set_off:
            parts.append(block("\n\n".join(paragraphs)))
        else:
            parts += [with_code(paragraph) for paragraph in paragraphs]
    return sections(*parts)


def siblings_part(node, catalogue):
    others = [other for other in catalogue.nodes_of(node["name"].split(".")[0]) if other["name"] != node["name"]]
    return "\n".join("- [%s](%s.md): %s" % (code(o["name"]), o["name"], plain(o["summary"])) for o in others)


def mentions_part(mentions):
    links = []
    for page, document, title, anchor in mentions:
        name = plain(document) if title == document else "%s: %s" % (plain(document), plain(title))
        links.append("- [%s](../%s.md#%s)" % (name, page, anchor) if anchor else "- [%s](../%s.md)" % (name, page))
    return "\n".join(links)


def node_page(node, catalogue, facts):
    """`facts` has what the repository tells: comments, uses, mentions and pictures, each by the node's name."""
    name = node["name"]
    kind = catalogue.kinds[name.split(".")[0]]
    head = "A node of the kind [%s](../kinds/%s.md): %s." % (kind["name"], kind["name"], plain(kind["summary"]))
    if node["random"]:
        head += " It draws random numbers: its result depends on the run's seed."
    uses = ["- [%s](../%s.md)" % (code(page), page) for page in facts.uses.get(name, [])]
    return sections(
        ORPHAN,
        "# " + name,
        plain(node["summary"]) + ".",
        head,
        facts.picture(name),
        section("Inputs", ports_table(node["inputs"])),
        section("Outputs", ports_table(node["outputs"])),
        section("Options", options_part(node)),
        section("Traits", traits_part(node, kind)),
        section("How it works", comment_part(facts.comments.get(name))),
        section("Conformance", conformance_part(node, kind)),
        section("Pipelines that use it", "\n".join(uses)),
        section("Read more", mentions_part(facts.mentions.get(name, []))),
        section("Other nodes of the kind", siblings_part(node, catalogue)),
    )


def write(catalogue, facts, folder):
    """Writes nodes/NAME.md for each node."""
    (folder / "nodes").mkdir(parents=True)
    for name, node in catalogue.nodes.items():
        (folder / "nodes" / (name + ".md")).write_text(node_page(node, catalogue, facts))
