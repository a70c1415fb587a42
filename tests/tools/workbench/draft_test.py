#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Cases that are being made: every change is kept, and none is lost. Of the files that `marrow open` makes beside them,
it removes those that nothing uses any more when it starts."""
import json
import os
import subprocess
import time
import unittest

from bench import BenchTest
from harness import formats
from server_test import DEEP

DAY_s = 24 * 3600


class DraftTest(BenchTest):
    def setUp(self):
        super().setUp()
        self.drafts = self.folder / ".marrow" / "drafts"

    def change(self, what, **document):
        self.server.change(document, "a", what=what)

    def state(self):
        return self.server.draft("a")

    def fault(self, revision, **document):
        asked = {"case": "a", "revision": revision, "what": "w", "document": document}
        return self.server.fault("/api/draft/change", asked, 400 if revision else 409)

    def test_each_change_outlives_a_crash_and_can_be_taken_back(self):
        self.enter()
        self.assertEqual(self.state()["document"], {"ct": None, "views": [], "fragments": {}, "landmarks": []})
        for i in range(5):
            self.change("step %d" % i, n=i)
        self.server.process.kill()
        self.server.process.wait()
        self.enter()
        state = self.state()
        self.assertEqual((state["document"], state["undo"], state["redo"]), ({"n": 4}, "step 4", None))
        step = lambda way, state: self.server.post("/api/draft/" + way, case="a", revision=state["revision"])
        for n in (3, 2, 1, 0):
            state = step("undo", state)
            self.assertEqual((state["document"], state["redo"]), ({"n": n}, "step %d" % (n + 1)))
        state = step("undo", state)
        self.assertEqual((state["document"]["views"], state["undo"]), ([], None))
        state = step("redo", state)
        self.assertEqual(state["document"], {"n": 0})
        self.change("another way", n=9)
        self.assertEqual((self.state()["redo"], self.state()["undo"]), (None, "another way"))

    def test_of_two_tabs_the_later_one_is_told_and_two_programs_see_each_other(self):
        one = self.enter()
        self.change("first tab", n=1)
        told = "this case was changed in another tab; the page now shows what is newest"
        self.assertEqual(self.fault(0, n=2), told)
        self.enter()
        self.assertEqual(self.state()["document"], {"n": 1})
        self.change("two", n=2)
        self.assertEqual(one.draft("a")["document"], {"n": 2})

    def test_half_a_line_of_a_crash_is_left_out(self):
        self.enter()
        self.change("good", n=1)
        file = self.drafts / "a.jsonl"
        file.write_text(file.read_text() + '{"what": "half')
        self.assertEqual(self.state()["document"], {"n": 1})
        self.change("better", n=2)
        self.server.close()
        self.enter()
        self.assertEqual(self.state()["document"], {"n": 2}, "the half line did not spoil the next one")

    def test_a_draft_that_cannot_be_read_is_told_and_can_be_thrown_away(self):
        self.drafts.mkdir(parents=True)
        for garbage, fault in (
            ("garbage\n", ":1:1:1: not valid JSON"),
            ("garbage", " holds no changes of a case"),
            ('{"undo": true}\n', ":1: this is no change of a case"),
            ('{"document": 7}\n', ":1: this is no change of a case"),
            ('{"document": {"a": %s}}\n' % DEEP, ":1: lists and objects are nested more than 64 deep"),
        ):
            (self.drafts / "a.jsonl").write_text(garbage)
            server, fault = self.enter(), "the draft .marrow/drafts/a.jsonl" + fault
            self.assertIn(fault, server.fault("/api/draft?case=a"))
            (row,) = server.get("/api/drafts")
            self.assertEqual(row["case"], "a")
            self.assertIn(fault, row["fault"])
            server.post("/api/draft/throw-away", case="a")
            self.assertEqual(server.get("/api/drafts"), [])
            self.assertEqual(self.state()["undo"], None)
            server.close()

    def test_drafts_that_are_not_saved_are_listed(self):
        server = self.enter()
        self.assertEqual(server.get("/api/drafts"), [])
        self.change("one", n=1)
        self.change("two", n=2)
        name = "cases/7 % ü"
        server.post("/api/draft/change", case=name, revision=0, what="x", document={})
        rows = {row["case"]: row["changes"] for row in server.get("/api/drafts")}
        self.assertEqual(rows, {"a": 2, name: 1})
        server.post("/api/draft/throw-away", case="a")
        self.assertEqual([row["case"] for row in server.get("/api/drafts")], [name])
        self.assertEqual(self.state()["document"]["views"], [], "the case begins anew")
        again = server.fault("/api/draft/throw-away", {"case": "a"})
        self.assertEqual(again, "there is no draft of this case")
        self.assertIn("leads out of the folder", server.fault("/api/draft/throw-away", {"case": "../x"}))

    @unittest.skipUnless(os.geteuid() == 0, "only root can mount a small disk")
    def test_a_full_disk_loses_nothing(self):
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", self.folder])
        if mounted.returncode != 0:
            self.skipTest("no disk can be mounted here")
        self.addCleanup(subprocess.run, ["umount", "-l", self.folder])
        self.enter()
        self.change("small", n=1)
        state = self.state()
        told = "the change is not kept in the draft: No space left on device; make room and try again"
        self.assertEqual(self.fault(state["revision"], n="x" * 200_000), told)
        self.assertEqual(self.state(), state)
        self.change("small", n=2)


class WorkingFilesTest(BenchTest):
    def setUp(self):
        super().setUp()
        self.drafts = self.folder / ".marrow" / "drafts"
        self.drafts.mkdir(parents=True)

    def put(self, name, age_s, text="x"):
        path = self.drafts / name
        path.write_text(text)
        os.utime(path, (time.time() - age_s,) * 2)
        return path

    def mask(self, digit):
        return "mask-" + digit * 32 + ".png"

    def test_only_what_is_old_and_unused_goes(self):
        unused = [self.put(self.mask("a"), 2 * DAY_s), self.put("camera-" + "b" * 32 + ".yaml", 2 * DAY_s)]
        undone = self.mask("c")
        steps = [{"what": "a", "document": {"views": [{"mask": ".marrow/drafts/" + undone}]}}, {"undo": True}]
        kept = [self.put("knee.jsonl", 9 * DAY_s, "\n".join(map(json.dumps, steps)))]
        ages = {undone: 9 * DAY_s, self.mask("e"): DAY_s / 2, "notes.png": 9 * DAY_s, "mask-of-mine.png": 9 * DAY_s}
        kept += [self.put(name, age_s) for name, age_s in ages.items()]
        self.open()
        self.assertEqual([one.name for one in unused if one.exists()], [])
        self.assertEqual([one.name for one in kept if not one.exists()], [])

    def test_what_is_asked_for_again_is_young_again(self):
        self.enter()
        (self.folder / "a.png").write_bytes(formats.png(2, 1, [128] * 2))
        body = {"image": "a.png", "camera": None, "width_px": 2, "height_px": 1, "runs": [1, 1]}
        mask = lambda: self.folder / self.server.post("/api/xray/mask", **body)["mask"]
        first = mask()
        os.utime(first, (time.time() - 2 * DAY_s,) * 2)
        self.assertEqual(mask(), first)
        self.server.close()
        self.open()
        self.assertTrue(first.exists())

    def test_without_a_draft_that_can_be_read_all_stay(self):
        old = self.put(self.mask("a"), 2 * DAY_s)
        (self.drafts / "knee.jsonl").mkdir()
        self.open()
        self.assertTrue(old.exists())


if __name__ == "__main__":
    unittest.main(verbosity=2)
