"""Closing on a springy post that cannot slide: where the hand ends, and how hard it was pressed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.robot import Array, MotionRefused, Pose, TactileFrame, World
from glotouch_bt.robot.fake import FakeRobot
from glotouch_skills.common.hand.compliant_close import (
    FOLLOW_FORCE_N,
    GENTLE_FORCE_N,
    MAX_CLOSING_FORCE_N,
    MAX_HAND_FORCE_N,
    MAX_REST_FORCE_N,
    MAX_TWIST_NM,
    RAMP_N_S,
    close_compliantly,
    release,
)

STIFFNESS_N_M = 2500.0
"""Of a standing object pushed sideways by one jaw, as MuJoCo showed it (1.5 N in 0.6 mm)."""
WIDTH_M, SPEED_M_S = 0.030, 0.03


class Post(FakeRobot):
    """A post `off_m` along y_P from the hand's first place; pushes the hand up by `up_N_m` per metre it is pushed."""

    def __init__(self, off_m: float, up_N_m: float = 0.0) -> None:
        self.off_m, self.up_N_m = off_m, up_N_m
        self.middle_B: Array | None = None
        self.felt_N: list[float] = []
        super().__init__(RIZON4_XENSE, wrench=self._pushed, grip_width_m=WIDTH_M)

    def _pushed(self, stamp: Array, position: Array, quat: Array) -> Array:
        y_B = Pose(position[-1], quat[-1]).rotation[:, 1]
        if self.middle_B is None:
            self.middle_B = position[-1] + self.off_m * y_B
        away = (self.middle_B - position) @ y_B
        into = [np.maximum(s * away + 0.5 * WIDTH_M - 0.5 * self._aperture, 0.0) for s in (1.0, -1.0)]
        out = np.zeros((len(position), 6))
        out[:, 1] = STIFFNESS_N_M * (into[0] - into[1])
        out[:, 2] = -self.up_N_m * np.maximum(*into)
        self.felt_N += list(np.linalg.norm(out[:, :3], axis=1))
        return out


