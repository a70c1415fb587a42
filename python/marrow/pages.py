# SPDX-License-Identifier: Apache-2.0
"""Pages that show a run or a comparison in a browser."""
import os
import pathlib
import tempfile
import webbrowser
from typing import Union

from . import program
from .comparison import Comparison
from .result import Result


def show(what: Union[Result, Comparison, str, "os.PathLike[str]"], *, open_browser: bool = True) -> pathlib.Path:
    """Writes a page with figures, pictures and a 3D view of a result, a comparison or the folder of a run, and opens it
    in a browser. A result without a folder is written to a temporary one. Returns the page's file."""
    if isinstance(what, Comparison):
        page = what.report
    else:
        if isinstance(what, Result) and what.folder is None:
            what.write(pathlib.Path(tempfile.mkdtemp(prefix="marrow-")) / "run")
        folder = what.folder if isinstance(what, Result) else pathlib.Path(what)
        page = pathlib.Path(str(folder)) / "report.html"
        program.call(["show", str(folder)])
    if open_browser:
        webbrowser.open(page.resolve().as_uri())
    return page
