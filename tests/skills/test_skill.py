"""Behaviour of every skill: ends with reasons, closes its body, holds the arm, and takes over from a braking arm."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_bt.robot import HOLD, MotionRefused
from glotouch_bt.skill import Failure, Out, Skill, SkillFailed, SkillParams, SkillRun, param


class GoParams(SkillParams):
    way_m: float = param("how far sideways", unit="m", default=0.10)
    end: str = param("ok, fail, refuse or bug", default="ok")


class Go(Skill):
    """Move sideways."""

    Params = GoParams
    params: GoParams
    closed = 0

    def run(self) -> SkillRun:
        try:
            yield from self.context.arm.shift((0.0, self.params.way_m, 0.0), 0.25)
        except GeneratorExit:
            self.closed += 1
            raise
        if self.params.end == "fail":
            raise SkillFailed("told_to", "the test says so", way_m=self.params.way_m)
        if self.params.end == "refuse":
            raise MotionRefused("line", "a wall")
        if self.params.end == "bug":
            raise ZeroDivisionError


def test_the_ways_to_end(bench) -> None:
    b = bench()
    done = b.make(Go, way_m=0.01)
    b.run(done)
    assert (done.status, done.reason) == (Status.SUCCESS, None)
    failed = b.make(Go, way_m=0.01, end="fail")
    b.run(failed)
    assert (failed.status, failed.reason.code, failed.reason.node) == (Status.FAILURE, "told_to", "skill")
    assert failed.reason.evidence == {"way_m": 0.01}
    refused = b.make(Go, way_m=0.01, end="refuse")
    b.run(refused)
    assert (refused.status, refused.reason.code) == (Status.FAILURE, "motion_refused")
    with pytest.raises(ZeroDivisionError):
        b.run(b.make(Go, way_m=0.01, end="bug"))


def test_a_preempted_skill_is_closed_once_and_can_start_again(bench) -> None:
    b = bench()
    skill = b.make(Go)
    b.run(skill, 30)
    b.preempt(skill)
    assert (skill.closed, skill.status) == (1, Status.INVALID)
    skill.stop(Status.INVALID)
    assert skill.closed == 1
    b.run(skill)
    assert skill.status is Status.SUCCESS


@pytest.mark.parametrize("tick", range(4, 70, 6))
def test_the_next_skill_takes_over_from_the_braking_arm_without_a_jump(bench, tick: int) -> None:
    """No period passes between breaking off and the next skill; the robot refuses setpoints that jump."""
    b = bench()
    first, second = b.make(Go), b.make(Go, way_m=-0.05)
    b.run(first, tick)
    b.context.command = HOLD
    first.tick_once()
    first.stop(Status.INVALID)
    assert b.context.command is HOLD
    assert b.context.preempted
    b.pass_time(b.context.command)
    b.run(second)
    assert second.status is Status.SUCCESS
    assert not b.context.preempted
    np.testing.assert_allclose(b.arm.q, b.context.observation.q[-1], atol=1e-9)


def test_a_skill_that_never_ran_leaves_no_trace_when_stopped(bench) -> None:
    b = bench()
    skill = b.make(Go)
    skill.stop(Status.INVALID)
    assert not b.context.preempted


def test_not_at_rest(bench) -> None:
    """An arm that never stands is not moved from anywhere it is not."""
    b = bench()
    skill = b.make(Go)
    b.context.preempted = True
    moving = dataclasses.replace(b.context.observation, dq=np.full((10, 7), 0.1))
    while True:
        b.context.observation = moving
        skill.tick_once()
        assert b.context.command.motion is None
        if skill.status is not Status.RUNNING:
            break
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "not_at_rest")
    assert b.context.preempted


class Weigh(Skill):
    """Write a result, and a section of the report."""

    Params = GoParams
    weight_N = Out(float, "the weight", result=lambda w: f"weighs {w:.1f} N")
    other = Out(float, "no result", on_failure=1.0)

    def run(self) -> SkillRun:
        self.report("Weighing", "on the scales", ("reading", "N"), [(1, 2.5)])
        self.weight_N, self.other = 2.5, 1.0
        if self.params.end == "fail":
            raise SkillFailed("told_to", "the test says so")
        yield HOLD


class Give(Skill):
    """Write a result, and fail."""

    GIVEN_UP = Failure("given_up", "it always fails", advice="none")
    tries = Out(int, "tries", always=True, result=lambda n: f"{n} tries" if n else "")
    best = Out(int, "the best", result=lambda n: f"best {n}")

    def run(self) -> SkillRun:
        yield HOLD
        self.tries, self.best = 3, 1
        raise self.GIVEN_UP("it always fails")


def test_of_a_failure_only_what_is_always_written_is_a_result(bench) -> None:
    b = bench()
    b.run(b.make(Give))
    assert [e["text"] for e in b.of_kind("result")] == ["3 tries"]


def test_a_result_is_recorded_in_words_when_the_skill_succeeds(bench) -> None:
    b = bench()
    b.run(b.make(Weigh, end="fail"))
    assert b.of_kind("result") == []
    b.run(b.make(Weigh))
    assert [dict(e) for e in b.of_kind("result")] == [{"node": "skill", "key": "weight_N", "text": "weighs 2.5 N"}]
    assert b.of_kind("report")[-1]["rows"] == [(1, 2.5)]
