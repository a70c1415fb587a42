# SPDX-License-Identifier: Apache-2.0
"""What the repository tells that is not in a manifest, gathered once for all pages."""
import pathlib

import document_pages
import pipeline_pages
import sources
from markdown import plain

FIGURE = (
    "<figure><a href='../nodes/{name}.html'><img src='../_images/{file}' alt='{name}'></a>"
    "<figcaption>{name}</figcaption></figure>"
)


class Facts:
    """`pictures` are {node: (file, legend, whether it is much wider than high)}. `python_package` is the folder in
    which the package marrow is, if it was built."""

    def __init__(self, root, python_package, pictures=None):
        self.root = pathlib.Path(root)
        self.python_package = pathlib.Path(python_package)
        self.documents = document_pages.documents(self.root)
        self.comments = sources.comments_of_nodes(self.root)
        texts = {pipeline_pages.page_of(path): text for path, (_, text, _) in pipeline_pages.files(self.root).items()}
        self.uses = sources.uses_of_pipelines(texts)
        read = {page: text for page, text in self.documents.items() if page != "CHANGELOG"}
        self.mentions = sources.sections_that_mention(read)
        self.pictures = pictures or {}

    def picture(self, name):
        """The picture of a node with its legend, or nothing."""
        if name not in self.pictures:
            return ""
        file, legend, _ = self.pictures[name]
        return "![%s](../pictures/%s)\n\n*%s*" % (plain(name), file, plain(legend))

    def pictures_of_kind(self, kind):
        """The pictures of a kind's nodes, side by side."""
        names = sorted(name for name in self.pictures if name.split(".")[0] == kind)
        figures = "".join(FIGURE.format(name=name, file=self.pictures[name][0]) for name in names)
        is_wide = any(self.pictures[name][2] for name in names)
        return "<div class='pictures%s'>%s</div>" % (" wide" if is_wide else "", figures) if names else ""
