# SPDX-License-Identifier: Apache-2.0
"""The blocks of code in docs/ and the README: pipelines, experiments and files of cases are checked by the program,
commands by what they name, and C++ is compiled. What needs data that are not there, or takes long, is named as not run.
tutorials_test.py runs the blocks of the tutorials."""
import os
import re
import shlex
import shutil
import unittest

import yaml

from documents import BUILD, IS_SANITIZED, MARROW, SOURCE, Documents, blocks, main

# A word in capitals stands for what the reader has: FOLDER, FILE, NODE. So do names of the reader's own files.
OF_THE_READER = re.compile(r"\b[A-Z]{3,}\b|\.\.\.|\.(stl|tif|dcm)\b|\bruns/|\bmetacarpal\b|\.\./shared")
# What varies in a message: names in quotes, numbers, names of nodes and files, and what is put in between.
VARYING = r"'[^']*'|[-+]?\b\d[\w.]*|\b[a-z_0-9]+\.[a-z_]+\b|[;:(),]|\b(?:is|has|of|mm|option|signed_field|case|sim)\b"
# What stands around a piece of C++ from the documents, so that it can be compiled.
AROUND = """#include <marrow/conformance.hpp>
#include <marrow/plugin.hpp>
#include "shipped.hpp"
void calls(const marrow::View& view) {
  %s
}
struct Options { double low = 1, high = 2, reach_px = 8; };
marrow::View one(const marrow::View& view, const Options&) { return view; }
marrow::conformance::Suite denoise_suite() { return {}; }
MARROW_PLUGIN(plugin) {
  %s
}
"""


def faults_in(told):
    """Errors that are about the block, and not about files or a node that the reader has."""
    of_the_reader = (
        r"no such file|matches no|nothing matches|steepest|strongest|denoise|there is no folder|is no folder"
    )
    return [line for line in told.splitlines() if "error:" in line and not re.search(of_the_reader, line)]


class Yaml(Documents):
    def checked(self, command, text, folder):
        file = folder / "from-docs.yaml"
        file.write_text(text)
        result = self.run_here(MARROW, *command, file)
        file.unlink()
        return result.returncode, result.stdout + result.stderr

    def pipelines_folder(self):
        """A folder beside the pipelines, so that paths in a block lead where they lead in a file of pipelines/."""
        copy = self.folder / "copy"
        if not copy.exists():
            shutil.copytree(SOURCE / "pipelines", copy / "pipelines")
        return copy / "pipelines"

    def test_every_block_is_what_it_says(self):
        count = {"pipeline": 0, "experiment": 0, "part": 0, "data": 0}
        for place, block in self.blocks("yaml"):
            if block.about and place.startswith("docs/tutorials/"):
                continue  # a file that the blocks after it use; tutorials_test.py runs them
            with self.subTest(place):
                text = re.sub(r"^\s*\.\.\.\s*$", "", block.text, flags=re.M)
                text = "nodes:\n" + text if text.startswith(" ") else text
                content = yaml.safe_load(text)
                self.assertIsInstance(content, dict)
                count[self.check(content, text)] += 1
        print(count)
        self.assertGreater(min(count.values()), 0)

    def check(self, content, text):
        folder = self.pipelines_folder()
        if "marrow" in content:
            if "repeat: pipelines/" in text:
                folder = folder.parent
            code, told = self.checked(["check"], text, folder)
            self.assertEqual(code, 0, told)
            return "pipeline"
        if "experiment" in content:
            if "pipelines/" in content["pipeline"]:
                folder = folder.parent
            elif content["pipeline"].startswith("../"):
                folder = folder / "experiments"
            _, told = self.checked(["compare", "--dry-run"], text, folder)
            self.assertEqual(faults_in(told), [], told)
            return "experiment"
        if "nodes" in content:
            self.check_part(content["nodes"])
            return "part"
        if set(content) == {"inputs", "set"}:  # a file of settings
            file = self.folder / "settings.yaml"
            file.write_text(text)
            told = self.run_here(MARROW, "check", SOURCE / "pipelines" / "femur" / "femur.yaml", "--set-file", file)
            self.assertEqual(told.returncode, 0, told.stderr)
            return "part"
        self.assertTrue(any(str(key).startswith("marrow-") for key in content), "it is no file of marrow")
        return "data"

    def check_part(self, nodes):
        """Some nodes of a pipeline: all that may be wrong with them is that what they are wired to is not there."""
        text = yaml.safe_dump({"marrow": 1, "nodes": nodes, "outputs": {name: name for name in nodes}})
        _, told = self.checked(["check"], text, self.pipelines_folder())
        for fault in re.findall(r"error: (.*)", told):
            self.assertRegex(
                fault,
                r"^there is no node '\w+'|^'\w+' has \d+ outputs|^nothing uses node|^node '\w+' has several outputs",
            )

    def test_the_files_of_a_case_are_read(self):
        text = self.documents["docs/case"]
        found = {}
        for block in blocks.blocks_of(text):
            if block.language == "yaml" and block.text.startswith("marrow-"):
                found[block.text.split(":")[0]] = block.text
        for name, node in (
            ("marrow-pose", "read.pose"),
            ("marrow-seeds", "read.seeds"),
            ("marrow-landmarks", "read.landmarks"),
        ):
            with self.subTest(name):
                (self.folder / "data.yaml").write_text(found[name])
                pipeline = "marrow: 1\nnodes:\n  a: {uses: %s, with: {path: data.yaml}}\noutputs: {a: a}\n" % node
                (self.folder / "read.yaml").write_text(pipeline)
                result = self.run_here(MARROW, "run", "read.yaml", "--out", self.folder / name)
                self.assertEqual(result.returncode, 0, result.stdout + result.stderr)


