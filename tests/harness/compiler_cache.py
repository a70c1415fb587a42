# SPDX-License-Identifier: Apache-2.0
"""Plugins that tests compile in each run anew come from ccache, if marrow itself is built with it."""
import os
import re
import tempfile


def use(build):
    """Makes CMake use ccache from here on, as the build folder `build` does; else changes nothing."""
    launcher = re.search(r"^CMAKE_CXX_COMPILER_LAUNCHER:\w+=(.*ccache)$", (build / "CMakeCache.txt").read_text(), re.M)
    if launcher:
        os.environ["CMAKE_CXX_COMPILER_LAUNCHER"] = launcher.group(1)
        os.environ["CCACHE_BASEDIR"] = tempfile.gettempdir()  # the folders in it have other names each time
