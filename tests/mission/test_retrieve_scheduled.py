"""The mission retrieve.yaml as a specification: unlike retrieve_fixed, it touches only what may be the target."""

from __future__ import annotations

from glotouch_bt.mission_testing import fails, ok
from tests.mission.retrieve_scripts import Run, candidates, each_code, found, measures, retrieve, safely, skills

__all__ = ["retrieve"]

DECIDED = ok(decided=True, lacks_space=False, in_doubt=0, absent=0.1)
REFUSED = fails("not_recognised", recognised=False)
KEPT = {"start_over": fails("consistent")}
EXCLUDED = {"match": [REFUSED, ok()], "match 2": REFUSED, "match 4": ok(), "touch_next*": DECIDED}
"""The target is recognised once what was excluded is measured."""


def scheduled(retrieve: Run, script, *measured: int, **settings):
    return retrieve({"next_probe*": measures(*measured)} | KEPT | script, mission="retrieve", **settings)


def test_it_goes_through_its_stages_in_order(retrieve: Run) -> None:
    run = scheduled(retrieve, {"touch_next*": [ok(decided=False), DECIDED]})
    assert run.succeeded
    assert run.order == [
        "tool_pickup", "tool_calibrate",
        "tool_check", "wrist_check", "guarded_sweep", "orbit_probe",
        "next_probe", "refine_outline", "next_probe", "touch_top", "next_probe", "tool_check 3", "tool_return",
        "wrist_check 3", "touch_next", "touch_next",
        "match", "put_back", "wrist_check 9", "grasp", "lift", "hold_check", "object_check",
    ]  # fmt: skip


def test_every_skill_is_told_the_target(retrieve: Run) -> None:
    script = {"match": REFUSED, "match 2": REFUSED, "match 3": ok(), "touch_next*": DECIDED, "orbit_probe": found(2)}
    run = scheduled(retrieve, script, 0, target="truck")
    rest = run.calls_of("*/measure what was excluded/*next_probe*")
    told = {c.params.target for c in run.calls if hasattr(c.params, "target") and c not in rest}
    assert told == {"truck"}
    assert {c.params.target for c in rest} == {""}, "the rest is measured whatever the target"


def test_every_closure_is_told_the_confidence(retrieve: Run) -> None:
    refused = {f"match{n}": REFUSED for n in ("", " 2", " 3", " 4")}
    run = scheduled(retrieve, {**refused, "touch_next*": DECIDED, "orbit_probe": found(2)}, 0, confidence="0.9")
    told = [c.params.confidence for c in run.calls if hasattr(c.params, "confidence")]
    assert len(told) >= 4, "every stage of the recognition closes the jaws"
    assert set(told) == {0.9}


def test_what_is_excluded_is_neither_refined_nor_topped(retrieve: Run) -> None:
    run = scheduled(retrieve, {"orbit_probe": found(3), "touch_next*": DECIDED}, 1)
    assert run.succeeded
    assert (run.ran("refine_outline"), run.ran("touch_top")) == (1, 1)
    assert run.calls_of("refine_outline")[0].inputs["candidate"].index == 1
    assert {t.candidate for t in run.calls_of("touch_next")[0].inputs["probed"]} == {1}


def test_if_the_evidence_does_not_suffice_what_was_put_off_is_measured(retrieve: Run) -> None:
    script = {"match": REFUSED, "match 2": REFUSED, "match 3": ok(), "touch_next*": DECIDED, "orbit_probe": found(3)}
    late = "*/measure what was put off, or was moved/*"
    script |= {"next_probe*": measures(1, postponed=1), late + "next_probe*": measures(1, 2)}
    run = retrieve(script, mission="retrieve")
    assert run.succeeded
    assert skills(run, late) == [
        "tool_pickup", "tool_calibrate", "forget_doubtful",
        "next_probe", "refine_outline", "next_probe", "touch_top", "next_probe",
        "tool_check", "tool_return", "wrist_check", "touch_next", "match",
    ]  # fmt: skip
    (touched,) = run.calls_of(late + "touch_next*")
    assert not touched.params.unmeasured
    assert {t.candidate for t in touched.inputs["probed"]} == {1, 2}


def test_if_that_does_not_suffice_what_was_excluded_is_measured(retrieve: Run) -> None:
    script = EXCLUDED | {"orbit_probe": found(3)}
    run = scheduled(retrieve, script, 1)
    assert run.succeeded
    assert not run.calls_of("*/measure what was put off, or was moved/*tool_pickup*")
    last = "*/measure what was excluded/*"
    assert skills(run, last).count("refine_outline") == skills(run, last).count("touch_top") == 2
    (touched,) = run.calls_of(last + "touch_next*")
    assert touched.params.unmeasured
    assert {t.candidate for t in touched.inputs["probed"]} == {0, 1, 2}


