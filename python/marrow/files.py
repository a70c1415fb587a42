# SPDX-License-Identifier: Apache-2.0
"""Single values in files: written as a run writes them, read by the nodes of the kind `read`."""
import os
import pathlib
import re
import tempfile
from typing import Any, Optional, Union

from . import _core, nodes
from .errors import Error
from .items import Items


# The node that reads a file, by the end of its name. Others say it themselves, or the caller does.
READERS = {
    "volume": (".mha", ".mhd", ".nrrd", ".nhdr", ".nii", ".nii.gz"),
    "mesh": (".ply", ".stl", ".obj", ".vtp"),
    "image": (".png", ".jpg", ".jpeg", ".tif", ".tiff"),
    "pose": (".tfm",),
}
_FORMAT = re.compile(rb"(?:^|[\r\n])marrow-([a-z]+) ?:")  # the first key of marrow's own files
_Path = Union[str, "os.PathLike[str]"]


def save(value: Any, path: _Path) -> pathlib.Path:
    """Writes one value into a file, in the format in which a run writes it. Without an end the name gets that of the
    format. An existing file is replaced; an existing folder is not. Returns the path."""
    if isinstance(value, (Items, dict, list, tuple)):
        raise Error("save takes one value, got a list; save its items one by one")
    file, end = pathlib.Path(path), _core.extension_of(value)
    if end and not file.suffix:
        file = file.with_name(file.name + end)
    if not file.name.endswith(end):
        own = "%s: a value of the type %s is written as %s" % (file, value.type, end)
        raise Error(own + "; the nodes of the kind write make values for other formats")
    if not file.absolute().parent.is_dir():
        raise Error("%s: there is no such folder; make it first" % file.absolute().parent)
    if file.is_dir():
        raise Error("%s: it is there already; remove it, or name another place" % file)
    with tempfile.TemporaryDirectory(prefix=".tmp-", dir=file.absolute().parent) as unfinished:
        made = pathlib.Path(unfinished) / file.name
        _core.write_value(value, str(made))
        os.replace(made, file)
    return file


def load(path: _Path, reader: Optional[str] = None) -> Any:
    """Reads one value from a file or a folder, by the node of the kind `read` that fits. `reader` names another one, as
    "view". Options of nodes are given to the nodes themselves: marrow.read.mesh(path=..., scale=10)."""
    name = reader or _reader_of(pathlib.Path(path))
    if "read." + name not in _core.node_names():
        known = [node[len("read.") :] for node in _core.node_names() if node.startswith("read.")]
        raise Error("there is no node read.%s; %s" % (name, _core.suggestion(name, known)))
    return getattr(nodes.read, name)(path=path)


def unpickled(type: str, version: int, size: int, packed: bytes) -> Any:
    """A value from what pickle has kept of it. pickle finds it by its name, as it finds no function in C++."""
    return _core.unpickled(type, version, size, packed)


def _reader_of(path: pathlib.Path) -> str:
    if path.is_dir():
        return "case" if (path / "case.yaml").is_file() else "volume"
    if not path.is_file():
        raise Error("%s: there is no such file" % path)
    for name, ends in READERS.items():
        if path.name.lower().endswith(ends):
            return name
    with open(path, "rb") as file:
        found = _FORMAT.search(file.read(1 << 16))
    if found:
        return found.group(1).decode()
    raise Error(
        "%s: its name and its first lines do not say what it holds; name the node that reads it, as reader='view'"
        % path
    )
