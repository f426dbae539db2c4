"""Draws the picture of the README: the page of a T-handle that flips, in the middle of a flip.

python tests/browser/front_page.py
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from selenium import webdriver

ROOT = Path(__file__).resolve().parents[2]
PICTURE = ROOT / "configs/pictures/page.png"

# Python runs this file as a program, and knows nothing of the package that it is in.
sys.path.insert(0, str(ROOT))
from tests.browser.conftest import FLAGS, PROGRAMS, Browser  # noqa: E402

COMMAND = ("euler", "configs/t_handle.yaml", "-f", "html")
PLACE = 0.35
"""The share of the motion that has been seen."""

MOVE = """(() => {
  const [time, place] = arguments;
  time.value = Number(time.min) + place * (time.max - time.min);
  time.dispatchEvent(new Event("input"));
})(...arguments)"""
"""Moves the slider of a replay."""


def main() -> None:
    """Write the page, move its replay, and take the picture."""
    options = webdriver.ChromeOptions()
    options.binary_location = next(filter(None, map(shutil.which, PROGRAMS)))
    for flag in (*FLAGS, "--hide-scrollbars"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))
    browser = Browser(driver)
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "page.html"
        subprocess.run([sys.executable, "-m", "rigidcli", *COMMAND, "-o", str(page)], cwd=ROOT, check=True)
        browser.open_page(page, still=True)
        time = browser.find(".rigidcli-replay input[type=range]")
        browser.ask(MOVE, time, PLACE)
        driver.execute_async_script("setTimeout(arguments[0], 1000)")  # what was moved is drawn in a moment
        driver.save_screenshot(str(PICTURE))
    driver.quit()


if __name__ == "__main__":
    main()
