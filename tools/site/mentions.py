# SPDX-License-Identifier: Apache-2.0
"""Names in the documents: a node, an option, a command or a key that marrow does not know is a fault."""
import difflib
import re

import yaml

import key_pages
import pipeline_pages
from blocks import blocks_of

SPAN = re.compile(r"(?<!`)`([^`\n]+)`(?!`)")
WORD = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)+")
NODE = re.compile(r"([a-z_]+)\.[a-z_0-9]+")
USES = re.compile(r"\buses(?:: +|=)([a-z_0-9]+\.(?!yaml\b)[a-z_0-9]+)")
OPTION = re.compile(r"\boptions? (?:of type \w+ )?`([a-z_0-9]+)`")
OF_NODE = re.compile(r"`([a-z_0-9]+)` of `([a-z_0-9]+\.[a-z_0-9]+)`")
# Words of the field that look like names of marrow.
OF_THE_FIELD = {"target_from_source", "qform_code", "sform_code"}


class Names:
    """All names that documents may speak of."""

    def __init__(self, catalogue, root):
        self.catalogue, self.root = catalogue, root
        self.options = {option["name"] for node in catalogue.nodes.values() for option in node["options"]}
        self.examples = nodes_of_examples(root)
        self.inputs = set()
        self.words = self.options | OF_THE_FIELD
        for node in catalogue.nodes.values():
            for port in node["inputs"] + node["outputs"]:
                self.words |= {port["name"], port["type"], port["axis"]}
        for kind in catalogue.kinds.values():
            self.words |= {part["name"] for part in kind["traits"] + kind["checks"] + kind["inputs"] + kind["outputs"]}
        self.words |= {name.split(".")[1] for name in catalogue.nodes}
        self._add_keys()
        self._add_pipelines()
        self._add_sources()

    def _add_keys(self):
        for schema in key_pages.schemas(self.catalogue, self.root).values():
            for path in key_pages.Schema(schema).keys:
                self.words |= set(path.split("."))

    def _add_pipelines(self):
        for path, (_, _, content) in pipeline_pages.files(self.root).items():
            for part in ("inputs", "nodes", "outputs", "variants"):
                self.words |= set(content.get(part) or {})
            self.inputs |= set(content.get("inputs") or {})
            self.words |= {path.stem, *path.parts[1:-1]}

    def _add_sources(self):
        """Names of functions, types, figures and files. Options are no reason to keep a word: they are known above."""
        for pattern in ("framework/**/*.[ch]pp", "plugins/**/*.[ch]pp", "tools/**/*"):
            for path in self.root.glob(pattern):
                if path.is_file() and path.suffix in (".hpp", ".cpp", ".cmake", "", ".js"):
                    self.words |= set(declared_in(path))
        for path in [*self.root.glob("framework/marrow/runtime/**/*.*"), *self.root.glob("framework/cmake/*")]:
            # It knows no node, so no option either. Members of other structs may be called as one: level.pixel_step.
            self.words |= set(re.findall(r"(?<![.\w])\w+", path.read_text()))
        for part in ("docs", "framework", "pipelines", "plugins", "schemas", "tests", "tools"):
            for path in (self.root / part).rglob("*"):
                self.words |= {path.name, path.stem}


def declared_in(path):
    """Names of functions and types of a source file, and the figures and keys that it writes. The names of options are
    left out: where a node's option is renamed, its old name is known no more."""
    text = path.read_text(errors="replace")
    found = re.findall(r"\b(\w+)\(", text) + re.findall(r"\b(?:class|struct|enum|enum class) (\w+)", text)
    lines = [line for line in text.splitlines() if not re.search(r"option|relation\(|replaces\(", line)]
    return found + re.findall(r'"([a-z][a-z0-9_]*)"', "\n".join(lines))


def nodes_of_examples(root):
    """Nodes that the examples in docs/ declare, in files and in blocks of C++ and Python."""
    texts = [path.read_text() for path in sorted((root / "docs").rglob("*.cpp"))]
    texts += [path.read_text() for path in sorted((root / "docs").rglob("*.md"))]
    return {
        name for text in texts for name in re.findall(r'\.(?:node|cost|optimizer|projector)\("([a-z_0-9.]+)"', text)
    }


def near(name, known):
    close = difflib.get_close_matches(name, list(known), 1)
    return "; did you mean '%s'?" % close[0] if close else ""


