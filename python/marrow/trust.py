# SPDX-License-Identifier: Apache-2.0
"""Modules that others could change are not imported by a node written in Python; the state of its process is kept."""
import contextlib
import os
import sys
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any, Iterator, List, Optional

from . import _core
from .errors import Error
from .installed import is_standard


class KeptState:
    """The state of the process as it must stay from one call to the next."""

    def __init__(self) -> None:
        self._before_import = ""
        self._imports = 0
        self._process = _core.ProcessState()

    def begin(self) -> None:
        """A call begins: numbers are calculated with as usual, whatever ran before."""
        self._process.begin_call()

    @contextlib.contextmanager
    def importing(self) -> Iterator[None]:
        """While a module runs for the first time. What it changes is no fault of the call, and stays."""
        if self._imports == 0:
            self._before_import = self._before_import or self._process.put_back()
        self._imports += 1
        try:
            yield
        finally:
            self._imports -= 1
            if self._imports == 0:
                self._process = _core.ProcessState()
                self.begin()

    def changed(self) -> str:
        """What the call has changed, in words; an empty text if it has left all as it was."""
        changed = self._before_import or self._process.put_back()
        self._before_import = ""
        return changed


class TrustedModules:
    """Asked first for each module. It has the other finders look, and refuses what they find in a place into which
    others may write, before it runs."""

    def __init__(self) -> None:
        self.fault = ""
        self.state: Optional[KeptState] = None  # is told of each module that runs

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> Optional[ModuleSpec]:
        for finder in sys.meta_path:
            find = getattr(finder, "find_spec", None)
            if finder is self or find is None:
                continue
            spec: Optional[ModuleSpec] = find(name, path, target)
            if spec is not None:
                self._expect_trusted(spec)
                self._tell_of(spec.loader)
                return spec
        return None

    def expect_none_refused(self) -> None:
        """A file may catch the error of an import and go on without it, but not without a word."""
        if self.fault:
            raise Error(self.fault)

    def _tell_of(self, loader: Any) -> None:
        """Has the loader say when its module runs. Loaders of the interpreter's own modules are classes, which all of
        these share; that of an archive is asked again for each module."""
        execute: Any = getattr(loader, "exec_module", None)
        if execute is None or isinstance(loader, type) or "exec_module" in getattr(loader, "__dict__", {}):
            return

        def told(module: ModuleType) -> None:
            with self.state.importing() if self.state else contextlib.nullcontext():
                execute(module)

        try:
            loader.exec_module = told
        except AttributeError:  # a loader that takes no attributes
            pass

    def _expect_trusted(self, spec: ModuleSpec) -> None:
        if not spec.has_location or not spec.origin or is_standard(spec.origin):
            return
        files = [existing(spec.origin)]
        if spec.cached and os.path.isfile(spec.cached):
            files.append(spec.cached)
        fault = untrusted_among(files)
        if fault:
            self.fault = self.fault or "module '%s' %s" % (spec.name, fault)
            raise ImportError(self.fault, name=spec.name, path=spec.origin)


def existing(path: str) -> str:
    """The archive of a module that lies in one."""
    while not os.path.exists(path):
        path = os.path.dirname(path)
    return path


def untrusted_among(files: List[str]) -> str:
    return _core.untrusted_among([os.fsencode(os.path.abspath(one)) for one in files], os.stat(sys.executable).st_uid)
