# SPDX-License-Identifier: Apache-2.0
"""The recipe that pictures, pages and folders of runs carry: another program reads it, and marrow runs it again."""
import html.parser
import importlib.util
import json

from harness import MARROW, skip
from harness.cases import contents
from harness.program import Case, main
from harness.terminal import Terminal

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
        self.environment = {"HOME": str(self.scratch)}
        picture = Image.new("L", (5, 4))
        picture.putdata([11 * i % 256 for i in range(20)])
        for case in "ab":
            self.write("cases/%s/a </script> $ b" % case, "1")
            picture.save(self.scratch / "cases" / case / "picture.png")
        self.write("p.yaml", PIPELINE)

    def run_into(self, folder, file="p.yaml", *arguments):
        self.expect(0, "run", file, "--out", folder, "--quiet", *arguments)
        return self.scratch / folder / "outputs"

    def run_of_case(self, folder="a", *arguments):
        return self.run_into(folder, "p.yaml", "case=cases/a", "--seed", 7, "--set", "m.value=4", *arguments)

    def recipe_of(self, picture):
        """By another program, with its pixels."""
        with Image.open(self.scratch / picture) as image:
            self.assertEqual(list(image.text), [KEYWORD])
            return image.text[KEYWORD], list(image.getdata())

    def no_recipe(self, *rows):
        """Each row: the words after the command, of which the first is what the fault is about, and the fault."""
        for words, fault in rows:
            said = self.expect(2, "recipe", *words).stderr
            self.assertEqual(said, "marrow: error: %s: %s\n" % (words[0], fault))

    def test_picture_folder_and_page_have_it_and_another_program_reads_it(self):
        self.run_of_case()
        recipe, pixels = self.recipe_of("a/outputs/picture.png")
        with Image.open(self.scratch / "cases/a/picture.png") as given:
            self.assertEqual(pixels, list(given.getdata()))
        resolved = self.read("a/pipeline.yaml")
        self.assertIn("value: 4", resolved)
        begin = recipe.index("marrow: 1\n")
        self.assertEqual(recipe[begin:], resolved.replace(str(self.scratch), "$env:HOME"))
        said = "# The recipe of a run with marrow %s.\n# As a file, it runs again by: marrow run FILE --seed 7\n"
        self.assertEqual(recipe[:begin], said % self.printed("version").split()[1])
        self.assertNotIn(str(self.scratch), recipe)
        self.expect(0, "show", "a")
        self.assertEqual(Recipes(self.scratch / "a/report.html").of, {"": recipe})
        for place in ("a/outputs/picture.png", "a", "a/report.html"):
            self.assertEqual(self.printed("recipe", place), recipe)
            self.assertEqual(self.json_of("recipe", place), [{"variant": "", "recipe": recipe}])
        self.assertEqual(self.printed("recipe", "a", "--out", "r.yaml"), str(self.scratch / "r.yaml") + "\n")
        self.assertEqual(self.read("r.yaml"), recipe)

    def test_it_gives_the_same_bytes_as_the_run_and_each_repetition(self):
        outputs = contents(self.run_of_case())
        self.assertEqual(len(outputs), 3)
        self.expect(0, "recipe", "a/outputs/picture.png", "-o", "r.yaml")
        self.assertIn("r.yaml: good; 3 nodes, 3 outputs\n", self.printed("check", "r.yaml"))
        self.assertEqual(contents(self.run_into("b", "r.yaml", "--seed", 7, "--no-cache")), outputs)
        other = contents(self.run_into("c", "r.yaml", "--seed", 8))
        self.assertNotEqual(other["drawn.json"], outputs["drawn.json"], "the seed counts")
        self.assertEqual(contents(self.run_of_case("d", "--threads", 1, "--no-cache")), outputs)
        self.expect(0, "rerun", "a", "--out", "e", "--quiet")
        self.assertEqual(contents(self.scratch / "e/outputs"), outputs)
        (self.scratch / "cases/a/picture.png").unlink()
        missing = "%s/cases/a/picture.png: there is no such file" % self.scratch
        self.refused(missing, "run", "r.yaml", "--seed", 7, "--out", "f", "--quiet", status=1)

    def test_it_is_removed(self):
        self.run_of_case()
        self.expect(0, "recipe", "a/outputs/picture.png", "--remove", "-o", "bare.png")
        with Image.open(self.scratch / "bare.png") as bare:
            self.assertEqual((bare.text, list(bare.getdata())), ({}, self.recipe_of("a/outputs/picture.png")[1]))
        self.no_recipe(
            *(
                ([place, "--remove", "-o", "bare.png"], "--remove takes a PNG picture, and this is none")
                for place in ("a", "p.yaml")
            )
        )
        said = "marrow: error: --remove writes a picture without its recipe; say where to, with --out FILE\n"
        self.assertEqual(self.expect(2, "recipe", "a/outputs/picture.png", "--remove").stderr, said)

    def test_a_comparison(self):
        self.write("e.yaml", EXPERIMENT)
        self.expect(0, "compare", "e.yaml", "--out", "out", "--quiet")
        page = "out/report.html"
        recipes = Recipes(self.scratch / page).of
        self.assertEqual(list(recipes), ["x", "y"])
        for variant, value in (("x", 3), ("y", 2)):
            told = self.printed("recipe", page, "--variant", variant)
            self.assertEqual(told, recipes[variant])
            self.assertIn("value: %d\n" % value, told)
            pictures = "out/pictures/%s/a/0/outputs" % variant
            self.assertEqual(told, self.printed("recipe", pictures + "/picture.png"))
            self.write("%s.yaml" % variant, told)
            again = self.run_into(variant, "%s.yaml" % variant, "--seed", told.split("--seed ")[1].split()[0])
            self.assertEqual(contents(again), contents(self.scratch / pictures))
        self.assertIn("value: 2\n", self.printed("recipe", "out/cells/y/b/0"))
        self.assertEqual([one["variant"] for one in self.json_of("recipe", page)], ["x", "y"])
        only = self.json_of("recipe", page, "--variant", "y")
        self.assertEqual(only, [{"variant": "y", "recipe": recipes["y"]}])
        self.no_recipe(
            ([page], "this page has the recipes of 2 variants; choose one by --variant: x, y"),
            ([page, "--variant", "z"], "the comparison has no variant 'z'; did you mean 'x'?"),
            (
                ["out/cells/x/a/0", "--variant", "x"],
                "this is the recipe of one run, without variants; leave out --variant",
            ),
        )
        self.refused("out: this is the folder of a comparison", "recipe", "out")

    def test_what_has_no_recipe_or_a_damaged_one(self):
        self.write("page.html", "<!DOCTYPE html>\n<p>recipe</p>\n")
        self.write("text.png", "marrow recipe")
        png = (self.run_of_case() / "picture.png").read_bytes()
        self.write("changed.png", png.replace(b"value: 4", b"value: 5"))
        self.expect(0, "show", "a")
        page = self.read("a/report.html")
        self.write("cut.html", page[: page.index('id="recipes">') + 100])
        none = "this is no PNG picture, no HTML page and no folder of a run; only these have a recipe"
        self.no_recipe(
            (
                ["cases/a/picture.png"],
                "this picture has no recipe; marrow writes one into the pictures of a run's outputs, and a program "
                "that saves a picture again may drop it; the folder of the run has it, too",
            ),
            (
                ["page.html"],
                "this page has no recipe; the pages of 'marrow show' and 'marrow compare' have one, make it again",
            ),
            (["text.png"], none),
            (["p.yaml"], none),
            (["changed.png"], "the text of the PNG file was changed: its check sum is another one"),
            (["cut.html"], "its recipe is damaged"),
        )
        self.refused("missing.png cannot be read: No such file or directory", "recipe", "missing.png")

    def test_it_commands_no_terminal(self):
        text = PngImagePlugin.PngInfo()
        text.add_itxt(KEYWORD, "marrow: 1\n# \x1b[2J\u202e\n")
        Image.new("L", (2, 2)).save(self.scratch / "a.png", pnginfo=text)
        self.assertEqual(self.printed("recipe", "a.png"), "marrow: 1\n# \x1b[2J\u202e\n", "elsewhere it is as it is")
        with Terminal([MARROW, "recipe", "a.png"], cwd=self.scratch) as terminal:
            self.assertEqual(terminal.to_the_end(), "marrow: 1\n# \\x1b[2J\\u202e\n")


if __name__ == "__main__":
    main()
