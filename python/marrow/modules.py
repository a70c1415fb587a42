# SPDX-License-Identifier: Apache-2.0
"""The files that a node written in Python depends on, and the folders in which its modules are looked for."""
import ast
import importlib.machinery
import importlib.util
import os
import pathlib
import sys
from types import CodeType, ModuleType
from typing import Any, Dict, FrozenSet, Iterable, Iterator, List, Optional, Set, Tuple

from . import _core
from .installed import is_installed, is_standard, metadata_files, setup_files, setup_folders
from .trust import existing

_STANDARD_NAMES: FrozenSet[str] = getattr(sys, "stdlib_module_names", frozenset())


class _FromSource(importlib.machinery.SourceFileLoader):
    """Compiles the text that is there now. Bytecode that was kept may be of an older text: it is told apart by size and
    second only."""

    def get_code(self, fullname: str) -> CodeType:
        return self.source_to_code(self.get_data(self.path), self.path)


def import_from_source(file: str, name: str) -> ModuleType:
    """Imports a file as the module `name`. From now on, modules are looked for in its folder first."""
    folder = str(pathlib.Path(file).parent)
    loaders = [
        (importlib.machinery.ExtensionFileLoader, importlib.machinery.EXTENSION_SUFFIXES),
        (_FromSource, importlib.machinery.SOURCE_SUFFIXES),
    ]

    def finder(path: str) -> Any:
        if os.path.isdir(path) and not is_installed(path + os.sep) and not is_standard(path + os.sep):
            return importlib.machinery.FileFinder(path, *loaders)
        raise ImportError

    sys.path_hooks.insert(0, finder)
    sys.path_importer_cache.clear()
    sys.path.insert(0, folder)
    spec = importlib.util.spec_from_loader(name, _FromSource(name, file))
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def loaded_files(file: str) -> List[str]:
    """All files besides `file` that decide what its nodes do: loaded modules and shared libraries, modules of its own
    folder that it imports when it is called, what tells the version of an installed distribution, and what sets the
    interpreter up. Of the standard library there is none, because the interpreter stands for it. A link is named as
    such: it may lead to another file later."""
    found: Set[str] = {path for path in map(os.fsdecode, _core.loaded_libraries()) if not is_standard(path)}
    found.update(setup_files())
    for name, module in list(sys.modules.items()):
        path = getattr(module, "__file__", None)
        if not isinstance(path, str) or is_standard(os.path.abspath(path)) or not os.path.isfile(existing(path)):
            continue
        found.add(existing(os.path.abspath(path)))
        found.update(metadata_files(name.partition(".")[0], os.path.abspath(path)))
    found.update(str(path) for path in _own_files(file))
    found.discard(file)
    return sorted(found)


def searched_folders(places: Dict[str, List[str]], file: str) -> List[Tuple[str, List[str]]]:
    """The folders in which modules were looked for, or will be in a call, each with the names of the modules: those
    that are not there, and those that would be another file if one appeared in the folder."""
    found: Dict[str, Set[str]] = {os.path.abspath(place): set() for place in sys.path}
    looked_for = {name: list(sys.path) for name in _STANDARD_NAMES}
    looked_for.update({name.partition(".")[0]: list(sys.path) for name in _names_in_own_files(file)})
    looked_for.update(places)
    for name, folders in looked_for.items():
        here = _place_of(name)
        for folder in [os.path.abspath(one) for one in folders] if here is not None else []:
            if not is_standard(folder + os.sep):
                found.setdefault(folder, set()).add(name.rpartition(".")[2])
            if folder == here or (name in _STANDARD_NAMES and is_standard(folder + os.sep)):
                break
    for place, name in _places_in_own_folder(file):
        found.setdefault(place, set()).add(name)
    for place, name in setup_folders():
        found.setdefault(place, set()).add(name)
    for place in _portions():
        found.setdefault(place, set()).add("__init__")
    first = [os.path.abspath(place) for place in sys.path]
    order = list(dict.fromkeys(first)) + sorted(set(found) - set(first))
    return [(place, sorted(found[place])) for place in order]


def _portions() -> Iterator[str]:
    """The folders of packages without __init__.py, which would be others if one had it."""
    for module in list(sys.modules.values()):
        if getattr(module, "__file__", None) is None:
            for folder in list(getattr(module, "__path__", None) or []):
                if isinstance(folder, str) and os.path.isdir(folder) and not is_standard(folder + os.sep):
                    yield os.path.abspath(folder)


def _place_of(name: str) -> Optional[str]:
    """The folder in which a module was found; "" if it is not loaded from one folder. None if no folder counts, because
    the module is a part of the interpreter."""
    module = sys.modules.get(name)
    if getattr(getattr(module, "__spec__", None), "origin", None) in ("built-in", "frozen"):
        return None
    if module is None and name in sys.builtin_module_names:
        return None
    path = getattr(module, "__file__", None)
    if not isinstance(path, str):
        return ""
    folder = os.path.dirname(os.path.abspath(path))
    return os.path.dirname(folder) if hasattr(module, "__path__") else folder


def _own_files(file: str) -> Iterable[pathlib.Path]:
    """Modules of the file's folder that it imports anywhere in its text, and those that these import."""
    folder = pathlib.Path(file).parent
    found: List[pathlib.Path] = []
    todo = [pathlib.Path(file)]
    while todo:
        for name in _imports(todo.pop()):
            for path in _files_of(folder, name):
                if path not in found:
                    found.append(path)
                    todo.append(path)
    return found


def _names_in_own_files(file: str) -> Set[str]:
    return {name for path in (pathlib.Path(file), *_own_files(file)) for name in _imports(path) if name}


def _places_in_own_folder(file: str) -> Iterator[Tuple[str, str]]:
    """Where the parts of packages in the file's folder are looked for, and their names."""
    for name in _names_in_own_files(file):
        place = pathlib.Path(file).parent
        for part in name.split("."):
            if not place.is_dir():
                break
            yield str(place), part
            place = place / part


def _imports(file: pathlib.Path) -> List[str]:
    try:
        tree = ast.parse(file.read_bytes())
    except (OSError, SyntaxError, ValueError):
        return []
    names = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names += [one.name for one in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            names += [base] + [base + "." + one.name if base else one.name for one in node.names]
    return names


def _files_of(folder: pathlib.Path, name: str) -> List[pathlib.Path]:
    """The files of a module and of the packages that it lies in."""
    files = []
    place = folder
    for part in filter(None, name.split(".")):
        for candidate in (place / (part + ".py"), place / part / "__init__.py"):
            if candidate.is_file():
                files.append(candidate)
        place = place / part
    return files
