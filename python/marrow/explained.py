# SPDX-License-Identifier: Apache-2.0
"""What an exception of a node written in Python is told as."""
import os
import pathlib
import traceback

from .errors import Error


def _text_of(error: BaseException) -> str:
    try:
        return str(error).strip() or "no message"
    except Exception:  # the exception's own text is at fault
        return "no message"


def explained(error: BaseException, file: str) -> str:
    """An exception in one sentence, with the last place in the folder of the file. An Error that the node raised on
    purpose speaks for itself."""
    text = _text_of(error)
    if isinstance(error, SyntaxError) and error.filename:
        return "%s, line %s: %s: %s" % (error.filename, error.lineno, type(error).__name__, error.msg)
    folder = str(pathlib.Path(file).parent) + os.sep
    frames = [one for one in traceback.extract_tb(error.__traceback__) if one.filename.startswith(folder)]
    if not frames:
        return text if isinstance(error, Error) else "%s: %s: %s" % (file, type(error).__name__, text)
    last = frames[-1]
    if isinstance(error, Error) and last.name != "<module>":
        return text
    kind = "" if isinstance(error, Error) else type(error).__name__ + ": "
    line = " (%s)" % last.line if last.line and last.name != "<module>" else ""
    return "%s, line %s, in %s: %s%s%s" % (last.filename, last.lineno, last.name, kind, text, line)
