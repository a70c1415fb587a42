# SPDX-License-Identifier: Apache-2.0
"""A page for each kind of file that people write: every key of pipelines, experiments and cases, from the schemas."""
import json

from markdown import code, entry, plain, sections, table, toctree

# What stands for names that are free: `nodes.NODE.uses`.
FREE = {"nodes": "NODE", "inputs": "INPUT", "fragments": "FRAGMENT", "outputs": "OUTPUT", "success": "FIGURE"}
FREE.update({"variants": "VARIANT", "set": "CHANGE", "draw": "INPUT", "matrix": "CHANGE", "carry": "NODE"})
ABOUT = {
    "pipeline": ("Keys of a pipeline", "`marrow schema` prints this schema with all nodes and their options."),
    "experiment": (
        "Keys of an experiment",
        "[Comparing variants](../docs/comparing.md) explains them with an example.",
    ),
    "case": ("Keys of a case", "[A case](../docs/case.md) explains them with an example."),
}


class Schema:
    """The keys of a JSON Schema, each with what it says of their values."""

    def __init__(self, schema):
        self.definitions = schema.get("definitions", {})
        self.keys = {}
        self._read(schema, "", ())
        self._demand(self._resolved(schema.get("else", {})), "")

    def _resolved(self, schema):
        """The schema with what it refers to. Its own words take precedence."""
        if "$ref" not in schema:
            return schema
        return {**self._resolved(self.definitions[schema["$ref"].split("/")[-1]]), **schema}

    def _alternatives(self, schema):
        """All forms that a value may have."""
        schema = self._resolved(schema)
        forms = [schema]
        for word in ("anyOf", "oneOf", "allOf"):
            for other in schema.get(word, []):
                if "if" not in other:
                    forms += self._alternatives({k: v for k, v in other.items() if k not in ("$schema",)})
        return forms

    def _read(self, schema, path, seen):
        reference = schema.get("$ref")
        if reference in seen:
            return
        seen = (*seen, reference) if reference else seen
        for form in self._alternatives(schema):
            required = form.get("required", [])
            for name, value in form.get("properties", {}).items():
                self._enter("%s.%s" % (path, name) if path else name, value, name in required, seen)
            free = form.get("additionalProperties")
            if isinstance(free, dict):
                self._read(free, "%s.%s" % (path, FREE.get(path.split(".")[-1], "NAME")), seen)
            if isinstance(form.get("items"), dict):
                self._read(form["items"], path, seen)

    def _demand(self, whole, path):
        """Keys that a file must have if it extends no other one."""
        for name in whole.get("required", []):
            self.keys[path + name]["required"] = True
        for name, inner in whole.get("properties", {}).items():
            self._demand(inner, path + name + ".")

    def _enter(self, path, value, required, seen):
        forms = [form for form in self._alternatives(value) if form]
        if path not in self.keys:
            told = [form["description"] for form in forms if "description" in form][:1]
            self.keys[path] = {"told": told[0] if told else "", "value": value_text(forms), "required": required}
        self._read(value, path, seen)


def form_text(form):
    if "const" in form:
        return json.dumps(form["const"])
    if "enum" in form:
        return "one of: " + ", ".join(json.dumps(one) if not isinstance(one, str) else one for one in form["enum"])
    kind = form.get("type")
    if kind is None:
        return ""
    names = {"object": "map", "array": "list", "string": "text", "boolean": "true or false", "null": "nothing"}
    text = " or ".join(names.get(one, one) for one in ([kind] if isinstance(kind, str) else kind))
    if "minimum" in form and "maximum" in form:
        return "%s, %g to %g" % (text, form["minimum"], form["maximum"])
    if "minimum" in form:
        return "%s, at least %g" % (text, form["minimum"])
    if kind == "array" and form.get("minItems") and form.get("minItems") == form.get("maxItems"):
        return "%s of %d" % (text, form["minItems"])
    return text


def value_text(forms):
    """What a value may be, in words."""
    words = []
    for form in forms:
        if len(form.get("oneOf", [])) > 20:
            return "text"
        if form_text(form) and form_text(form) not in words:
            words.append(form_text(form))
    default = [json.dumps(form["default"]).strip('"') for form in forms if "default" in form]
    return " or ".join(words) + ("; default " + default[0] if default else "")


def key_page(name, schema):
    title, more = ABOUT[name]
    entries = []
    for path, key in Schema(schema).keys.items():
        told = "; ".join(part for part in (key["value"], "must be given" if key["required"] else "") if part)
        entries.append(entry("file-key", "%s: %s" % (name, path), told, plain(key["told"])))
    example = ""
    if name == "pipeline":
        example = "Options under `with` are those of the node: [Kinds and nodes](../kinds/index.md)."
    return sections("# " + title, plain(schema.get("description", "")), more, example, *entries)


def schemas(catalogue, root):
    """{name: schema} of all files that people write."""
    found = {"pipeline": catalogue.schema()}
    for name in ("experiment", "case"):
        found[name] = json.loads((root / "schemas" / (name + ".schema.json")).read_text())
    return found


def write(catalogue, facts, folder):
    """Writes keys/NAME.md for each schema, and keys/index.md."""
    (folder / "keys").mkdir(parents=True)
    rows = []
    for name, schema in schemas(catalogue, facts.root).items():
        (folder / "keys" / (name + ".md")).write_text(key_page(name, schema))
        rows.append(["[%s](%s.md)" % (ABOUT[name][0], name), len(Schema(schema).keys), code(name + ".schema.json")])
    text = "Editors complete and check these files by the schemas in `schemas/`."
    page = sections("# Keys of files", text, table(["file", "keys", "schema"], rows), toctree(ABOUT))
    (folder / "keys" / "index.md").write_text(page)
