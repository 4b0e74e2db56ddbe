"""glotouch_missions/retrieve.yaml as a specification, continued: recognising, taking, the wrong object, the end."""

from __future__ import annotations

import pytest

from glotouch_bt.mission_testing import fails, ok
from tests.mission.retrieve_scripts import SAFE_END, SHELF, TAKE, Run, each_code, ended, retrieve, safely

__all__ = ["retrieve"]

# --- recognising -----------------------------------------------------------------------------------------------------


@each_code("match")
def test_thin_evidence_is_touched_again_until_it_is_known(retrieve: Run, code: str) -> None:
    run = retrieve(
        {"match": fails(code), "match 2": ok(), "touch_next": [ok(decided=False), ok(decided=False), ok(decided=True)]}
    )
    assert run.succeeded
    assert run.ran("touch_next") == 3
    assert run.before("touch_next", "match 2")


def test_it_touches_no_more_than_told_and_then_decides(retrieve: Run) -> None:
    run = retrieve({"match": fails("not_recognised"), "match 2": ok(), "touch_next": ok(decided=False)})
    assert run.succeeded
    assert run.ran("touch_next") == 12


@each_code("touch_next")
def test_what_cannot_be_touched_again_is_decided_as_it_is(retrieve: Run, code: str) -> None:
    run = retrieve({"match": fails("not_recognised"), "match 2": ok(), "touch_next": fails(code)})
    assert run.succeeded
    assert run.ran("touch_next") == 1


def test_what_is_not_recognised_is_not_taken(retrieve: Run) -> None:
    run = retrieve({"match*": fails("not_recognised"), "touch_next": ok(decided=True, lacks_space=False, in_doubt=0)})
    assert safely(run, "not_recognised")
    assert (run.ran("match"), run.ran("match 2")) == (1, 1)
    assert run.never_ran("grasp")


def test_one_more_object_is_looked_for_before_it_gives_up(retrieve: Run) -> None:
    """One object may have been traced as two, so that the search ended too early."""
    unknown = {f"match{k}": fails("not_recognised", recognised=False) for k in (" 2", " 3", " 4")}
    unknown |= {"match": [fails("not_recognised", recognised=False), ok()]}
    found = {"touch_next*": ok(decided=True, lacks_space=False, in_doubt=0), "orbit_probe 5": ok(complete=True)}
    run = retrieve(unknown | found)
    assert run.succeeded
    assert run.before("match 2", "*/search on/*/search_anew*")
    assert run.before("guarded_sweep 5", "orbit_probe 5")
    assert run.before("tool_return 5", "match 5")
    nothing = {"guarded_sweep 5": fails("search_exhausted", exhausted=True), "forget_doubtful*": ok(forgotten=0)}
    none = retrieve(unknown | found | nothing)
    assert safely(none, "not_recognised")
    assert none.never_ran("match 5")


# --- taking ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("node", "code"), [(s, c) for s in ("grasp", "lift", "hold_check") for c in SHELF[s].failures()]
)
def test_what_is_not_held_is_put_back_and_taken_anew(retrieve: Run, node: str, code: str) -> None:
    run = retrieve({node: [fails(code), fails(code), ok()]})
    assert run.succeeded
    stage = ["put_back", "wrist_check 10", "grasp", "lift", "hold_check"]
    once = stage[: stage.index(node) + 1]
    assert [c.node for c in run.calls_of("*/hold/*")] == once * 2 + stage


def test_what_slips_three_times_is_left_where_it_was(retrieve: Run) -> None:
    run = retrieve({"hold_check": fails("slipped")})
    assert safely(run, "slipped")
    assert (run.ran("grasp"), run.ran("put_back"), run.ran("put_back 2")) == (3, 3, 1)
    assert run.never_ran("object_check")


@each_code("put_back")
def test_without_an_empty_hand_nothing_is_grasped(retrieve: Run, code: str) -> None:
    run = retrieve({"put_back": fails(code), "put_back 2": fails(code)})
    assert safely(run, code)
    assert run.ran("put_back") == 3
    assert run.never_ran("grasp")


def test_the_wrist_is_zeroed_before_a_grasp_if_need_be(retrieve: Run) -> None:
    run = retrieve({"wrist_check 10": fails("off_zero")})
    assert run.succeeded
    assert run.order[run.order.index("grasp") - 4 :][:4] == ["put_back", "wrist_check 10", "tare 6", "wrist_check 11"]
    off = retrieve({"wrist_check 10": fails("off_zero"), "wrist_check 11": fails("off_zero")})
    assert safely(off, "off_zero")
    assert off.never_ran("grasp")


# --- the wrong object ------------------------------------------------------------------------------------------------


@each_code("object_check")
def test_what_does_not_fit_is_put_back_and_the_next_one_is_taken(retrieve: Run, code: str) -> None:
    run = retrieve({"object_check": [fails(code, fits=False, impossible=True), ok()], "reject": ok(rejected=(4,))})
    assert run.succeeded
    stage = ["match", "put_back", "wrist_check 10", "grasp", "lift", "hold_check", "object_check"]
    assert [c.node for c in run.calls_of(TAKE)] == [*stage, "put_back 3", "reject", *stage]
    assert run.calls_of("match")[1].inputs["rejected"] == (4,)
    assert run.calls_of("reject")[0].params.max_rejected == 2


def test_what_has_been_taken_in_vain_often_enough_ends_it(retrieve: Run) -> None:
    run = retrieve({"object_check": fails("wrong_object", fits=False), "reject": [ok(), ok(), fails("wrong_object")]})
    assert safely(run, "wrong_object")
    assert (run.ran("grasp"), run.ran("reject")) == (3, 3)


def test_however_it_goes_no_more_than_six_objects_are_taken(retrieve: Run) -> None:
    run = retrieve({"object_check": fails("not_as_felt", fits=False)})
    assert not run.succeeded
    assert run.ran("grasp") == 6
    assert ended(run)


WRONG = {"object_check": [fails("wrong_object", fits=False), ok()], "put_back 3": fails("in_the_way")}


@each_code("put_back")
def test_a_wrong_object_that_cannot_be_put_back_is_set_down_elsewhere(retrieve: Run, code: str) -> None:
    run = retrieve(WRONG | {"put_back 3": fails(code)})
    assert run.succeeded
    after = run.order[run.order.index("put_back 3") + 1 :]
    assert after[:4] == ["find_place", "set_down", "reject", "match"]
    assert run.calls_of("set_down")[0].inputs["places"] == run.calls_of("find_place")[0].outputs["places"]


@pytest.mark.parametrize(("node", "code"), [(s, c) for s in ("find_place", "set_down") for c in SHELF[s].failures()])
def test_a_wrong_object_that_cannot_be_put_anywhere_ends_it(retrieve: Run, node: str, code: str) -> None:
    run = retrieve(WRONG | {node: fails(code)})
    assert run.status == "failure"
    assert ended(run)
    assert run.never_ran("reject")


# --- the end ---------------------------------------------------------------------------------------------------------


@each_code("stow")
def test_the_first_reason_is_kept_whatever_the_safe_ending_does(retrieve: Run, code: str) -> None:
    run = retrieve({"match*": fails("too_wide"), SAFE_END: fails(code)})
    assert safely(run, "too_wide")


def test_a_mission_that_succeeds_holds_what_it_has(retrieve: Run) -> None:
    assert retrieve().never_ran("stow*")
