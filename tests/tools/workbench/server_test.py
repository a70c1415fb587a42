#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Who can reach the server of `marrow open`, its answers to requests that none of its pages sends, and how it bears
strain: requests that are made to break it, connections that send next to nothing, and reports of many megabytes."""
import json
import os
import pathlib
import socket
import subprocess
import threading
import time
import unittest

from bench import BenchTest
from harness import formats
from harness.program import marrow

TRICKLERS = 200
NOT_KNOWN = "this browser is not known here; open the address that 'marrow open' printed, or start it again"
DEEP = "%s%s" % ("[" * 200_000, "]" * 200_000)


class ServerTest(BenchTest):
    def refused(self, fault, *asked, status=403, **headers):
        answer = self.server.ask(*asked, **headers)
        self.assertEqual((answer[0], json.loads(answer[2])["error"]), (status, fault), (asked, headers))

    def test_it_listens_at_this_machine_only_and_ends_when_told(self):
        self.open()
        places = []  # as the kernel writes them: 0100007F is 127.0.0.1, and 0A a socket that listens
        for table in ("/proc/net/tcp", "/proc/net/tcp6"):
            for line in pathlib.Path(table).read_text().splitlines()[1:]:
                address, port = line.split()[1].split(":")
                if int(port, 16) == self.server.port and line.split()[3] == "0A":
                    places.append(address)
        self.assertEqual(places, ["0100007F"])
        self.server.close()
        self.assertEqual(self.server.process.returncode, 0)

    def test_the_address_works_once_and_the_cookie_after_it(self):
        server = self.open()
        page = "/?token=" + server.token
        status, headers, _ = server.ask("GET", page)
        self.assertEqual((status, headers["Location"]), (302, "/"))
        self.assertTrue(headers["Set-Cookie"].startswith("marrow_%d=" % server.port), headers["Set-Cookie"])
        for part in ("HttpOnly", "SameSite=Strict", "Path=/"):
            self.assertIn("; " + part, headers["Set-Cookie"])
        self.refused("this address was used before; start 'marrow open' again for a new one", "GET", page)
        server.cookie = headers["Set-Cookie"].split(";")[0]
        self.assertEqual(server.ask("GET", "/")[0], 200)
        self.assertEqual(server.ask("GET", page)[0], 302, "its own browser may come again")

    def test_without_the_cookie_nothing_is_told(self):
        server = self.open()
        for cookie in (None, "marrow_%d=" % server.port, "marrow_%d=%s" % (server.port, "0" * 64)):
            for path in ("/", "/api/folder", "/workbench.js", "/nowhere"):
                self.refused(NOT_KNOWN, "GET", path, Cookie=cookie)
        fault = (
            "the token in this address is not that of this server; copy the whole address that 'marrow open' printed"
        )
        self.refused(fault, "GET", "/?token=" + "0" * 64)

    def test_other_hosts_and_pages_of_other_sites_reach_nothing(self):
        server = self.enter()
        for host in ("evil.example", "evil.example:%d" % server.port, "127.0.0.1", "", None, "127.0.0.1:1"):
            answer = server.ask("GET", "/api/folder", Host=host)
            self.assertIn(answer[0], (400, 403), host)
            if answer[0] == 403:
                self.assertTrue(json.loads(answer[2])["error"].startswith("this server answers only to 127.0.0.1:"))
        self.assertEqual(server.ask("GET", "/api/folder", Host="localhost:%d" % server.port)[0], 200)
        for header, value in (
            ("Origin", "http://evil.example"),
            ("Origin", "null"),
            ("Origin", "http://127.0.0.1:1"),
            ("Sec_Fetch_Site", "cross-site"),
        ):
            fault = "a page of another site may not ask this server"
            self.refused(fault, "GET", "/api/folder", **{header: value})

    def test_changes_need_json_and_a_header_of_their_own(self):
        server = self.enter()
        body = {"case": "a", "revision": 0, "what": "w", "document": {}}
        change = ("POST", "/api/draft/change")
        self.refused("the header X-Marrow is missing", *change, body, X_Marrow=None)
        for kind in ("text/plain", None):
            self.refused("only JSON may be sent here", *change, body, Content_Type=kind)
        self.assertFalse((self.folder / ".marrow").exists())
        for method in ("PUT", "DELETE", "OPTIONS"):
            self.assertNotEqual(server.ask(method, "/api/draft/change", body)[0], 200)
        for broken, fault in (
            (b"", "the request:1:1: not valid JSON"),
            (b"{", "the request:1:2: not valid JSON"),
            (b"[]", "the request is no JSON object"),
            (b"\xff", "the request:1:1: not valid JSON"),
        ):
            self.refused(fault, *change, broken, status=400)
        deep = json.dumps(body).replace("{}", '{"a": %s}' % DEEP).encode()
        self.assertIn("the request: lists and objects are nested more than 64 deep", server.fault(change[1], deep))
        self.assertEqual(server.get("/api/drafts"), [])

    def test_pages_may_load_nothing_from_elsewhere(self):
        _, headers, page = self.enter().ask("GET", "/")
        policy = headers["Content-Security-Policy"]
        self.assertIn("default-src 'none'", policy)
        self.assertNotIn("unsafe", policy)
        self.assertEqual(headers["X-Content-Type-Options"], "nosniff")
        self.assertIsNone(headers["Access-Control-Allow-Origin"])
        self.assertNotIn(b" style=", page)

    def test_paths_stay_in_the_folder_and_names_come_as_they_are(self):
        name = "<img src=x onerror=alert(1)>&'\"ü"
        (self.scratch / "secret").mkdir()
        (self.scratch / "secret" / "case.yaml").write_text("marrow-case: 1\n")
        (self.folder / "link").symlink_to(self.scratch / "secret")
        for inside in ("inside", name, os.fsdecode(b"not-\xff-utf8")):
            (self.folder / inside).mkdir()
        (self.folder / "good").symlink_to(self.folder / "inside")
        server = self.enter()
        for path in ("..", "../secret", "inside/../../secret", "link", "/etc", "link/case.yaml", "..%00", "a/../.."):
            fault = server.fault("/api/listing?path=" + path)
            self.assertIn(" leads out of the folder that is open, ", fault)
            server.fault("/api/draft?case=" + path)
        for path in ("", "inside", "good", "inside/../inside", "inside/"):
            self.assertEqual(server.ask("GET", "/api/listing?path=" + path)[0], 200, path)
        self.assertEqual(server.get("/api/folder")["cases"], [], "a link is not followed")
        self.assertIn(name, server.get("/api/listing?path=")["folders"])

    def test_too_much_is_refused(self):
        server = self.enter()
        change, fault = ("POST", "/api/draft/change", b""), "the request is too large; at most 64 MB can be sent"
        self.refused(fault, *change, status=413, Content_Length="100000000")
        self.assertIn(server.ask("GET", "/" + "a" * 100_000)[0], (400, 403, 414))
        idle = [socket.create_connection(("127.0.0.1", server.port)) for _ in range(20)]
        self.assertEqual(server.ask("GET", "/api/folder")[0], 200, "connections that say nothing hold up nobody")
        for one in idle:
            one.close()
        for path, fault in (
            ("/api/job?job=1&since=x", "'since' must be a whole number from 0 to 1000000, got 'x'"),
            ("/api/job?job=7&since=0", "there is no job '7'"),
            ("/api/listing", "the request lacks 'path'"),
        ):
            self.assertEqual(server.fault(path), fault)
        self.assertEqual(json.loads(server.ask("GET", "/api/nothing")[2])["error"], "there is no such page")

    def test_what_cannot_be_opened(self):
        (self.folder / "notes.txt").write_text("")
        taken = "marrow: error: the port is taken, or may not be used; give another with --port, or leave it out\n"
        for place, fault, *more in (
            ("nowhere", "No such file or directory"),
            ("notes.txt", "open a folder, a case.yaml or a pipeline"),
            (".", taken, "--port", self.open().port),
        ):
            ended = marrow("open", self.folder / place, "--no-browser", *more)
            self.assertEqual(ended.returncode, 2)
            (self.assertEqual if fault == taken else self.assertIn)(fault, ended.stderr)


class StrainedTest(BenchTest):
    def trickle(self, begin):
        """Connections that send `begin`, then a byte every half second, until they are closed; the seconds of each."""
        self.is_over, seconds = False, []

        def one():
            connection = socket.create_connection(("127.0.0.1", self.server.port))
            start = time.monotonic()
            try:
                connection.sendall(begin)
                while not self.is_over and time.monotonic() - start < 30:
                    connection.sendall(b"a")
                    connection.settimeout(0.5)
                    try:
                        if not connection.recv(1):
                            break
                    except socket.timeout:
                        pass
            except OSError:
                pass
            seconds.append(time.monotonic() - start)
            connection.close()

        threads = [threading.Thread(target=one) for _ in range(TRICKLERS)]
        for thread in threads:
            thread.start()
        self.addCleanup(lambda: [thread.join() for thread in threads])
        return threads, seconds

    def test_connections_that_trickle_hold_up_nobody_nor_its_end(self):
        self.enter()
        threads, seconds = self.trickle(b"GET / HTTP/1.1\r\nX-Slow: ")
        time.sleep(1)  # until each has a thread of the server
        for _ in range(5):
            begin = time.monotonic()
            self.assertEqual(self.server.ask("GET", "/api/listing?path=")[0], 200)
            self.assertLess(time.monotonic() - begin, 1)
        for thread in threads:
            thread.join()
        self.assertLess(max(seconds), 9, "each is closed after the time for a header")
        self.assertEqual(self.server.process.poll(), None)
        self.trickle(b"GET")
        time.sleep(0.5)
        begin = time.monotonic()
        self.server.close()
        self.is_over = True
        self.assertLess(time.monotonic() - begin, 15)

    def processor_s(self):
        """Processor time that the server took so far."""
        fields = pathlib.Path("/proc/%d/stat" % self.server.process.pid).read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def test_pages_and_reports_are_sent_as_they_are(self):
        self.enter().change({}, "a")
        run = self.folder / "run"
        run.mkdir()
        (run / "run.json").write_text("{}")
        (run / "report.html").write_bytes(b"<p>" + os.urandom(4_500_000).hex().encode())  # 9 MB
        for path in ("/workbench.js", "/results/report.html?folder=run"):
            before, begin = self.processor_s(), time.monotonic()
            for _ in range(3):
                status, headers, content = self.server.ask("GET", path, Accept_Encoding="gzip, deflate, br")
                self.assertEqual((status, headers["Content-Encoding"]), (200, None), path)
                self.assertEqual(int(headers["Content-Length"]), len(content))
            self.assertLess(time.monotonic() - begin, 3, path)
            self.assertLess(self.processor_s() - before, 0.5, path)


DAY_s = 24 * 3600


class DraftTest(BenchTest):
    """Cases that are being made: every change is kept, and none is lost."""

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
    """What nothing uses any more is removed when `marrow open` starts."""

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
