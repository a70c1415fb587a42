# SPDX-License-Identifier: Apache-2.0
"""Blocks of code in a Markdown document, with what they are: shell, yaml, cpp or text."""
import dataclasses
import re

SHELL = re.compile(
    r"^\s*(?:\$ )?(marrow|tools/|tests/|build/bin/|build-\w+/|cmake|ctest|export|cd|cp|mkdir|sudo|apt-get|python3)"
)
CPP = re.compile(r"^\s*(plugin\.|\.option\(|shipped::|#include|[A-Z_]+\()", re.M)
FENCE = re.compile(r"^(`{3,})(\S*)\s*(.*)$")
NAMED = {"bash": "shell", "sh": "shell", "shell": "shell", "console": "shell", "c++": "cpp", "": ""}


@dataclasses.dataclass
class Block:
    line: int  # of its first line, from 1
    language: str  # shell, yaml, cpp, cmake, or text
    text: str
    about: str = ""  # what stands behind the language of its fence: the name of a file


def language_of(named, text):
    language = NAMED.get(named, named)
    if language:
        return language
    first = next((line for line in text.splitlines() if line.strip()), "")
    return "shell" if SHELL.match(first) else "cpp" if CPP.search(text) else "text"


def blocks_of(text):
    """The blocks of a document in their order: between fences, and paragraphs that are set off by four spaces."""
    found, lines, i = [], text.splitlines(), 0
    while i < len(lines):
        fence = FENCE.match(lines[i])
        if fence:
            end = next(j for j in range(i + 1, len(lines)) if lines[j].strip() == fence.group(1))
            body = "\n".join(lines[i + 1 : end])
            found.append(Block(i + 2, language_of(fence.group(2), body), body, fence.group(3)))
            i = end + 1
        elif lines[i].startswith("    ") and (i == 0 or not lines[i - 1].strip()) and not in_list(lines, i):
            end = i
            while end < len(lines) and (lines[end].startswith("    ") or not lines[end].strip()):
                end += 1
            body = "\n".join(line[4:] for line in lines[i:end]).rstrip("\n")
            found.append(Block(i + 1, language_of("", body), body))
            i = end
        else:
            i += 1
    return found


def in_list(lines, i):
    """Whether a set-off line goes on with an item of a list: the last line that is not set off begins one."""
    for line in reversed(lines[:i]):
        if line.strip() and not line.startswith(" "):
            return bool(re.match(r"([-*]|\d+\.) ", line))
    return False
