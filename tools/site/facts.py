# SPDX-License-Identifier: Apache-2.0
"""What the repository tells that is not in a manifest, gathered once for all pages."""
import pathlib

import document_pages
import pipeline_pages
import sources
from markdown import plain


class Facts:
    def __init__(self, root, pictures=None):
        self.root = pathlib.Path(root)
        self.documents = document_pages.documents(self.root)
        self.comments = sources.comments_of_nodes(self.root)
        texts = {pipeline_pages.page_of(path): text for path, (_, text, _) in pipeline_pages.files(self.root).items()}
        self.uses = sources.uses_of_pipelines(texts)
        read = {page: text for page, text in self.documents.items() if page != "CHANGELOG"}
        self.mentions = sources.sections_that_mention(read)
        self.pictures = pictures or {}
        self.has_headers = True

    def picture(self, name):
        """The picture of a node with its legend, or nothing."""
        if name not in self.pictures:
            return ""
        file, legend = self.pictures[name]
        return "![%s](../pictures/%s)\n\n*%s*" % (plain(name), file, plain(legend))

    def pictures_of_kind(self, kind):
        """The pictures of a kind's nodes, side by side."""
        names = [name for name in self.pictures if name.split(".")[0] == kind]
        if not names:
            return ""
        cells = []
        for name in names:
            file = self.pictures[name][0]
            cells.append(
                "<figure><a href='../nodes/%s.html'><img src='../_images/%s' alt='%s'></a>" % (name, file, name)
            )
            cells[-1] += "<figcaption>%s</figcaption></figure>" % name
        return "<div class='pictures'>%s</div>" % "".join(cells)
