# SPDX-License-Identifier: Apache-2.0
"""Simulated X-rays, shadows of a limb through cameras that are known exactly, and what a person does with them in the
page "Case"."""
import json
import struct
import time
import zlib

import numpy
from selenium.webdriver.common.action_chains import ActionChains

from bench import PageTest

WIDTH, HEIGHT = 320, 240
ARM = {"source_to_detector_mm": 1000, "source_to_isocentre_mm": 600, "pixel_mm": 1.0}
ANGLES = {"frontal": (0, 0), "lateral": (0, 90)}
MODEL = {"a": [10, 0, 20], "b": [-25, 12, 5], "c": [5, -20, -30], "d": [30, 25, -8], "e": [-10, -15, 35]}
SHIFT = numpy.array([4.0, -3.0, 6.0])  # the truth: the bone is moved, and not turned


def camera_matrices(alpha_deg, beta_deg):
    """By docs/case.md: z from the source to the detector, v to the feet in the frontal view."""
    assert alpha_deg == 0
    beta = numpy.radians(beta_deg)
    # In the frontal view the detector is in front of the patient (-y), and the patient's left (+x) is on the left.
    frontal = numpy.array([[-1.0, 0, 0], [0, 0, -1], [0, -1, 0]])
    about_z = numpy.array([[numpy.cos(beta), -numpy.sin(beta), 0], [numpy.sin(beta), numpy.cos(beta), 0], [0, 0, 1]])
    rotation = frontal @ about_z.T
    focal = ARM["source_to_detector_mm"] / ARM["pixel_mm"]
    intrinsics = numpy.array([[focal, 0, (WIDTH - 1) / 2], [0, focal, (HEIGHT - 1) / 2], [0, 0, 1]])
    return intrinsics, rotation, numpy.array([0, 0, ARM["source_to_isocentre_mm"]])


def pixel(view, world_mm):
    intrinsics, rotation, shift = camera_matrices(*ANGLES[view])
    seen = intrinsics @ (rotation @ world_mm + shift)
    return seen[:2] / seen[2]


def ray(view, at):
    """(source, unit direction) in the world."""
    intrinsics, rotation, shift = camera_matrices(*ANGLES[view])
    direction = rotation.T @ numpy.linalg.solve(intrinsics, [*at, 1])
    return -rotation.T @ shift, direction / numpy.linalg.norm(direction)


def write_png(path, image, bits=16):
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    height, width = image.shape
    header = struct.pack(">IIBBBBB", width, height, bits, 0, 0, 0, 0)
    rows = b"".join(b"\0" + row.astype(">u2" if bits == 16 else "u1").tobytes() for row in image)
    data = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + data)


