# SPDX-License-Identifier: Apache-2.0
"""The files that a node written in Python depends on."""
import ast
import importlib.machinery
import importlib.util
import os
import pathlib
import sys
from types import CodeType, ModuleType
from typing import Any, Iterable, List, Set

from . import _core
from .installed import is_installed, is_standard, metadata_files, setup_files
from .trust import existing


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
