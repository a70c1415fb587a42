# SPDX-License-Identifier: Apache-2.0
"""A headless Chromium with what the report's tests need of it, from Debian's chromium, chromium-driver and
python3-selenium."""
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
        self.driver.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": width_px, "height": height_px, "deviceScaleFactor": 1, "mobile": False},
        )
        self.driver.execute_cdp_cmd(
            "Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": theme}]}
        )
        address = str(path) if str(path).startswith("http:") else pathlib.Path(path).resolve().as_uri()
        begin = time.monotonic()
        self.driver.get(address + hash)
        self.wait(
            "return document.documentElement.dataset.ready === 'true' && (!document.querySelector('#distributions') ||"
            " !!document.querySelector('#distributions svg.plot .box'))"
        )
        return time.monotonic() - begin

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

    def drag(self, selector, from_fraction, to_fraction):
        """The mouse pressed at one fraction of an element's width and let go at another."""
        box = self.js(
            (
                "const r = document.querySelector(arguments[0]).getBoundingClientRect(); return [r.left, r.top,"
                " r.width, Math.min(r.height, innerHeight - r.top)]"
            ),
            selector,
        )
        at = lambda fraction: {"x": box[0] + fraction * box[2], "y": box[1] + 0.5 * box[3]}
        send = lambda kind, fraction, buttons: self.driver.execute_cdp_cmd(
            "Input.dispatchMouseEvent", dict(at(fraction), type=kind, button="left", buttons=buttons, clickCount=1)
        )
        send("mousePressed", from_fraction, 1)
        for i in range(1, 6):
            send("mouseMoved", from_fraction + (to_fraction - from_fraction) * i / 5, 1)
        send("mouseReleased", to_fraction, 0)

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
