# SPDX-License-Identifier: Apache-2.0
"""The pages of docs/, the README and the like, as they are in the repository. Their links lead to the same places."""
import json
import re
import shutil

import vocabulary
from markdown import ORPHAN, block, sections, toctree

# Captions of the navigation, and the pages under each. A page of docs/ that is not here comes last, under MORE.
GROUPS = {
    "Tutorials": [
        "tutorials/first-registration",
        "tutorials/first-hour",
        "tutorials/own-data",
        "tutorials/first-node",
        "tutorials/first-comparison",
        "tutorials/reading-a-report",
        "i-have",
        "questions",
        "faq",
    ],
    "Guides": [
        "pipeline-file",
        "running",
        "case",
        "formats",
        "choosing",
        "command-line",
        "workbench",
        "comparing",
        "verdict",
        "glossary",
        "repetition",
        "programs",
        "tracking",
        "python",
        "simulation",
        "networks",
        "nailing",
        "guidance",
    ],
    "Method": ["method", "results", "results-trust", "results-parts"],
    "Development": ["plugins", "plugin-host", "architecture", "testing", "site"],
}
# A page of these is in the navigation if it has been written. python/index is for a reference of a Python module.
REFERENCE = ["kinds/index", "commands/index", "keys/index", "pipelines/index", "cpp/index", "python/index"]
MORE = "More"
AT_TOP = ["CONTRIBUTING", "CHANGELOG"]
LINK = re.compile(r"\]\(([^)#\s]+)(#[^)\s]*)?\)")
LANGUAGES = {".cpp": "cpp", ".hpp": "cpp", ".txt": "cmake", ".yaml": "yaml", ".py": "python"}


def documents(root):
    """{page: text} of all that people wrote. The README is the page index."""
    found = {"index": (root / "README.md").read_text()}
    for name in AT_TOP:
        found[name] = (root / (name + ".md")).read_text()
    for path in sorted((root / "docs").rglob("*.md")):
        found[str(path.relative_to(root).with_suffix(""))] = path.read_text()
    return found


def groups(pages):
    """{caption: pages} in the order of the navigation, for the pages that are there."""
    found = {
        caption: ["docs/" + name for name in names if "docs/" + name in pages] for caption, names in GROUPS.items()
    }
    known = {page for names in found.values() for page in names}
    more = [page for page in pages if page.startswith("docs/") and page not in known]
    return {**found, MORE: more} if more else found


def with_links(text, page, root):
    """The text with links to folders, which have pages, and to the README, which is the page index."""

    def changed(match):
        target, anchor = match.group(1), match.group(2) or ""
        if ":" in target:
            return match.group(0)
        place = (root / page).parent / target
        if place.is_dir():
            target = target.rstrip("/") + ".md"
        elif place.suffix == ".ipynb":
            target = target.removesuffix(".ipynb") + ".md"
        elif place.name == "README.md":
            target = target.replace("README.md", "index.md")
        return "](%s%s)" % (target, anchor)

    return LINK.sub(changed, text)


def linked_places(text, page, root):
    """Files and folders of the repository that a document links to."""
    places = [(root / page).parent / target for target, _ in LINK.findall(text) if ":" not in target]
    return [place.resolve() for place in places if place.exists()]


def folder_page(folder):
    """A page with all files of a folder. Of those that are no source, it has the names."""
    parts = [ORPHAN, "# " + folder.name]
    for path in sorted(path for path in folder.iterdir() if path.is_file()):
        language = LANGUAGES.get(path.suffix)
        parts += ["## " + path.name, block(path.read_text(), language) if language else ""]
    return sections(*parts)


def notebook_page(path):
    """The cells of a notebook: text as it is, code as blocks."""
    cells = json.loads(path.read_text())["cells"]
    texts = ["".join(cell["source"]) for cell in cells]
    parts = [text if cell["cell_type"] == "markdown" else block(text, "python") for cell, text in zip(cells, texts)]
    return sections(ORPHAN, *parts)


def bring(place, root, folder):
    """Makes what a link leads to be on the site: a page for a folder or a notebook, and a copy of a file that is no
    page."""
    page = folder / place.relative_to(root).with_suffix(".md")
    page.parent.mkdir(parents=True, exist_ok=True)
    if place.is_dir():
        page.write_text(folder_page(place))
    elif place.suffix == ".ipynb":
        page.write_text(notebook_page(place))
    elif place.suffix != ".md":
        copy = folder / place.relative_to(root)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(place, copy)


def navigation(pages, folder):
    reference = [page for page in REFERENCE if (folder / (page + ".md")).exists()]
    by_caption = groups(pages)
    order = [caption for caption in ("Tutorials", "Guides") if by_caption.get(caption)]
    trees = [toctree(by_caption[caption], caption) for caption in order]
    trees.append(toctree(reference, "Reference"))
    for caption in ("Method", "Development", MORE):
        if by_caption.get(caption):
            more = AT_TOP if caption == "Development" else []
            trees.append(toctree([*by_caption[caption], *more], caption))
    return sections(*trees)


def write(catalogue, facts, folder):
    """Writes index.md and the pages of docs/, with all that they link to. Comes last, because the navigation in
    index.md has the pages that are there."""
    for page, text in facts.documents.items():
        source = "README" if page == "index" else page
        for place in linked_places(text, source, facts.root):
            bring(place, facts.root.resolve(), folder)
        text = with_links(text, source, facts.root)
        if page == "docs/vocabulary":
            text = sections(text, vocabulary.tables(catalogue.nodes))
        if page == "index":
            text = sections(text, navigation(facts.documents, folder))
        (folder / page).parent.mkdir(parents=True, exist_ok=True)
        (folder / (page + ".md")).write_text(text)
