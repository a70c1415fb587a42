# SPDX-License-Identifier: Apache-2.0
"""The recipe that pictures, pages and folders of runs carry: another program reads it, and marrow runs it again."""
import html.parser
import importlib.util
import json
import os
import pty
import subprocess

from harness import MARROW, skip
from harness.program import Case, main

if not importlib.util.find_spec("PIL"):
    skip("Pillow is missing: apt-get install python3-pil")
from PIL import Image, PngImagePlugin

KEYWORD = "marrow recipe"
PIPELINE = """marrow: 1
inputs: {case: {type: path}}
nodes:
  picture: {uses: read.image, with: {path: $case/picture.png}}
  drawn: {uses: test.draw}
  m: {uses: test.constant, with: {value: 3, path: "$case/a </script> $$ b"}}
outputs: {number: m, drawn: drawn, picture: picture}
"""
EXPERIMENT = """experiment: 1
name: e
pipeline: p.yaml
cases: {folders: [cases/*], input: case}
metrics: [number.value]
pictures: [picture]
timed_cells: 0
variants: {x: {}, y: {m.value: 2}}
"""


class Recipes(html.parser.HTMLParser):
    """The recipes of a page, by variant, as a program reads them that knows nothing of marrow."""

    def __init__(self, page):
        super().__init__()
        self.is_inside, self.text = False, ""
        self.feed(page.read_text())
        self.of = {one["name"]: one["recipe"] for one in json.loads(self.text)}

    def handle_starttag(self, tag, attributes):
        self.is_inside = ("id", "recipes") in attributes

    def handle_data(self, data):
        self.text += data if self.is_inside else ""


