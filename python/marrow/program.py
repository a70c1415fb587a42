# SPDX-License-Identifier: Apache-2.0
"""Calls marrow's program, for what is not in the framework's library: the processes of a comparison, and pages."""
import pathlib
import shutil
import signal
import subprocess
import sys
from typing import List

from . import _core
from .errors import Error


def path() -> pathlib.Path:
    """The program that was installed with this package. Raises Error if there is none."""
    library = pathlib.Path(_core.framework_file()).resolve()
    for folder in list(library.parents)[1:3]:  # PREFIX/lib or PREFIX/lib/MACHINE
        if (folder / "bin" / "marrow").is_file():
            return folder / "bin" / "marrow"
    found = shutil.which("marrow")
    if found is None:
        raise Error("the program marrow is not there; install the package marrow, or build the target marrow_cli")
    return pathlib.Path(found)


def call(arguments: List[str], progress: bool = False) -> None:
    """Runs the program and waits for its end. Its messages go to sys.stderr with `progress`. Ctrl-C stops it and raises
    KeyboardInterrupt. Raises Error with its messages if it fails."""
    with subprocess.Popen(
        [str(path()), *arguments],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        start_new_session=True,  # so that Ctrl-C reaches it once, from here
    ) as process:
        said: List[str] = []
        try:
            for line in process.stderr or ():
                said.append(line)
                if progress:
                    sys.stderr.write(line)
            process.wait()
        except KeyboardInterrupt:
            process.send_signal(signal.SIGINT)
            process.wait()
            raise
    if process.returncode not in (0, 130):
        raise Error("".join(said).strip() or "marrow %s ended with %d" % (arguments[0], process.returncode))
    if process.returncode == 130:
        raise KeyboardInterrupt
