"""Guards of time: missing samples, late cycles and gaps."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from glotouch_bt.robot import HOLD, Command, GuardTripped, Observation
from glotouch_bt.robot.fake import forward
from tests.robot.supervision.supervised import Device, Spoil, setpoint, spin, supervised


def missing(count: int) -> Spoil:
    def spoil(seen: Observation) -> Observation:
        names = ("stamp_s", "q", "dq", "position_B_P", "quat_B_P", "wrench_S")
        return dataclasses.replace(seen, **{n: getattr(seen, n)[: len(seen.stamp_s) - count] for n in names})

    return spoil


def test_samples_missing__recorded_then_fatal() -> None:
    robot, found = supervised(Device(missing(7)))
    spin(robot, 30)
    assert found == [], "a polled device delivers 0.7-0.9 of its samples, on a loaded machine fewer"
    robot, found = supervised(Device(missing(8), since=5, until=7))
    spin(robot, 30)
    assert {f.guard for f in found} == {"samples_missing", "overrun"}, "the next block was late"
    robot, found = supervised(Device(missing(8), since=5))
    with pytest.raises(GuardTripped, match="samples_missing"):
        spin(robot, 30)


class Late(Device):
    """A device whose cycle lets extra periods pass; their samples are lost or arrive with it."""

    def __init__(self, extra: int, *at: int, lost: bool) -> None:
        self._extra, self._at, self._lost = extra, at, lost
        super().__init__()

    def cycle(self, command: Command) -> Observation:
        blocks = []
        if self.cycles in self._at:
            blocks = [super(Late, self).cycle(HOLD) for _ in range(self._extra)]
        newest = super().cycle(command)
        if self._lost:
            return newest
        names = ("stamp_s", "q", "dq", "position_B_P", "quat_B_P", "wrench_S")
        parts = {n: np.concatenate([getattr(b, n) for b in (*blocks, newest)]) for n in names}
        return dataclasses.replace(newest, **parts)


def move(k: int, home: Any) -> Command:
    return setpoint(np.array(home) + 0.001 * k * np.eye(7)[6], 0.1 * np.eye(7)[6])


@pytest.mark.parametrize("lost", [True, False])
def test_overrun__is_fatal_in_motion_but_not_at_rest(lost: bool) -> None:
    device = Late(40, 5, lost=lost)
    robot, found = supervised(device)
    spin(robot, 20)
    assert not any(f.fatal for f in found)
    assert found[0].guard == "overrun"
    device = Late(40, 5, lost=lost)
    robot, _ = supervised(device)
    for k in range(5):
        robot.cycle(move(k + 1, device.description.home_q))
    with pytest.raises(GuardTripped, match="overrun"):
        robot.cycle(move(6, device.description.home_q))


@pytest.mark.parametrize(("extra", "times", "ends"), [(5, 4, False), (20, 1, False), (20, 2, True)])
def test_samples_missing__fatal_after_a_quarter_second_of_lost_motion(extra: int, times: int, ends: bool) -> None:
    """The device holds during each gap."""
    device = Late(extra, *(5 + (extra + 3) * i for i in range(times)), lost=True)
    robot, found = supervised(device)
    guards = []
    for k in range(5 + 3 * times):
        try:
            robot.cycle(move(k + 1, device.description.home_q))
        except GuardTripped as e:
            guards.append(e.guard)
            break
    assert guards == ["samples_missing"] * ends
    blind = [f for f in found if f.guard == "samples_missing"]
    assert len(blind) == times
    assert all(f.value > f.limit > 1.0 for f in blind), "value and limit have the same unit"


def test_overrun__a_long_computation_before_a_motion_is_allowed() -> None:
    device = Late(40, 5, lost=False)
    robot, found = supervised(device)
    spin(robot, 5)
    for k in range(5):
        robot.cycle(move(k + 1, device.description.home_q))
    assert [f.fatal for f in found] == [False]


@pytest.mark.parametrize(("extra", "lost"), [(4, True), (7, False)])
def test_overrun__a_single_late_cycle_is_only_recorded(extra: int, lost: bool) -> None:
    device = Late(extra, 5, lost=lost)
    robot, found = supervised(device)
    for k in range(5):
        robot.cycle(move(k + 1, device.description.home_q))
    robot.cycle(move(6, device.description.home_q))
    assert {f.guard for f in found} == {"overrun"} | ({"samples_missing"} if lost else set())


def test_samples_missing__the_first_block_of_several_samples_sets_the_rate() -> None:
    class Single(Device):
        """A driver that answers with one sample when it is opened."""

        def observe(self) -> Observation:
            seen = super().observe()
            names = ("stamp_s", "q", "dq", "position_B_P", "quat_B_P", "wrench_S")
            return seen if self.cycles else dataclasses.replace(seen, **{n: getattr(seen, n)[-1:] for n in names})

    robot, found = supervised(Single(missing(8), since=5))
    spin(robot, 5)
    assert found == []
    with pytest.raises(GuardTripped, match="8 of 10 samples are missing"):
        spin(robot, 10)


@pytest.mark.parametrize(("extra", "away_m"), [(7, 0.012), (1, 0.0019)])
def test_following__a_device_that_held_by_itself_is_ahead_of_the_next_command(extra: int, away_m: float) -> None:
    """After a late command the arm rests at v^2 / 2a beyond the last one: 11 mm at 0.21 m/s.

    In two periods it may go as far as in twice one.
    """
    device = Late(extra, 8, lost=False)
    home = np.array(device.description.home_q)
    radius_m = float(np.hypot(*forward(device.description, home).position_m[:2]))
    dq = 0.21 / radius_m * np.eye(7)[0]
    poses = [setpoint(home + 0.01 * k * dq, dq) for k in range(9)]
    device._spoil, device._since = lambda seen: ahead(seen, away_m), 8 + extra
    robot, found = supervised(device)
    for command in poses:
        robot.cycle(command)
    assert {f.guard for f in found} <= {"overrun"}


def ahead(seen: Observation, away_m: float) -> Observation:
    """Return the block with the hand farther along its circle about the base."""
    position = np.array(seen.position_B_P)
    along = np.cross([0.0, 0.0, 1.0], position)
    return dataclasses.replace(seen, position_B_P=position + away_m * along / np.linalg.norm(along[-1]))
