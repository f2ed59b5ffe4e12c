"""The picture of the decision page in the README: ``python -m benchmarks.pictures``.

This requires Chromium on the PATH and playwright (extra ``test``).
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import pandas as pd
from playwright.sync_api import sync_playwright

from benchmarks.machine import output
from pymoo_psi import Formulation, VectorizedSphereChute, investigate, read_table
from pymoo_psi.page import decision_page

PICTURE = output(Path(__file__).parent / "pictures" / "decision_page.png")
NAMES = {
    "x1": "slope",
    "x2": "floor speed",
    "f1": "time",
    "f2": "energy balance",
    "f3": "height",
    "f4": "speed",
}


def main() -> None:
    """Write the page for the chute under the full model, and take a picture of it."""
    table = investigate(VectorizedSphereChute(0.4), 4096)
    frame = table.to_frame().rename(columns=NAMES)
    frame = frame[list(NAMES.values())]
    frame.index = pd.Index(table.names, name="design")
    program = shutil.which("chromium") or shutil.which("google-chrome")
    switches = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking"]
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        path = Path(folder, "page.html")
        asked = Formulation(["time", "energy balance", "height", "speed"])
        document = decision_page(
            read_table(frame, asked, variables=["slope", "floor speed"]),
            title="Sphere in the chute, μ = 0.4, full model, 4096 LPτ points",
        )
        document.save(path)
        browser = playwright.chromium.launch(executable_path=program, args=switches)
        page = browser.new_page(viewport={"width": 1366, "height": 768})
        page.goto(path.as_uri())
        page.wait_for_selector("body[data-ready]")
        page.wait_for_timeout(500)
        PICTURE.parent.mkdir(exist_ok=True)
        page.screenshot(path=PICTURE)
        browser.close()
    print(f"{PICTURE}: {PICTURE.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
