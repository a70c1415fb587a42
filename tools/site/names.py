# SPDX-License-Identifier: Apache-2.0
"""An extension of Sphinx: entries for options and keys, and links from names in the text to their pages."""
import posixpath
import re

from docutils import nodes
from sphinx import addnodes

SHELL = re.compile(r"^(marrow|tools/|tests/|build/bin/|build-\w+/|cmake|ctest|export|cd|cp|sudo|apt-get|ninja|\$) ?")
PIPELINE = re.compile(r"^(?:pipelines/)?([a-z0-9_/-]+)\.yaml$")


def parse_entry(environment, text, signature):
    """`OWNER.name -- what it may be`: shows the name and what it may be, and is found by OWNER.name."""
    name, _, told = text.partition(" -- ")
    shown = name
    if signature.parent["objtype"] == "node-option":
        shown = name.rsplit(".", 1)[1]
    elif signature.parent["objtype"] == "file-key":
        shown = name.split(": ", 1)[1]
    elif signature.parent["objtype"] == "command-option":
        shown = name.rsplit(" ", 1)[1]
    signature += addnodes.desc_name(shown, shown)
    if told:
        signature += addnodes.desc_annotation(told, " " + told)
    return name


def page_of(text, pages):
    """The page that a name in the text is about, or None."""
    if "nodes/" + text in pages:
        return "nodes/" + text
    words = text.split()
    if len(words) > 1 and words[0] == "marrow":
        for count in (2, 1):
            page = "commands/" + "-".join(words[1 : 1 + count])
            if page in pages:
                return page
    match = PIPELINE.match(text)
    if match and "pipelines/" + match.group(1) in pages:
        return "pipelines/" + match.group(1)
    return None


def link_names(app, doctree, page):
    """A name in code style that has a page becomes a link to it."""
    pages = app.env.found_docs
    for literal in list(doctree.findall(nodes.literal)):
        target = page_of(literal.astext(), pages)
        above = literal.parent
        while above is not None and not isinstance(above, (nodes.reference, nodes.title, addnodes.desc_signature)):
            above = above.parent
        if target is None or target == page or above is not None:
            continue
        uri = app.builder.get_relative_uri(page, target)
        reference = nodes.reference("", "", internal=True, refuri=uri)
        literal.replace_self(reference)
        reference += literal


def colour_shell(app, doctree):
    """Set-off lines that are commands are coloured as such."""
    for block in doctree.findall(nodes.literal_block):
        if block.get("language", "default") in ("default", "none") and SHELL.match(block.astext()):
            block["language"] = "bash"


def use_known_tree(app, page, template, context, doctree):
    """Saves a third of the time: a page that is not in the navigation has the same one as the other pages of its
    folder, so it is made once a folder."""
    if "orphan" not in app.env.metadata.get(page, {}) or "toctree" not in context:
        return
    known, make = app.trees_by_folder, context["toctree"]

    def toctree(**given):
        key = (posixpath.dirname(page), tuple(sorted(given.items())))
        if key not in known:
            known[key] = make(**given)
        return known[key]

    context["toctree"] = toctree


def setup(app):
    for kind, told in (
        ("node-option", "option of a node"),
        ("command-option", "option of a command"),
        ("file-key", "key of a file"),
    ):
        app.add_object_type(kind, kind, "pair: %s; " + told, parse_entry, objname=told)
    app.trees_by_folder = {}
    app.connect("html-page-context", use_known_tree, priority=100)  # before the theme asks for the tree
    app.connect("doctree-read", colour_shell)
    app.connect("doctree-resolved", link_names)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
