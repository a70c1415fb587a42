# SPDX-License-Identifier: Apache-2.0
"""The documentation site: everything that marrow has is on it, every link leads somewhere, and its search finds."""
import json
import os
import pathlib
import re
import subprocess
import sys
import zlib

from harness import BUILD, MARROW, SOURCE, TEST_PLUGINS
from harness.program import Case, main
from harness.shipped import shipped

LINK = re.compile(r'<(?:a|img|link|script)\b[^>]*?\b(?:href|src)="([^"#]*)(?:#([^"]*))?"')
ID = re.compile(r'\bid="([^"]+)"')
MISSING_PACKAGES = 77
ASKED = re.split(
    r",\s+",
    """one view, batch patients, CSV, units, label map, cite, GPU, Windows, upgrade, uninstall, memory, log level,
threads, exit codes, troubleshooting""",
)
# Nodes of other libraries have their pages, too.
os.environ["MARROW_PLUGIN_PATH"] = str(TEST_PLUGINS)


def told(*arguments):
    return subprocess.run([MARROW, *arguments], capture_output=True, text=True, check=True).stdout


def has_packages():
    command = ["/usr/bin/python3", "-c", "import sphinx, myst_parser, furo"]
    return subprocess.run(command, stderr=subprocess.DEVNULL).returncode == 0


def entries_of(site):
    """{role: names} of what has a link of its own, from the site's inventory."""
    data = (site / "objects.inv").read_bytes()
    for _ in range(4):
        data = data[data.index(b"\n") + 1 :]
    found = {}
    for line in zlib.decompress(data).decode().splitlines():
        name, role = re.match(r"(.+?) (\S+:\S+) -?\d+ ", line).groups()
        found.setdefault(role, set()).add(name)
    return found


def keys_of(schema, definitions, path=()):
    """All keys that a schema names, as (key above it in the file, key)."""
    if isinstance(schema, list):
        return set().union(*(keys_of(one, definitions, path) for one in schema))
    if not isinstance(schema, dict):
        return set()
    found = set()
    for word, value in schema.items():
        if word == "properties":
            for name, inner in value.items():
                found |= {(path[-1] if path else "", name)} | keys_of(inner, definitions, (*path, name))
        elif word == "$ref" and value not in path:
            found |= keys_of(definitions[value.split("/")[-1]], definitions, (value, *path))
        elif word in ("anyOf", "oneOf", "allOf", "additionalProperties", "items"):
            found |= keys_of([one for one in value if "if" not in one] if word == "allOf" else value, definitions, path)
    return found


