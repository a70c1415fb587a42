# SPDX-License-Identifier: Apache-2.0
"""A page for each shipped pipeline and experiment: what it is for, its inputs, its nodes and its text."""
import yaml

from markdown import ORPHAN, block, code, plain, section, sections, table
from sources import USES


def page_of(path):
    """The page of a file: pipelines/femur/femur.yaml has pipelines/femur."""
    return str(path.with_suffix(""))


def kind_of(document):
    """pipeline, experiment, or '' for other files."""
    if not isinstance(document, dict):
        return ""
    return (
        "pipeline" if "marrow" in document and "nodes" in document else "experiment" if "experiment" in document else ""
    )


def files(root):
    """{path from the root: (kind, text, content)} of pipelines and experiments."""
    found = {}
    for path in sorted((root / "pipelines").rglob("*.yaml")):
        text = path.read_text()
        content = yaml.safe_load(text)
        if kind_of(content):
            found[path.relative_to(root)] = (kind_of(content), text, content)
    return found


def inputs_table(content):
    rows = []
    for name, given in (content.get("inputs") or {}).items():
        default = code(str(given["default"])) if "default" in given else "must be given"
        rows.append([code(name), given.get("type", "text"), default, plain(given.get("help", ""))])
    return table(["input", "type", "default", "meaning"], rows)


def command_for(path, kind, content):
    if kind == "experiment":
        return "marrow compare %s" % path
    needed = [name for name, given in (content.get("inputs") or {}).items() if "default" not in given]
    return "marrow run %s%s" % (path, "".join(" %s=%s" % (name, name.upper()) for name in needed))


def file_page(path, kind, text, content, up):
    names = sorted(set(USES.findall(text)))
    nodes = ", ".join("[%s](%snodes/%s.md)" % (name, up, name) for name in names)
    pipeline = "" if kind == "pipeline" else "It compares variants of %s." % code(str(content["pipeline"]))
    outputs = content.get("outputs") if kind == "pipeline" else None
    return sections(
        ORPHAN,
        "# " + path.name,
        plain(content.get("help", "")),
        pipeline,
        block(command_for(path, kind, content), "bash"),
        section("Inputs", inputs_table(content) if kind == "pipeline" else ""),
        section("Outputs", ", ".join(code(name) for name in outputs or {})),
        section("Nodes", nodes),
        section("The file", block(text, "yaml")),
    )


def first_sentence(text):
    return " ".join(text.split()).split(". ")[0].rstrip(".")


def index_page(found):
    parts = ["# Pipelines and experiments"]
    for kind, title in (("pipeline", "Pipelines"), ("experiment", "Experiments")):
        rows = []
        for path, (its_kind, _, content) in found.items():
            if its_kind == kind:
                page = page_of(path)[len("pipelines/") :]
                rows.append(["[%s](%s.md)" % (page, page), plain(first_sentence(content.get("help", "")))])
        parts.append(section(title, table(["file", "what it is for"], rows)))
    return sections(*parts)


def write(catalogue, facts, folder):
    """Writes pipelines/NAME.md for each pipeline and experiment, and pipelines/index.md."""
    found = files(facts.root)
    for path, (kind, text, content) in found.items():
        page = folder / (page_of(path) + ".md")
        page.parent.mkdir(parents=True, exist_ok=True)
        page.write_text(file_page(path, kind, text, content, "../" * (len(path.parts) - 1)))
    (folder / "pipelines" / "index.md").write_text(index_page(found))
