# SPDX-License-Identifier: Apache-2.0
"""Processes of the machine."""
import pathlib
import re


def has_processes(user):
    """Whether a process of this user has not ended. All of them count for the user's limit."""
    for status in pathlib.Path("/proc").glob("[0-9]*/status"):
        try:
            if re.search(r"^Uid:\t%d\t" % user, status.read_text(), re.MULTILINE):
                return True
        except OSError:  # it has ended
            pass
    return False
