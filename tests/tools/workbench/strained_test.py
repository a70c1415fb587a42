#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The server of `marrow open` under strain: requests that are made to break it, connections that send next to nothing,
and reports of many megabytes."""
import os
import pathlib
import socket
import threading
import time
import unittest

from bench import BenchTest

TRICKLERS = 200


class StrainedTest(BenchTest):
    def setUp(self):
        super().setUp()
        self.server = self.open()
        self.server.enter()

    def processor_s(self):
        """Processor time that the server took so far."""
        fields = pathlib.Path("/proc/%d/stat" % self.server.process.pid).read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def seconds_of_a_request(self):
        begin = time.monotonic()
        self.assertEqual(self.server.ask("GET", "/api/listing?path=")[0], 200)
        return time.monotonic() - begin

    def test_a_deeply_nested_request_is_refused(self):
        deep = b'{"case": "a", "revision": 0, "what": "w", "document": {"a": %s%s}}' % (b"[" * 200_000, b"]" * 200_000)
        status, _, content = self.server.ask("POST", "/api/draft/change", deep)
        self.assertEqual(status, 400)
        self.assertIn(b"the request: lists and objects are nested more than 64 deep", content)
        self.assertEqual(self.server.json("GET", "/api/drafts"), [])

    def trickle(self, begin):
        """Connections that send `begin`, then a byte every half second, until they are closed; the seconds of each."""
        self.is_over = False
        seconds = []

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

    def test_connections_that_trickle_hold_up_nobody(self):
        threads, seconds = self.trickle(b"GET / HTTP/1.1\r\nX-Slow: ")
        time.sleep(1)  # until each has a thread of the server
        self.assertLess(max(self.seconds_of_a_request() for _ in range(5)), 1)
        for thread in threads:
            thread.join()
        self.assertLess(max(seconds), 9, "each is closed after the time for a header")
        self.assertEqual(self.server.process.poll(), None)

    def test_it_ends_while_connections_trickle(self):
        self.trickle(b"GET")
        time.sleep(0.5)
        begin = time.monotonic()
        self.server.close()
        self.is_over = True
        self.assertLess(time.monotonic() - begin, 15)

    def test_pages_and_reports_are_sent_as_they_are(self):
        self.server.json("POST", "/api/draft/change", {"case": "a", "revision": 0, "what": "w", "document": {}})
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


if __name__ == "__main__":
    unittest.main(verbosity=2)
