# SPDX-License-Identifier: Apache-2.0
"""The Python reference: what the package marrow offers, from its own doc strings. It is asked in a process of
Debian's python3, for which the package is built. The nodes have pages of their own."""
import json
import os
import subprocess

from markdown import block, plain, section, sections, table
from node_pages import with_code

ASK = r"""
import inspect, json, marrow
def doc(thing):
    return inspect.getdoc(thing) or ""
def signature(thing):
    try:
        return str(inspect.signature(thing))
    except (TypeError, ValueError):
        return ""
def member(name, thing):
    called = callable(thing) and not isinstance(thing, property)
    return {"name": name, "doc": doc(thing), "is_called": called, "signature": signature(thing) if called else ""}
told = []
for name in marrow.__all__:
    thing = getattr(marrow, name)
    if inspect.ismodule(thing):
        continue
    entry = member(name, thing)
    if inspect.isclass(thing):
        entry["init"] = doc(thing.__init__)
        own = [key for base in thing.__mro__ if base.__module__.startswith("marrow") for key in vars(base)]
        entry["members"] = [member(key, inspect.getattr_static(thing, key)) for key in dict.fromkeys(own)
                            if not key.startswith("_") and not isinstance(inspect.getattr_static(thing, key), str)]
    told.append(entry)
print(json.dumps(told))
"""


def asked(package):
    """What the package says of itself; nothing if it is not built."""
    if not (package / "marrow").is_dir():
        return []
    environment = {**os.environ, "PYTHONPATH": str(package), "PYTHONDONTWRITEBYTECODE": "1"}
    command = ["/usr/bin/python3", "-c", ASK]
    return json.loads(subprocess.run(command, env=environment, stdout=subprocess.PIPE, check=True).stdout)


def text_of(doc):
    """A doc string as Markdown: paragraphs as they are, lines that are examples as code."""
    parts = []
    for paragraph in doc.split("\n\n"):
        is_code = all(line.startswith(" ") or " = " in line or line.startswith("r[") for line in paragraph.splitlines())
        parts.append(block(paragraph, "python") if is_code and paragraph else with_code(" ".join(paragraph.split())))
    return sections(*parts)


def call_of(entry):
    """How a function or a class is called, and what its doc string adds. pybind11 puts the first into the second."""
    doc = entry.get("init", "") if "init" in entry else entry["doc"]
    first, _, rest = doc.partition("\n")
    if first.startswith((entry["name"] + "(", "__init__(")):
        arguments = first[first.index("(") :].replace("self: marrow._core.%s, " % entry["name"], "")
        return entry["name"] + arguments.replace("marrow._core.", "").replace(" -> None", ""), rest.strip()
    is_made_by_people = entry["signature"] and not doc.startswith("Initialize self")
    return entry["name"] + entry["signature"] if is_made_by_people else "", "" if "init" in entry else doc


def member_row(one):
    name, doc = one["name"], one["doc"]
    first, _, rest = doc.partition("\n")
    if one["is_called"]:
        name += "()"
        doc = rest.strip() if first.startswith(one["name"] + "(") else doc
    return ["`%s`" % name, with_code(" ".join(doc.split()))]


def entry_text(entry):
    call, more = call_of(entry)
    parts = ["## " + plain(entry["name"]), block(call, "python") if call else ""]
    if "members" in entry:
        parts += [text_of(entry["doc"]), text_of(more) if not more.startswith("Initialize self") else ""]
        parts.append(table(["member", "what it is"], [member_row(one) for one in entry["members"]]))
    else:
        parts.append(text_of(more or entry["doc"]))
    return sections(*parts)


def write(catalogue, facts, folder):
    """Writes python/index.md, if the package is built."""
    told = asked(facts.python_package)
    if not told:
        return
    intro = (
        "[Python](../docs/python.md) is the guide. Each [node](../kinds/index.md) is a function of `marrow.KIND`, too."
    )
    (folder / "python").mkdir()
    (folder / "python" / "index.md").write_text(
        sections("# Python reference", intro, *[entry_text(entry) for entry in told])
    )
