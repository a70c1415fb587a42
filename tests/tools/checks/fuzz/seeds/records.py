# SPDX-License-Identifier: Apache-2.0
"""Files that marrow itself writes and reads back: entries of the store, manifests, runs, cells."""
import json
import struct

from images import png


def u64(value):
    return struct.pack("<Q", value)


def text(value):
    return u64(len(value)) + value.encode()


def texts(values):
    return u64(len(values)) + b"".join(text(value) for value in values)


def digest(value):
    return struct.pack("<QQ", value, value + 1)


def matrix(rows, columns, values):
    return struct.pack("<qq", rows, columns) + struct.pack(f"<{len(values)}d", *values)


def vector(*values):
    return matrix(len(values), 1, values)


IDENTITY = matrix(3, 3, [1, 0, 0, 0, 1, 0, 0, 0, 1])
TRANSFORM = text("world") + text("ct") + IDENTITY + vector(1, 2, 3)
FRAME = vector(0, 0, 0) + IDENTITY
PICTURE = struct.pack("<iii", 2, 3, 0) + bytes(range(6))
CAMERA = struct.pack("<ii", 3, 2) + IDENTITY + text("camera") + text("world") + IDENTITY + vector(0, 0, 900)
GRID = struct.pack("<iii", 2, 2, 2) + vector(1, 1, 1) + vector(0, 0, 0) + IDENTITY + text("ct")
MESH = u64(3) + struct.pack("<9d", *range(9)) + u64(1) + struct.pack("<3I", 0, 1, 2) + text("ct")
SEEDS = text("distal") + u64(1) + struct.pack("<3d", 1, 2, 3) + b"\1"
VIEW = text("frontal") + PICTURE + CAMERA + struct.pack("<iii", 0, 0, 0)
POSE = TRANSFORM + FRAME + b"\1" + matrix(6, 6, [0.5] * 36) + texts(["mind the gap"])
POSE += struct.pack("<di", 0.5, 12) + u64(1) + struct.pack("<id", 3, 0.7)
METRICS = u64(2) + text("mtre_mm") + struct.pack("<d", 1.5) + text("mm") + text("n") + struct.pack("<d", 7) + text("")
SEGMENT = vector(1, 2) + vector(3, 4)
LINES = SEGMENT + SEGMENT + struct.pack("<3d", 30, 1, -2) + u64(1) + SEGMENT + SEGMENT + text("too wide")


def provenance(node="read.pose"):
    inputs = u64(1) + text("path") + text("a.yaml") + u64(1) + text("in") + digest(7)
    return text(node) + digest(5) + inputs + struct.pack("<?Qd", True, 42, 0.25) + texts(["mind the gap"])


def leaf(kind, version, size, offset, length, axis="", names=(), present=True):
    head = text(kind) + struct.pack("<iQ?", version, size, present) + digest(9)
    return head + u64(offset) + u64(length) + text(axis) + texts(names)


def entry(leaves, payload):
    """The description of an entry. The items of a list follow it."""
    key = struct.pack("<QQ", 0x0123456789ABCDEF, 0xFEDCBA9876543210)
    return key + provenance() + u64(len(leaves)) + b"".join(leaves) + u64(payload)


def store_seeds():
    volume = GRID + u64(8) + bytes(32)
    landmarks = u64(1) + text("a") + vector(1, 2, 3) + u64(1) + text("a") + text("frontal") + vector(4, 5)
    landmarks += u64(1) + text("a") + vector(6, 7, 8)
    scene = u64(1) + text("bone") + MESH + u64(1) + text("bone") + text("result") + TRANSFORM
    scene += u64(1) + text("frontal") + CAMERA + PICTURE
    landscape = u64(1) + text("axis") + text("deg") + 2 * (u64(2) + bytes(16)) + b"\1" + bytes(8)
    case = volume + texts(["d"]) + SEEDS + texts(["f"]) + VIEW + texts(["d"]) + POSE + texts(["d"]) + TRANSFORM
    edges = struct.pack("<ii", 3, 2) + u64(1) + struct.pack("<5f", 1, 2, 0, 1, 9)
    values = [PICTURE, PICTURE, volume, volume, SEEDS, MESH, CAMERA, VIEW, edges, LINES, landmarks, POSE, TRANSFORM]
    values = dict(zip("ABCDEFGHIJKLMNOPQ", values + [METRICS, scene, landscape, case]))
    result = {"v_" + letter: b"v" + letter.encode() + packed for letter, packed in values.items()}
    one = leaf("image", 1, 96, 0, 16)
    missing = leaf("pose", 2, 500, 8, 8, present=False)
    listed = [leaf("pose", 2, 500, 0, 0, "fragment", ["a", "b"], False), leaf("pose", 2, 500, 0, 8), missing]
    described = {"one": [one], "list": listed, "both": [one, *listed], "short_list": listed[:2]}
    described["wrapping"] = [leaf("image", 1, 96, 2**64 - 8, 16)]
    described["huge"] = [leaf("metrics", 1, 24, 8, 2**63)]
    for name, outputs in described.items():
        result["d_" + name] = b"d\x10" + entry(outputs, 16) + bytes(16)
    result["f_file"] = b"f" + b"marrowr2" + u64(100) + digest(1) + entry([one], 16) + bytes(16)
    return result


