"""The mission survey.yaml as a specification: outlines that stay uncertain are traced anew before a top is touched.

The skills are scripted, the tree and the runner are real.
"""

from __future__ import annotations

from typing import Any

from glotouch_bt.mission_testing import Call, fails, ok
from glotouch_bt.perception.recognition import PARTS, ProbeTouch
from glotouch_bt.perception.touch import Candidate
from tests.mission.retrieve_scripts import candidates

START = ["tool_pickup", "tool_calibrate", "tool_check", "wrist_check"]
END = ["next_probe", "touch_top", "next_probe", "tool_check", "tool_return"]


def measures(call: Call) -> Any:
    """Return next_probe's answers: the outline of the last candidate, then its top, if it is not left for later."""
    (thing,), tried = call.inputs["known"], call.inputs.get("before") or ()
    parts = PARTS[:1] if call.params.outlines_only else PARTS
    left = [part for part in parts if ProbeTouch(thing.index, part) not in tried]
    probed = (*tried, *(ProbeTouch(thing.index, part) for part in left[:1]))
    return ok(
        candidates=(thing,), candidate=thing, next_part=left[0] if left else "", probed=probed,
        measured_enough=not left, postponed=0, unmeasured=len(left),
    )  # fmt: skip


def forgets(times: int) -> Any:
    """Return trace_anew's answers: the outline is forgotten so many times."""
    calls: list[Call] = []

    def answer(call: Call) -> Any:
        calls.append(call)
        known: tuple[Candidate, ...] = call.inputs["known"]
        probed = call.inputs["before_probed"]
        if len(calls) > times:
            return ok(search_done=True, candidates=known, probed=probed)
        return ok(search_done=False, candidates=(), probed=())

    return answer


def run_survey(scripted: Any, times: int, **more: Any) -> Any:
    script = {
        "orbit_probe*": ok(candidates=candidates(0.5), found=1, complete=True),
        "next_probe*": measures,
        "trace_anew*": forgets(times),
    }
    return scripted("survey", script | more, settings={})


def test_a_certain_map_is_made_once(scripted: Any) -> None:
    run = run_survey(scripted, 0)
    assert run.succeeded
    once = ["guarded_sweep", "orbit_probe", "next_probe", "refine_outline", "next_probe", "trace_anew"]
    assert [c.skill for c in run.calls] == [*START, *once, *END]


def test_what_stays_uncertain_is_searched_and_traced_anew_before_its_top_is_touched(scripted: Any) -> None:
    run = run_survey(scripted, 2)
    assert run.succeeded
    again = ["guarded_sweep", "orbit_probe", "next_probe", "refine_outline", "next_probe", "trace_anew"]
    ready = ["tool_check", "wrist_check"]
    assert [c.skill for c in run.calls] == [*START, *again, *ready, *again, *ready, *again, *END]


def test_how_often_is_a_parameter(scripted: Any) -> None:
    run = scripted(
        "survey",
        {"orbit_probe*": ok(candidates=candidates(0.5), found=1, complete=True), "next_probe*": measures,
         "trace_anew*": forgets(0)},
        settings={"retraces": 7},
    )  # fmt: skip
    assert [c.params.times for c in run.calls_of("trace_anew")] == [7]


def test_a_search_that_cannot_go_on_ends_safely(scripted: Any) -> None:
    """The probe is lost in the second search, and cannot be taken again."""
    swept: list[Call] = []

    def sweeps(call: Call) -> Any:
        swept.append(call)
        return ok() if len(swept) == 1 else fails("tool_lost", exhausted=False)

    run = run_survey(scripted, 1, **{"guarded_sweep*": sweeps, "tool_check*": ok()})
    assert not run.succeeded
    assert run.calls[-1].skill == "stow"
