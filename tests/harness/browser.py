# SPDX-License-Identifier: Apache-2.0
"""A headless Chromium with what tests of pages need of it, from Debian's chromium, chromium-driver and
python3-selenium."""
import atexit
import functools
import json
import os
import pathlib
import shutil
import time


def missing():
    """What keeps the tests from running here, or None."""
    needed = {"chromium": "chromium", "chromedriver": "chromium-driver", "esbuild": "esbuild"}
    absent = [package for program, package in needed.items() if not shutil.which(program)]
    try:
        import selenium  # noqa: F401
    except ImportError:
        absent.append("python3-selenium (for /usr/bin/python3)")
    if not pathlib.Path("/usr/share/javascript/three/three.module.js").exists():
        absent.append("libjs-three")
    return "missing Debian packages: " + ", ".join(absent) if absent else None


@functools.lru_cache
def shared():
    """The one browser of this process: to start one takes seconds."""
    one = Browser()
    atexit.register(one.close)
    return one


class Browser:
    def __init__(self):
        from selenium import webdriver
        from selenium.common.exceptions import WebDriverException
        from selenium.webdriver.chrome.service import Service

        options = webdriver.ChromeOptions()
        options.binary_location = shutil.which("chromium")
        flags = [
            "--headless=new",
            "--use-gl=angle",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
            "--disable-dev-shm-usage",
            "--hide-scrollbars",
        ]
        for flag in flags + (["--no-sandbox"] if os.geteuid() == 0 else []):
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        for is_last in (False, False, True):  # on a busy machine it may come too late for its driver
            try:
                self.driver = webdriver.Chrome(service=Service(shutil.which("chromedriver")), options=options)
                break
            except WebDriverException:
                if is_last:
                    raise
        self.driver.set_script_timeout(120)

    def open(self, path, width_px=1200, height_px=900, theme="light", hash=""):
        """Opens a page from disk, or at an address; the seconds until it says that it is ready."""
        self.driver.get("about:blank")
        self.logs()
        self.look(width_px, height_px, theme)
        address = str(path) if str(path).startswith("http:") else pathlib.Path(path).resolve().as_uri()
        begin = time.monotonic()
        self.driver.get(address + hash)
        self.wait(
            "return document.documentElement.dataset.ready === 'true' && (!document.querySelector('#distributions') ||"
            " !!document.querySelector('#distributions svg.plot .box'))"
        )
        return time.monotonic() - begin

    def look(self, width_px=1440, height_px=900, theme="light"):
        """The size of the window, and the colours that the person prefers."""
        size = {"width": width_px, "height": height_px, "deviceScaleFactor": 1, "mobile": False}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        preferred = [{"name": "prefers-color-scheme", "value": theme}]
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": preferred})

    def js(self, text, *arguments):
        return self.driver.execute_script(text, *arguments)

    def wait(self, condition, seconds=120):
        from selenium.common.exceptions import JavascriptException

        end = time.monotonic() + seconds
        while True:
            try:
                value = self.js(condition)
            except JavascriptException:  # the page is not there yet
                value = None
            if value:
                return value
            if time.monotonic() > end:
                raise AssertionError("after %d s still not true: %s" % (seconds, condition))
            time.sleep(0.05)

    def show(self, section):
        self.js("document.getElementById(arguments[0]).scrollIntoView()", section)
        time.sleep(0.3)

    def key(self, name, selector):
        from selenium.webdriver.common.by import By
        from selenium.webdriver.common.keys import Keys

        self.driver.find_element(By.CSS_SELECTOR, selector).send_keys(getattr(Keys, name, name))

    def press(self, key, code, modifiers=0):
        """A key that is pressed wherever the focus is. Modifiers: 1 Alt, 2 Ctrl, 8 Shift."""
        event = {"type": "keyDown", "modifiers": modifiers, "key": key, "code": code}
        self.driver.execute_cdp_cmd("Input.dispatchKeyEvent", event)

    def box(self, selector):
        """[left, top, width, height] of an element in the window."""
        script = "const r = document.querySelector(arguments[0]).getBoundingClientRect();"
        return self.js(script + "return [r.left, r.top, r.width, r.height]", selector)

    def mouse(self, kind, at, buttons=0, **more):
        event = {"type": kind, "x": at[0], "y": at[1], "button": "left", "buttons": buttons, "clickCount": 1, **more}
        self.driver.execute_cdp_cmd("Input.dispatchMouseEvent", event)

    def drag_along(self, places, buttons=1, **more):
        """The mouse pressed at the first place, moved to the others and let go at the last."""
        self.mouse("mousePressed", places[0], buttons, **more)
        for place in places[1:]:
            self.mouse("mouseMoved", place, buttons, **more)
        self.mouse("mouseReleased", places[-1], **more)

    def drag(self, selector, from_fraction, to_fraction):
        """The same from one fraction of an element's width to another."""
        left, top, width, height = self.box(selector)
        y = top + 0.5 * min(height, self.js("return innerHeight") - top)
        steps = [from_fraction + (to_fraction - from_fraction) * i / 5 for i in range(6)]
        self.drag_along([(left + step * width, y) for step in steps])

    def touch(self, kind, places=()):
        points = [{"x": x, "y": y, "id": finger} for finger, (x, y) in enumerate(places)]
        self.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def logs(self):
        """Since the last call: faults in the console, and addresses that were asked for and are not on this page."""
        faults = [
            entry["message"] for entry in self.driver.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")
        ]
        asked = []
        for entry in self.driver.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] in ("Network.requestWillBeSent", "Network.webSocketCreated"):
                asked.append(message["params"].get("request", message["params"])["url"])
        return faults, [url for url in asked if not url.startswith(("data:", "blob:", "about:"))]

    def picture(self, path):
        self.driver.save_screenshot(str(path))

    def close(self):
        self.driver.quit()
