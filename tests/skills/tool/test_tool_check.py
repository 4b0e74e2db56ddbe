"""tool_check on the fake robot: two witnesses who agree, and the floor where they do not."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_skills.tool.tool_check import ToolCheck


@pytest.fixture
def make(bench, tool, things):
    """The probe in the jaws over the container, weighed away by the tare."""

    def make_one(lighter_N=0.0, jaws_m=0.016, floor_m=0.0, taken=tool, moment_S_Nm=(0.0, 0.0, 0.0), **params):
        b = bench(
            grip_width_m=jaws_m or None,
            weight_N=lambda position, aperture: -lighter_N,
            things=[] if floor_m is None else [things.floor(floor_m)],
            moment_S_Nm=moment_S_Nm,
        )
        b.arm.scene.hold_tool(True)
        b.go(b.arm.joints(b.arm.kinematics.ik(taken.pose_B_P(b.world, np.array([0.02, 0.05, 0.06])), b.arm.q)))
        b.go(b.arm.jaws(0.0, speed_m_s=0.2))
        return b, b.make(ToolCheck, inputs={"taken": taken}, **params)

    return make_one


def lowest_m(b) -> float:
    """Lowest height of the pads' mid-point above the floor, so far."""
    heights = [c.motion.pose_B_P.position_m[2] for c in b.commands if c.motion is not None]
    return float(min(heights) - b.world.container.pose_B_K.position_m[2])


@pytest.mark.parametrize("lighter_N", [0.0, 0.25, -0.5])
def test_held(make, lighter_N: float) -> None:
    b, skill = make(lighter_N)
    before = lowest_m(b)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert skill.tool_lost is False
    assert lowest_m(b) == before, "the floor was not touched"


def test_tool_check__tool_lost__aperture_and_weight_agree_without_touching_the_floor(make) -> None:
    b, skill = make(0.59, jaws_m=0.0)
    begun = lowest_m(b)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "tool_lost")
    assert skill.tool_lost is True
    assert not b.arm.scene.holding_tool
    assert lowest_m(b) == begun
    assert skill.reason.evidence["missing_N"] == pytest.approx(0.59, abs=0.01)


@pytest.mark.parametrize(("lighter_N", "jaws_m"), [(0.59, 0.016), (0.0, 0.0)], ids=["weight", "jaws"])
def test_tool_check__tool_lost__the_floor_decides_if_aperture_and_weight_disagree(
    make, lighter_N: float, jaws_m: float
) -> None:
    b, skill = make(lighter_N, jaws_m)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message  # a drifted tare, or jaws that report wrongly
    assert skill.tool.aperture_m == pytest.approx(jaws_m, abs=1e-4), "what is reported from now on"
    b, skill = make(lighter_N, jaws_m, floor_m=None)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "tool_lost")
    assert "nothing was met where the floor is" in skill.reason.message


def test_tool_check__tool_slipped__floor_height_changed(make, tool) -> None:
    b, skill = make(floor_m=0.003, touch=True)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "tool_slipped")
    assert skill.reason.evidence["off_m"] == pytest.approx(0.003, abs=5e-4)
    assert b.arm.scene.holding_tool
    # Where the floor was felt before is where it is expected.
    b, skill = make(floor_m=0.003, touch=True, taken=dataclasses.replace(tool, floor_z_K_m=0.003))
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message


def test_tool_check__tool_lost__at_once_after_the_probe_was_returned(make) -> None:
    b, skill = make()
    b.arm.scene.hold_tool(False)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "tool_lost")


def test_broken_off_anywhere(make, preempt_all_along) -> None:
    preempt_all_along(lambda: make(0.59), 4)


def turned(make, tilt_deg: float, about: float, floor_m: float):
    probe = make()[0].world.probe
    moment = 9.81 * probe.mass_kg * probe.com_below_grasp_m * np.sin(np.radians(tilt_deg))
    b, skill = make(moment_S_Nm=(moment * np.cos(about), moment * np.sin(about), 0.1), floor_m=floor_m)
    before = lowest_m(b)
    b.run(skill)
    assert b.arm.scene.holding_tool
    return skill, moment, lowest_m(b) < before - 0.02


@pytest.mark.parametrize("about", [0.0, 1.0, 2.5])
def test_tool_check__tool_slipped__tilted_in_the_jaws(make, about: float) -> None:
    """It weighs as before, but its weight hangs aside, and its ball is 0.13 m (1 - cos 20 deg) higher."""
    skill, moment, touched = turned(make, 20.0, about, floor_m=0.0078)
    assert (skill.status, touched) == (Status.FAILURE, True)
    assert skill.reason.code == "tool_slipped"
    assert "hangs askew" in skill.reason.message
    assert skill.reason.evidence["moment_Nm"] == pytest.approx(moment, rel=1e-3)


def test_a_torque_that_drifted_is_no_tilt(make) -> None:
    """5 mNm in a minute, as in the realistic conditions: the floor is where it was."""
    skill, _, touched = turned(make, 20.0, 0.0, floor_m=0.0)
    assert (skill.status, touched) == (Status.SUCCESS, True)
    skill, _, touched = turned(make, 10.0, 1.0, floor_m=0.0)
    assert (skill.status, touched) == (Status.SUCCESS, False)