def faults_of_options(content, names):
    """Faults of the options of all nodes in a YAML document."""
    found = []
    if isinstance(content, dict):
        uses = content.get("uses")
        node = names.catalogue.nodes.get(uses) if isinstance(uses, str) else None
        if node and isinstance(content.get("with"), dict):
            known = [option["name"] for option in node["options"]]
            for name in content["with"]:
                if name not in known:
                    found.append("%s has no option '%s'%s" % (uses, name, near(name, known)))
        for value in content.values():
            found += faults_of_options(value, names)
    elif isinstance(content, list):
        for value in content:
            found += faults_of_options(value, names)
    return found


def faults_of_shell(text, names):
    """Faults of commands and their options in lines of the shell, and of the options of nodes that they set."""
    found = []
    for line in text.replace("\\\n", " ").splitlines():
        words = line.split("  #")[0].split(" # ")[0].split()
        if words and words[0] == "$":
            words = words[1:]
        if not words or words[0] not in ("marrow", "build/bin/marrow") or len(words) < 2:
            continue
        if words[1].startswith("-") or words[1].isupper():  # COMMAND: any of them
            continue
        count = 3 if " ".join(words[1:3]) in names.catalogue.commands else 2
        command = names.catalogue.commands.get(" ".join(words[1:count]))
        if not command:
            found.append("there is no command 'marrow %s'%s" % (words[1], near(words[1], names.catalogue.commands)))
            continue
        for word in words[count:]:
            option = word.split("=")[0]
            if option.startswith("-") and option != "-" and option not in command.options():
                found.append("marrow %s has no option '%s'" % (command.name, option) + near(option, command.options()))
        for place, setting in zip(words, words[1:]):
            name = setting.strip("'\"").split("=")[0].split(".")
            if place == "--set" and len(name) > 1 and name[-1] not in names.options | {"uses", "may_fail"}:
                if "in" not in name and name[-1] not in names.words:
                    found.append("no node has the option '%s'%s" % (name[-1], near(name[-1], names.options)))
    return found


def faults_of_spans(line, names):
    """Faults of the names in code style in a line of text."""
    found = []
    for span in SPAN.findall(line):
        node = NODE.fullmatch(span)
        if node and node.group(1) in names.catalogue.kinds and span not in names.catalogue.nodes:
            own = span.split(".")[1]
            if own not in names.words:
                found.append("there is no node '%s'%s" % (span, near(span, names.catalogue.nodes)))
        if span.startswith("marrow "):
            found += faults_of_shell(span, names)
        if WORD.fullmatch(span) and span not in names.words:
            found.append("nothing is named '%s': no option, port, key or function%s" % (span, near(span, names.words)))
    for name in OPTION.findall(line):
        if name not in names.options | names.inputs:
            found.append("no node has the option '%s'%s" % (name, near(name, names.options)))
    for name, owner in OF_NODE.findall(line):
        node = names.catalogue.nodes.get(owner)
        parts = [part["name"] for part in node["options"] + node["inputs"] + node["outputs"]] if node else []
        if node and name in names.options and name not in parts:
            found.append("%s has no option '%s'%s" % (owner, name, near(name, parts)))
    return found + faults_of_uses(line, names)


def faults_of_uses(line, names):
    found = []
    for uses in USES.findall(line):
        if uses.split(".")[0] in names.catalogue.kinds and uses not in names.catalogue.nodes.keys() | names.examples:
            found.append("there is no node '%s'%s" % (uses, near(uses, names.catalogue.nodes)))
    return found


def faults_of(text, names):
    """[(line, fault)] of a document."""
    found, in_block = [], set()
    for block in blocks_of(text):
        in_block |= set(range(block.line, block.line + block.text.count("\n") + 1))
        if block.language == "yaml":
            try:
                content = yaml.safe_load(block.text)
            except yaml.YAMLError:
                content = None  # what is left out is written as ...
            found += [(block.line, fault) for fault in faults_of_options(content, names)]
        if block.language == "shell":
            found += [(block.line, fault) for fault in faults_of_shell(block.text, names)]
    for number, line in enumerate(text.splitlines(), 1):
        outside = "" if number in in_block else line
        uses = " ".join("uses: " + name for name in USES.findall(line))
        found += [(number, fault) for fault in faults_of_spans(outside or uses, names)]
    return sorted(set(found))


def faults(documents, names):
    """One sentence for each fault of the documents, {page: text}."""
    found = []
    for page, text in documents.items():
        file = ("README" if page == "index" else page) + ".md"
        found += ["%s:%d: %s" % (file, line, fault) for line, fault in faults_of(text, names)]
    return found
