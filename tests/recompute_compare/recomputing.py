# SPDX-License-Identifier: Apache-2.0
"""What the tests here share."""
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(HERE.parent / "tools" / "marrow"))
sys.path.insert(0, str(HERE))
try:
    import numpy  # noqa: F401
    import scipy  # noqa: F401
except ImportError as missing:
    print("skipped: %s; install python3-scipy to recompute figures" % missing)
    sys.exit(77)

from marrow_cli import BUILD  # noqa: E402, F401
