# SPDX-License-Identifier: Apache-2.0
"""Every node of a kind passes a sample of the kind's checks; all of them with MARROW_TEST_ALL=1.

    kind_test.py BUILD KIND COUNT    COUNT: the number of checks of a sample
"""
import json
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from sample import sample  # noqa: E402

MARROW = pathlib.Path(sys.argv[1]) / "bin" / "marrow"
KIND, COUNT = sys.argv[2], int(sys.argv[3])
ALWAYS = "contract"


def main():
    listed = subprocess.run([MARROW, "list", "--kinds", "--json"], stdout=subprocess.PIPE, text=True, check=True).stdout
    checks = next([check["name"] for check in kind["checks"]] for kind in json.loads(listed) if kind["name"] == KIND)
    others = [check for check in checks if check != ALWAYS]
    chosen = [ALWAYS, *sample(others, COUNT)]
    return subprocess.run([MARROW, "conformance", KIND, *("--check=" + check for check in chosen)]).returncode


if __name__ == "__main__":
    sys.exit(main())
