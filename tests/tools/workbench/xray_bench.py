# SPDX-License-Identifier: Apache-2.0
"""The X-rays on the page "Case", and what a person does with them."""
from selenium.webdriver.common.action_chains import ActionChains

from bench import PageTest
from made_cases import HEIGHT, WIDTH, write_xrays


class XrayPage(PageTest):
    def setUp(self):
        super().setUp()
        self.views = write_xrays(self.folder)

    def begin(self, **document):
        """Shows the page of the case `mine`, whose draft holds `document`."""
        document = {"ct": None, "views": self.views, "fragments": {}, "landmarks": [], **document}
        self.enter().change(document)
        self.show("case=mine")
        if document["views"]:
            self.find("[data-check] > *")  # it comes last
            self.go_to_step("xrays")  # the X-rays are larger then

    def document(self):
        return self.server.draft()["document"]

    def box(self, view):
        self.wait("document.querySelector('[data-view=\"%s\"] canvas')?.width" % view)
        self.in_sight('[data-view="%s"]' % view)
        return self.browser.box('[data-view="%s"]' % view)

    def place(self, view, at):
        """The place of a pixel of a whole image on the screen."""
        left, top, width, height = self.box(view)
        zoom = min(width / WIDTH, height / HEIGHT)
        return left + width / 2 + zoom * (at[0] - (WIDTH - 1) / 2), top + height / 2 + zoom * (at[1] - (HEIGHT - 1) / 2)

    def click_pixel(self, view, at):
        place = self.place(view, at)
        self.browser.mouse("mouseMoved", place)
        self.browser.drag_along([place])

    def drag_pixel(self, view, begin, end):
        a, b = self.place(view, begin), self.place(view, end)
        self.browser.mouse("mouseMoved", a)
        self.browser.drag_along([[x + share * (y - x) for x, y in zip(a, b)] for share in (0, 0.25, 0.5, 0.75, 1)])

    def keys(self, view, *keys):
        """Keys, or tuples of keys that are held and the last one."""
        self.box(view)
        self.the('[data-view="%s"]' % view, "one.focus()")
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

    def fill(self, selector, value):
        box = self.find(selector)
        box.clear()
        box.send_keys(value)

    def landmark(self, name):
        return next((one for one in self.document()["landmarks"] if one["name"] == name), None)

    def pixels(self, name):
        return (self.landmark(name) or {}).get("pixels", {})
