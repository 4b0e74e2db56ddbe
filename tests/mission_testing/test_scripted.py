"""Scripted leaves on the real tree and runner: who is called, with what, in which order, and what comes of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from glotouch_bt.mission.load import Mission
from glotouch_bt.mission_testing import Call, ScriptError, fails, hangs, ok, raises, real, run_scripted, stand_in
from glotouch_bt.mission_testing.outcomes import LeafOutcome
from glotouch_bt.mission_testing.scripted import RunsAway

Make = Callable[..., Mission]


def test_what_is_not_scripted_succeeds_with_values_of_the_ports_types(mission: Make) -> None:
    run = run_scripted(
        mission("\n  - find\n  - use: {in: {item: item}, name: nobody}\n".replace("item: item", "item: {weight: 1}"))
    )
    assert run.succeeded
    assert run.order == ["find", "nobody"]
    assert run.keys["complete"] is True
    assert [type(i).__name__ for i in run.keys["items"]] == ["Item"]


def test_a_row_goes_on_call_after_call_and_its_last_outcome_repeats(mission: Make, item: Any) -> None:
    run = run_scripted(
        mission(),
        {
            "find": [fails("nothing"), ok(items=tuple(map(item, (1.0, 2.0, 3.0))), found=3)],
            "use": [ok(mark=1), fails("broken")],
        },
    )
    assert run.order == ["find", "find", "use", "use", "use"]
    assert run.endings("use") == ["SUCCESS", "broken", "broken"]
    assert run.keys["marks"] == (1.0,)
    assert run.succeeded


def test_a_failure_names_its_root_cause(mission: Make) -> None:
    run = run_scripted(mission(), {"find": fails("blocked")})
    assert run.failed_with("blocked", "find")
    assert not run.failed_with("nothing")
    assert (run.code, run.ran("find"), run.never_ran("use")) == ("blocked", 2, True)
    assert run.status_of("retry") == "FAILURE"
    assert run.status_of("for_each") == "INVALID"


def test_a_condition_that_fails_is_a_reason(mission: Make) -> None:
    run = run_scripted(mission(), {"find": ok(found=1)})
    assert (run.status, run.code, run.chain[-1].node) == ("failure", "condition_false", "enough")


def test_a_function_decides_when_it_is_called(mission: Make, item: Any) -> None:
    def use(call: Call) -> LeafOutcome:
        return fails() if call.inputs["item"].weight == 2.0 else ok(mark=call.number)

    run = run_scripted(mission(), {"find": ok(items=tuple(map(item, (1.0, 2.0, 3.0))), found=3), "use": use})
    assert run.endings("use") == ["SUCCESS", "broken", "SUCCESS"]
    assert run.keys["marks"] == (0.0, 2.0)


@pytest.mark.parametrize("pattern", ["use", "u*", "*/for_each/*", "m/sequence/for_each/use"])
def test_patterns_fit_names_skills_and_paths(mission: Make, pattern: str) -> None:
    run = run_scripted(mission(), {pattern: fails("broken")})
    assert run.failed_with("broken")
    assert run.ran(pattern) == 1


def test_of_two_patterns_the_last_one_counts_and_a_name_above_all(mission: Make) -> None:
    tree = "\n  - find: {name: one}\n  - find: {name: two}\n"
    run = run_scripted(mission(tree), {"one": ok(found=1), "f*": ok(found=7), "*": ok(found=8)})
    assert [c.outputs["found"] for c in run.calls] == [1, 8]


@pytest.mark.parametrize(
    ("script", "words"),
    [
        ({"fnd": ok()}, "no leaf of 'm' is called 'fnd'; did you mean 'find'?"),
        ({"find": fails("nothin")}, "'find' never fails with 'nothin'; did you mean 'nothing'?"),
        ({"find": ok(foud=1)}, "no output port 'foud'; did you mean 'found'?"),
        ({"find": ok(found="two")}, "port 'found' takes a int, not 'two'"),
        ({"find": ok(complete=1)}, "port 'complete' takes a bool, not 1"),
        ({"find": []}, "an outcome"),
        ({"find": "ok"}, "an outcome"),
        ({"find": ok}, "called: ok()"),
        ({"find": [ok(), real()]}, "real() cannot stand in a row"),
        ({"find": lambda call: fails("nothin")}, "never fails with 'nothin'"),
    ],
)
def test_a_script_that_cannot_be_is_refused(mission: Make, script: Any, words: str) -> None:
    with pytest.raises(Exception, match=r".") as refused:
        run_scripted(mission(), script)
    assert words in str(refused.value)


def test_asking_for_a_leaf_that_is_not_there_is_a_slip_of_the_test(mission: Make) -> None:
    run = run_scripted(mission())
    with pytest.raises(ScriptError, match="no leaf of 'm' is called 'lift'"):
        run.never_ran("lift")
    with pytest.raises(ScriptError, match="no node"):
        run.status_of("lift")


def test_time_passes_on_the_robot_s_clock_only(mission: Make) -> None:
    run = run_scripted(mission(), {"find": ok(found=2).after(834.5)})
    assert run.succeeded
    assert run.duration_s == pytest.approx(834.5, abs=0.011)
    assert run.ticks < 20, "nobody ticks while nothing happens"


def test_a_timeout_breaks_off_what_hangs_at_its_time(mission: Make) -> None:
    tree = "\n  - retry: {attempts: 2, do: {timeout: {seconds: 50, do: find}}}\n"
    run = run_scripted(mission(tree), {"find": [hangs(), ok().after(20)]})
    assert run.endings("find") == ["PREEMPTED", "SUCCESS"]
    assert run.calls[1].start_s == pytest.approx(50.0, abs=0.1)
    assert run.duration_s == pytest.approx(70.0, abs=0.2)


def test_skipping_time_changes_nothing(mission: Make, fake_robot: Callable[..., Any]) -> None:
    """The same scripts with every period of 10 ms ticked."""
    tree = """
  - retry: {attempts: 3, do: {timeout: {seconds: 0.2, do: find}}}
  - timeout: {seconds: 0.5, do: {repeat: {times: 3, do: {find: {name: again}}}}}
