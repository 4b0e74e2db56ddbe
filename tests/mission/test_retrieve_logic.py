"""The mission retrieve_fixed.yaml as a specification: what it does as its skills end. Exploring and squeezing.

The skills are scripted, the tree and the runner are real. `glotouch test retrieve` with these files says which slips
in the mission these tests do not notice.
"""

from __future__ import annotations

from typing import Any

import pytest

from glotouch_bt.mission_testing import Call, fails, ok, stand_in
from glotouch_bt.perception.touch import Candidate, TouchSet
from tests.mission.retrieve_scripts import (
    FELT,
    GO_ON,
    JAWS,
    LAST_CHECK,
    SHELF,
    SWEEP,
    Run,
    candidates,
    each_code,
    ended,
    found,
    retrieve,
    safely,
    skills,
)

__all__ = ["retrieve"]

# --- all goes well ---------------------------------------------------------------------------------------------------


def test_it_goes_through_its_stages_in_order(retrieve: Run) -> None:
    run = retrieve()
    assert run.succeeded
    assert [c.skill for c in run.calls] == [
        "tool_pickup", "tool_calibrate",
        "tool_check", "wrist_check", "guarded_sweep", "orbit_probe",
        "next_probe", "refine_outline", "next_probe", "touch_top", "next_probe", "tool_check", "tool_return",
        "wrist_check", "squeeze",
        "match", "put_back", "wrist_check", "grasp", "lift", "hold_check", "object_check",
    ]  # fmt: skip


def test_every_skill_is_told_what_the_mission_is_told(retrieve: Run) -> None:
    again = {"match": fails("not_recognised"), "match 2": ok(), "touch_next": ok(decided=True)}
    run = retrieve(again, target="truck", expected_objects=3, policy="nearest_frontier")
    (sweep,) = run.calls_of("guarded_sweep")
    assert (sweep.params.expected_objects, sweep.params.policy) == (3, "nearest_frontier")
    told = [c.params.target for c in run.calls if hasattr(c.params, "target") and c.skill != "next_probe"]
    assert told == ["truck"] * 4, "match, touch_next, match, object_check"


def test_what_one_stage_finds_the_next_one_gets(retrieve: Run) -> None:
    measured = {i: stand_in(Candidate, index=i, quality=0.9) for i in range(3)}
    felt = {i: stand_in(TouchSet) for i in range(3)}
    run = retrieve(
        {
            "orbit_probe": ok(candidates=candidates(0.5, 0.2, 0.8), found=3),
            "touch_top": lambda call: ok(measured=measured[call.inputs["candidate"].index]),
            "refine_outline": lambda call: ok(refined=call.inputs["candidate"]),
            "squeeze": lambda call: ok(touchset=felt[call.inputs["candidate"].index]),
        }
    )
    assert run.succeeded
    assert [c.inputs["candidate"].index for c in run.calls_of("touch_top")] == [1, 0, 2], "the worst known first"
    assert [c.inputs["candidate"] for c in run.calls_of("squeeze")] == [measured[i] for i in range(3)]
    assert run.calls_of("match")[0].inputs["touchsets"] == tuple(felt.values())
    assert run.keys["candidates"] == tuple(measured.values())


# --- the probe -------------------------------------------------------------------------------------------------------


@each_code("tool_pickup")
def test_a_probe_that_is_not_taken_is_put_back_and_taken_anew(retrieve: Run, code: str) -> None:
    run = retrieve({"tool_pickup": [fails(code), fails(code), ok()]})
    assert run.succeeded
    assert run.order[:6] == ["tool_pickup", "stow", "tool_pickup", "stow", "tool_pickup", "tool_calibrate"]


@each_code("tool_calibrate")
def test_a_probe_that_cannot_be_measured_is_put_back_and_taken_anew(retrieve: Run, code: str) -> None:
    run = retrieve({"tool_calibrate": [fails(code), ok()]})
    assert run.succeeded
    assert run.order[:5] == ["tool_pickup", "tool_calibrate", "stow", "tool_pickup", "tool_calibrate"]


def test_without_a_probe_nothing_is_found_and_the_first_reason_is_kept(retrieve: Run) -> None:
    run = retrieve({"tool_pickup": fails("no_probe"), "stow": fails("request_failed")})
    assert safely(run, "no_probe")
    assert (run.ran("tool_pickup"), run.ran("stow"), run.ran(GO_ON)) == (3, 3, 1)
    assert run.never_ran("guarded_sweep")
    assert run.never_ran("squeeze")


@each_code("tool_check")
def test_a_probe_that_was_lost_is_taken_from_its_holder_before_the_sweep_goes_on(retrieve: Run, code: str) -> None:
    run = retrieve({"tool_check": [fails(code), ok()], FELT: fails(code)})
    assert run.succeeded
    lost = ["tool_check", "tool_check", "stow", "tool_pickup", "tool_calibrate", "search_anew"]
    assert skills(run, SWEEP) == [*lost, "tool_check", "wrist_check", "guarded_sweep", "orbit_probe"]


