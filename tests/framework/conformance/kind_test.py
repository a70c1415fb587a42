# SPDX-License-Identifier: Apache-2.0
"""Every node of a kind passes a sample of the kind's checks; all of them with MARROW_TEST_ALL=1.

    kind_test.py KIND COUNT    COUNT: the number of checks of a sample
"""
import json
import subprocess
import sys

from harness import MARROW
from harness.sample import sample

KIND, COUNT = sys.argv[1], int(sys.argv[2])
ALWAYS = "contract"


def main():
    listed = subprocess.run([MARROW, "list", "--kinds", "--json"], stdout=subprocess.PIPE, text=True, check=True).stdout
    checks = next([check["name"] for check in kind["checks"]] for kind in json.loads(listed) if kind["name"] == KIND)
    others = [check for check in checks if check != ALWAYS]
    chosen = [ALWAYS, *sample(others, COUNT)]
    return subprocess.run([MARROW, "conformance", KIND, *("--check=" + check for check in chosen)]).returncode


if __name__ == "__main__":
    sys.exit(main())
