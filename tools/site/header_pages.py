# SPDX-License-Identifier: Apache-2.0
"""The C++ reference: a page for each public header, its comments as text and its declarations as code.

A comment that stands by itself, and what follows it up to the next such comment, make an entry. Comments at the end of
a line, and those inside a type, stay where they are in the code.
"""
import pathlib
import re

from markdown import ORPHAN, block, plain, sections, table
from node_pages import comment_text, with_code
from sources import leading_comment

FOLDERS = {
    "": "Plugins: what a library includes",
    "domain": "Domain: values and functions of the field",
    "runtime": "Runtime: graph, store, libraries",
    "compare": "Compare: experiments and statistics",
    "toolbox": "Toolbox: what nodes are built on",
}
DECLARED = re.compile(
    r"^(?:template.*> )?(?:class|struct|enum class|enum|using|concept|#define) +(?:MARROW_API )?(\w+)"
    r"|([\w~]+|operator\S+)\(",
    re.M,
)


def without_frame(text):
    """The lines of a header between its includes and its end."""
    lines = [line for line in text.splitlines() if not re.match(r"#(pragma once|include)|// SPDX", line)]
    return "\n".join(lines)


def chunks(text):
    """(comment, code) of each declaration at the outermost level."""
    found, comment, code, depth = [], [], [], 0
    lines = without_frame(text[text.find("\nnamespace") + 1 :] if "\nnamespace" in text else text).splitlines()

    def close():
        if any(line.strip() for line in code):
            found.append(("\n".join(comment), "\n".join(code).strip("\n")))
        comment.clear()
        code.clear()

    for line in lines:
        if re.match(r"(inline )?namespace\b.*\{$|\}  // namespace", line):
            close()
            continue
        is_comment = depth == 0 and re.match(r"///? ?(?!<)", line)
        if is_comment or (depth == 0 and not line.strip()):
            if any(part.strip() for part in code) or not is_comment:
                close()
            if is_comment:
                comment.append(re.sub(r"^///? ?", "", line))
            continue
        code.append(line)
        bare = re.sub(r'"(\\.|[^"])*"|//.*', "", line)
        depth += sum(bare.count(c) for c in "{(") - sum(bare.count(c) for c in "})")
    close()
    return found


def names_of(code):
    """Names that a piece of code declares at its outermost level."""
    found = []
    for line in code.splitlines():
        match = None if line.startswith((" ", "}")) else DECLARED.search(line)
        name = match and (match.group(1) or match.group(2))
        if name and name not in found and name not in ("decltype", "sizeof", "requires", "if", "alignas"):
            found.append(name)
    return found


def header_page(path, text):
    parts = [ORPHAN, "# " + str(path), block("#include <marrow/%s>" % path, "cpp")]
    parts.append(comment_text(leading_comment(text)))
    for comment, code in chunks(text):
        names = names_of(code)
        if names:
            parts.append("## " + ", ".join(plain(name) for name in names[:3]))
        parts += [comment_text(comment), block(code, "cpp")]
    return sections(*parts)


def headers(root):
    """{path as it is included, without marrow/: text} of all headers that CMake's lists call public."""
    found = {}
    for file in sorted([root / "framework/CMakeLists.txt", root / "framework/marrow/compare/CMakeLists.txt"]):
        for room, names in re.findall(r"marrow_public_headers\(marrow\w* (\S+) ([^)]*)\)", file.read_text()):
            for name in names.split():
                found[pathlib.Path(room, name)] = root / "framework/marrow" / room / name
    for file in sorted(root.glob("plugins/*/CMakeLists.txt")):
        pattern = r"marrow_add_library\(\w+ FOLDER (\S+)[^)]*?HEADERS ([^)]*)\)"
        for folder, names in re.findall(pattern, file.read_text()):
            below = folder if folder.startswith("toolbox/") else folder + "/library"
            for name in re.findall(r"[a-z_0-9]+\.hpp", names):
                found[pathlib.Path(folder, name)] = root / "plugins" / below / name
    return {path: found[path].read_text() for path in sorted(found)}


def page_of(path):
    return str(path.with_suffix(""))


def index_row(path, text):
    """A row of the index: the header, its first sentence, and the names that it declares."""
    told = " ".join(leading_comment(text).split()).split(". ")[0].rstrip(".:")
    names = [name for _, code in chunks(text) for name in names_of(code)]
    shown = ", ".join("`%s`" % name for name in dict.fromkeys(names))
    return ["[%s](%s.md)" % (path, page_of(path)), with_code(told) + (": " if told and shown else "") + shown]


def write(catalogue, facts, folder):
    """Writes cpp/PATH.md for each public header, and cpp/index.md."""
    found = headers(facts.root)
    by_folder = {}
    for path, text in found.items():
        page = folder / "cpp" / (page_of(path) + ".md")
        page.parent.mkdir(parents=True, exist_ok=True)
        page.write_text(header_page(path, text))
        by_folder.setdefault(path.parts[0] if len(path.parts) > 1 else "", []).append(path)
    parts = [
        "# C++ reference",
        "A plugin needs only [marrow/plugin.hpp](plugin.md); [Writing plugins](../docs/plugins.md) is the guide.",
    ]
    for name, title in FOLDERS.items():
        rows = [index_row(path, found[path]) for path in by_folder.get(name, [])]
        parts += ["## " + title, table(["header", "what it declares"], rows)]
    (folder / "cpp" / "index.md").write_text(sections(*parts))
