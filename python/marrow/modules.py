# SPDX-License-Identifier: Apache-2.0
"""The files that a node written in Python depends on."""
import ast
import importlib.machinery
import importlib.metadata
import importlib.util
import os
import pathlib
import sys
import sysconfig
from types import CodeType, ModuleType
from typing import Any, Dict, Iterator, List, Optional, Set

from . import _core

_STANDARD = [os.path.realpath(sysconfig.get_paths()[key]) for key in ("stdlib", "platstdlib")]


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
        if (path + os.sep).startswith(folder + os.sep):
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
    """All files besides `file` that decide what its nodes do: loaded modules, and modules of its own folder that it
    imports when it is called. Of an installed distribution, the files that tell its version. The standard library is
    left out, because the interpreter stands for it."""
    found: Set[str] = {os.path.realpath(str(_core.__file__))}
    for name, module in list(sys.modules.items()):
        path = getattr(module, "__file__", None)
        if not isinstance(path, str) or not os.path.isfile(path):
            continue
        real = os.path.realpath(path)
        if _is_installed(real):
            found.update(_version_files(name.partition(".")[0]))
        elif not _is_standard(real):
            found.add(real)
    folder = pathlib.Path(file).parent
    for path in [file, *sorted(found)]:
        if path.endswith(".py") and folder in pathlib.Path(path).parents:
            found.update(_imported_from(pathlib.Path(path), folder, found))
    found.discard(file)
    return sorted(found)


def _is_installed(path: str) -> bool:
    return "/dist-packages/" in path or "/site-packages/" in path


def _is_standard(path: str) -> bool:
    return any(path.startswith(folder + os.sep) for folder in _STANDARD)


_versions: Dict[str, List[str]] = {}


def _version_files(package: str) -> List[str]:
    """The package's own file and the metadata of its distribution, whose text and name hold the version."""
    if package not in _versions:
        files = [getattr(sys.modules.get(package), "__file__", None), _metadata_file(package)]
        _versions[package] = [os.path.realpath(one) for one in files if one and os.path.isfile(one)]
    return _versions[package]


def _metadata_file(package: str) -> Optional[str]:
    try:
        distribution: Any = importlib.metadata.distribution(package)
    except importlib.metadata.PackageNotFoundError:
        return None
    folder = getattr(distribution, "_path", None)
    if folder is None:
        return None
    for name in ("METADATA", "PKG-INFO"):
        if (pathlib.Path(folder) / name).is_file():
            return str(pathlib.Path(folder) / name)
    return str(folder)


def _imported_from(file: pathlib.Path, folder: pathlib.Path, known: Set[str]) -> Set[str]:
    """Modules of the folder that the text of a file imports anywhere, and those that these import."""
    found: Set[str] = set()
    todo = [file]
    while todo:
        try:
            tree = ast.parse(todo.pop().read_bytes())
        except (OSError, SyntaxError, ValueError):
            continue
        for name in _imports(tree):
            for path in _files_of(folder, name):
                real = os.path.realpath(path)
                if real not in known and real not in found:
                    found.add(real)
                    todo.append(path)
    return found


def _imports(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (one.name for one in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            yield base
            yield from (base + "." + one.name if base else one.name for one in node.names)


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