def read_png(path):
    """Reads a PNG of one channel of 8 bits."""
    data, at, body = path.read_bytes(), 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at : at + 8])
        if kind == b"IHDR":
            width, height, bits, colour = struct.unpack(">IIBB", data[at + 8 : at + 18])
        if kind == b"IDAT":
            body += data[at + 8 : at + 8 + size]
        at += size + 12
    assert (bits, colour) == (8, 0), (bits, colour)
    raw, rows = zlib.decompress(body), [numpy.zeros(width, int)]
    for row in range(height):
        line = numpy.frombuffer(raw[row * (width + 1) : (row + 1) * (width + 1)], numpy.uint8).astype(int)
        kind, values = line[0], line[1:].copy()
        for i in range(width if kind else 0):
            left, up = values[i - 1] if i else 0, rows[-1][i]
            corner = rows[-1][i - 1] if i else 0
            paeth = min((left, up, corner), key=lambda one: abs(left + up - corner - one))
            values[i] = (values[i] + [0, left, up, (left + up) // 2, paeth][kind]) % 256
        rows.append(values)
    return numpy.array(rows[1:])


def shadow(view):
    """Grey values of an ellipsoid, shaped like a limb, with half axes 40, 30 and 400 mm. Air has 20000."""
    intrinsics, rotation, shift = camera_matrices(*ANGLES[view])
    u, v = numpy.meshgrid(numpy.arange(WIDTH), numpy.arange(HEIGHT))
    rays = numpy.stack([u, v, numpy.ones_like(u)], -1) @ numpy.linalg.inv(intrinsics).T @ rotation
    rays /= numpy.linalg.norm(rays, axis=-1, keepdims=True)
    source = -rotation.T @ shift
    half = numpy.array([40.0, 30, 400])
    a = ((rays / half) ** 2).sum(-1)
    b = (rays / half * (source / half)).sum(-1)
    inside = numpy.maximum(0, b * b - a * (((source / half) ** 2).sum() - 1))
    return numpy.round(20000 * numpy.exp(-0.02 * 2 * numpy.sqrt(inside) / a)).astype(int)


class XrayTest(PageTest):
    def setUp(self):
        super().setUp()
        self.views = []
        for name, (alpha, beta) in ANGLES.items():
            write_png(self.folder / (name + ".png"), shadow(name))
            arm = {"alpha_deg": alpha, "beta_deg": beta, **ARM}
            camera = {"width_px": WIDTH, "height_px": HEIGHT, "c_arm": arm}
            (self.folder / (name + ".camera.yaml")).write_text(json.dumps({"marrow-camera": 1, **camera}))
            self.views.append({"name": name, "image": name + ".png", "camera": camera})
        self.driver = self.browser.driver

    def begin(self, document=None, **how):
        """Shows the page of the case `knee`, whose draft holds `document`."""
        self.server = self.open()
        if document is not None:
            self.server.enter()
            whole = {"ct": None, "views": [], "fragments": {}, "landmarks": [], **document}
            state = self.server.json("GET", "/api/draft?case=knee")
            change = {"case": "knee", "revision": state["revision"], "what": "test", "document": whole}
            self.server.json("POST", "/api/draft/change", change)
            self.driver.get("http://127.0.0.1:%d/none" % self.server.port)  # a cookie is set on a page of the server
            name, value = self.server.cookie.split("=", 1)
            self.driver.add_cookie({"name": name, "value": value})
            self.server.address = "http://127.0.0.1:%d/" % self.server.port
        self.show(self.server, "case=knee", **how)
        self.browser.logs()
        if document and document.get("views"):
            self.find("[data-check] > *")  # it comes last
            self.go_to_step("xrays")  # the X-rays are larger then

    def document(self):
        """The document in the draft's file, as a crash would leave it."""
        lines = (self.folder / ".marrow" / "drafts" / "knee.jsonl").read_text().splitlines()
        steps, at = [], 0
        for line in map(json.loads, lines):
            if "document" in line:
                steps, at = steps[: at + 1] + [line["document"]], len(steps[: at + 1])
            at += ("redo" in line) - ("undo" in line)
        return steps[at]

    def text(self, selector):
        """Also of what the present step does not show."""
        return self.browser.js("return arguments[0].textContent", self.find(selector)).strip()

    def wait_text(self, selector, part, seconds=120):
        self.find(selector, seconds)
        script = "return [...document.querySelectorAll(%s)].some((one) => one.textContent.includes(%s))"
        self.browser.wait(script % (json.dumps(selector), json.dumps(part)), seconds)

    def until(self, condition, what, seconds=120):
        end = time.monotonic() + seconds
        while not condition():
            self.assertLess(time.monotonic(), end, what)
            time.sleep(0.05)

    def box(self, view):
        self.browser.wait("return !!document.querySelector('[data-view=\"%s\"] canvas')?.width" % view)
        element = self.find_in_sight('[data-view="%s"]' % view)
        return element, self.browser.js(
            "const r = arguments[0].getBoundingClientRect(); return [r.left, r.top, r.width, r.height]", element
        )

    def place(self, view, at):
        """The place of a pixel of a whole image on the screen."""
        _, (left, top, width, height) = self.box(view)
        zoom = min(width / WIDTH, height / HEIGHT)
        return left + width / 2 + zoom * (at[0] - (WIDTH - 1) / 2), top + height / 2 + zoom * (at[1] - (HEIGHT - 1) / 2)

    def mouse(self, kind, place, buttons=0, button="left"):
        event = {"type": kind, "x": place[0], "y": place[1], "button": button, "buttons": buttons, "clickCount": 1}
        self.driver.execute_cdp_cmd("Input.dispatchMouseEvent", event)

    def click_pixel(self, view, at):
        place = self.place(view, at)
        self.mouse("mouseMoved", place)
        self.mouse("mousePressed", place, 1)
        self.mouse("mouseReleased", place)

    def drag_pixel(self, view, begin, end):
        a, b = self.place(view, begin), self.place(view, end)
        self.mouse("mouseMoved", a)
        self.mouse("mousePressed", a, 1)
        for share in (0.25, 0.5, 0.75, 1):
            self.mouse("mouseMoved", [x + share * (y - x) for x, y in zip(a, b)], 1)
        self.mouse("mouseReleased", b)

    def keys(self, view, *keys):
        element, _ = self.box(view)
        self.browser.js("arguments[0].focus()", element)
        for key in keys:
            actions = ActionChains(self.driver)
            *held, last = key if isinstance(key, tuple) else (key,)
            for one in held:
                actions.key_down(one)
            actions.send_keys(last)
            for one in held:
                actions.key_up(one)
            actions.perform()

    def tool(self, name):
        self.click('.xrays [data-value="%s"]' % name)

    def landmark(self, name):
        return next((one for one in self.document()["landmarks"] if one["name"] == name), None)

    def no_faults(self):
        self.assertEqual(self.browser.logs()[0], [])