def test_if_all_was_measured_the_probe_is_taken_again_only_to_search_on(retrieve: Run) -> None:
    run = scheduled(retrieve, {"match*": REFUSED, "touch_next*": DECIDED})
    assert safely(run, "not_recognised")
    assert (run.ran("match"), run.ran("match 2"), len(run.calls_of("tool_pickup*"))) == (1, 1, 2)
    assert run.before("*/search on/*/tool_pickup*", "*/search on/*/search_anew*")


MOVED = "*/measure what was put off, or was moved/*"
DOUBTED = {
    "match": REFUSED,
    "match 2": REFUSED,
    "match 3": ok(),
    "touch_next*": ok(decided=True, lacks_space=False, in_doubt=1),
}


def test_what_is_not_where_it_was_traced_is_searched_again_at_once(retrieve: Run) -> None:
    script = {
        "forget_doubtful*": ok(forgotten=1, candidates=candidates(0.9), probed=()),
        MOVED + "orbit_probe*": found(2),
    }
    run = scheduled(retrieve, DOUBTED | script, 1)
    assert run.succeeded
    assert skills(run, MOVED) == [
        "tool_pickup", "tool_calibrate", "forget_doubtful",
        "tool_check", "wrist_check", "guarded_sweep", "orbit_probe",
        "next_probe", "refine_outline", "next_probe", "touch_top", "next_probe",
        "tool_check", "tool_return", "wrist_check", "touch_next", "match",
    ]  # fmt: skip
    assert run.calls_of(MOVED + "refine_outline*")[0].inputs["candidate"].index == 1, "only what may be the target"
    assert not run.calls_of("*/look_further/*")


def test_if_it_is_found_nowhere_the_rest_is_touched(retrieve: Run) -> None:
    gone = {"forget_doubtful*": ok(forgotten=1, candidates=candidates(0.9), probed=())}
    gone |= {MOVED + "guarded_sweep*": fails("search_exhausted", exhausted=True)}
    run = scheduled(retrieve, DOUBTED | gone | {"orbit_probe": found(2)}, 1)
    assert run.succeeded
    assert not run.calls_of(MOVED + "orbit_probe*")
    assert run.ran(MOVED + "touch_next*") == 1


def test_after_the_last_search_the_rest_is_touched_if_what_was_forgotten_is_not_found(retrieve: Run) -> None:
    last = "*/search on/*"
    script = {"match": [REFUSED, ok()], "match 2": REFUSED, "match 5": ok(), "touch_next*": DECIDED}
    script |= {last + "forget_doubtful*": ok(forgotten=1, candidates=candidates(0.9), probed=())}
    script |= {last + "guarded_sweep*": fails("search_exhausted", exhausted=True), last + "search_anew*": ok(found=1)}
    run = scheduled(retrieve, script)
    assert run.succeeded
    done = skills(run, last)
    assert [done.count(s) for s in ("guarded_sweep", "orbit_probe", "refine_outline", "touch_top")] == [1, 0, 1, 1]
    assert run.ran("match 5") == 1


@each_code("tool_pickup")
def test_without_the_probe_the_rest_is_touched_as_it_is(retrieve: Run, code: str) -> None:
    script = EXCLUDED | {"orbit_probe": found(2)}
    last = "*/measure what was excluded/*"
    run = scheduled(retrieve, script | {last + "tool_pickup*": fails(code)}, 1)
    assert run.succeeded
    assert len(run.calls_of(last + "tool_pickup*")) == 3
    assert not run.calls_of(last + "refine_outline*")
    assert len(run.calls_of(last + "touch_next*")) == 1


def test_a_hand_that_cannot_be_cleared_then_touches_nothing(retrieve: Run) -> None:
    last = "*/measure what was excluded/*"
    script = {
        "match*": REFUSED,
        "touch_next*": DECIDED,
        "orbit_probe": found(2),
        last + "tool_check*": fails("tool_lost"),
    }
    run = scheduled(retrieve, script | {last + "stow*": fails("object_held")}, 1)
    assert not run.succeeded
    assert not run.calls_of(last + "touch_next*")