@settings(max_examples=5, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(off_mm=st.floats(-12.0, 12.0))
def test_the_hand_comes_to_the_post(bench: Any, world: World, off_mm: float) -> None:
    robot = Post(off_mm * 1e-3)
    b = bench().on(world, robot)
    state = b.go(close_compliantly(b.arm, SPEED_M_S, 10.0))
    assert state.aperture_m == pytest.approx(WIDTH_M, abs=1e-4)
    y_B = b.arm.pose_B_P.rotation[:, 1]
    assert robot.middle_B is not None
    rest = abs((robot.middle_B - b.arm.pose_B_P.position_m) @ y_B)
    assert rest * STIFFNESS_N_M <= FOLLOW_FORCE_N + 1.0
    assert max(robot.felt_N) < 8.0, "without giving way 12 mm would be 30 N"


class Stuck(Post):
    """A post whose coupled jaw pushes with twice the jaw's force, as a real gripper's does, and that never moves."""

    def _pushed(self, stamp: Array, position: Array, quat: Array) -> Array:
        out = super()._pushed(stamp, position, quat)
        most = 2 * self._target.force_N
        out[:, 1] = np.clip(out[:, 1], -most, most)
        return out


@pytest.mark.parametrize("force_N", [2.0, 10.0, 30.0])
def test_full_force_comes_only_when_the_jaws_rest(bench: Any, world: World, force_N: float) -> None:
    """What one jaw meets alone feels at most 6 N, whatever the grasp's force is."""
    robot = Stuck(0.010)
    b = bench().on(world, robot)
    seen: list[Any] = []
    b.go(close_compliantly(b.arm, SPEED_M_S, force_N, on_observation=seen.append))
    assert max(robot.felt_N) <= 2 * GENTLE_FORCE_N + 1e-9
    forces = np.array([c.gripper.force_N for c in b.commands if c.gripper is not None])
    assert forces[0] == min(force_N, GENTLE_FORCE_N)
    assert forces[-1] == pytest.approx(force_N)
    assert np.all(np.diff(forces) > 0.0)
    assert np.all(np.diff(forces) <= RAMP_N_S * b.arm.period_s + 1e-9), "a ramp: what wedges is felt before it presses"
    assert len(seen) > 0.95 * len(b.commands), "all is shown but the braking of giving way"


def test_what_presses_the_hand_away_ends_the_closure(bench: Any, world: World) -> None:
    robot = Post(0.002, up_N_m=40e3)
    b = bench().on(world, robot)
    with pytest.raises(MotionRefused, match="pressed"):
        b.go(close_compliantly(b.arm, SPEED_M_S, 10.0))
    assert max(robot.felt_N) < 1.3 * MAX_CLOSING_FORCE_N < MAX_HAND_FORCE_N, "it is known while the jaws are gentle"
    assert b.arm.aperture_m == pytest.approx(RIZON4_XENSE.gripper.stroke_m, abs=1e-3)


@pytest.mark.parametrize(
    ("rest_force_N", "refused"), [(0.5 * MAX_REST_FORCE_N, False), (1.2 * MAX_REST_FORCE_N, True), (np.nan, True)]
)
def test_what_leans_on_the_hand_between_gentle_jaws_is_not_pressed(
    bench: Any, world: World, rest_force_N: float, refused: bool
) -> None:
    class Leaning(Post):
        def _pushed(self, stamp: Array, position: Array, quat: Array) -> Array:
            out = super()._pushed(stamp, position, quat)
            out[:, 2] = rest_force_N * (self._aperture < WIDTH_M + 2e-4)
            return out

    b = bench().on(world, Leaning(0.0))
    if refused:
        with pytest.raises(MotionRefused, match="pressed"):
            b.go(close_compliantly(b.arm, SPEED_M_S, 10.0))
    else:
        b.go(close_compliantly(b.arm, SPEED_M_S, 10.0))
    closing = [c.gripper.force_N for c in b.commands if c.gripper is not None and c.gripper.aperture_m == 0.0]
    assert max(closing) == (GENTLE_FORCE_N if refused else 10.0)


class Sprag(FakeRobot):
    """A fingertip stands on a foot: `held_N` up at rest, more the farther the opening jaws drag the foot along.

    The foot turns up by `LIFT` per metre of jaw travel against a fingertip of `STIFF_N_M`; going up frees it.
    """

    LIFT, STIFF_N_M = 1.5, 7000.0

    def __init__(self, held_N: float) -> None:
        self.held_m, self.grip_m, self.low_B_z = held_N / self.STIFF_N_M, 0.0, 0.0
        self.felt_N: list[float] = []
        super().__init__(RIZON4_XENSE, wrench=self._pushed, grip_width_m=WIDTH_M)

    def start_here(self) -> None:
        """The jaws hold; the hand is where the foot is met."""
        self.grip_m, self.low_B_z = self._aperture, float(self.observe().position_B_P[-1][2])

    def _pushed(self, stamp: Array, position: Array, quat: Array) -> Array:
        out = np.zeros((len(position), 6))
        if self.grip_m:
            dragged = min(max(self._aperture - self.grip_m, 0.0), 0.003)
            deep = self.held_m + self.LIFT * dragged - (position[:, 2] - self.low_B_z)
            out[:, 2] = -self.STIFF_N_M * np.maximum(deep, 0.0)
            self.felt_N += list(np.abs(out[:, 2]))
        return out


@pytest.mark.parametrize("held_N", [0.0, 3.0, 9.0])
def test_a_foot_under_a_fingertip_frees_the_hand_when_it_lets_go(bench: Any, world: World, held_N: float) -> None:
    """Opening regardless would press with 7000 N/m x 1.5 x 3 mm = 31 N more before the jaws are off."""
    robot = Sprag(held_N)
    b = bench().on(world, robot)
    b.go(b.arm.jaws(0.0))
    robot.start_here()
    z = float(b.arm.pose_B_P.position_m[2])
    b.go(release(b.arm, 0.07))
    assert b.arm.aperture_m == pytest.approx(0.07, abs=1e-3)
    assert max(robot.felt_N) < held_N + 10.0
    assert float(b.arm.pose_B_P.position_m[2]) > z, "the way it was pushed"


class Askew(FakeRobot):
    """An object that the two gels touch at places `apart_m` from each other along x_P."""

    def __init__(self, apart_m: float) -> None:
        self.apart_m = apart_m
        super().__init__(RIZON4_XENSE, grip_width_m=WIDTH_M)

    def _frame(self) -> TactileFrame:
        rows, cols = RIZON4_XENSE.gripper.pad_shape
        touched = self._aperture < WIDTH_M + 1e-4
        shift = 0.5 * self.apart_m / RIZON4_XENSE.gripper.pad_window_m[0] * cols
        maps = []
        for side in (1.0, -1.0):
            near = np.abs(np.arange(cols) + 0.5 - 0.5 * cols - side * shift) < 2.5
            maps.append(np.tile(np.where(near & touched, 4e-4, 0.0), (rows, 1)))
        return TactileFrame(self.cycles * self.period_s, *maps)


@pytest.mark.parametrize(("apart_m", "most_N"), [(0.0, 30.0), (0.006, 30.0), (0.012, MAX_TWIST_NM / 0.012)])
def test_an_object_held_askew_is_pressed_less(bench: Any, world: World, apart_m: float, most_N: float) -> None:
    b = bench().on(world, Askew(apart_m))
    b.go(close_compliantly(b.arm, SPEED_M_S, 30.0))
    forces = [c.gripper.force_N for c in b.commands if c.gripper is not None]
    assert forces[-1] == pytest.approx(most_N, rel=0.15)
