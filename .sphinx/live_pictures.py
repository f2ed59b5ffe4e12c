"""Pictures of a run that is steered in the browser, for the documentation.

They need Chromium on the PATH and playwright (extra ``test``); without these, there are none.
"""

import json
import shutil
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

from IPython.display import Image

from pymoo_psi import live

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
WINDOW = {"width": 1280, "height": 720}
MODEL = '''
import time
from pymoo.core.problem import ElementwiseProblem

class Bracket(ElementwiseProblem):
    """A tube under a load."""

    names = {"x1": "diameter", "x2": "wall", "f1": "mass", "f2": "deflection"}
    units = {"diameter": "mm", "wall": "mm", "mass": "kg", "deflection": "mm"}

    def __init__(self):
        super().__init__(n_var=2, n_obj=2, xl=[20, 1], xu=[60, 5])

    def _evaluate(self, x, out, *args, **kwargs):
        time.sleep(0.05)
        diameter, wall = x
        area = 3.1416 * wall * (diameter - wall)
        inertia = area * (diameter - wall) ** 2 / 8
        out["F"] = [area * 0.00785, 3e6 / inertia]
'''


def take():
    """Steer a run, and return the pictures by name; none where no browser is."""
    if CHROMIUM is None or find_spec("playwright") is None:
        return {}
    with tempfile.TemporaryDirectory() as folder:
        # In a process of its own, as the loop of events of a notebook admits no other.
        command = [sys.executable, __file__, folder]
        subprocess.run(command, check=True, timeout=200)
        return {path.stem: Image(path.read_bytes()) for path in Path(folder).glob("*.png")}


class Visitor:
    """Somebody in front of the page."""

    def __init__(self, browser, address, folder):
        self.page = browser.new_page(viewport=WINDOW, bypass_csp=True)
        self.page.goto(address)
        self.page.wait_for_selector("#live:not([hidden])", timeout=60_000)
        self._folder = folder

    def until(self, expression):
        """Wait until an expression is true."""
        self.page.wait_for_function(expression, timeout=60_000)

    def picture(self, name):
        """Take a picture of the page as it is."""
        self.page.wait_for_function("decisionPage.settled")
        self.page.screenshot(path=self._folder / f"{name}.png")


def main(folder):
    """Write the pictures into a folder."""
    from playwright.sync_api import sync_playwright

    (folder / "bracket.py").write_text(MODEL)
    study = folder / "bracket.db"
    command = [sys.executable, "-m", "pymoo_psi", "solve", "bracket:Bracket", "--jobs", "2"]
    command += ["--algorithm", "surrogate", "--points", "120", "--study", study.name]
    with subprocess.Popen(command, cwd=folder) as run, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        try:
            steer(browser, study, folder)
        finally:
            run.terminate()
        browser.close()


def steer(browser, study, folder):
    """Watch and steer the run of a study."""
    with live(study, steer=True) as view:
        anna, bo = (Visitor(browser, view.address, folder) for _ in range(2))
        anna.until("decisionPage.data.n >= 24")
        anna.picture("watched")
        anna.page.fill("#steerer", "Anna")
        limits = json.dumps({"mass": [None, 2.5], "deflection": [None, 60]})
        anna.page.evaluate(f"decisionPage.set({{...decisionPage.state(), limits: {limits}}})")
        anna.page.click("[name=search]")
        anna.picture("limited")
        n_before = anna.page.evaluate("decisionPage.data.n")
        anna.until(f"decisionPage.data.n >= {n_before + 40}")
        anna.picture("directed")
        bo.page.fill("#steerer", "Bo")
        bo.page.click("[name=pause]")
        bo.page.click("#live summary")
        bo.until("document.getElementById('live').textContent.includes('Paused.')")
        bo.picture("paused")
        bo.page.click("[name=stop]")
        anna.until("document.getElementById('steered').textContent.includes('stop: done')")
    anna.until("!document.getElementById('offline').hidden")
    anna.picture("offline")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