PORT = """{"name": "a", "help": "first", "type": %s, "optional": false, "axis": "", "figures": []}"""
KIND = """{"id": "metrics", "version": 1, "size": 24, "function": false}"""
MANIFEST = """{"marrow_manifest": 7, "library": "0123456789abcdef0123456789abcdef", "refused": "",
 "linked": [{"path": "/usr/lib/a.so", "size": 5}], "kinds": [],
 "nodes": [{"name": "test.add", "summary": "Adds", "random": true, "inputs": [PORT], "outputs": [PORT], "options": [],
   "relations": [{"type": "distinct", "names": ["text", "path"]}], "traits": ["fast"]}],
 "writers": [{"type": KIND, "extension": ".json", "help": "h"}], "checksum": "00000000000000000000000000000000"}"""
DEFAULTS = """{"boolean": true, "integer": 3, "number": 1.5, "text": "one", "path": "", "numbers": [1, 2],
 "texts": ["a"], "paths": []}"""


def manifest_seeds():
    manifest = json.loads(MANIFEST.replace("PORT", PORT % KIND).replace("KIND", KIND))
    node = manifest["nodes"][0]
    node["outputs"][0]["axis"] = "side"
    for name, value in json.loads(DEFAULTS).items():
        choices = ["one", "two"] if name == "text" else []
        option = {"name": name, "help": "h", "unit": "mm", "type": name, "required": False, "default": value}
        node["options"].append({**option, "choices": choices, "length": 0, "replaces": []})
    node["options"][2].update(minimum=0, maximum=9.5)
    invented = dict(node, options=[dict(node["options"][0], type="invented")])
    files = {"c_all": manifest, "c_refused": dict(manifest, nodes=[], refused="is no plugin"), "r_all": manifest}
    files["c_digest"] = dict(manifest, library="x" * 32)
    files["c_invented"] = dict(manifest, nodes=[invented])
    result = {name: name[:1].encode() + json.dumps(content).encode() for name, content in files.items()}
    result["r_deep"] = b"r" + b"[" * 30000
    result["r_deep_object"] = b"r" + b'{"a":' * 10000
    return result


def shared(kind, packed, items=(), names=(), axis=""):
    """Values in shared memory: the packed data, their description, and the place of the description."""

    def described(type_, axis_, names_, items_, place):
        head = (
            text(type_) + struct.pack("<iQ", 1, 8) + text(axis_) + texts(names_) + u64(len(items_)) + b"".join(items_)
        )
        return head + (b"\0" if place is None else b"\1" + u64(place[0]) + u64(place[1]))

    one = described(kind, "", [], [], (0, len(packed)))
    description = u64(1) + (described(kind, axis, names, [one] * len(names), None) if names else one)
    return packed + description + struct.pack("<QQQ", 0x31766F7272616D00, len(packed), len(description))


WORKER_LINES = """{"job": 7, "end": 3}
{"job": 7, "end": null}
{"job": 7, "failed": "why"}
{"job": 7, "failed": "", "out_of_memory": true}
{"job": 8, "end": 1}
{"job": 7, "say": "at", "place": "node 'a'"}
{"job": 7, "say": "waiting"}
{"job": 7, "say": "goes on"}
{"job": 7, "say": "progress", "fraction": 0.5, "text": "x"}
{"job": 7, "say": "at", "place": 5}
{"job": "7", "end": 1}
{}"""


