"""Waiting for a slow request."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from glotouch_bt.robot import HOLD
from glotouch_bt.skill import SkillFailed
from glotouch_skills.common.hand.wait_for import TIMEOUT_PERIODS, finish


def periods(ticket: SimpleNamespace, done_after: int) -> int:
    n = 0
    for command in finish(ticket, "tare"):
        assert command is HOLD
        n += 1
        ticket.done = n >= done_after
    return n


@pytest.mark.parametrize("n", [1, 20, TIMEOUT_PERIODS])
def test_holds_until_done(n: int) -> None:
    assert periods(SimpleNamespace(done=False, error=None), n) == n


def test_done_at_once_costs_no_period() -> None:
    assert periods(SimpleNamespace(done=True, error=None), 0) == 0


@pytest.mark.parametrize(("after", "error", "words"), [(3, "no power", "no power"), (10**6, None, "timed out")])
def test_wait_for__request_failed(after: int, error: str | None, words: str) -> None:
    with pytest.raises(SkillFailed, match=words) as caught:
        periods(SimpleNamespace(done=False, error=error), after)
    assert caught.value.reason.code == "request_failed"
