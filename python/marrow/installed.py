# SPDX-License-Identifier: Apache-2.0
"""What is installed for the interpreter: its standard library, distributions, and what sets its search path up."""
import os
import re
import site
import sys
import sysconfig
from typing import Dict, List, Set

_STANDARD_PATHS = [sysconfig.get_paths()[key] for key in ("stdlib", "platstdlib")]
_STANDARD = {folder for path in _STANDARD_PATHS for folder in (os.path.abspath(path), os.path.realpath(path))}


def is_installed(path: str) -> bool:
    """Whether an installer put the file there, and not a person."""
    return "/dist-packages/" in path or "/site-packages/" in path


def is_standard(path: str) -> bool:
    """Whether the file is one of the standard library."""
    return not is_installed(path) and any(path.startswith(folder + os.sep) for folder in _STANDARD)


_owners: Dict[str, Dict[str, Set[str]]] = {}  # by the folder of the distributions, then by the package


def metadata_files(package: str, file: str) -> Set[str]:
    """The files that tell the version of the distribution to which a package belongs. Its name may be another one, as
    Pillow's is, whose package is PIL."""
    folder = re.match(r".*/(?:dist|site)-packages(?=/)", file)
    if folder is None:
        return set()
    if folder[0] not in _owners:
        _owners[folder[0]] = _owners_in(folder[0])
    return _owners[folder[0]].get(package, set())


def _owners_in(folder: str) -> Dict[str, Set[str]]:
    owners: Dict[str, Set[str]] = {}
    for name in os.listdir(folder):
        if name.endswith((".dist-info", ".egg-info")):
            place = os.path.join(folder, name)
            told = [os.path.join(place, one) for one in ("METADATA", "PKG-INFO")]
            for package in _packages_of(place, name):
                owners.setdefault(package, set()).update(filter(os.path.isfile, [*told, place]))
    return owners


def _packages_of(place: str, name: str) -> Set[str]:
    """The packages of a distribution: what its list of them says, else its list of files, else its own name."""
    listed = _lines(os.path.join(place, "top_level.txt"))
    if not listed:
        listed = [line.partition(",")[0].partition("/")[0] for line in _lines(os.path.join(place, "RECORD"))]
    return {line.partition(".")[0] for line in listed} or {re.split("-[0-9]", name)[0].replace("-", "_")}


def _lines(file: str) -> List[str]:
    try:
        with open(file, encoding="utf-8", errors="surrogateescape") as stream:
            return [line.strip() for line in stream if line.strip()]
    except OSError:
        return []


def _site_folders() -> List[str]:
    folders = [*site.getsitepackages()]
    if site.ENABLE_USER_SITE:
        folders.append(site.getusersitepackages())
    return [os.path.abspath(folder) for folder in folders]


def setup_files() -> List[str]:
    """The files that decide where modules are looked for."""
    found = []
    for folder in _site_folders():
        if os.path.isdir(folder):
            found += [os.path.join(folder, name) for name in os.listdir(folder) if name.endswith(".pth")]
    settings = [os.path.join(folder, "pyvenv.cfg") for folder in _folders_of_interpreter()]
    return [path for path in found + settings if os.path.isfile(path)]


def _folders_of_interpreter() -> List[str]:
    folder = os.path.dirname(os.path.abspath(sys.executable))
    return [folder, os.path.dirname(folder)]
