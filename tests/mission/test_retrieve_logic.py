"""missions/retrieve.yaml as a specification: what it does when its skills end so or so."""

from __future__ import annotations

from typing import Any

from glotouch_bt.mission_testing import fails, ok


def test_everything_goes_well(scripted: Any) -> None:
    run = scripted("retrieve")
    assert run.succeeded
    assert run.before("tool_return", "squeeze")


def test_no_candidate_can_be_squeezed(scripted: Any) -> None:
    run = scripted("retrieve", {"guarded_sweep": [ok() * 3, fails("search_exhausted", exhausted=True)],
                                "orbit_probe": ok(complete=False, found=2), "squeeze": fails("no_squeeze")})  # fmt: skip
    assert run.failed_with("no_squeeze")
    assert run.never_ran("lift")