class Shell(Documents):
    def test_every_line_is_shell(self):
        for place, block in self.blocks("shell"):
            result = self.run_here("bash", "-n", input=block.text)
            self.assertEqual(result.returncode, 0, place + ": " + result.stderr)

    def test_every_command_names_what_is_there(self):
        checked, not_run = 0, []
        for place, block in self.blocks("shell"):
            for line in block.text.replace("\\\n", " ").splitlines():
                words = shlex.split(line, comments=True)
                if not words:
                    continue
                checked += 1
                with self.subTest(place + ": " + line):
                    if not self.check(words, place):
                        not_run.append("%s: %s" % (place, line.split("  #")[0]))
        print("%d commands; not run, only their names checked:" % checked)
        print("\n".join(not_run))
        self.assertGreater(checked, 80)

    def check(self, words, place):
        """Whether the command was tried, so far as it is quick."""
        if words[0] in ("marrow", "build/bin/marrow") and len(words) > 1:
            return self.check_marrow(words[1:], place)
        if words[0] == "python3":
            self.assertTrue((SOURCE / words[1]).exists(), "there is no " + words[1])
        if words[0].startswith(("tools/", "tests/")):
            self.assertTrue(os.access(SOURCE / words[0], os.X_OK), "there is no program " + words[0])
            text = (SOURCE / words[0]).read_text()
            if words[0] == "tools/networks/train" and len(words) > 1:  # each network declares options of its own
                text += (SOURCE / "tools/networks" / (words[1] + ".py")).read_text()
            for word in words[1:]:
                if word.startswith("--"):
                    self.assertIn(word.split("=")[0], text)
        elif "--preset" in words:
            self.assertIn('"%s"' % words[words.index("--preset") + 1], (SOURCE / "CMakePresets.json").read_text())
        return False

    def check_marrow(self, words, place):
        own = OF_THE_READER.search(" ".join(words)) or "tutorials/" in place
        files = [word for word in words if word.startswith("pipelines/")]
        for file in files:
            self.assertTrue((SOURCE / file).exists(), "there is no " + file)
        # Shipped experiments are tried with --dry-run by the test of their schema, which takes longer.
        if words[0] in ("run", "check", "plan", "graph") and files:
            result = self.run_here(MARROW, "check", *self.without_own_options(words[1:]))
        elif (
            words[0] in ("list", "inspect", "doctor") or words[:1] + words[2:3] == ["conformance", "--check"]
        ) and not own:
            result = self.run_here(MARROW, *words)
        else:
            return False
        told = result.stdout + result.stderr
        self.assertEqual(faults_in(told), [], told)
        return True

    @staticmethod
    def without_own_options(words):
        """The words of `run` that `check` takes too: the file, inputs and --set."""
        kept, words = [], list(words)
        while words:
            word = words.pop(0)
            if word == "--set":
                kept += [word, words.pop(0)]
            elif word in ("--seed", "--out", "--only", "--profile", "--threads", "--log-level"):
                words.pop(0)
            elif not word.startswith("--") and "=$" not in word:  # a variable of the shell
                kept.append(word)
        return kept


class Messages(Documents):
    def test_every_message_of_the_faq_is_one_of_the_program(self):
        sources = []
        for folder in ("framework", "plugins", "tools/marrow"):
            for path in sorted((SOURCE / folder).rglob("*.?pp")):
                sources.append(path.read_text())
        # What a sentence is put together from: the pieces of text, without what stands between them in the source.
        everything = re.sub(r'"\s*"', "", "\n".join(sources)).replace('\\"', '"')
        count = 0
        for block in blocks.blocks_of(self.documents["docs/faq"]):
            if block.language != "text":
                continue
            for line in block.text.splitlines():
                for piece in re.split(VARYING, line):
                    if len(piece.strip()) > 12:
                        count += 1
                        self.assertIn(piece.strip(), everything, line)
        self.assertGreater(count, 40)


@unittest.skipIf(IS_SANITIZED, "the headers are compiled without the sanitizer")
class Cpp(Documents):
    def test_every_piece_compiles(self):
        """Files of the tutorials are built there; all other pieces are declarations, or a call in a test."""
        declarations, calls = "", ""
        for place, block in self.blocks("cpp"):
            if place.startswith("docs/testing"):
                calls += block.text + ";\n"
            elif not block.about:
                declarations += declaration_of(block.text)
        self.assertIn("denoise", declarations)
        self.assertIn("shipped::call", calls)
        file = self.folder / "pieces.cpp"
        file.write_text(AROUND % (calls, declarations))
        digest = BUILD / "include"
        flags = ["-std=c++20", "-fsyntax-only", "-I", SOURCE / "framework", "-I", digest, "-I", SOURCE / "tests"]
        flags += ["-isystem", "/usr/include/eigen3", "-isystem", "/usr/include/opencv4"]
        result = self.run_here("c++", *flags, file)
        self.assertEqual(result.returncode, 0, result.stderr)


def declaration_of(text):
    """A piece of a declaration as a whole statement."""
    if text.startswith("."):
        text = 'plugin.node("denoise.one", one).summary("s").in("view", "v").out("view", "v")\n' + text
    return text if text.rstrip().endswith(";") else text + ";\n"


if __name__ == "__main__":
    main()
