#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Who can reach the server of `marrow open`, and its answers to requests that none of its pages sends."""
import json
import os
import pathlib
import socket
import subprocess
import unittest

from bench import MARROW, BenchTest


class ServerTest(BenchTest):
    def error(self, answer):
        return json.loads(answer[2])["error"]

    def test_it_listens_at_this_machine_only(self):
        server = self.open()
        places = []  # as the kernel writes them: 0100007F is 127.0.0.1, and 0A a socket that listens
        for table in ("/proc/net/tcp", "/proc/net/tcp6"):
            for line in pathlib.Path(table).read_text().splitlines()[1:]:
                address, port = line.split()[1].split(":")
                if int(port, 16) == server.port and line.split()[3] == "0A":
                    places.append(address)
        self.assertEqual(places, ["0100007F"])

    def test_the_address_works_once_and_the_cookie_after_it(self):
        server = self.open()
        status, headers, _ = server.ask("GET", "/?token=" + server.token)
        self.assertEqual((status, headers["Location"]), (302, "/"))
        name = "marrow_%d=" % server.port
        self.assertTrue(headers["Set-Cookie"].startswith(name), headers["Set-Cookie"])
        for part in ("HttpOnly", "SameSite=Strict", "Path=/"):
            self.assertIn("; " + part, headers["Set-Cookie"])
        again = server.ask("GET", "/?token=" + server.token)
        self.assertEqual(again[0], 403)
        self.assertEqual(self.error(again), "this address was used before; start 'marrow open' again for a new one")
        server.cookie = headers["Set-Cookie"].split(";")[0]
        self.assertEqual(server.ask("GET", "/")[0], 200)
        self.assertEqual(server.ask("GET", "/?token=" + server.token)[0], 302, "its own browser may come again")

    def test_without_the_cookie_nothing_is_told(self):
        server = self.open()
        for cookie in (None, "marrow_%d=" % server.port, "marrow_%d=%s" % (server.port, "0" * 64)):
            for path in ("/", "/api/folder", "/workbench.js", "/nowhere"):
                answer = server.ask("GET", path, Cookie=cookie)
                self.assertEqual(answer[0], 403, path)
                self.assertEqual(
                    self.error(answer),
                    "this browser is not known here; open the address that 'marrow open' printed, or start it again",
                )
        wrong = server.ask("GET", "/?token=" + "0" * 64)
        self.assertEqual(wrong[0], 403)
        self.assertEqual(
            self.error(wrong),
            "the token in this address is not that of this server; copy the whole address that 'marrow open' printed",
        )

    def test_other_hosts_and_pages_of_other_sites_reach_nothing(self):
        server = self.open()
        server.enter()
        for host in ("evil.example", "evil.example:%d" % server.port, "127.0.0.1", "", None, "127.0.0.1:1"):
            answer = server.ask("GET", "/api/folder", Host=host)
            self.assertIn(answer[0], (400, 403), host)
            if answer[0] == 403:
                self.assertTrue(self.error(answer).startswith("this server answers only to 127.0.0.1:"))
        self.assertEqual(server.ask("GET", "/api/folder", Host="localhost:%d" % server.port)[0], 200)
        for headers in (
            {"Origin": "http://evil.example"},
            {"Origin": "null"},
            {"Origin": "http://127.0.0.1:1"},
            {"Sec_Fetch_Site": "cross-site"},
        ):
            answer = server.ask("GET", "/api/folder", **headers)
            self.assertEqual((answer[0], self.error(answer)), (403, "a page of another site may not ask this server"))

    def test_changes_need_json_and_a_header_of_their_own(self):
        server = self.open()
        server.enter()
        body = {"case": "a", "revision": 0, "what": "w", "document": {}}
        for headers, fault in (
            ({"X_Marrow": None}, "the header X-Marrow is missing"),
            ({"Content_Type": "text/plain"}, "only JSON may be sent here"),
            ({"Content_Type": None}, "only JSON may be sent here"),
        ):
            answer = server.ask("POST", "/api/draft/change", body, **headers)
            self.assertEqual((answer[0], self.error(answer)), (403, fault))
        self.assertFalse((self.folder / ".marrow").exists())
        for method in ("PUT", "DELETE", "OPTIONS"):
            self.assertNotEqual(server.ask(method, "/api/draft/change", body)[0], 200)
        for broken, fault in (
            (b"", "the request:1:1: not valid JSON"),
            (b"{", "the request:1:2: not valid JSON"),
            (b"[]", "the request is no JSON object"),
            (b"\xff", "the request:1:1: not valid JSON"),
        ):
            answer = server.ask("POST", "/api/draft/change", broken)
            self.assertEqual((answer[0], self.error(answer)), (400, fault))

    def test_pages_may_load_nothing_from_elsewhere(self):
        server = self.open()
        server.enter()
        _, headers, page = server.ask("GET", "/")
        policy = headers["Content-Security-Policy"]
        self.assertIn("default-src 'none'", policy)
        self.assertNotIn("unsafe", policy)
        self.assertEqual(headers["X-Content-Type-Options"], "nosniff")
        self.assertIsNone(headers["Access-Control-Allow-Origin"])
        self.assertNotIn(b" style=", page)

    def test_paths_stay_in_the_folder(self):
        (self.scratch / "secret").mkdir()
        (self.scratch / "secret" / "case.yaml").write_text("marrow-case: 1\n")
        (self.folder / "link").symlink_to(self.scratch / "secret")
        (self.folder / "inside").mkdir()
        (self.folder / "good").symlink_to(self.folder / "inside")
        server = self.open()
        server.enter()
        for path in ("..", "../secret", "inside/../../secret", "link", "/etc", "link/case.yaml", "..%00", "a/../.."):
            answer = server.ask("GET", "/api/listing?path=" + path)
            self.assertEqual(answer[0], 400, path)
            self.assertIn(" leads out of the folder that is open, ", self.error(answer))
            self.assertEqual(server.ask("GET", "/api/draft?case=" + path)[0], 400)
        for path in ("", "inside", "good", "inside/../inside", "inside/"):
            self.assertEqual(server.ask("GET", "/api/listing?path=" + path)[0], 200, path)
        self.assertEqual(server.json("GET", "/api/folder")["cases"], [], "a link is not followed")

    def test_names_come_as_they_are(self):
        name = "<img src=x onerror=alert(1)>&'\"ü"
        (self.folder / name).mkdir()
        (self.folder / os.fsdecode(b"not-\xff-utf8")).mkdir()
        server = self.open()
        server.enter()
        self.assertIn(name, server.json("GET", "/api/listing?path=")["folders"])

    def test_too_much_is_refused(self):
        server = self.open()
        server.enter()
        answer = server.ask("POST", "/api/draft/change", b"", Content_Length="100000000")
        self.assertEqual((answer[0], self.error(answer)), (413, "the request is too large; at most 64 MB can be sent"))
        self.assertIn(server.ask("GET", "/" + "a" * 100_000)[0], (400, 403, 414))
        idle = [socket.create_connection(("127.0.0.1", server.port)) for _ in range(20)]
        self.assertEqual(server.ask("GET", "/api/folder")[0], 200, "connections that say nothing hold up nobody")
        for one in idle:
            one.close()
        answer = server.ask("GET", "/api/job?job=1&since=x")
        self.assertEqual(self.error(answer), "'since' must be a whole number from 0 to 1000000, got 'x'")
        self.assertEqual(self.error(server.ask("GET", "/api/job?job=7&since=0")), "there is no job '7'")
        self.assertEqual(self.error(server.ask("GET", "/api/listing")), "the request lacks 'path'")
        self.assertEqual(self.error(server.ask("GET", "/api/nothing")), "there is no such page")

    def test_what_cannot_be_opened(self):
        for place, fault in (
            ("nowhere", "No such file or directory"),
            ("notes.txt", "open a folder, a case.yaml or a pipeline"),
        ):
            (self.folder / "notes.txt").write_text("")
            ended = subprocess.run(
                [MARROW, "open", self.folder / place, "--no-browser"], capture_output=True, text=True
            )
            self.assertEqual(ended.returncode, 2)
            self.assertIn(fault, ended.stderr)
        taken = self.open()
        ended = subprocess.run(
            [MARROW, "open", self.folder, "--no-browser", "--port", str(taken.port)], capture_output=True, text=True
        )
        self.assertEqual(
            (ended.returncode, ended.stderr),
            (2, "marrow: error: the port is taken, or may not be used; give another with --port, or leave it out\n"),
        )

    def test_ctrl_c_ends_it(self):
        server = self.open()
        server.close()
        self.assertEqual(server.process.returncode, 0)


