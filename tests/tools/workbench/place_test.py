#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The page "Place" of `marrow open`: where a dragged bone comes to lie, its steps, and a registration from there."""
import math
import shlex

from harness.modules import modules
from harness.page import main
from made_cases import angle_deg, at, femur, seen
from placing import PlacePage

STEPS = ".place-steps button"


class PlaceTest(PlacePage):
    def moved(self, view, before, after):
        """How far the bone's middle went in a view: [u px, v px, depth mm]."""
        old, new = (seen(self.camera(view), self.middle(pose)) for pose in (before, after))
        return [b - a for a, b in zip(old, new)]

    def test_drags_and_fingers(self):
        """What is under the pointer stays under it, and turns are about the ray or the long axis."""
        self.place()
        for view, begin, end in (("frontal", (250, 250), (310, 205)), ("lateral", (260, 240), (200, 290))):
            before = self.pose()
            self.drag(view, begin, (280, 230), end)
            after = self.kept()
            right, down, away = self.moved(view, before, after)
            self.assertAlmostEqual(right, end[0] - begin[0], delta=0.5)
            self.assertAlmostEqual(down, end[1] - begin[1], delta=0.5)
            self.assertAlmostEqual(away, 0, places=6, msg="nothing moves in the depth that is not seen")
            self.assertLess(angle_deg(before, after), 1e-4)
        for options in ({"modifiers": 8}, {"button": "right"}):
            before = self.pose()
            u, v, _ = seen(self.camera("frontal"), self.middle(before))
            self.drag("frontal", (u + 100, v), (u + 70, v + 70), (u, v + 100), **options)
            after = self.kept()
            self.assertAlmostEqual(angle_deg(before, after), 90, delta=1)
            self.assertLess(math.dist(self.middle(before), self.middle(after)), 1e-6)
        before = self.pose()
        self.drag("frontal", (250, 250), (290, 250), modifiers=1)
        after = self.kept()
        along = lambda pose: at([[*row[:3], 0] for row in pose], self.about["bones"][0]["long_axis"])
        self.assertLess(math.dist(along(before), along(after)), 1e-9, "Alt turns about the long axis")
        self.assertGreater(angle_deg(before, after), 5)
        before = self.pose()
        self.touch("frontal", [(250, 250)], [(270, 240)], [(300, 220)])
        right, down, _ = self.moved("frontal", before, self.kept())
        self.assertAlmostEqual(right, 50, delta=0.5)
        self.assertAlmostEqual(down, -30, delta=0.5)
        before = self.pose()
        self.touch("frontal", [(200, 250), (300, 250)], [(215, 215), (285, 285)], [(250, 200), (250, 300)])
        self.assertAlmostEqual(angle_deg(before, self.kept()), 90, delta=1)
        self.keys("z")
        before = self.pose()
        u, v, _ = seen(self.camera("frontal"), self.middle(before))
        self.drag("frontal", (u, v), (u + 20, v + 10), (u + 30, v - 15))
        right, down, _ = self.moved("frontal", before, self.kept())
        self.assertAlmostEqual(right, 30, delta=0.5, msg="in a larger image")
        self.assertAlmostEqual(down, -15, delta=0.5)
        self.no_faults()

    def test_keys_move_by_the_chosen_step(self):
        self.place()
        for name, way_mm, degrees in (
            ("ARROW_RIGHT", (1, 0, 0), 0),
            ("ARROW_UP", (0, -1, 0), 0),
            ("e", (0, 0, 0), 1),
            ("a", (0, 0, 0), 1),
            ("r", (0, 0, 0), 1),
        ):
            before = self.pose()
            self.keys(name)
            after = self.kept()
            old, new = (at(self.camera("frontal")["camera_from_world"], self.middle(pose)) for pose in (before, after))
            for a, b, expected in zip(old, new, way_mm):
                self.assertAlmostEqual(b - a, expected, places=6, msg=name)
            self.assertAlmostEqual(angle_deg(before, after), degrees, places=4, msg=name)
        before = self.pose()
        self.keys("w")
        after = self.kept()
        right, down, away = self.moved("frontal", before, after)
        self.assertAlmostEqual(math.dist(self.middle(before), self.middle(after)), 1, places=6)
        self.assertLess(math.hypot(right, down), 1e-6, "it stays in its place in this view")
        self.assertGreater(away, 0)
        self.keys("-")
        before = self.pose()
        self.keys("ARROW_LEFT")
        self.assertAlmostEqual(math.dist(self.middle(before), self.middle(self.kept())), 0.5, places=6)

    def test_steps_can_be_taken_back_and_outlive_the_page(self):
        self.place()
        begin = self.pose()
        self.drag("frontal", (250, 250), (270, 250))
        one = self.kept()
        self.keys("e")
        two = self.kept()
        start = "begin: CT coordinates taken as world coordinates"
        self.assertEqual(self.texts(STEPS), [start, "move distal", "turn distal"])
        self.do("undo")
        self.wait_page("page.draft.state_redo === 'turn distal'")
        self.assertEqual(self.pose(), one)
        self.do("undo")
        self.wait_page("page.draft.state_undo === null")
        self.assertEqual(self.pose(), begin)
        for _ in range(2):
            self.do("redo")
        self.wait_page("page.draft.state_redo === null")
        self.assertEqual(self.pose(), two)
        self.js("document.querySelectorAll(arguments[0])[1].click()", STEPS)
        self.assertEqual(self.kept(), one)
        before = self.texts(STEPS)
        self.show("home")
        self.show("place=case")
        self.assertEqual(self.pose(), one)
        self.assertEqual(self.texts(STEPS), before)

    def test_pictures_follow_what_is_chosen(self):
        """The greys change without a request, and each way to show the bone changes the picture."""
        self.place()
        drawn = lambda: self.the(".place-canvas", "one.toDataURL()")
        pictures = [drawn()]
        for way in ("equalised", "all"):
            self.the(".xray-look [data-value=%s]" % way, "one.click()")
            pictures.append(drawn())
        self.assertEqual(len(set(pictures)), 3)
        self.assertEqual([url for url in self.browser.logs()[1] if "api/place/image" in url], [])
        pictures = []
        for mode in ("blend", "wipe", "checkerboard", "edges", "outline"):
            self.the("[data-value=%s]" % mode, "one.click()")
            self.wait_page("page.views.every((view) => !view.inFlight && view.paint.layers.size === 1)")
            pictures.append(self.until(lambda: (new := drawn()) not in pictures and new))  # it is drawn in time

    def test_the_overlay_is_that_of_the_newest_pose(self):
        self.place()
        self.js(
            "const page = marrow.place();"
            "const shift = [[1, 0, 0, 0.5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];"
            "for (let i = 0; i < 30; ++i) page.move(page.placed, shift, i < 29)"
        )
        self.wait_page("page.views.every((view) => !view.inFlight && !view.wanted)")
        asked = {"case": "case", "view": "frontal", "what": "radiograph", "step_px": 1}
        about, content = self.server.bytes("/api/place/overlay", {**asked, "poses": {"distal": self.pose()}})
        layer = "const one = marrow.place().views[0].paint.layers.get('distal');"
        drawn = self.js(layer + "return [one.u_px, one.columns, [...one.bytes]]")
        self.assertEqual(drawn[:2], [about["layers"][0]["u_px"], about["layers"][0]["columns"]])
        self.assertEqual(bytes(drawn[2]), content)

    def test_it_registers_from_here(self):
        self.place()
        truth = femur()[1]
        self.js("marrow.place().show({distal: arguments[0]})", truth)
        self.keys("ARROW_RIGHT", "ARROW_RIGHT", "q")
        self.kept()
        self.do("register")
        self.wait_page("page.steps.current.what === 'register distal by register'")
        self.assertLess(math.dist(self.middle(self.kept()), self.middle(truth)), 0.2)
        self.assertIn("distal: trusted", self.text(".place-verdict"))
        self.assertIn("predicted deviations", self.text(".place-steps"))
        command = shlex.split(self.text(".command code"))
        self.assertEqual(command[-3:], ["case=case", "--set", "case.starts=placed/case/1"])

    def test_bones_move_together_or_stay(self):
        file = self.folder / "case" / "case.yaml"
        file.write_text(file.read_text().replace("register: false", "register: true").split("    truth:")[0])
        self.place()
        self.assertEqual([bone["name"] for bone in self.about["bones"]], ["proximal", "distal"])
        begin = self.page("placed")
        self.keys("ARROW_RIGHT")
        self.kept()
        together = self.page("placed")
        for bone in begin:
            self.assertAlmostEqual(math.dist(*([pose[bone][i][3] for i in range(3)] for pose in (begin, together))), 1)
        self.the(".place-bones input", "one.click()")
        self.keys("ARROW_RIGHT")
        self.kept()
        alone = self.page("placed")
        self.assertEqual(alone["proximal"], together["proximal"])
        self.assertNotEqual(alone["distal"], together["distal"])
        layers = self.js("return [...marrow.place().views[0].paint.layers.keys()].sort()")
        self.assertEqual(layers, ["distal", "proximal"])
        fragments = self.page("draft.document.fragments")
        self.assertEqual({name: one["start"] for name, one in fragments.items()}, alone)

    def test_costs_are_in_the_order_of_the_case_and_against_the_best(self):
        views = [str(number) for number in range(1, 12)]
        cost = lambda value: {"value": value, "views": {name: value for name in sorted(views)}}
        costs = lambda value: {"bone": {"contour": cost(value), "grey_values": cost(value)}}
        self.driver.get("about:blank")
        shown = self.js(
            modules(Costs="workbench/page/place_steps.js")
            + """const table = document.createElement('table'), [before, now, views] = arguments;
            Costs.fill(table, now, 'bone', before.map((costs) => ({costs})), views);
            const fill = table.querySelector('[data-cost=contour] .cost-fill');
            return [[...table.querySelectorAll('tbody th')].map((one) => one.textContent),
              table.querySelector('[data-cost=contour] small').textContent, fill.style.width];""",
            [costs(4), costs(2)],
            costs(3),
            views,
        )
        self.assertEqual(shown, [["all views", *views], "1.50 × the best", "75%"])


if __name__ == "__main__":
    main(part=5)