class Recipe(Case):
    def setUp(self):
        super().setUp()
        self.home = {"HOME": str(self.scratch)}
        for case in "ab":
            (self.scratch / "cases" / case).mkdir(parents=True)
            picture = Image.new("L", (5, 4))
            picture.putdata([11 * i % 256 for i in range(20)])
            (self.scratch / "cases" / case / "a <").mkdir()
            (self.scratch / "cases" / case / "a <" / "script> $ b").write_text("1")
            picture.save(self.scratch / "cases" / case / "picture.png")
        self.write("p.yaml", PIPELINE)

    def good(self, *arguments, code=0):
        result = self.marrow(*arguments, extra_environment=self.home)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result.stdout if code == 0 else result.stderr

    def run_into(self, folder, file="p.yaml", *arguments):
        self.good("run", file, "--out", folder, "--quiet", *arguments)
        return self.scratch / folder / "outputs"

    def run_of_case(self, folder="a", *arguments):
        return self.run_into(folder, "p.yaml", "case=cases/a", "--seed", 7, "--set", "m.value=4", *arguments)

    def files(self, folder):
        return {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*") if file.is_file()}

    def test_another_program_reads_it_and_the_pixels_are_the_same(self):
        outputs = self.run_of_case()
        with Image.open(outputs / "picture.png") as image, Image.open(self.scratch / "cases/a/picture.png") as given:
            self.assertEqual(list(image.text), [KEYWORD])
            self.assertEqual(list(image.getdata()), list(given.getdata()))
            recipe = image.text[KEYWORD]
        resolved = (self.scratch / "a" / "pipeline.yaml").read_text()
        begin = recipe.index("marrow: 1\n")
        self.assertEqual(recipe[begin:], resolved.replace(str(self.scratch), "$env:HOME"))
        self.assertIn("value: 4", resolved)
        version = self.good("version").split()[1]
        self.assertEqual(
            recipe[:begin],
            "# The recipe of a run with marrow %s.\n# As a file, it runs again by: marrow run FILE --seed 7\n"
            % version,
        )
        self.assertNotIn(str(self.scratch), recipe)

    def test_picture_folder_and_page_have_the_same(self):
        outputs = self.run_of_case()
        told = self.good("recipe", "a/outputs/picture.png")
        with Image.open(outputs / "picture.png") as image:
            self.assertEqual(told, image.text[KEYWORD])
        self.good("show", "a")
        self.assertEqual(Recipes(self.scratch / "a/report.html").of, {"": told})
        for place in ("a", "a/report.html"):
            self.assertEqual(self.good("recipe", place), told)
            self.assertEqual(json.loads(self.good("recipe", place, "--json")), [{"variant": "", "recipe": told}])
        self.assertEqual(self.good("recipe", "a", "--out", "r.yaml"), str(self.scratch / "r.yaml") + "\n")
        self.assertEqual((self.scratch / "r.yaml").read_text(), told)

    def test_it_runs_again_and_gives_the_same_bytes(self):
        outputs = self.run_of_case()
        self.good("recipe", "a/outputs/picture.png", "-o", "r.yaml")
        self.assertIn("r.yaml: good; 3 nodes, 3 outputs\n", self.good("check", "r.yaml"))
        again = self.run_into("b", "r.yaml", "--seed", 7, "--no-cache")
        self.assertEqual(self.files(again), self.files(outputs))
        self.assertEqual(len(self.files(outputs)), 3)
        other = self.run_into("c", "r.yaml", "--seed", 8)
        self.assertNotEqual(self.files(other)["drawn.json"], self.files(outputs)["drawn.json"], "the seed counts")

    def test_the_same_run_has_the_same_bytes(self):
        outputs = self.run_of_case()
        threads = self.run_of_case("b", "--threads", 1, "--no-cache")
        self.assertEqual(self.files(threads), self.files(outputs))
        self.good("rerun", "a", "--out", "c", "--quiet")
        self.assertEqual(self.files(self.scratch / "c/outputs"), self.files(outputs))

    def test_data_are_missing(self):
        self.run_of_case()
        self.good("recipe", "a", "-o", "r.yaml")
        (self.scratch / "cases/a/picture.png").unlink()
        told = self.good("run", "r.yaml", "--seed", 7, "--out", "b", "--quiet", code=1)
        self.assertIn("%s/cases/a/picture.png: there is no such file" % self.scratch, told)

    def test_it_is_removed(self):
        self.run_of_case()
        self.good("recipe", "a/outputs/picture.png", "--remove", "-o", "bare.png")
        with Image.open(self.scratch / "bare.png") as bare, Image.open(self.scratch / "a/outputs/picture.png") as image:
            self.assertEqual(bare.text, {})
            self.assertEqual(list(bare.getdata()), list(image.getdata()))
        self.assertEqual(
            self.good("recipe", "a/outputs/picture.png", "--remove", code=2),
            "marrow: error: --remove writes a picture without its recipe; say where to, with --out FILE\n",
        )
        for place in ("a", "p.yaml"):
            self.assertEqual(
                self.good("recipe", place, "--remove", "-o", "bare.png", code=2),
                "marrow: error: %s: --remove takes a PNG picture, and this is none\n" % place,
            )

    def test_a_comparison(self):
        self.write("e.yaml", EXPERIMENT)
        self.good("compare", "e.yaml", "--out", "out", "--quiet")
        recipes = Recipes(self.scratch / "out/report.html").of
        self.assertEqual(list(recipes), ["x", "y"])
        for variant, value in (("x", 3), ("y", 2)):
            told = self.good("recipe", "out/report.html", "--variant", variant)
            self.assertEqual(told, recipes[variant])
            self.assertIn("value: %d\n" % value, told)
            self.assertEqual(told, self.good("recipe", "out/pictures/%s/a/0/outputs/picture.png" % variant))
            self.write("%s.yaml" % variant, told)
            again = self.files(
                self.run_into(variant, "%s.yaml" % variant, "--seed", told.split("--seed ")[1].split()[0])
            )
            self.assertEqual(again, self.files(self.scratch / "out/pictures" / variant / "a/0/outputs"))
        self.assertIn("value: 2\n", self.good("recipe", "out/cells/y/b/0"))
        self.assertEqual(
            [one["variant"] for one in json.loads(self.good("recipe", "out/report.html", "--json"))], ["x", "y"]
        )
        only = json.loads(self.good("recipe", "out/report.html", "--json", "--variant", "y"))
        self.assertEqual(only, [{"variant": "y", "recipe": recipes["y"]}])
        for arguments, fault in (
            (["out/report.html"], "this page has the recipes of 2 variants; choose one by --variant: x, y"),
            (["out/report.html", "--variant", "z"], "the comparison has no variant 'z'; did you mean 'x'?"),
            (
                ["out/cells/x/a/0", "--variant", "x"],
                "this is the recipe of one run, without variants; leave out --variant",
            ),
        ):
            told = self.good("recipe", *arguments, code=2)
            self.assertEqual(told, "marrow: error: %s: %s\n" % (arguments[0], fault))
        self.assertIn("out: this is the folder of a comparison", self.good("recipe", "out", code=2))

    def test_what_has_no_recipe(self):
        self.write("page.html", "<!DOCTYPE html>\n<p>recipe</p>\n")
        self.write("text.png", "marrow recipe")
        for place, fault in (
            (
                "cases/a/picture.png",
                "this picture has no recipe; marrow writes one into the pictures of a run's outputs, and a program "
                "that saves a picture again may drop it; the folder of the run has it, too",
            ),
            (
                "page.html",
                "this page has no recipe; the pages of 'marrow show' and 'marrow compare' have one, make it again",
            ),
            ("text.png", "this is no PNG picture, no HTML page and no folder of a run; only these have a recipe"),
            ("p.yaml", "this is no PNG picture, no HTML page and no folder of a run; only these have a recipe"),
        ):
            self.assertEqual(self.good("recipe", place, code=2), "marrow: error: %s: %s\n" % (place, fault))
        self.assertIn(
            "missing.png cannot be read: No such file or directory", self.good("recipe", "missing.png", code=2)
        )

    def test_it_commands_no_terminal(self):
        text = PngImagePlugin.PngInfo()
        text.add_itxt(KEYWORD, "marrow: 1\n# \x1b[2J\u202e\n")
        Image.new("L", (2, 2)).save(self.scratch / "a.png", pnginfo=text)
        self.assertEqual(self.good("recipe", "a.png"), "marrow: 1\n# \x1b[2J\u202e\n", "elsewhere it is as it is")
        reader, terminal = pty.openpty()
        subprocess.run([str(MARROW), "recipe", "a.png"], cwd=self.scratch, stdout=terminal, check=True)
        os.close(terminal)
        told = os.read(reader, 1000)
        os.close(reader)
        self.assertEqual(told, b"marrow: 1\r\n# \\x1b[2J\\u202e\r\n")

    def test_what_is_damaged(self):
        outputs = self.run_of_case()
        png = (outputs / "picture.png").read_bytes()
        (self.scratch / "changed.png").write_bytes(png.replace(b"value: 4", b"value: 5"))
        (self.scratch / "cut.png").write_bytes(png[:200])
        text = PngImagePlugin.PngInfo()
        text.add_itxt(KEYWORD, "marrow: 1", zip=True)
        Image.new("L", (2, 2)).save(self.scratch / "packed.png", pnginfo=text)
        self.good("show", "a")
        page = (self.scratch / "a/report.html").read_text()
        self.write("cut.html", page[: page.index('id="recipes">') + 100])
        for place, fault in (
            ("changed.png", "the text of the PNG file was changed: its check sum is another one"),
            ("cut.png", "the PNG file ends too early"),
            ("packed.png", "another program has compressed the text of the PNG file"),
            ("cut.html", "its recipe is damaged"),
        ):
            self.assertEqual(self.good("recipe", place, code=2), "marrow: error: %s: %s\n" % (place, fault))


if __name__ == "__main__":
    main()
