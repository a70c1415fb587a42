#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Files that `marrow open` makes for itself: it removes those that nothing uses any more when it starts."""
import json
import os
import time
import unittest

from bench import BenchTest
from harness import formats

DAY_s = 24 * 3600


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

    def name(self, digit, what="mask", ending=".png"):
        return what + "-" + digit * 32 + ending

    def test_only_what_is_old_and_unused_goes(self):
        unused = [self.put(self.name("a"), 2 * DAY_s), self.put(self.name("b", "camera", ".yaml"), 2 * DAY_s)]
        undone = self.name("c")
        steps = [{"what": "a", "document": {"views": [{"mask": ".marrow/drafts/" + undone}]}}, {"undo": True}]
        self.put("knee.jsonl", 9 * DAY_s, "\n".join(map(json.dumps, steps)))
        kept = [
            self.put(undone, 9 * DAY_s),
            self.put(self.name("e"), DAY_s / 2),
            self.put("notes.png", 9 * DAY_s),
            self.put("mask-of-mine.png", 9 * DAY_s),
            self.drafts / "knee.jsonl",
        ]
        self.open()
        self.assertEqual([one.name for one in unused if one.exists()], [])
        self.assertEqual([one.name for one in kept if not one.exists()], [])

    def test_what_is_asked_for_again_is_young_again(self):
        server = self.open()
        server.enter()
        (self.folder / "a.png").write_bytes(formats.png(2, 1, [128] * 2))
        body = {"image": "a.png", "camera": None, "width_px": 2, "height_px": 1, "runs": [1, 1]}
        first = self.folder / server.json("POST", "/api/xray/mask", body)["mask"]
        os.utime(first, (time.time() - 2 * DAY_s,) * 2)
        self.assertEqual(self.folder / server.json("POST", "/api/xray/mask", body)["mask"], first)
        server.close()
        self.open()
        self.assertTrue(first.exists())

    def test_without_a_draft_that_can_be_read_all_stay(self):
        old = self.put(self.name("a"), 2 * DAY_s)
        (self.drafts / "knee.jsonl").mkdir()
        self.open()
        self.assertTrue(old.exists())


if __name__ == "__main__":
    unittest.main(verbosity=2)
