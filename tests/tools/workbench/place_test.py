#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The page "Place" of `marrow open`: where a dragged bone comes to lie, its steps, and a registration from there."""
import concurrent.futures
import json
import math
import shlex
import subprocess

import yaml

import bench
import ct_cases
from bench import MARROW, BenchTest, PageTest
from harness import formats
from placing import PageOfCase, Placing, angle_deg, at, seen, truth


class RequestsTest(Placing, BenchTest):
    def test_a_bone_is_drawn_where_it_is(self):
        server = self.open()
        about = self.opened(server)
        self.assertEqual([bone["name"] for bone in about["bones"]], ["distal"])
        self.assertEqual(about["bones"][0]["start_is"], "CT coordinates taken as world coordinates")
        camera = about["views"][0]["camera"]

        def middle(pose, step_px=1, what="radiograph"):
            status, headers, content = self.overlay(server, poses={"distal": pose}, step_px=step_px, what=what)
            self.assertEqual(status, 200, content)
            (layer,) = json.loads(headers["X-Marrow-About"])["layers"]
            columns, rows = layer["columns"], layer["rows"]
            self.assertEqual(len(content), columns * rows)
            weight = sum(content)
            u = sum(value * (i % columns) for i, value in enumerate(content)) / weight
            return layer["u_px"] + layer["step_px"] * u

        pose = truth()
        moved = [list(row) for row in pose]
        moved[0][3] += 10
        point = at(pose, about["bones"][0]["middle_mm"])
        expected = seen(camera, [point[0] + 10, *point[1:]])[0] - seen(camera, point)[0]
        for step_px in (1, 2, 3):
            self.assertAlmostEqual(middle(moved, step_px) - middle(pose, step_px), expected, delta=2)
        self.assertAlmostEqual(middle(pose, 1), middle(pose, 4), delta=0.5)
        self.assertAlmostEqual(middle(pose, 1, "edges"), middle(pose, 1), delta=20)
        away = [list(row) for row in pose]
        away[0][3] += 5000
        status, headers, content = self.overlay(server, poses={"distal": away})
        self.assertEqual(
            (status, content, json.loads(headers["X-Marrow-About"])["layers"][0]["columns"]), (200, b"", 0)
        )

    def test_a_bone_given_by_a_label(self):
        file = self.folder / "case" / "case.yaml"
        case = yaml.safe_load(file.read_text())
        middle = case["fragments"]["distal"]["seeds"][0]
        grid = formats.straight((20, 20, 40), (2, 2, 2), [value - size for value, size in zip(middle, (19, 19, 39))])
        values = ct_cases.labelled_balls(grid, [(7, middle, 15)])
        (self.folder / "case" / "labels.mha").write_bytes(formats.mha(grid, values))
        case.update(labels="labels.mha", fragments={"distal": {"label": 7}})
        file.write_text(yaml.safe_dump(case))
        server = self.open()
        (bone,) = self.opened(server)["bones"]
        self.assertEqual(bone["name"], "distal")
        self.assertLess(math.dist(bone["middle_mm"], middle), 1)
        del case["ct"]
        file.write_text(yaml.safe_dump(case))
        state = server.finish(server.json("POST", "/api/place/open", {"case": "case"})["job"])
        self.assertEqual(
            state["error"],
            "this case has no CT, and this page shows bones by their radiographs; add the CT to the case",
        )

    def test_the_true_pose_costs_least(self):
        server = self.open()
        about = self.opened(server)
        cost = lambda pose: server.json("POST", "/api/place/costs", {"case": "case", "poses": {"distal": pose}})[
            "distal"
        ]
        best, other = cost(truth()), cost(about["bones"][0]["start"])
        for measure in ("contour", "grey_values"):
            self.assertLess(best[measure]["value"], other[measure]["value"])
            self.assertEqual(sorted(best[measure]["views"]), ["frontal", "lateral"])

    def test_what_is_wrong_is_said(self):
        server = self.open()
        server.enter()
        answer = self.overlay(server, poses={})
        self.assertEqual(answer[0], 409)
        self.assertEqual(json.loads(answer[2])["error"], "the case 'case' is no longer in memory; open it again")
        self.opened(server)
        pose = truth()
        skewed = [[2, 0, 0, 0], *pose[1:]]
        for changes, fault in (
            ({"poses": {"distal": [[1]]}}, "a pose must be 4 rows of 4 numbers"),
            ({"poses": {"tibia": pose}}, "the case has no bone 'tibia' that is registered"),
            ({"poses": {}, "view": "oblique"}, "the case has no view 'oblique'"),
            ({"poses": {}, "step_px": 0}, "'step_px' must be a whole number from 1 to 16"),
            ({"poses": {}, "step_px": 1.5}, "'step_px' must be a whole number from 1 to 16"),
            ({"poses": []}, "the request lacks 'poses', an object"),
            ({"poses": {"distal": pose}, "what": "x"}, "'what' must be radiograph, edges or outline, got 'x'"),
        ):
            answer = self.overlay(server, **changes)
            self.assertEqual((answer[0], json.loads(answer[2])["error"]), (400, fault))
        answer = self.overlay(server, poses={"distal": skewed})
        self.assertEqual(answer[0], 400)
        self.assertIn("the pose", json.loads(answer[2])["error"])
        for pipeline in ("nowhere.yaml", "/etc/passwd"):
            answer = server.ask(
                "POST", "/api/place/register", {"case": "case", "pipeline": pipeline, "poses": {"distal": pose}}
            )
            self.assertEqual(
                json.loads(answer[2])["error"], "this pipeline cannot start from a placement; choose one of the list"
            )
        answer = server.ask("POST", "/api/place/open", {"case": "../.."})
        self.assertIn(" leads out of the folder that is open, ", json.loads(answer[2])["error"])
        state = server.finish(server.json("POST", "/api/place/open", {"case": "nothing"})["job"])
        self.assertEqual(state["state"], "failed")
        self.assertIn("there is no such folder", state["error"])

    def test_from_here_and_the_command_line_find_the_same(self):
        server = self.open()
        about = self.opened(server)
        pipeline = about["pipelines"][0]["file"]
        asked = {"case": "case", "pipeline": pipeline, "poses": {"distal": truth()}}
        asked["poses"]["distal"][0][3] += 1.5
        begun = server.json("POST", "/api/place/register", asked)
        state = server.finish(begun["job"])
        self.assertEqual((state["state"], state["error"]), ("done", ""))
        found = state["result"]["poses"]["distal"]
        self.assertLess(max(abs(found["matrix"][i][3] - truth()[i][3]) for i in range(3)), 0.2)
        self.assertLess(found["deviations"]["long"]["rotation_deg"], 1)
        self.assertEqual(state["result"]["verdicts"]["distal"]["judgement"], "trusted")
        again = server.json("POST", "/api/place/register", asked)
        self.assertEqual(again["command"], begun["command"], "the same poses are not written twice")
        server.finish(again["job"])
        words = shlex.split(begun["command"])
        self.assertEqual(words[:2], ["marrow", "run"])
        store = self.scratch / "another-store"
        subprocess.run(
            [MARROW, *words[1:], "--out", self.scratch / "run"],
            cwd=self.folder,
            check=True,
            env={**bench.os.environ, "MARROW_CACHE": str(store)},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        import yaml

        written = yaml.safe_load((self.scratch / "run" / "outputs" / "pose" / "distal.yaml").read_text())
        self.assertEqual(written["matrix"], found["matrix"])

    def test_poses_of_requests_at_the_same_time_do_not_mix(self):
        server = self.open()
        self.opened(server)

        def written(shift_mm):
            """What the folder holds that is named in the answer."""
            asked = {"case": "case", "poses": {"distal": [list(row) for row in truth()]}}
            asked["poses"]["distal"][0][3] = shift_mm
            begun = server.json("POST", "/api/place/verdict", asked)
            server.json("POST", "/api/job/stop", {"job": begun["job"]})
            server.finish(begun["job"])
            folder = shlex.split(begun["command"])[-1].rpartition("=")[2]
            import yaml

            return yaml.safe_load((self.folder / folder / "distal.yaml").read_text())["matrix"][0][3]

        with concurrent.futures.ThreadPoolExecutor(6) as pool:
            for i in range(50):
                shifts_mm = list(range(6 * i, 6 * i + 6))
                self.assertEqual(list(pool.map(written, shifts_mm)), shifts_mm)

    def test_a_registration_can_be_stopped(self):
        server = self.open()
        about = self.opened(server)
        asked = {"case": "case", "pipeline": about["pipelines"][0]["file"], "poses": {"distal": truth()}}
        for _ in range(5):  # on a busy machine the stop may come too late
            asked["poses"]["distal"][0][3] += 0.5
            job = server.json("POST", "/api/place/register", asked)["job"]
            server.json("POST", "/api/job/stop", {"job": job})
            state = server.finish(job)["state"]
            if state == "stopped":
                break
        self.assertEqual(state, "stopped")


class PageOfCaseTest(PageOfCase, Placing, PageTest):
    def test_what_is_under_the_pointer_stays_under_it(self):
        self.place()
        for view, begin, end in (("frontal", (250, 250), (310, 205)), ("lateral", (260, 240), (200, 290))):
            camera, before = self.camera(view), self.pose()
            self.drag(view, begin, (280, 230), end)
            after = self.kept()
            old, new = (seen(camera, self.middle(pose)) for pose in (before, after))
            self.assertAlmostEqual(new[0] - old[0], end[0] - begin[0], delta=0.5)
            self.assertAlmostEqual(new[1] - old[1], end[1] - begin[1], delta=0.5)
            self.assertAlmostEqual(new[2], old[2], places=6, msg="nothing moves in the depth that is not seen")
            self.assertLess(angle_deg(before, after), 1e-4)
        self.assertEqual(self.browser.logs()[0], [])

    def test_shift_and_right_button_turn_about_the_ray(self):
        self.place()
        camera = self.camera("frontal")
        for options in ({"modifiers": 8}, {"button": "right"}):
            before = self.pose()
            u, v, _ = seen(camera, self.middle(before))
            self.drag("frontal", (u + 100, v), (u + 70, v + 70), (u, v + 100), **options)
            after = self.kept()
            self.assertAlmostEqual(angle_deg(before, after), 90, delta=1)
            self.assertLess(math.dist(self.middle(before), self.middle(after)), 1e-6)

    def test_alt_turns_about_the_long_axis(self):
        self.place()
        before = self.pose()
        self.drag("frontal", (250, 250), (290, 250), modifiers=1)
        after = self.kept()
        axis = self.about["bones"][0]["long_axis"]
        turned = [[sum(pose[i][k] * axis[k] for k in range(3)) for i in range(3)] for pose in (before, after)]
        self.assertLess(math.dist(*turned), 1e-9)
        self.assertGreater(angle_deg(before, after), 5)

    def test_one_finger_moves_and_two_turn(self):
        self.place()
        camera, before = self.camera("frontal"), self.pose()
        self.touch("frontal", [(250, 250)], [(270, 240)], [(300, 220)])
        after = self.kept()
        old, new = (seen(camera, self.middle(pose)) for pose in (before, after))
        self.assertAlmostEqual(new[0] - old[0], 50, delta=0.5)
        self.assertAlmostEqual(new[1] - old[1], -30, delta=0.5)
        before = self.pose()
        self.touch("frontal", [(200, 250), (300, 250)], [(215, 215), (285, 285)], [(250, 200), (250, 300)])
        after = self.kept()
        self.assertAlmostEqual(angle_deg(before, after), 90, delta=1)

    def test_keys_move_by_the_chosen_step(self):
        self.place()
        camera = self.camera("frontal")
        key = lambda name: self.browser.key(name, "[data-view=frontal]")
        for name, (right, down, away), degrees in (
            ("ARROW_RIGHT", (1, 0, 0), 0),
            ("ARROW_UP", (0, -1, 0), 0),
            ("e", (0, 0, 0), 1),
            ("a", (0, 0, 0), 1),
            ("r", (0, 0, 0), 1),
        ):
            before = self.pose()
            key(name)
            after = self.kept()
            old, new = (at(camera["camera_from_world"], self.middle(pose)) for pose in (before, after))
            for got, expected in zip([b - a for a, b in zip(old, new)], (right, down, away)):
                self.assertAlmostEqual(got, expected, places=6, msg=name)
            self.assertAlmostEqual(angle_deg(before, after), degrees, places=4, msg=name)
        before = self.pose()
        key("w")
        after = self.kept()
        old, new = (seen(camera, self.middle(pose)) for pose in (before, after))
        self.assertAlmostEqual(math.dist(self.middle(before), self.middle(after)), 1, places=6)
        self.assertLess(math.dist(old[:2], new[:2]), 1e-6, "it stays in its place in this view")
        self.assertGreater(new[2], old[2])
        key("-")
        before = self.pose()
        key("ARROW_LEFT")
        self.assertAlmostEqual(math.dist(self.middle(before), self.middle(self.kept())), 0.5, places=6)

    def test_steps_can_be_taken_back_and_outlive_the_page(self):
        server = self.place()
        begin = self.pose()
        self.drag("frontal", (250, 250), (270, 250))
        one = self.kept()
        self.browser.key("e", "[data-view=frontal]")
        two = self.kept()
        self.assertEqual(
            self.js("return [...document.querySelectorAll('.place-steps button')].map((b) => b.textContent)"),
            ["begin: CT coordinates taken as world coordinates", "move distal", "turn distal"],
        )
        self.js("document.querySelector('[data-do=undo]').click()")
        self.browser.wait("return marrow.place().draft.state_redo === 'turn distal'")
        self.assertEqual(self.pose(), one)
        self.js("document.querySelector('[data-do=undo]').click()")
        self.browser.wait("return marrow.place().draft.state_undo === null")
        self.assertEqual(self.pose(), begin)
        for _ in range(2):
            self.js("document.querySelector('[data-do=redo]').click()")
        self.browser.wait("return marrow.place().draft.state_redo === null")
        self.assertEqual(self.pose(), two)
        self.js("document.querySelectorAll('.place-steps button')[1].click()")
        self.assertEqual(self.kept(), one)
        steps = "return [...document.querySelectorAll('.place-steps button')].map((b) => b.textContent)"
        before = self.js(steps)
        self.show(server, "home")
        self.show(server, "place=case")
        self.assertEqual(self.pose(), one)
        self.assertEqual(self.js(steps), before)

    def test_greys_change_without_a_request(self):
        self.place()
        drawn = lambda: self.js("return marrow.place().views[0].canvas.toDataURL()")
        pictures = [drawn()]
        self.browser.logs()
        for way in ("equalised", "all"):
            self.js("document.querySelector('.xray-look [data-value=%s]').click()" % way)
            pictures.append(drawn())
        self.assertEqual(len(set(pictures)), 3)
        self.assertEqual([url for url in self.browser.logs()[1] if "api/place/image" in url], [])

    def test_the_overlay_is_that_of_the_newest_pose(self):
        server = self.place()
        self.js(
            "const page = marrow.place();"
            "const shift = [[1, 0, 0, 0.5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];"
            "for (let i = 0; i < 30; ++i) page.move(page.placed, shift, i < 29)"
        )
        self.browser.wait("return marrow.place().views.every((view) => !view.inFlight && !view.wanted)")
        server.cookie = "; ".join("%s=%s" % (c["name"], c["value"]) for c in self.browser.driver.get_cookies())
        _, headers, content = self.overlay(server, poses={"distal": self.pose()})
        drawn = self.js(
            "const layer = marrow.place().views[0].paint.layers.get('distal');"
            "return [layer.u_px, layer.columns, [...layer.bytes]]"
        )
        layer = json.loads(headers["X-Marrow-About"])["layers"][0]
        self.assertEqual(drawn[:2], [layer["u_px"], layer["columns"]])
        self.assertEqual(bytes(drawn[2]), content)

    def test_it_registers_from_here(self):
        self.place()
        self.js("marrow.place().show({distal: arguments[0]})", truth())
        for name in ("ARROW_RIGHT", "ARROW_RIGHT", "q"):
            self.browser.key(name, "[data-view=frontal]")
        self.kept()
        self.js("document.querySelector('[data-do=register]').click()")
        self.browser.wait("return marrow.place().steps.current.what === 'register distal by register'")
        self.assertLess(math.dist(self.middle(self.kept()), self.middle(truth())), 0.2)
        self.assertIn("distal: trusted", self.js("return document.querySelector('.place-verdict').textContent"))
        self.assertIn("predicted deviations", self.js("return document.querySelector('.place-steps').textContent"))
        command = shlex.split(self.js("return document.querySelector('.command code').textContent"))
        self.assertEqual(command[-3:], ["case=case", "--set", "case.starts=placed/case/1"])

    def test_each_way_to_show_the_bone_changes_the_picture(self):
        self.place()
        pictures = []
        for mode in ("blend", "wipe", "checkerboard", "edges", "outline"):
            self.js("document.querySelector('[data-value=%s]').click()" % mode)
            self.browser.wait(
                "return marrow.place().views.every((view) => !view.inFlight && view.paint.layers.size === 1)"
            )
            picture = "document.querySelector('[data-view=frontal]').toDataURL()"
            self.browser.wait("return !%s.includes(%s)" % (json.dumps(pictures), picture))  # it is drawn in time
            pictures.append(self.js("return " + picture))

    def test_the_bone_stays_under_the_pointer_in_a_larger_image(self):
        self.place()
        self.browser.key("z", "[data-view=frontal]")
        camera, before = self.camera("frontal"), self.pose()
        u, v, _ = seen(camera, self.middle(before))
        self.drag("frontal", (u, v), (u + 20, v + 10), (u + 30, v - 15))
        new = seen(camera, self.middle(self.kept()))
        self.assertAlmostEqual(new[0] - u, 30, delta=0.5)
        self.assertAlmostEqual(new[1] - v, -15, delta=0.5)

    def test_bones_move_together_or_stay(self):
        file = self.folder / "case" / "case.yaml"
        file.write_text(file.read_text().replace("register: false", "register: true").split("    truth:")[0])
        self.place()
        self.assertEqual([bone["name"] for bone in self.about["bones"]], ["proximal", "distal"])
        placed = lambda: self.js("return structuredClone(marrow.place().placed)")
        begin = placed()
        self.browser.key("ARROW_RIGHT", "[data-view=frontal]")
        self.kept()
        together = placed()
        for bone in begin:
            self.assertAlmostEqual(math.dist(*([pose[bone][i][3] for i in range(3)] for pose in (begin, together))), 1)
        self.js("document.querySelector('.place-bones input').click()")
        self.browser.key("ARROW_RIGHT", "[data-view=frontal]")
        self.kept()
        alone = placed()
        self.assertEqual(alone["proximal"], together["proximal"])
        self.assertNotEqual(alone["distal"], together["distal"])
        layers = self.js("return [...marrow.place().views[0].paint.layers.keys()].sort()")
        self.assertEqual(layers, ["distal", "proximal"])
        fragments = self.js("return marrow.place().draft.document.fragments")
        self.assertEqual({name: one["start"] for name, one in fragments.items()}, alone)

    def test_nothing_is_cut_off_on_a_narrow_page(self):
        for width_px in (1440, 1024, 400):
            self.place(width_px=width_px)
            self.assertLessEqual(self.js("return document.documentElement.scrollWidth"), width_px)


if __name__ == "__main__":
    bench.main()
