"""Someone in front of the decision page."""

from tests.helpers.processes import LONG, until

WINDOW = {"width": 1400, "height": 900}
# A search waits a quarter of a second for the hand to rest; here it begins at once.
UNHURRIED = """{
    const later = setTimeout
    window.setTimeout = (call, wait, ...rest) => later(call, wait === 250 ? 0 : wait, ...rest)
}"""


class Reader:
    """Someone in front of the page, without a network; looks at it and uses its controls."""

    def __init__(self, browser):
        self.context = browser.new_context(viewport=WINDOW, offline=True, accept_downloads=True)
        self.context.set_default_timeout(1000 * LONG)
        self.context.add_init_script(UNHURRIED)
        self.page = self.context.new_page()
        self.trouble = []
        self.page.on(
            "console", lambda m: m.type in ("error", "warning") and self.trouble.append(m.text)
        )
        self.page.on("pageerror", lambda error: self.trouble.append(str(error)))
        self.page.on(
            "request",
            lambda r: r.url.startswith(("file:", "data:", "blob:")) or self.trouble.append(r.url),
        )

    def open(self, address):
        self.page.goto(address)
        self.page.wait_for_selector("body[data-ready]")

    def ask(self, expression):
        """The value of an expression, in which D is the page's hook and what its scripts know."""
        known = "...decisionPage, update, explain, axes, scatter, verdict, order, inspected"
        return self.page.evaluate(f"(() => {{const D = {{{known}}}; return {expression}}})()")

    def set(self, **changes):
        """Change the state as a control would."""
        self.page.evaluate("(c) => decisionPage.set({...decisionPage.state(), ...c})", changes)
        self.settle()

    def until(self, expression):
        """Wait until an expression is true; the page's policy forbids playwright's own way."""
        assert until(lambda: self.ask(expression), every=0.025), expression

    def click(self, target):
        """Click on a selector or a locator, once nothing comes between press and release.

        Cautions that grow above a button take it away from under the mouse.
        """
        self.settle()
        (self.page.locator(target) if isinstance(target, str) else target).click()
        self.settle()

    def press(self, *keys, on=None):
        """Press keys, in a control that gets the focus or in the one that has it."""
        if on is not None:
            on.focus()
        for key in keys:
            self.page.keyboard.press(key)
        self.settle()

    def settle(self):
        """Wait until the page rests: all is drawn, and nothing is searched for behind it."""
        self.page.evaluate(
            "() => new Promise((done) => {"
            " const look = () => decisionPage.settled && !search ? done()"
            " : requestAnimationFrame(look); requestAnimationFrame(look) })"
        )

    @property
    def state(self):
        return self.ask("D.state()")

    @property
    def shown(self):
        """Labels that the table shows, in its order."""
        return self.ask("[...D.order].map((row) => D.data.names[row])")

    @property
    def first_row(self):
        """The button of the first row of the table."""
        return self.page.locator("#table-body button").first

    def text(self, selector):
        return self.page.inner_text(selector).replace("\xa0", " ")

    def field(self, name):
        return self.page.get_by_label(name, exact=True)

    def type_limit(self, name, value):
        self.field(name).fill(value)
        self.field(name).press("Enter")
        self.settle()

    def search(self, text):
        self.page.fill("#search", text)
        self.settle()

    def look_at(self, label, option):
        """Choose an option of a list."""
        self.page.get_by_label(label).select_option(option)
        self.settle()

    def drag(self, selector, start, end):
        """Drag from one spot of an element to another; shares of its width and height."""
        self.settle()  # nothing above grows any more
        self.page.locator(selector).scroll_into_view_if_needed()
        box = self.page.locator(selector).bounding_box()
        spots = [
            (box["x"] + x * box["width"], box["y"] + y * box["height"]) for x, y in (start, end)
        ]
        self.page.mouse.move(*spots[0])
        self.page.mouse.down()
        self.page.mouse.move(*spots[1], steps=3)
        self.page.mouse.up()
        self.settle()

    def keep_position(self, name):
        self.click("#adding summary")
        self.page.fill("#position-name", name)
        self.press("Tab", "Enter")

    def save(self, path, button="#save"):
        """Write the decision, or the page, to a file; return its path."""
        path.write_text(self.download(button), "utf-8", newline="")
        return path

    def export(self, path):
        """Write what the page exports, and its metadata beside; return the former."""
        with self.page.expect_download(
            lambda one: one.suggested_filename.endswith(".json")
        ) as json:
            text = self.download("#export")
        assert json.value.suggested_filename == f"{self.file_name}-metadata.json"
        path.write_text(text, "utf-8", newline="")
        json.value.save_as(f"{path}-metadata.json")
        return text

    def download(self, button):
        self.page.evaluate("document.getElementById('menu').open = true")
        with self.page.expect_download() as download:
            self.click(button)
        self.file_name = download.value.suggested_filename
        with open(download.value.path(), encoding="utf-8-sig", newline="") as file:
            return file.read()
