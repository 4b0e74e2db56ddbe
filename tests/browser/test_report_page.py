"""report.html in a browser: the scene is drawn, the scrubber moves it, nothing fails, and a phone can show it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from glotouch_bt.report import write_report
from tests.support.browser_page import PHONE, Page, drawn, until
from tests.support.made_run import Made


@pytest.fixture(scope="session")
def report(made: Made) -> Path:
    return write_report(made.folder)


def seek(page: Page, share: float) -> None:
    """Move the scrubber to a share of the run, as a finger would, and wait for the clock."""
    at = page.driver.execute_script(
        "const s = document.getElementById('scene-slider');"
        "s.value = Number(s.min) + arguments[0] * (s.max - s.min); s.dispatchEvent(new Event('input'));"
        "return `${Number(s.value).toFixed(1)} s`",
        share,
    )
    until(lambda: page.find("#scene-time").text == at, f"the clock at {at}")


def test_the_scene_follows_the_scrubber(browse: Callable[..., Page], report: Path) -> None:
    page = browse()
    page.open(report.as_uri())
    until(lambda: drawn(page.picture("#scene")), "the scene drawn")
    seek(page, 0.0)
    early = page.picture("#scene")
    seek(page, 1.0)

    def changed() -> bool:
        return bool(np.mean(np.any(page.picture("#scene") != early, axis=2)) > 0.01)

    until(changed, "the arm and what was felt in another picture")
    assert page.errors() == []


def test_play_moves_the_clock(browse: Callable[..., Page], report: Path) -> None:
    page = browse()
    page.open(report.as_uri())
    seek(page, 0.0)
    before = page.find("#scene-time").text
    page.press("play")
    until(lambda: page.find("#scene-time").text != before, "the clock moves")
    page.press("pause")
    assert page.errors() == []


def test_a_phone_needs_no_sideways_scrolling(browse: Callable[..., Page], report: Path) -> None:
    page = browse(PHONE)
    page.open(report.as_uri())
    until(lambda: drawn(page.picture("#scene")), "the scene drawn")
    assert page.overflow_px() <= 0
    assert page.errors() == []
