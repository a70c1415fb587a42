# SPDX-License-Identifier: Apache-2.0
"""How Sphinx makes the site. tools/docs writes the pages first."""
import pathlib
import sys

from sphinx.search.en import SearchEnglish

sys.path.insert(0, str(pathlib.Path(__file__).parent))

project = "marrow"
extensions = ["myst_parser", "names"]
myst_heading_anchors = 4
smartquotes = False
highlight_language = "text"
html_theme = "furo"
html_title = "marrow"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_show_copyright = False
html_show_sphinx = False


class Search(SearchEnglish):
    """Finds "one view": the stem of "one" is "on", which is left out of the index otherwise, but is searched for."""

    stopwords = SearchEnglish.stopwords - {"on"}


def setup(app):
    app.add_search_language(Search)
