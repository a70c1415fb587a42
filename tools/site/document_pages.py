# SPDX-License-Identifier: Apache-2.0
"""The pages of docs/, the README and the like, as they are in the repository. Their links lead to the same places."""
import json
import re
import shutil

from markdown import ORPHAN, block, sections, toctree

# Captions of the navigation, and the pages under each. A page of docs/ that is not here comes last, under MORE.
GROUPS = {
    "Tutorials": [
        "tutorials/first-registration",
        "tutorials/own-data",
        "tutorials/first-node",
        "tutorials/first-comparison",
        "tutorials/reading-a-report",
        "faq",
    ],
    "Guides": ["case", "comparing", "python", "verdict", "repetition", "simulation", "nailing", "guidance"],
    "Method": ["method", "results"],
    "Development": ["plugins", "architecture", "testing", "site"],
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


def folder_page(folder):
    """A page with all files of an example."""
    parts = ["# " + folder.name]
    for path in sorted(folder.iterdir()):
        if path.is_file():
            parts += ["## " + path.name, block(path.read_text(), LANGUAGES.get(path.suffix, "text"))]
    return sections(*parts)


def notebook_page(path):
    """The cells of a notebook: text as it is, code as blocks."""
    cells = json.loads(path.read_text())["cells"]
    texts = ["".join(cell["source"]) for cell in cells]
    parts = [text if cell["cell_type"] == "markdown" else block(text, "python") for cell, text in zip(cells, texts)]
    return sections(*parts)


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
    """Writes index.md and the pages of docs/, with their pictures, and a page for each folder of examples. Comes last,
    because the navigation in index.md has the pages that are there."""
    for page, text in facts.documents.items():
        source = "README" if page == "index" else page
        text = with_links(text, source, facts.root)
        if page == "index":
            text = sections(text, navigation(facts.documents, folder))
        (folder / page).parent.mkdir(parents=True, exist_ok=True)
        (folder / (page + ".md")).write_text(text)
    shutil.copytree(facts.root / "docs" / "images", folder / "docs" / "images")
    for path in sorted((facts.root / "docs").rglob("*.ipynb")):
        page = folder / path.relative_to(facts.root).with_suffix(".md")
        page.parent.mkdir(parents=True, exist_ok=True)
        page.write_text(ORPHAN + notebook_page(path))
    examples = [path for path in sorted((facts.root / "docs").glob("example-*")) if path.is_dir()]
    for path in examples:
        (folder / "docs" / (path.name + ".md")).write_text(ORPHAN + folder_page(path))
