# SPDX-License-Identifier: Apache-2.0
"""What the repository itself tells of a node: its comment, the pipelines that use it, the sections that speak of it."""
import re

from markdown import slug

NODE = re.compile(r'\bnode\(\s*"([a-z_0-9]+\.[a-z_0-9]+)"')
USES = re.compile(r"\buses: *([a-z_0-9]+\.(?!yaml\b)[a-z_0-9]+)")
MENTION = re.compile(r"[a-z_0-9]+\.[a-z_0-9]+")


def leading_comment(text):
    """The paragraphs of the comment at the top of a source file, without the licence."""
    lines = []
    for line in text.splitlines():
        if line.startswith("// SPDX") or line == "#pragma once":
            continue
        if not line.startswith("//"):
            break
        lines.append(line[2:][1:] if line.startswith("// ") else line[2:])
    return "\n".join(lines).strip("\n")


def comments_of_nodes(root):
    """{node: comment of the file that declares it}. A file that declares several nodes speaks of all of them."""
    found = {}
    for path in sorted((root / "plugins").rglob("*.cpp")):
        text = path.read_text()
        for name in NODE.findall(text):
            found[name] = (path.relative_to(root), leading_comment(text))
    return found


def uses_of_pipelines(pipelines):
    """{node: pipelines that use it}, where `pipelines` is {page: text}."""
    found = {}
    for page, text in sorted(pipelines.items()):
        for name in sorted(set(USES.findall(text))):
            found.setdefault(name, []).append(page)
    return found


def headings(text):
    """(title, anchor, text of the section) of each heading, as MyST numbers anchors that occur twice."""
    found, seen, in_fence = [["", "", []]], {}, False
    for line in text.splitlines():
        in_fence = in_fence != line.startswith("```")
        match = None if in_fence else re.match(r"#{1,4} +(.+)", line)
        if match:
            anchor = slug(match.group(1).replace("`", ""))
            seen[anchor] = seen.get(anchor, -1) + 1
            found.append([match.group(1), anchor + ("-%d" % seen[anchor] if seen[anchor] else ""), []])
        found[-1][2].append(line)
    return [(title, anchor, "\n".join(lines)) for title, anchor, lines in found]


def sections_that_mention(documents):
    """{word with a dot: [(page, title of the document, title of the section, anchor)]}, of {page: text}."""
    found = {}
    for page, text in documents.items():
        parts = headings(text)
        document = next((title for title, _, _ in parts if title), page)
        for title, anchor, body in parts:
            for word in sorted(set(MENTION.findall(body))):
                found.setdefault(word, []).append((page, document, title or document, anchor))
    return found
