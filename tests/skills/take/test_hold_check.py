"""hold_check on the fake robot: weight, jaws and gels, of which one may err."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_bt.robot import TactileFrame
from glotouch_skills.take.hold_check import HoldCheck

PRESSED = np.pad(np.full((15, 10), 4e-4), ((10, 10), (5, 5)))


@pytest.fixture
def make(bench):
    def make_one(weight_N=2.5, jaws_m=0.04, gels=(PRESSED, PRESSED), grip_m=0.04, frames=True):
        b = bench(weight_N=lambda position, aperture: weight_N, grip_width_m=jaws_m)
        b.go(b.arm.jaws(0.0, speed_m_s=0.2))
        cycle = b.robot.cycle

        def with_gels(command):
            seen = cycle(command)
            if seen.tactile is None:
                return seen
            frame = TactileFrame(seen.tactile.stamp_s, *gels) if frames else None
            return dataclasses.replace(seen, tactile=frame)

        b.robot.cycle = with_gels
        return b, b.make(HoldCheck, inputs={"grip_m": grip_m, "before_N": 2.5})

    return make_one


FLAT = np.zeros_like(PRESSED)


@pytest.mark.parametrize(
    "kw",
    [{}, {"weight_N": 1.6}, {"weight_N": 0.0}, {"gels": (FLAT, FLAT)}, {"gels": (FLAT, PRESSED)}, {"frames": False}],
    ids=["all well", "a little lighter", "a wrist that lost it", "dark gels", "one dark gel", "no images"],
)
def test_one_witness_may_err(make, kw) -> None:
    b, skill = make(**kw)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message


@pytest.mark.parametrize(
    "kw",
    [
        {"weight_N": 0.0, "gels": (FLAT, FLAT)},
        {"weight_N": 0.1, "jaws_m": None},
        {"jaws_m": None, "gels": (FLAT, FLAT)},
    ],
    ids=["weight and gels", "weight and jaws", "jaws and gels"],
)
def test_hold_check__lost(make, kw) -> None:
    b, skill = make(**kw)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "lost")
    assert {"weight_N", "moved_m", "gels_touched"} < set(skill.reason.evidence)


@pytest.mark.parametrize("grip_m", [0.045, 0.035])
def test_hold_check__slipped(make, grip_m: float) -> None:
    b, skill = make(grip_m=grip_m)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "slipped")
    assert skill.reason.evidence["moved_m"] == pytest.approx(0.04 - grip_m, abs=1e-4)


def test_nothing_moves(make) -> None:
    b, skill = make()
    begun = len(b.commands)
    b.run(skill)
    assert all(c.motion is None and c.gripper is None for c in b.commands[begun:])
