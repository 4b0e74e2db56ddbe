"""One window of Debian's Chromium with one page, driven by Selenium; WebGL is drawn in software."""

from __future__ import annotations

import io
import re
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

if TYPE_CHECKING:
    from selenium import webdriver
    from selenium.webdriver.remote.webelement import WebElement

OPTIONS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-back-forward-cache",  # a page kept there stays connected, and `glotouch run --live` waits for it
)
PATIENCE_S = 60.0
DESKTOP, PHONE = (1100, 640), (390, 844)
"""Width and height of a window, px. A larger one takes the software longer to draw."""


def until(done: Callable[[], Any], what: str) -> Any:
    """Wait until `done` returns something true, and return it."""
    end = time.perf_counter() + PATIENCE_S
    while time.perf_counter() < end:
        if found := done():
            return found
        threading.Event().wait(0.1)
    raise AssertionError(f"waited {PATIENCE_S:.0f} s in vain: {what}")


class Page:
    """One browser window with one page."""

    def __init__(self, driver: webdriver.Chrome) -> None:
        self.driver = driver

    def open(self, address: str) -> None:
        self.driver.get(address)

    @property
    def text(self) -> str:
        """Everything that can be read on the page."""
        return str(self.driver.execute_script("return document.body.innerText"))

    def says(self, words: str) -> None:
        """Wait until the page has these words."""
        until(lambda: words in self.text, f"{words!r} on the page")

    @property
    def clock_s(self) -> float:
        """The robot clock that the page of a view shows."""
        return float(until(lambda: re.search(r"^([\d.]+) s$", self.text, re.MULTILINE), "the robot clock")[1])

    def find(self, css: str) -> WebElement:
        return self.driver.find_element("css selector", css)

    def press(self, label: str) -> None:
        """Press the first button whose label starts with `label`; in one step, since the page draws it anew."""
        press = (
            "const b = [...document.querySelectorAll('button')].find(b => b.innerText.startsWith(arguments[0]));"
            "if (b) b.click(); return !!b"
        )
        until(lambda: self.driver.execute_script(press, label), f"a button {label!r}")

    def picture(self, css: str = "canvas") -> np.ndarray:
        """Return the pixels (h, w, 3) of the largest such element; none without one, or if drawing takes too long."""
        from selenium.common.exceptions import TimeoutException

        found = self.driver.find_elements("css selector", css)
        if not found:
            return np.zeros((0, 0, 3), dtype=np.uint8)
        shown = max(found, key=lambda e: e.size["width"] * e.size["height"])
        try:
            return np.asarray(Image.open(io.BytesIO(shown.screenshot_as_png)).convert("RGB"))
        except TimeoutException:  # the driver waits for 10 s; on a busy machine the software needs longer
            return np.zeros((0, 0, 3), dtype=np.uint8)

    def overflow_px(self) -> int:
        """Return by how much the page is wider than the window."""
        return int(self.driver.execute_script("return document.documentElement.scrollWidth - innerWidth"))

    def errors(self) -> list[str]:
        """Return the errors that the console has shown since the last call."""
        return [entry["message"] for entry in self.driver.get_log("browser") if entry["level"] == "SEVERE"]


def drawn(picture: np.ndarray) -> bool:
    """Return True if a picture has what a drawn scene has: many shades, none of which fills it."""
    shades, counts = np.unique(picture.reshape(-1, 3) // 8, axis=0, return_counts=True)
    return len(shades) > 40 and bool(counts.max() < 0.95 * counts.sum())


def open_window(size: tuple[int, int], chromium: str, driver: str, profile: Path) -> Page:
    """Open a window of a size."""
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for option in (*OPTIONS, f"--window-size={size[0]},{size[1]}", f"--user-data-dir={profile}"):
        options.add_argument(option)
    if size == PHONE:
        metrics = {"width": size[0], "height": size[1], "pixelRatio": 1.0}
        options.add_experimental_option("mobileEmulation", {"deviceMetrics": metrics})
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return Page(webdriver.Chrome(options=options, service=webdriver.ChromeService(driver)))