"""
    made = mission(tree)
    script = {"find": [hangs(), fails().after(0.05), ok().after(0.13)], "again": ok().after(0.17)}
    quick, slow = run_scripted(made, script), run_scripted(made, script, robot=fake_robot())
    assert quick.ticks < slow.ticks / 3
    assert (quick.status, quick.code) == (slow.status, slow.code)
    for a, b in zip(quick.calls, slow.calls, strict=True):
        assert (a.node, a.ending) == (b.node, b.ending)
        assert a.start_s == pytest.approx(b.start_s, abs=0.011)
        assert a.end_s == pytest.approx(b.end_s, abs=0.011)


def test_in_a_parallel_the_other_child_goes_on(mission: Make) -> None:
    tree = "\n  parallel: {policy: one, do: [rest: {name: slow}, repeat: {times: 3, do: {find: {name: quick}}}]}\n"
    run = run_scripted(mission(tree), {"slow": hangs(), "quick": ok().after(0.1)})
    assert run.succeeded
    assert (run.endings("slow"), run.ran("quick")) == (["PREEMPTED"], 3)


def test_what_hangs_without_a_timeout_ends_with_its_skill_s_longest_time(mission: Make) -> None:
    run = run_scripted(mission(), {"find": [hangs(), ok(found=2)]})
    assert (run.endings("find"), run.succeeded) == (["skill_timeout", "SUCCESS"], True)
    assert run.duration_s == pytest.approx(900.0, abs=0.2)


def test_the_mission_s_time_ends_it(mission: Make) -> None:
    run = run_scripted(mission(), {"find": hangs()}, timeout_s=300)
    assert (run.code, run.duration_s, run.endings("find")) == ("mission_timeout", 300.0, ["PREEMPTED"])


def test_a_fault_in_a_skill_aborts_and_is_named(mission: Make) -> None:
    run = run_scripted(mission(), {"use": raises(ZeroDivisionError("a bug"))})
    assert (run.status, run.endings("use")) == ("aborted", ["RAISED"])
    assert isinstance(run.error, ZeroDivisionError)
    assert run.chain[-1].node == "m/sequence/for_each/use"


def test_a_required_input_that_nobody_wrote_raises_as_it_does_in_a_skill(mission: Make) -> None:
    made = mission()
    made.spec.children[1].children[0].reads = {}  # a hole in the wiring that check would have found
    assert run_scripted(made).status == "aborted"


def test_a_real_skill_runs_among_scripted_ones(mission: Make, fake_robot: Callable[..., Any]) -> None:
    robot = fake_robot()
    run = run_scripted(mission("\n  - find\n  - rest\n"), {"rest": real()}, robot=robot)
    assert run.succeeded
    assert run.order == ["find"], "only scripted leaves are calls"
    assert run.status_of("rest") == "SUCCESS"
    assert robot.cycles == 3


def test_a_mission_that_does_not_end_is_broken_off(mission: Make) -> None:
    run = run_scripted(mission("\n  repeat: {times: 1000000, do: find}\n"), max_ticks=50)
    assert isinstance(run.error, RunsAway)


def test_a_run_shows_what_happened(mission: Make) -> None:
    shown = repr(run_scripted(mission(), {"find": [fails("nothing"), ok(found=1)]}))
    assert "find[nothing] find use" in shown
    assert "enough" in shown


def test_stand_ins_have_the_fields_asked_for(mission: Make, item: Any) -> None:
    assert stand_in(item, weight=-3.0).weight == -3.0, "what the class refuses is made all the same"
    assert stand_in(item).name == "x"
    with pytest.raises(Exception, match="one of its fields weight, name"):
        stand_in(item, wight=3.0)


def test_a_setting_that_the_mission_does_not_have_is_a_slip_of_the_test(scripted: Any) -> None:
    with pytest.raises(ScriptError, match=r"unknown setting 'targt'; did you mean 'target'\?"):
        scripted("retrieve", {}, settings={"targt": "apple"})
