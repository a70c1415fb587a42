# SPDX-License-Identifier: Apache-2.0
"""Pieces of Markdown (MyST), of which the pages are put together."""
import re

# In front of a page that is not in the navigation, which would be too long to read, and slow to make for each page.
ORPHAN = "---\norphan: true\n---\n"
SPECIAL = re.compile(r"([\\`*_\[\]<>|#$~])")


def plain(text, keeps_ends=False):
    """The text as it is: nothing in it is taken for Markdown."""
    words = " ".join(text.split())
    if keeps_ends:
        words = (" " if text[:1].isspace() else "") + words + (" " if words and text[-1:].isspace() else "")
    return SPECIAL.sub(r"\\\1", words)


def code(text):
    return "`%s`" % text if text else ""


def in_cell(text):
    return text.replace("|", "\\|") if "\\|" not in text else text


def table(head, rows):
    """A table, or nothing if it has no rows. Cells are Markdown."""
    if not rows:
        return ""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| %s |" % " | ".join(in_cell(str(cell)) for cell in line) for line in lines) + "\n"


def block(text, language="text"):
    """The text in a fence that is longer than any in it."""
    fence = "`" * max(3, 1 + max((len(run) for run in re.findall(r"`+", text)), default=0))
    return "%s%s\n%s\n%s\n" % (fence, language, text.rstrip("\n"), fence)


def entry(role, name, told, body):
    """An entry with a link of its own, in the index and in the search: a directive of names.py."""
    return "```{%s} %s%s\n%s\n```\n" % (role, name, " -- " + told if told else "", body)


def toctree(pages, caption="", hidden=True):
    options = [":hidden:"] if hidden else []
    options += [":caption: " + caption] if caption else []
    return "```{toctree}\n%s\n\n%s\n```\n" % ("\n".join(options), "\n".join(pages))


def slug(heading):
    """The anchor of a heading, as GitHub and MyST make it."""
    return re.sub(r"[^\w\- ]", "", heading.strip().lower().replace(" ", "-"))


def sections(*parts):
    """Parts of a page with an empty line between them. Empty parts are left out."""
    return "\n".join(part.rstrip("\n") + "\n" for part in parts if part)


def section(title, body):
    """A section with its title, or nothing if it has no body."""
    return "## %s\n\n%s" % (title, body) if body else ""
