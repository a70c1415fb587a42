# SPDX-License-Identifier: Apache-2.0
"""What the tests of `marrow open` share: a server on a folder of its own, and a browser that shows it."""
import atexit
import http.client
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from harness import MARROW, SHARED_CACHE, SOURCE, skip
from harness import browser as chromium
from harness.sample import sample

os.environ["MARROW_CACHE"] = tempfile.mkdtemp(prefix="marrow-cache-")  # not the store of the person who runs the tests
atexit.register(shutil.rmtree, os.environ["MARROW_CACHE"], ignore_errors=True)

SMALL = ["--set", "ct.spacing_mm=[1.2, 1.2, 1.5]", "--set", "ct.range_mm=[0, 300]"]  # 0.8 s instead of 5 s to make


def simulate(folder, *arguments, pipeline=SOURCE / "pipelines" / "simulate" / "simulate.yaml"):
    """Runs a simulation, and returns the folder of its outputs. Equal simulations are computed once for all tests."""
    environment = {**os.environ, "MARROW_CACHE": str(SHARED_CACHE)}
    command = [MARROW, "run", pipeline, "--out", folder, "--quiet", *arguments]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=environment)
    return folder / "outputs"


class Server:
    """`marrow open` on a folder. A client without a browser: it has the cookie, and asks as a page does."""

    def __init__(self, folder, *arguments):
        environment = {**os.environ, "MARROW_CACHE": str(pathlib.Path(folder).parent / "store")}
        self.process = subprocess.Popen(
            [MARROW, "open", folder, "--no-browser", *map(str, arguments)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=environment,
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

    def json(self, method, path, body=None):
        status, _, content = self.ask(method, path, body)
        answer = json.loads(content)
        assert status == 200, answer
        return answer

    def finish(self, job):
        """Waits for a job, and returns its state."""
        while True:
            state = self.json("GET", "/api/job?job=%s&since=0" % job)
            if state["state"] != "running":
                return state

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

    def open(self, *arguments, folder=None):
        server = Server(folder or self.folder, *arguments)
        self.addCleanup(server.close)
        return server


class PageTest(BenchTest):
    """The same with a browser."""

    @classmethod
    def setUpClass(cls):
        cls.browser = chromium.Browser()

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()

    def show(self, server, page="home", width_px=1440, height_px=900, theme="light"):
        """Opens the server's address, and waits for the page."""
        driver = self.browser.driver
        driver.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": width_px, "height": height_px, "deviceScaleFactor": 1, "mobile": False},
        )
        driver.execute_cdp_cmd(
            "Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": theme}]}
        )
        driver.get(server.address + ("" if page == "home" else "#" + page))
        self.wait_for_page(page.split("=")[0])

    def wait_for_page(self, name, seconds=120):
        self.browser.wait("return document.documentElement.dataset.ready === '%s'" % name, seconds)

    def find(self, selector, seconds=120):
        """Waits for an element."""
        self.browser.wait("return !!document.querySelector(%s)" % json.dumps(selector), seconds)
        return self.browser.driver.find_element("css selector", selector)

    def go_to_step(self, name):
        """Shows the tools of a step on the page "Case"."""
        self.browser.driver.find_element("css selector", '[data-step="%s"]' % name).click()

    def find_in_sight(self, selector):
        """On the page "Case", goes to the step whose tools hold the element."""
        element = self.find(selector)
        step = self.browser.js("return arguments[0].closest('[data-of-step][hidden]')?.dataset.ofStep || null", element)
        if step:
            self.go_to_step(step)
        self.browser.js("arguments[0].scrollIntoView({block: 'center'})", element)
        return element

    def click(self, selector):
        from selenium.common.exceptions import StaleElementReferenceException

        for _ in range(5):
            try:
                return self.find_in_sight(selector).click()
            except StaleElementReferenceException:  # the page was drawn again after it was found
                pass
        self.fail("%s is drawn again and again" % selector)

    def document(self):
        """The draft of the case 'mine', as the server keeps it."""
        return self.browser.driver.execute_async_script(
            "fetch('api/draft?case=mine').then((answer) => answer.json())"
            ".then((state) => arguments[0](state.document))"
        )

    def saved_when(self, condition, seconds=240):
        """Waits until the draft of the case 'mine' fulfils a condition, and returns it."""
        end = time.monotonic() + seconds
        while not condition(document := self.document()):
            self.assertLess(time.monotonic(), end, document)
            time.sleep(0.05)
        return document

    def wait_for_slices(self):
        """Waits until all three slices of a CT are drawn."""
        self.browser.wait(
            "return document.querySelectorAll('[data-slice]').length === 3 &&"
            " [...document.querySelectorAll('[data-slice]')].every((one) => one.dataset.shown)",
            240,
        )

    def go_to_slice(self, name, number):
        self.browser.js(
            "arguments[0].value = arguments[1]; arguments[0].dispatchEvent(new Event('input'))",
            self.find('input[aria-label="%s slice"]' % name),
            number,
        )
        self.browser.wait("return document.querySelector('[data-slice=%s]').dataset.shown === '%d'" % (name, number))


def named_tests(suite):
    """The ids of the tests in a suite of unittest, as they are given on the command line: Class.test."""
    for one in suite:
        if isinstance(one, unittest.TestSuite):
            yield from named_tests(one)
        else:
            yield ".".join(one.id().split(".")[-2:])


def main(part=5):
    """Runs the tests that the command line names; without names, one of `part` of them, the same in each run."""
    missing = chromium.missing()
    if missing:
        skip(missing)
    names = sys.argv[1:]
    if not names:
        every = list(named_tests(unittest.defaultTestLoader.loadTestsFromModule(sys.modules["__main__"])))
        names = sample(every, max(3, len(every) // part))
    unittest.main(argv=sys.argv[:1] + names, verbosity=2)