def test_a_probe_that_is_felt_where_it_was_is_kept(retrieve: Run) -> None:
    run = retrieve({"tool_check": [fails("tool_lost"), ok()]})
    assert run.succeeded
    assert (run.ran(FELT), run.ran("*/bring the probe in order/*/*")) == (1, 0)
    assert [c.params.touch for c in run.calls_of("tool_check*")] == [False, True, False, False]


@pytest.mark.parametrize("skill", ["stow", "tool_pickup", "tool_calibrate"])
def test_a_probe_that_is_not_taken_anew_ends_the_search(retrieve: Run, skill: str) -> None:
    node = f"*/take it from its holder/{skill}*"
    run = retrieve({"guarded_sweep": fails("tool_lost"), FELT: fails("tool_lost"), node: fails()})
    assert run.ran(node) == 3
    after = {"stow": "tool_pickup*", "tool_pickup": "tool_calibrate*", "tool_calibrate": None}[skill]
    assert after is None or run.never_ran(f"*/take it from its holder/{after}")


def test_a_wrist_that_reads_something_in_free_air_is_zeroed(retrieve: Run) -> None:
    run = retrieve({"wrist_check": fails("off_zero")})
    assert run.succeeded
    assert skills(run, SWEEP) == ["tool_check", "wrist_check", "tare", "wrist_check", "guarded_sweep", "orbit_probe"]


@pytest.mark.parametrize("script", [{"wrist_check 2": fails("off_zero")}, {"tare": fails("request_failed")}])
def test_with_a_wrist_that_cannot_be_zeroed_nothing_is_swept(retrieve: Run, script: dict[str, Any]) -> None:
    run = retrieve({"wrist_check": fails("off_zero"), **script})
    assert not run.succeeded
    assert (run.ran("wrist_check"), run.ran(FELT), run.ran(GO_ON)) == (3, 3, 1)
    assert run.never_ran("guarded_sweep")
    assert run.never_ran("squeeze*")


# --- exploring -------------------------------------------------------------------------------------------------------


def test_it_sweeps_until_all_are_found(retrieve: Run) -> None:
    run = retrieve({"orbit_probe": [found(1, complete=False), found(2, complete=False), found(3, complete=True)]})
    assert run.succeeded
    assert run.ran("guarded_sweep") == 3


@each_code("orbit_probe")
def test_what_cannot_be_traced_does_not_end_the_search(retrieve: Run, code: str) -> None:
    run = retrieve({"orbit_probe": [found(1, complete=False), fails(code), found(2, complete=True)]})
    assert run.succeeded
    assert (run.ran("guarded_sweep"), run.ran("tool_check")) == (3, 1), "and it is not begun anew"


def test_with_nothing_left_to_explore_it_goes_on_with_what_there_is(retrieve: Run) -> None:
    sweeps = [ok(), fails("search_exhausted", exhausted=True)]
    run = retrieve({"guarded_sweep": sweeps, "orbit_probe": found(1, complete=False)})
    assert run.succeeded
    assert (run.ran("guarded_sweep"), run.ran("squeeze")) == (2, 1)


def test_nothing_found_at_all_is_not_enough(retrieve: Run) -> None:
    run = retrieve(
        {"guarded_sweep": [ok(), fails("search_exhausted", exhausted=True)], "orbit_probe": found(0, complete=False)}
    )
    assert not run.succeeded
    assert run.ran("guarded_sweep") == 4, "it looks three times"
    assert ended(run)
    assert run.never_ran("squeeze*")


@pytest.mark.parametrize("code", [c for c in SHELF["guarded_sweep"].failures() if c != "search_exhausted"])
def test_a_sweep_that_breaks_off_is_taken_up_with_the_probe_in_order(retrieve: Run, code: str) -> None:
    run = retrieve({"guarded_sweep": [fails(code, exhausted=False), ok()]})
    assert run.succeeded
    once = ["tool_check", "wrist_check", "guarded_sweep"]
    assert skills(run, SWEEP) == [*once, "tool_check", *once, "orbit_probe"]


def test_a_sweep_that_breaks_off_three_times_leaves_what_was_found(retrieve: Run) -> None:
    sweeps = [ok(), fails("hard_contact", exhausted=False)]
    run = retrieve({"guarded_sweep": sweeps, "orbit_probe": found(2, complete=False)})
    assert run.succeeded
    assert (run.ran("guarded_sweep"), run.ran("tool_check"), run.ran(FELT), run.ran(GO_ON)) == (4, 3, 3, 1)
    assert run.never_ran("touch_top")
    assert run.ran("squeeze") == 2
    assert run.before(GO_ON, "squeeze")


