# SPDX-License-Identifier: Apache-2.0
"""A headless Firefox without a driver: it is told what to do by its own protocol, Marionette. Each message is JSON with
its length in front, over a socket. Debian has Firefox but no geckodriver."""
import base64
import json
import os
import pathlib
import shutil
import socket
import subprocess
import tempfile
import time

ELEMENT = "element-6066-11e4-a52e-4f735466cecf"  # the key of an element, as WebDriver has it
PREFERENCES = {
    "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "toolkit.telemetry.reportingpolicy.firstRun": False,
    "app.update.disabledForTesting": True,
    "webgl.force-enabled": True,
}


def program():
    """The program, or None."""
    return shutil.which("firefox-esr") or shutil.which("firefox")


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


class Firefox:
    def __init__(self, width_px=1440, height_px=900):
        self.home, port = pathlib.Path(tempfile.mkdtemp(prefix="marrow-firefox-")), free_port()
        profile = self.home / "profile"
        profile.mkdir()
        lines = ["user_pref(%s, %s);" % (json.dumps(k), json.dumps(v)) for k, v in PREFERENCES.items()]
        (profile / "user.js").write_text("\n".join(lines + ['user_pref("marionette.port", %d);\n' % port]))
        command = [program(), "--headless", "--marionette", "--no-remote", "--profile", profile]
        command += ["--width", str(width_px), "--height", str(height_px)]
        self.log = open(self.home / "log", "w")
        self.process = subprocess.Popen(
            command, stdout=self.log, stderr=self.log, env={**os.environ, "HOME": str(self.home)}
        )
        self.count, self.socket, self.pending = 0, self.connected(port), b""
        self.message()  # it greets
        self.tell("WebDriver:NewSession", {"capabilities": {"alwaysMatch": {}}})
        self.tell("WebDriver:SetTimeouts", {"script": 120_000, "pageLoad": 120_000, "implicit": 0})

    def connected(self, port):
        end = time.monotonic() + 120
        while True:
            try:
                return socket.create_connection(("127.0.0.1", port), timeout=300)
            except OSError:
                if time.monotonic() > end or self.process.poll() is not None:
                    raise AssertionError("Firefox did not start: " + (self.home / "log").read_text()[-500:])
                time.sleep(0.1)

    def message(self):
        """The next message."""
        while b":" not in self.pending:
            self.receive()
        length, self.pending = self.pending.split(b":", 1)
        while len(self.pending) < int(length):
            self.receive()
        text, self.pending = self.pending[: int(length)], self.pending[int(length) :]
        return json.loads(text)

    def receive(self):
        more = self.socket.recv(1 << 16)
        if not more:
            raise AssertionError("Firefox ended: " + (self.home / "log").read_text()[-500:])
        self.pending += more

    def tell(self, command, parameters=None):
        """Sends a command, and returns its value."""
        self.count += 1
        text = json.dumps([0, self.count, command, parameters or {}]).encode()
        self.socket.sendall(b"%d:%s" % (len(text), text))
        _, number, fault, value = self.message()
        assert number == self.count
        if fault:
            raise AssertionError("%s: %s" % (command, fault.get("message", fault)))
        return value.get("value") if isinstance(value, dict) and set(value) == {"value"} else value

    def open(self, address):
        self.tell("WebDriver:Navigate", {"url": address})

    def js(self, text, *arguments):
        return self.tell("WebDriver:ExecuteScript", {"script": text, "args": list(arguments)})

    def wait(self, condition, seconds=120):
        end = time.monotonic() + seconds
        while not (value := self.js(condition)):
            if time.monotonic() > end:
                raise AssertionError("after %d s still not true: %s" % (seconds, condition))
            time.sleep(0.05)
        return value

    def find(self, selector):
        self.wait("return !!document.querySelector(%s)" % json.dumps(selector))
        return self.tell("WebDriver:FindElement", {"using": "css selector", "value": selector})[ELEMENT]

    def click(self, selector):
        """A click of the mouse, where a person could click."""
        self.tell("WebDriver:ElementClick", {"id": self.find(selector)})

    def type(self, selector, text):
        self.tell("WebDriver:ElementSendKeys", {"id": self.find(selector), "text": text})

    def into(self, selector):
        """From now on, js() looks into a frame; without one, at the page again."""
        element = {"element": self.find(selector)} if selector else {"id": None}
        self.tell("WebDriver:SwitchToFrame", element)

    def picture(self, path):
        pathlib.Path(path).write_bytes(base64.b64decode(self.tell("WebDriver:TakeScreenshot", {"full": False})))

    def close(self):
        self.process.terminate()
        try:
            self.process.wait(30)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.socket.close()
        self.log.close()
        shutil.rmtree(self.home, ignore_errors=True)
