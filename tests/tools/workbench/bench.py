# SPDX-License-Identifier: Apache-2.0
"""What the tests of `marrow open` share: a server on a folder of its own, and a browser that shows it."""
import http.client
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
import unittest

from harness import MARROW
from harness.page import BrowserTest
from harness.program import marrow


class Server:
    """`marrow open` on a folder. A client without a browser: it has the cookie, and asks as a page does."""

    def __init__(self, folder, *arguments):
        self.process = subprocess.Popen(
            [MARROW, "open", folder, "--no-browser", *map(str, arguments)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "MARROW_CACHE": str(pathlib.Path(folder).parent / "store")},
        )
        for line in self.process.stdout:
            found = re.search(r"http://127\.0\.0\.1:(\d+)/\?token=(\w+)", line)
            if found:
                break
        else:
            raise AssertionError("it printed no address: " + self.process.stderr.read())
        self.address, self.port, self.token = found.group(0), int(found.group(1)), found.group(2)
        self.cookie = None

    def ask(self, method, path, body=None, **headers):
        """(status, headers, bytes) of the answer. Headers that are None are left out."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=600)
        sent = {"Host": "127.0.0.1:%d" % self.port, "Cookie": self.cookie}
        if method != "GET":
            sent.update({"Content-Type": "application/json", "X-Marrow": "1"})
        sent.update({name.replace("_", "-"): value for name, value in headers.items()})
        connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
        data = body if isinstance(body, (bytes, type(None))) else json.dumps(body).encode()
        if method != "GET":
            sent.setdefault("Content-Length", str(len(data or b"")))
        for name, value in sent.items():
            if value is not None:
                connection.putheader(name, value)
        connection.endheaders(data)
        answer = connection.getresponse()
        result = answer.status, answer.headers, answer.read()
        connection.close()
        return result

    def enter(self):
        """Hands in the token, as the browser does that opens the address."""
        status, headers, _ = self.ask("GET", "/?token=" + self.token)
        assert status == 302, status
        self.cookie = headers["Set-Cookie"].split(";")[0]

    def bytes(self, path, body=None):
        """(what is said about the content, the content); with a body, of a POST."""
        status, headers, content = self.ask("GET" if body is None else "POST", path, body)
        assert status == 200, content
        return json.loads(headers["X-Marrow-About"] or "null"), content

    def get(self, path):
        return json.loads(self.bytes(path)[1])

    def post(self, path, **body):
        return json.loads(self.bytes(path, body)[1])

    def fault(self, path, body=None, status=400):
        """The error of an answer that must have this status."""
        answer = self.ask("GET" if body is None else "POST", path, body)
        assert answer[0] == status, answer
        return json.loads(answer[2])["error"]

    def finish(self, job):
        """Waits for a job, and returns its state."""
        while True:
            state = self.get("/api/job?job=%s&since=0" % job)
            if state["state"] != "running":
                return state

    def job(self, path, **body):
        """The state of a job at its end."""
        return self.finish(self.post(path, **body)["job"])

    def done(self, path, **body):
        """The result of a job that must succeed."""
        state = self.job(path, **body)
        assert (state["state"], state["error"]) == ("done", ""), state
        return state["result"]

    def draft(self, case="mine"):
        return self.get("/api/draft?case=" + case)

    def change(self, document, case="mine", **more):
        """The revision of the draft after a change."""
        asked = {"case": case, "revision": self.draft(case)["revision"], "what": "test", "document": document}
        return self.post("/api/draft/change", **{**asked, **more})["revision"]

    def close(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        try:
            self.process.wait(200)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise
        finally:
            self.process.stdout.close()
            self.process.stderr.close()


class BenchTest(unittest.TestCase):
    """Each test has its own folder. A subclass may fill it in setUp(), before it calls open()."""

    def setUp(self):
        self.scratch = pathlib.Path(tempfile.mkdtemp(prefix="marrow-open-"))
        self.addCleanup(shutil.rmtree, self.scratch, ignore_errors=True)
        self.folder = self.scratch / "folder"
        self.folder.mkdir()
        self.server = None

    def open(self, *arguments, folder=None):
        """A new server, which is that of the test from now on."""
        self.server = Server(folder or self.folder, *arguments)
        self.addCleanup(self.server.close)
        return self.server

    def enter(self, **where):
        self.open(**where).enter()
        return self.server

    def marrow(self, *arguments, store="store"):
        """What the program prints, which must succeed. Its store is that of the server, or another one."""
        ended = marrow(*arguments, cwd=self.folder, extra_environment={"MARROW_CACHE": str(self.scratch / store)})
        self.assertEqual(ended.returncode, 0, ended.stderr)
        return ended.stdout


class PageTest(BenchTest, BrowserTest):
    """The same with a browser."""

    def setUp(self):
        super().setUp()
        self.driver = self.browser.driver

    def show(self, page="home", **look):
        """Shows a page of the server, which is started if there is none yet. The browser and the client share the
        server's cookie: who comes first hands in the token."""
        server = self.server or self.open()
        self.browser.look(**look)
        self.driver.get("about:blank")
        address = server.address
        if server.cookie:
            address = "http://127.0.0.1:%d/" % server.port
            name, value = server.cookie.split("=", 1)
            self.driver.execute_cdp_cmd("Network.setCookie", {"name": name, "value": value, "url": address})
        self.driver.get(address + ("" if page == "home" else "#" + page))
        self.wait_for_page(page.split("=")[0])
        if not server.cookie:
            name = "marrow_%d" % server.port  # servers at other ports have cookies here, too
            server.cookie = "%s=%s" % (name, self.driver.get_cookie(name)["value"])
        self.browser.logs()  # those of the page before

    def wait_for_page(self, name):
        self.wait("document.documentElement.dataset.ready === '%s'" % name)

    def no_faults(self):
        self.assertEqual(self.browser.logs()[0], [])

    def find(self, selector):
        """Waits for an element."""
        self.wait("!!document.querySelector(%s)" % json.dumps(selector))
        return self.driver.find_element("css selector", selector)

    def says(self, selector, part):
        """Waits until one of the elements has this in its text."""
        holds = "[...document.querySelectorAll(%r)].some((one) => one.textContent.includes(%s))"
        self.wait(holds % (selector, json.dumps(part)))

    def do(self, name):
        """Presses a button that stands for what it does, in sight or not."""
        self.find("[data-do=%s]" % name)
        self.the("[data-do=%s]" % name, "one.click()")

    def in_sight(self, selector):
        """On the page "Case", goes to the step whose tools hold the element."""
        element = self.find(selector)
        step = self.js("return arguments[0].closest('[data-of-step][hidden]')?.dataset.ofStep || null", element)
        if step:
            self.go_to_step(step)
        self.js("arguments[0].scrollIntoView({block: 'center'})", element)
        return element

    def go_to_step(self, name):
        """Shows the tools of a step on the page "Case"."""
        self.driver.find_element("css selector", '[data-step="%s"]' % name).click()

    def click(self, selector):
        from selenium.common.exceptions import StaleElementReferenceException

        for _ in range(5):
            try:
                return self.in_sight(selector).click()
            except StaleElementReferenceException:  # the page was drawn again after it was found
                pass
        self.fail("%s is drawn again and again" % selector)

    def set(self, selector, value, event="change"):
        """Puts a value into a field, and leaves it."""
        self.find(selector)
        self.js(
            "const one = document.querySelector(arguments[0]); one.value = arguments[1];"
            "one.dispatchEvent(new Event(arguments[2], {bubbles: true}))",
            selector,
            value,
            event,
        )

    def saved_when(self, condition):
        """Waits until the draft of the case 'mine' fulfils a condition, and returns it."""

        def holds():
            document = self.server.draft()["document"]
            return condition(document) and document

        return self.until(holds, "the draft", 240)


PIPELINE = """\
marrow: 1
name: small
inputs:
  level: {type: number, help: height of the fracture}
nodes:
  bone: {uses: simulate.femur}
  fracture: {uses: simulate.fracture, in: {bone: bone}, with: {height_fraction: $level}}
  cameras:   # two views
    uses: camera.carm
    with:
      names: [frontal, lateral]   # as in the clinic
      width_px: 96
      height_px: 96
      pixel_mm: 3
  views: {uses: simulate.fluoroscopy, in: {phantom: fracture, cameras: cameras}}
  edges: {uses: edges.canny, in: {view: views}, with: {noise_high: 5}}  # quick
  truth: {uses: simulate.truth, in: {phantom: fracture}}
outputs: {cameras: cameras, edges: edges, model: truth.models}
"""


class PipelineBench(BenchTest):
    def setUp(self):
        super().setUp()
        self.file = self.folder / "small.yaml"
        self.file.write_text(PIPELINE)
