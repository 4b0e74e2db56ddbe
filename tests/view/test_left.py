"""When the page's process says that nobody has a finished run open any more."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import pytest

pytest.importorskip("viser")

from glotouch_bt.view.__main__ import GRACE_S, LOOK_S, _tell_when_left

GRACE = int(GRACE_S / LOOK_S)
"""Looks for viewers within the grace period."""


@pytest.mark.parametrize(
    ("patient", "viewers", "word"),
    [
        pytest.param(True, [*[0] * 500, 1, *[0] * GRACE], "left", id="it waits for the first viewer"),
        pytest.param(True, [1, *[0] * (GRACE - 1), 1, *[0] * GRACE], "left", id="a page loaded again is kept"),
        pytest.param(False, [], "unseen", id="without patience nobody is waited for"),
        pytest.param(True, [0, 0, None], "unseen", id="the run ended the wait"),
    ],
)
def test_the_page_is_left(patient: bool, viewers: list[int | None], word: str) -> None:
    """`viewers` are the numbers of viewers at each look; at None the run closes the pipe."""
    watch, looks, said = SimpleNamespace(viewers=0, was_viewed=False), iter(viewers), []

    def look(seconds: float) -> bool:
        assert said == []
        number = next(looks)
        watch.viewers = number or 0
        watch.was_viewed |= watch.viewers > 0
        return number is None

    finished = threading.Event()
    finished.set()
    link = SimpleNamespace(
        finished=finished, told={"patient": patient}, ended=SimpleNamespace(wait=look), tell=said.append
    )
    _tell_when_left(watch, link)
    assert said == [word]
    assert list(looks) == [], "it was said too early"
