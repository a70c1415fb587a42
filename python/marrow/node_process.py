# SPDX-License-Identifier: Apache-2.0
"""Starts the process that holds the nodes of one Python file (plugin.py): python3 .../marrow/node_process.py FILE"""
import sys

if __name__ == "__main__":
    if not getattr(sys.flags, "safe_path", False):
        del sys.path[0]  # the folder of this file, whose modules are marrow's
    from marrow import plugin

    sys.exit(plugin.main(sys.argv[1:]))