def test_a_map_that_contradicts_itself_is_forgotten_and_all_begins_again(retrieve: Run) -> None:
    refused = {f"match{n}": REFUSED for n in (" 2", " 3", " 4", " 5")} | {"match": [REFUSED, ok()]}
    run = scheduled(retrieve, {**refused, "touch_next*": DECIDED, "start_over": ok(candidates=())})
    assert run.succeeded
    (again,) = run.calls_of("start_over")
    assert again.params.expected_objects == 5
    at = run.order.index("start_over")
    assert run.calls[at - 1].skill == "stow"
    assert run.order[at + 1 : at + 5] == ["tool_pickup", "tool_calibrate", "tool_check", "wrist_check"]
    assert run.ran("match") == 2


def test_it_begins_again_only_once(retrieve: Run) -> None:
    """The second time, `start_over` says that it forgot everything before."""
    script = {"match*": REFUSED, "touch_next*": DECIDED, "start_over": [ok(), fails("consistent")]}
    run = scheduled(retrieve, script)
    assert safely(run, "not_recognised")
    assert (run.ran("match"), run.ran("start_over")) == (2, 2)


# --- space for the fingers -------------------------------------------------------------------------------------------

CRAMPED = ok(decided=True, cramped=(0,), lacks_space=True, in_doubt=0, absent=0.1)
MAKE_SPACE = "*/make_space/*"
SAFELY = ("none is the target so far", "make_space 2", "begin again", "end safely")
"""Where an object in the hand ends the mission, in order."""
NOT_KNOWN = {f"match{n}": REFUSED for n in (" 2", " 3", " 4", " 5")} | {
    "match": [REFUSED, ok()],
    "touch_next*": CRAMPED,
}


def test_where_closures_lack_space_a_push_makes_it_and_the_target_is_recognised_again(retrieve: Run) -> None:
    run = scheduled(retrieve, NOT_KNOWN)
    assert run.succeeded
    assert skills(run, MAKE_SPACE) == ["stow", "wrist_check", "nudge"]
    assert run.calls_of("nudge")[0].inputs["cramped_before"] == (0,)
    assert not run.calls_of("*/look_further/*"), "that takes minutes"
    assert run.ran("match") == 2


def test_if_the_target_is_probably_not_among_them_what_moves_nothing_comes_first(retrieve: Run) -> None:
    doubted = ok(decided=True, cramped=(0,), lacks_space=True, in_doubt=0, absent=0.9)
    run = scheduled(retrieve, NOT_KNOWN | {"touch_next*": doubted})
    assert run.succeeded
    assert run.before("*/look_further/*search_anew*", "nudge*")


@each_code("nudge")
def test_where_no_push_makes_space_one_is_lifted_out(retrieve: Run, code: str) -> None:
    run = scheduled(retrieve, NOT_KNOWN | {"nudge": fails(code)})
    assert run.succeeded
    assert skills(run, MAKE_SPACE)[2:] == [
        "nudge", "clear_plan", "put_back", "wrist_check", "grasp", "lift", "hold_check", "set_down",
    ]  # fmt: skip


def test_where_nothing_lacks_space_nothing_is_moved(retrieve: Run) -> None:
    run = scheduled(retrieve, {"match*": REFUSED, "touch_next*": DECIDED})
    assert safely(run, "not_recognised")
    assert run.never_ran("nudge*")
    assert run.never_ran("clear_plan*")


def test_if_no_space_can_be_made_the_first_reason_is_kept(retrieve: Run) -> None:
    script = {"match*": REFUSED, "touch_next*": CRAMPED}
    script |= {"nudge*": fails("no_push"), "clear_plan*": fails("no_clear")}
    assert safely(scheduled(retrieve, script), "not_recognised")


def test_an_object_that_can_be_set_down_nowhere_ends_the_mission_in_the_hand(retrieve: Run) -> None:
    held = {"nudge": fails("no_push"), "set_down 2": fails("no_place"), "put_back 7": fails("in_the_way")}
    held |= {f"*/{where}/*stow*": fails("object_held") for where in SAFELY}
    run = scheduled(retrieve, {"match*": REFUSED, "touch_next*": CRAMPED} | held)
    assert run.status == "failure"
    assert (run.ran("nudge"), run.ran("set_down 2")) == (1, 1)
    assert [c.skill for c in run.calls[run.order.index("set_down 2") + 1 :]] == ["put_back", *["stow"] * len(SAFELY)]


def test_where_the_hand_fits_at_no_grasp_space_is_made_and_the_target_is_recognised_again(retrieve: Run) -> None:
    no_space = fails("no_space", graspable=True, cramped=(0,), lacks_space=True)
    run = scheduled(retrieve, {"touch_next*": DECIDED, "grasp": [no_space] * 3 + [ok()]})
    assert run.succeeded
    assert (run.ran("nudge"), run.ran("match"), run.ran("grasp")) == (1, 2, 4)
    assert run.never_ran("search_anew 2")