def worker_seeds():
    lines = WORKER_LINES.splitlines() + ["[" * 20000, "", "null", "end {}", "at node", "\xff"]
    result = {f"l_{i}": b"l" + line.encode("latin-1") + b"\n" for i, line in enumerate(lines)}
    result["l_all"] = b"l" + "\n".join(lines[5:9] + lines[:1]).encode() + b"\n"
    for name, content in {"image": PICTURE, "pose": POSE, "mesh": MESH, "view": VIEW}.items():
        result["m_" + name] = b"m" + shared(name, content)
    result["m_list"] = b"m" + shared("pose", POSE, names=["a", "b"], axis="fragment")
    result["t_text"] = b"tabc"
    result["t_bytes"] = b't{"bytes": [255, 0, 10, 300, -1]}'
    result["t_latin"] = b"t\xff\xfe"
    return result


def name_seeds():
    names = "a final ../../x .. . a/b a_b a\\b %2F % ~ CON a.b \x1b[31m \u00e9 a\0b \u202e".split(" ")
    names += ["", "a b ", " a", "x" * 300, "y" * 201]
    everything = "\n".join(names + names[:5] + ["a (2)", "a", "a"])
    short, long = b"a\nb\na\na (2)\na", b"\xc3\xa9" * 400
    return {"all": everything.encode(), "short": short, "bytes": bytes(range(256)), "long": long}


KEY = "0123456789abcdef0123456789abcdef"
NODE = """{"id": "one", "uses": "test.constant", "status": "done", "calls": 1, "cached": 0, "start_s": 0.5,
 "seconds": 0.1, "peak_process_memory_mb": 50, "keys": {"number": "KEY"}, "items": {"number": [["", "KEY"]]},
 "functions": [], "random": false, "files": {"path": null, "other": "KEY"}, "library": "marrow_a.so", "build_id": "KEY",
 "inputs": {"a": "KEY"}}"""
RUN = """{"marrow": "0.1.0", "framework": "KEY", "pipeline": "p", "finished": "2026-01-01T00:00:00Z", "status": "done",
 "seconds": 1, "seed": 1, "threads": 2, "cpu_level": "x86-64", "inputs": {"amount": "3"},
 "overrides": ["one.value=3"], "nodes": [], "plugins": [{"file": "marrow_a.so", "build_id": "KEY", "links": []}],
 "outputs": [{"name": "sum", "files": ["outputs/sum.json"],
   "items": [["a/b", "KEY"], ["c", "00000000000000000000000000000000"]], "fault": ""}]}"""
CELL = """{"id": "a/b/0", "variant": "a", "case": "b", "start": "0", "status": "done", "tries": 1,
 "values": [1.5, null], "units": ["mm", ""], "initial_error": 3, "seconds": null, "evaluations": 100,
 "nodes": {"one": {"made": 1, "cached": 0, "seconds": 0.5}}, "key": "KEY"}"""


def run_seeds():
    node, run, cell = (json.loads(part.replace("KEY", KEY)) for part in (NODE, RUN, CELL))
    run["nodes"] = [node, dict(node, id="two", functions=["number"], reason="why")]
    pipeline = (
        "marrow: 1\nnodes:\n  one: {uses: test.constant, with: {value: 2, names: [a, [b, c]]}}\n  two:\n    uses:"
        " test.add\n    in: {a: one.number, b: [one, one]}\noutputs: {sum: two}\n"
    )
    return {
        "r_run": b"r" + json.dumps(run).encode(),
        "r_threads": b"r" + json.dumps(dict(run, threads=1e9)).encode(),
        "r_deep": b"r" + b'{"a":' * 10000,
        "c_cell": b"c" + json.dumps(cell).encode(),
        "c_failed": b"c" + json.dumps(dict(cell, status="failed", reason="crashed")).encode(),
        "c_long": b"c" + json.dumps(dict(cell, tries=10**30, evaluations=-1)).encode(),
        "p_pipeline": b"p" + pipeline.encode(),
        "i_picture": b"i" + png(8, 2),
        "i_wide": b"i" + png(16, 6),
        "i_interlaced": b"i" + png(8, interlaced=1),
    }