class DraftTest(BenchTest):
    """Cases that are being made: every change is kept, and none is lost."""

    def change(self, server, revision, what, **document):
        return server.ask(
            "POST", "/api/draft/change", {"case": "a", "revision": revision, "what": what, "document": document}
        )

    def state(self, server):
        return server.json("GET", "/api/draft?case=a")

    def test_each_change_outlives_a_crash_and_can_be_taken_back(self):
        server = self.open()
        server.enter()
        self.assertEqual(self.state(server)["document"], {"ct": None, "views": [], "fragments": {}, "landmarks": []})
        for i in range(5):
            self.assertEqual(self.change(server, self.state(server)["revision"], "step %d" % i, n=i)[0], 200)
        server.process.kill()
        server.process.wait()
        other = self.open()
        other.enter()
        state = self.state(other)
        self.assertEqual((state["document"], state["undo"], state["redo"]), ({"n": 4}, "step 4", None))
        for n in (3, 2, 1, 0):
            state = other.json("POST", "/api/draft/undo", {"case": "a", "revision": state["revision"]})
            self.assertEqual((state["document"], state["redo"]), ({"n": n}, "step %d" % (n + 1)))
        state = other.json("POST", "/api/draft/undo", {"case": "a", "revision": state["revision"]})
        self.assertEqual((state["document"]["views"], state["undo"]), ([], None))
        state = other.json("POST", "/api/draft/redo", {"case": "a", "revision": state["revision"]})
        self.assertEqual(state["document"], {"n": 0})
        self.assertEqual(self.change(other, state["revision"], "another way", n=9)[0], 200)
        self.assertEqual((self.state(other)["redo"], self.state(other)["undo"]), (None, "another way"))

    def test_of_two_tabs_the_later_one_is_told(self):
        server = self.open()
        server.enter()
        self.assertEqual(self.change(server, 0, "first tab", n=1)[0], 200)
        answer = self.change(server, 0, "second tab", n=2)
        self.assertEqual(answer[0], 409)
        self.assertEqual(
            json.loads(answer[2])["error"], "this case was changed in another tab; the page now shows what is newest"
        )
        self.assertEqual(self.state(server)["document"], {"n": 1})

    def test_two_programs_on_one_folder_see_each_other(self):
        one, two = self.open(), self.open()
        one.enter()
        two.enter()
        self.assertEqual(self.change(one, self.state(one)["revision"], "one", n=1)[0], 200)
        self.assertEqual(self.state(two)["document"], {"n": 1})
        self.assertEqual(self.change(two, self.state(two)["revision"], "two", n=2)[0], 200)
        self.assertEqual(self.state(one)["document"], {"n": 2})

    def test_half_a_line_of_a_crash_is_left_out(self):
        server = self.open()
        server.enter()
        self.change(server, 0, "good", n=1)
        file = self.folder / ".marrow" / "drafts" / "a.jsonl"
        file.write_text(file.read_text() + '{"what": "half')
        self.assertEqual(self.state(server)["document"], {"n": 1})
        self.assertEqual(self.change(server, self.state(server)["revision"], "better", n=2)[0], 200)
        server.close()
        other = self.open()
        other.enter()
        self.assertEqual(self.state(other)["document"], {"n": 2}, "the half line did not spoil the next one")

    def test_a_draft_that_cannot_be_read_is_told_and_can_be_thrown_away(self):
        drafts = self.folder / ".marrow" / "drafts"
        drafts.mkdir(parents=True)
        deep = '{"document": {"a": %s%s}}\n' % ("[" * 200_000, "]" * 200_000)
        for garbage, fault in (
            ("garbage\n", "the draft .marrow/drafts/a.jsonl:1:1:1: not valid JSON"),
            ("garbage", "the draft .marrow/drafts/a.jsonl holds no changes of a case"),
            ('{"undo": true}\n', "the draft .marrow/drafts/a.jsonl:1: this is no change of a case"),
            ('{"document": 7}\n', "the draft .marrow/drafts/a.jsonl:1: this is no change of a case"),
            (deep, "the draft .marrow/drafts/a.jsonl:1: lists and objects are nested more than 64 deep"),
        ):
            (drafts / "a.jsonl").write_text(garbage)
            server = self.open()
            server.enter()
            status, _, content = server.ask("GET", "/api/draft?case=a")
            self.assertEqual(status, 400, garbage[:40])
            self.assertIn(fault, json.loads(content)["error"])
            (row,) = server.json("GET", "/api/drafts")
            self.assertEqual(row["case"], "a")
            self.assertIn(fault, row["fault"])
            server.json("POST", "/api/draft/throw-away", {"case": "a"})
            self.assertEqual(server.json("GET", "/api/drafts"), [])
            self.assertEqual(self.state(server)["undo"], None)
            server.close()

    def test_drafts_that_are_not_saved_are_listed(self):
        server = self.open()
        server.enter()
        self.assertEqual(server.json("GET", "/api/drafts"), [])
        self.change(server, 0, "one", n=1)
        self.change(server, 1, "two", n=2)
        name = "cases/7 % ü"
        server.json("POST", "/api/draft/change", {"case": name, "revision": 0, "what": "x", "document": {}})
        rows = {row["case"]: row for row in server.json("GET", "/api/drafts")}
        self.assertEqual(sorted(rows), ["a", name])
        self.assertEqual((rows["a"]["changes"], rows[name]["changes"]), (2, 1))
        server.json("POST", "/api/draft/throw-away", {"case": "a"})
        self.assertEqual([row["case"] for row in server.json("GET", "/api/drafts")], [name])
        self.assertEqual(self.state(server)["document"]["views"], [], "the case begins anew")
        answer = server.ask("POST", "/api/draft/throw-away", {"case": "a"})
        self.assertEqual(json.loads(answer[2])["error"], "there is no draft of this case")
        answer = server.ask("POST", "/api/draft/throw-away", {"case": "../x"})
        self.assertIn("leads out of the folder", json.loads(answer[2])["error"])

    @unittest.skipUnless(os.geteuid() == 0, "only root can mount a small disk")
    def test_a_full_disk_loses_nothing(self):
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", self.folder])
        if mounted.returncode != 0:
            self.skipTest("no disk can be mounted here")
        self.addCleanup(subprocess.run, ["umount", "-l", self.folder])
        server = self.open()
        server.enter()
        self.assertEqual(self.change(server, 0, "small", n=1)[0], 200)
        state = self.state(server)
        answer = self.change(server, state["revision"], "large", n="x" * 200_000)
        self.assertEqual(answer[0], 400)
        self.assertEqual(
            json.loads(answer[2])["error"],
            "the change is not kept in the draft: No space left on device; make room and try again",
        )
        self.assertEqual(self.state(server), state)
        self.assertEqual(self.change(server, state["revision"], "small", n=2)[0], 200)


if __name__ == "__main__":
    unittest.main(verbosity=2)
