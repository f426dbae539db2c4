"""A real browser for the pages: headless Chromium without a network. Without one, these tests are skipped."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
"""Names of the browser, as the systems have it."""

FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-rasterization",
)
"""How it is started: without a window, also as root or with little shared memory; WebGL in software.

Debian starts it so that the graphics card draws all of a page, which takes three times as long in software.
"""

HEIGHT = 900
"""Height of its window (CSS pixels)."""

PATIENCE = 20.0
"""Seconds after which a page that does not become as it should has failed: machines of the gate are slow."""


@dataclass(frozen=True)
class Browser:
    """A browser of which a test opens one page after the other; `driver` is that of selenium."""

    driver: Any

    def open_page(
        self, path: Path, width: int = 1280, *, dark: bool = False, still: bool = False, density: float = 1
    ) -> None:
        """Open a file in a window so wide (CSS pixels), for one who wants dark colours, or still pages.

        A CSS pixel has the `density` in pixels of the screen along each side.
        """
        self.resize(width, density)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        motion = {"name": "prefers-reduced-motion", "value": "reduce" if still else "no-preference"}
        self._emulate("setEmulatedMedia", media="", features=[scheme, motion])
        for kind in ("browser", "performance"):
            self.driver.get_log(kind)  # what other pages have left
        self.driver.get(path.resolve().as_uri())

    def resize(self, width: int, density: float = 1) -> None:
        """Make the window so wide (CSS pixels)."""
        size = {"width": width, "height": HEIGHT, "deviceScaleFactor": density, "mobile": False}
        self._emulate("setDeviceMetricsOverride", **size)

    def print_page(self) -> None:
        """Show the page as it is printed."""
        self._emulate("setEmulatedMedia", media="print")

    def _emulate(self, what: str, **values: object) -> None:
        self.driver.execute_cdp_cmd(f"Emulation.{what}", values)

    def ask(self, expression: str, *arguments: object) -> Any:
        """The value of an expression of JavaScript; `arguments` are its arguments[0], arguments[1], ..."""
        return self.driver.execute_script(f"return {expression}", *arguments)

    def wait(self, expression: str, *arguments: object) -> Any:
        """The value of an expression as soon as it is true; the test fails where it does not become so."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if value := self.ask(expression, *arguments):
                return value
            time.sleep(0.02)
        return pytest.fail(f"this did not become true in {PATIENCE} s: {expression}")

    def find(self, selector: str) -> Any:
        """The first element that a CSS selector finds."""
        return self.driver.find_element("css selector", selector)

    def complaints(self) -> list[str]:
        """What the console says since the page was opened: errors, and what its policy has refused."""
        return [entry["message"] for entry in self.driver.get_log("browser") if entry["level"] != "INFO"]

    def requests(self) -> list[str]:
        """The addresses that were asked for since the page was opened, its own among them."""
        messages = [json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance")]
        sent = (each["params"] for each in messages if each["method"] == "Network.requestWillBeSent")
        return [each["request"]["url"] for each in sent if not each["request"]["url"].startswith("data:")]

    @property
    def overflow(self) -> int:
        """By how many pixels the page is wider than its window."""
        root = "document.documentElement"
        return int(self.ask(f"{root}.scrollWidth - {root}.clientWidth"))


@pytest.fixture(scope="session")
def _driver() -> Iterator[Any]:
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    service = shutil.which("chromedriver")
    if program is None or service is None:
        pytest.skip("there is no browser: Debian's packages are chromium and chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = program
    for flag in FLAGS:
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(service))
    yield driver
    driver.quit()


@pytest.fixture
def browser(_driver: Any) -> Browser:
    """A browser; all tests of a process share its start."""
    return Browser(_driver)
