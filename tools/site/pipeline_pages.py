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
    return "pipeline" if "marrow" in document else "experiment" if "experiment" in document else ""


def merged(old, new):
    """A map with another put over it, down to the last entry; None removes one."""
    if not isinstance(old, dict) or not isinstance(new, dict):
        return new
    names = list(old) + [name for name in new if name not in old]
    kept = [name for name in names if name not in new or new[name] is not None]
    return {name: merged(old.get(name), new[name]) if name in new else old[name] for name in kept}


def whole(path):
    """The content of a file with that of the files that it extends."""
    content = yaml.safe_load(path.read_text())
    if not kind_of(content) or "extends" not in content:
        return content
    return merged(whole(path.parent / content["extends"]), content)


def files(root):
    """{path from the root: (kind, text, content)} of pipelines and experiments."""
    found = {}
    for path in sorted((root / "pipelines").rglob("*.yaml")):
        content = whole(path)
        if kind_of(content):
            found[path.relative_to(root)] = (kind_of(content), path.read_text(), content)
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
    extended = "It says what differs from %s." % code(content["extends"]) if "extends" in content else ""
    outputs = content.get("outputs") if kind == "pipeline" else None
    return sections(
        ORPHAN,
        "# " + path.name,
        plain(content.get("help", "")),
        pipeline,
        extended,
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
