"""The repeated solver steps of a run end in its end state: only its controls moved the world."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from glotouch_backends.mujoco import MujocoBackend
from glotouch_backends.mujoco.robot import MujocoRobot
from glotouch_bt.robot import HOLD, Conditions, Limits, ParamError, SafetyStop, World

Drive = Callable[[MujocoRobot], Any]
LAYOUT = {"block": (0.03, 0.08, 0.0)}


def open_traced(world: World, limits: Limits | None = None) -> MujocoRobot:
    backend = MujocoBackend(limits=limits)
    robot = backend.open(world, Conditions(), 0, {"layout": LAYOUT, "trace": "true"})
    assert isinstance(robot, MujocoRobot)
    return robot


def test_a_replay_ends_in_the_same_state_and_does_not_change_the_run(world: World, drive: Drive) -> None:
    """Jaws with two forces (the solver's limits change), a line that pushes the block, and a query of the truth."""
    with open_traced(world) as robot:
        driver, referee = drive(robot), MujocoBackend().referee(robot)
        assert referee is not None
        driver.jaws(0.070, force_N=20.0, time_s=0.2)
        driver.line((0.63, 0.08, -0.10), speed_m_s=0.2)
        driver.line((0.63, 0.08, -0.165), speed_m_s=0.1)
        driver.jaws(0.020, force_N=10.0, time_s=0.5)
        assert len(referee.objects()) == 1
        before = robot.data.qpos.copy()
        first, second = referee.replay_bare_steps(), referee.replay_bare_steps()
        assert first is not None
        assert second is not None
        assert first.same_end_state
        assert second.same_end_state
        assert first.steps == 10 * (len(driver.observations) - 1)
        assert first.wall_s > 0.0
        assert (robot.data.qpos == before).all()


def test_a_change_by_anything_but_the_controls_is_detected(world: World) -> None:
    """One joint is displaced by a nanoradian."""
    with open_traced(world) as robot:
        robot.cycle(HOLD)
        robot.data.qpos[robot.handles.arm_qpos.start] += 1e-9
        robot.cycle(HOLD)
        referee = MujocoBackend().referee(robot)
        assert referee is not None
        done = referee.replay_bare_steps()
        assert done is not None
        assert not done.same_end_state


def test_a_safety_stop_within_a_period_is_replayed(world: World, drive: Drive) -> None:
    """The arm stops between two chunks of a period: the trace has the applied controls, not the planned ones."""
    with open_traced(world, Limits(hard_force_N=8.0)) as robot:
        driver = drive(robot)
        driver.jaws(0.0, time_s=0.3)
        with pytest.raises(SafetyStop):
            driver.line((0.55, 0.0, -0.25), speed_m_s=0.2)
        for _ in range(10):
            with pytest.raises(SafetyStop):
                robot.cycle(HOLD)
        assert robot.trace is not None
        assert robot.trace.replay(robot.data).same_end_state


def test_without_the_option_nothing_is_recorded(world: World) -> None:
    backend = MujocoBackend()
    with backend.open(world, Conditions(), 0, {"layout": LAYOUT}) as robot:
        referee = backend.referee(robot)
        assert referee is not None
        assert referee.replay_bare_steps() is None


def test_the_option_is_true_or_false(world: World) -> None:
    with pytest.raises(ParamError, match="option trace"):
        MujocoBackend().open(world, Conditions(), 0, {"layout": LAYOUT, "trace": "maybe"})
