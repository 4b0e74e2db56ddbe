"""Windows of Chromium, and the run that the pages show.

Without Chromium or its driver these tests are skipped; `GLOTOUCH_REQUIRE_BROWSER=1` makes that a failure.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from glotouch_backends.rizon4 import RIZON4_XENSE
from tests.support.browser_page import DESKTOP, Page, open_window
from tests.support.made_run import Made, make_run

REQUIRED = os.environ.get("GLOTOUCH_REQUIRE_BROWSER") == "1"


@pytest.fixture
def browse(tmp_path: Path) -> Iterator[Callable[..., Page]]:
    """Open windows of a size; all are closed at the end."""
    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if not REQUIRED:
        pytest.importorskip("selenium")
        if not (chromium and driver):
            pytest.skip("needs chromium and chromium-driver")
    assert chromium, "GLOTOUCH_REQUIRE_BROWSER=1, but chromium is not installed"
    assert driver, "GLOTOUCH_REQUIRE_BROWSER=1, but chromium-driver is not installed"
    windows: list[Page] = []

    def make(size: tuple[int, int] = DESKTOP) -> Page:
        windows.append(open_window(size, chromium, driver, tmp_path / f"profile{len(windows)}"))
        return windows[-1]

    yield make
    for window in windows:
        window.driver.quit()


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    """A made-up run from start to end."""
    return make_run(tmp_path_factory.mktemp("run"), description=RIZON4_XENSE)
