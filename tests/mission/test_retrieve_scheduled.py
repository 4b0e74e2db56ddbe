"""The mission retrieve.yaml as a specification: unlike retrieve_fixed, it touches only what may be the target."""

from __future__ import annotations

from glotouch_bt.mission_testing import fails, ok
from tests.mission.retrieve_scripts import Run, each_code, found, measures, retrieve, safely

__all__ = ["retrieve"]

DECIDED = ok(decided=True)
REFUSED = fails("not_recognised")


def scheduled(retrieve: Run, script, *measured: int, **settings):
    return retrieve({"next_probe*": measures(*measured), **script}, mission="retrieve", **settings)


def test_it_goes_through_its_stages_in_order(retrieve: Run) -> None:
    run = scheduled(retrieve, {"touch_next*": [ok(decided=False), DECIDED]})
    assert run.succeeded
    assert run.order == [
        "tool_pickup", "tool_calibrate",
        "tool_check", "wrist_check", "guarded_sweep", "orbit_probe",
        "next_probe", "refine_outline", "next_probe", "touch_top", "next_probe", "tool_check 3", "tool_return",
        "wrist_check 3", "touch_next", "touch_next",
        "match", "put_back", "wrist_check 7", "grasp", "lift", "hold_check", "object_check",
    ]  # fmt: skip


def test_every_skill_is_told_the_target(retrieve: Run) -> None:
    script = {"match": REFUSED, "match 2": REFUSED, "match 3": ok(), "touch_next*": DECIDED, "orbit_probe": found(2)}
    run = scheduled(retrieve, script, 0, target="truck")
    rest = run.calls_of("*/measure the rest/*/next_probe*")
    told = {c.params.target for c in run.calls if hasattr(c.params, "target") and c not in rest}
    assert told == {"truck"}
    assert {c.params.target for c in rest} == {""}, "the rest is measured whatever the target"


def test_what_is_excluded_is_neither_refined_nor_topped(retrieve: Run) -> None:
    run = scheduled(retrieve, {"orbit_probe": found(3), "touch_next*": DECIDED}, 1)
    assert run.succeeded
    assert (run.ran("refine_outline"), run.ran("touch_top")) == (1, 1)
    assert run.calls_of("refine_outline")[0].inputs["candidate"].index == 1
    assert {t.candidate for t in run.calls_of("touch_next")[0].inputs["probed"]} == {1}


def test_if_the_evidence_does_not_suffice_the_rest_is_measured(retrieve: Run) -> None:
    script = {"match": REFUSED, "match 2": REFUSED, "match 3": ok(), "touch_next*": DECIDED, "orbit_probe": found(3)}
    run = scheduled(retrieve, script, 1)
    assert run.succeeded
    assert (run.ran("tool_pickup 3"), run.ran("tool_return 2")) == (1, 1)
    assert (run.ran("refine_outline 2"), run.ran("touch_top 2")) == (2, 2)
    assert run.before("tool_return 2", "touch_next 3")
    assert run.calls_of("touch_next 3")[0].params.unmeasured
    assert {t.candidate for t in run.calls_of("touch_next 3")[0].inputs["probed"]} == {0, 1, 2}


def test_if_all_was_measured_the_probe_is_not_taken_again(retrieve: Run) -> None:
    run = scheduled(retrieve, {"match*": REFUSED, "touch_next*": DECIDED})
    assert safely(run, "not_recognised")
    assert (run.ran("match"), run.ran("match 2"), run.never_ran("tool_pickup 3")) == (1, 1, True)


@each_code("tool_pickup")
def test_without_the_probe_the_rest_is_touched_as_it_is(retrieve: Run, code: str) -> None:
    script = {"match": REFUSED, "match 2": REFUSED, "match 3": ok(), "touch_next*": DECIDED, "orbit_probe": found(2)}
    run = scheduled(retrieve, script | {"tool_pickup 3": fails(code)}, 1)
    assert run.succeeded
    assert run.ran("tool_pickup 3") == 3
    assert (run.never_ran("refine_outline 2"), run.ran("touch_next 3")) == (True, 1)


def test_a_hand_that_cannot_be_cleared_then_touches_nothing(retrieve: Run) -> None:
    script = {"match*": REFUSED, "touch_next*": DECIDED, "orbit_probe": found(2), "tool_check 4": fails("tool_lost")}
    run = scheduled(retrieve, script | {"*/measure the rest/stow*": fails("object_held")}, 1)
    assert not run.succeeded
    assert run.never_ran("touch_next 3")