def test_a_search_that_gets_nowhere_is_bounded(retrieve: Run) -> None:
    run = retrieve({"orbit_probe": found(1, complete=False)})
    assert run.ran("guarded_sweep") == 3 * 60
    assert run.succeeded, "with what was found"
    assert run.ran(GO_ON) == 1


def test_what_was_found_is_no_use_if_the_hand_cannot_be_cleared(retrieve: Run) -> None:
    run = retrieve({"tool_return": fails("request_failed"), GO_ON: fails("object_held")})
    assert safely(run, "request_failed")
    assert run.never_ran("squeeze")


# --- measuring -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("skill", "code"), [(s, c) for s in ("refine_outline", "touch_top") for c in SHELF[s].failures()]
)
def test_what_cannot_be_measured_stays_as_it_was(retrieve: Run, skill: str, code: str) -> None:
    run = retrieve({"orbit_probe": found(3), skill: fails(code)})
    assert run.succeeded
    assert (run.ran("refine_outline"), run.ran("touch_top"), run.ran("squeeze")) == (3, 3, 3)
    assert run.before("guarded_sweep", "refine_outline")
    assert run.calls_of("touch_top")[0].number == 0


def test_each_outline_is_refined_before_its_top_is_touched(retrieve: Run) -> None:
    run = retrieve({"orbit_probe": found(2)})
    assert [c.skill for c in run.calls_of("*/outline or top/*/*")] == ["refine_outline", "touch_top"] * 2


@pytest.mark.parametrize(
    ("node", "code"),
    [(LAST_CHECK, c) for c in SHELF["tool_check"].failures()]
    + [("tool_return", c) for c in SHELF["tool_return"].failures()],
)
def test_a_probe_lost_while_measuring_is_given_up(retrieve: Run, node: str, code: str) -> None:
    run = retrieve({node: fails(code)})
    assert run.succeeded
    assert run.before(node, GO_ON)
    assert run.before(GO_ON, "squeeze")
    assert run.ran("tool_return") == (node == "tool_return")


# --- squeezing -------------------------------------------------------------------------------------------------------


@each_code("squeeze")
def test_a_candidate_that_cannot_be_squeezed_does_not_end_the_mission(retrieve: Run, code: str) -> None:
    def squeeze(call: Call) -> Any:
        return fails(code) if call.inputs["candidate"].index == 0 else ok()

    kept = {"refine_outline": lambda call: ok(refined=call.inputs["candidate"]),
            "touch_top": lambda call: ok(measured=call.inputs["candidate"])}  # fmt: skip
    run = retrieve({"orbit_probe": found(3), "squeeze": squeeze, **kept})
    assert run.succeeded
    assert run.ran("squeeze") == 3
    assert len(run.calls_of("match")[0].inputs["touchsets"]) == 2


def test_with_no_candidate_squeezed_there_is_nothing_to_recognise(retrieve: Run) -> None:
    run = retrieve({"orbit_probe": found(2), "squeeze*": fails("no_squeeze")})
    assert safely(run, "no_squeeze")
    assert run.ran("squeeze") == 2
    assert run.never_ran("match*")


def test_a_squeeze_is_made_again_only_if_the_wrist_was_off(retrieve: Run) -> None:
    fine = retrieve({"squeeze": fails("nothing_felt")})
    assert safely(fine, "nothing_felt")
    assert (fine.ran("wrist_check 5"), fine.never_ran("tare 3"), fine.never_ran("squeeze 2")) == (1, True, True)
    off = retrieve({"squeeze": fails("nothing_felt"), "wrist_check 5": fails("off_zero")})
    assert off.succeeded
    assert [c.node for c in off.calls_of(JAWS)] == ["wrist_check 3", "squeeze", "wrist_check 5", "tare 3", "squeeze 2"]


@pytest.mark.parametrize(("node", "code"), [("tare 3", "request_failed"), ("squeeze 2", "no_squeeze")])
def test_a_second_squeeze_may_fail_too(retrieve: Run, node: str, code: str) -> None:
    run = retrieve({"squeeze": fails("nothing_felt"), "wrist_check 5": fails("off_zero"), node: fails(code)})
    assert not run.succeeded
    assert run.ran("squeeze 2") == (node == "squeeze 2")


def test_the_wrist_is_zeroed_before_a_squeeze_if_need_be(retrieve: Run) -> None:
    run = retrieve({"wrist_check 3": fails("off_zero")})
    assert run.succeeded
    assert [c.node for c in run.calls_of(JAWS)] == ["wrist_check 3", "tare 2", "wrist_check 4", "squeeze"]
    off = retrieve({"wrist_check 3": fails("off_zero"), "wrist_check 4": fails("off_zero")})
    assert safely(off, "off_zero")
    assert off.never_ran("squeeze")