class Site(Case):
    @classmethod
    def setUpClass(cls):
        cls.site = cls.shared_folder() / "site"
        command = [SOURCE / "tools" / "docs", "--build", BUILD, "--out", cls.site, "--without-pictures"]
        cls.made = subprocess.run(command, capture_output=True, text=True)
        print(cls.made.stdout + cls.made.stderr)
        assert cls.made.returncode == 0, "the site could not be built"
        cls.pages = {path.relative_to(cls.site): path.read_text() for path in cls.site.rglob("*.html")}
        cls.entries = entries_of(cls.site)

    def page(self, name):
        self.assertIn(pathlib.Path(name), self.pages)
        return self.pages[pathlib.Path(name)]

    def test_every_node_option_and_port_has_its_place(self):
        nodes = json.loads(told("list", "--json"))
        options = set()
        for node in nodes:
            page = self.page("nodes/%s.html" % node["name"])
            for port in node["inputs"] + node["outputs"]:
                self.assertIn('<span class="pre">%s</span>' % port["name"], page, node["name"])
            options |= {"%s.%s" % (node["name"], option["name"]) for option in node["options"]}
        self.assertEqual(self.entries["std:node-option"], options)
        self.assertIn("test.add", [node["name"] for node in nodes], "a node of another library")
        print("%d nodes and %d options" % (len(nodes), len(options)))

    def test_every_kind_lists_its_nodes(self):
        for kind in json.loads(told("list", "--kinds", "--json")):
            page = self.page("kinds/%s.html" % kind["name"])
            for node in json.loads(told("list", "--json")):
                if node["name"].split(".")[0] == kind["name"]:
                    self.assertIn("../nodes/%s.html" % node["name"], page)
            for part in kind["checks"] + kind["traits"]:
                self.assertIn('<span class="pre">%s</span>' % part["name"], page)

    def test_every_command_and_option_of_it_has_its_place(self):
        found, waiting = set(), [[]]
        while waiting:
            words = waiting.pop()
            part = ""
            for line in told(*words, "--help").splitlines():
                part = line[:-1] if line.endswith(":") else part
                match = re.match(r"  (\S+)", line)
                if match and not line.startswith("   ") and part == "Subcommands":
                    waiting.append([*words, match.group(1)])
                    self.page("commands/%s.html" % "-".join(waiting[-1]))
                elif match and not line.startswith("   ") and words and part in ("Options", "Positionals"):
                    name = match.group(1).split(",")[-1].split("=")[0]
                    found.add(" ".join([*words, name]))
        self.assertGreater(len(found), 50)
        self.assertEqual(self.entries["std:command-option"], found)

    def test_every_key_of_a_file_has_its_place(self):
        schemas = {"pipeline": json.loads(told("schema"))}
        for name in ("experiment", "case"):
            schemas[name] = json.loads((SOURCE / "schemas" / (name + ".schema.json")).read_text())
        for name, schema in schemas.items():
            keys = keys_of(schema, schema.get("definitions", {}))
            entries = {entry.split(": ")[1] for entry in self.entries["std:file-key"] if entry.startswith(name + ":")}
            last = {entry.split(".")[-1] for entry in entries}
            self.assertEqual({key for _, key in keys} - last, set(), name)
            self.assertGreaterEqual(len(entries), len(keys), name)
            without_text = re.findall(
                r'class="sig-name[^>]*><span class="pre">([^<]+)<(?:(?!</dt>).)*</dt>\s*<dd></dd>',
                self.page("keys/%s.html" % name),
                re.S,
            )
            self.assertEqual(without_text, [], name)
            print("%s: %d keys" % (name, len(entries)))

    def test_every_document_pipeline_and_header_has_its_page(self):
        for path in (SOURCE / "docs").rglob("*.md"):
            self.page(path.relative_to(SOURCE).with_suffix(".html"))
        for path in shipped():
            self.page(path.relative_to(SOURCE).with_suffix(".html"))
        headers = SOURCE / "framework" / "include" / "marrow"
        for path in headers.rglob("*.hpp"):
            self.page("cpp" / path.relative_to(headers).with_suffix(".html"))

    def test_every_link_leads_somewhere(self):
        ids = {path: set(ID.findall(text)) for path, text in self.pages.items()}
        count, broken = 0, []
        for page, text in self.pages.items():
            for target, anchor in LINK.findall(text):
                if ":" in target or target.startswith("data"):
                    continue
                count += 1
                path = (self.site / page).parent / target.split("?")[0] if target else self.site / page
                path = pathlib.Path(path).resolve()
                if not path.is_file():
                    broken.append("%s: there is no %s" % (page, target))
                elif anchor and path.suffix == ".html" and anchor not in ids[path.relative_to(self.site)]:
                    broken.append("%s: %s has no #%s" % (page, target or page, anchor))
        self.assertGreater(count, 10000)
        self.assertEqual(broken, [])

    def test_nothing_is_loaded_from_elsewhere(self):
        for page, text in self.pages.items():
            loaded = re.findall(r'<(?:script|img|link)\b[^>]*?(?:src|href)="(https?:[^"]*)"', text)
            self.assertEqual(loaded, [], str(page))

    def test_the_search_finds_what_people_ask(self):
        from sphinx.search.en import SearchEnglish

        text = (self.site / "searchindex.js").read_text()
        index = json.loads(text[text.index("(") + 1 : text.rindex(")")])

        def pages_with(word):
            places = [index["terms"].get(word, []), index["titleterms"].get(word, [])]
            numbers = [number for one in places for number in (one if isinstance(one, list) else [one])]
            return {index["docnames"][number] for number in numbers}

        # What people look for. A page counts if it has all words, as the browser's search has it.
        stem = SearchEnglish({}).stem
        for words in ASKED:
            pages = set.intersection(*(pages_with(stem(word.lower())) for word in words.split()))
            self.assertTrue({"docs/questions", "docs/running"} & pages, words)
        self.assertIn("nodes/camera.bead_board", pages_with("pincushion"))
        self.assertIn("docs/case", pages_with("pincushion"))
        self.assertEqual(pages_with("pincushionn"), set())


if __name__ == "__main__":
    if not has_packages():
        print("skipped: the site needs the packages python3-sphinx, python3-myst-parser and furo")
        sys.exit(MISSING_PACKAGES)
    main()
