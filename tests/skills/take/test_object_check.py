"""object_check: a block in the hand, taken for a block of known size."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import trimesh
from py_trees.common import Status

from glotouch_skills.common.planning.grasp_plan import GraspPlan
from glotouch_skills.take.object_check import ObjectCheck

SIDES_M = (0.050, 0.035, 0.060)  # 105 cm3: 0.10 N of balsa to 21 N of tungsten
PLAN = GraspPlan(0, np.array([0.0, 0.0, 0.03]), 0.0, 0.035, 0.055)


@pytest.fixture(scope="module")
def target(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("block") / "block.stl"
    block = trimesh.creation.box(SIDES_M)
    block.apply_translation((0.0, 0.0, 0.5 * SIDES_M[2]))
    block.export(path)
    return str(path)


@pytest.fixture
def judged(bench, target):
    def judge(grip_m: float, weight_N: float = 2.0, plan: GraspPlan = PLAN):
        b = bench()
        made = dataclasses.replace(plan, closed_m=grip_m)
        skill = b.make(ObjectCheck, inputs={"made": made, "weight_N": weight_N}, target=target)
        b.run(skill)
        return skill

    return judge


@pytest.mark.parametrize("grip_m", [0.0345, 0.0300, 0.0370])
def test_as_planned(judged, grip_m: float) -> None:
    skill = judged(grip_m)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert (skill.fits, skill.impossible) == (True, False)


def test_object_check__not_as_felt__wide_as_the_other_side(judged) -> None:
    skill = judged(0.049)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "not_as_felt")
    assert (skill.fits, skill.impossible) == (False, False)


@pytest.mark.parametrize("grip_m", [0.020, 0.072])
def test_object_check__wrong_object__no_such_width(judged, grip_m: float) -> None:
    """The block is 35 mm across at least, 61 mm over its corners at most."""
    skill = judged(grip_m)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "wrong_object")
    assert (skill.fits, skill.impossible) == (False, True)
    # Gels of 1.5 mm: the jaws stop up to 3 mm below the width.
    least = {0.020: 0.035 - 0.003 - 0.020, 0.072: 0.072 - float(np.hypot(0.050, 0.035))}[grip_m]
    assert skill.reason.evidence["min_m"] == pytest.approx(least, abs=2e-3)


@pytest.mark.parametrize("weight_N", [0.05, 25.0])
def test_object_check__wrong_object__impossible_weight(judged, weight_N: float) -> None:
    skill = judged(0.035, weight_N)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "wrong_object")
    light, heavy = (9.81 * d * float(np.prod(SIDES_M)) for d in (100.0, 20000.0))
    assert skill.reason.evidence["light_N"] == pytest.approx(light, rel=1e-3)
    assert skill.reason.evidence["heavy_N"] == pytest.approx(heavy, rel=1e-3)


def test_object_check__wrong_object__held_above_the_top_of_the_target(judged) -> None:
    skill = judged(0.020, plan=dataclasses.replace(PLAN, position_K_m=np.array([0.0, 0.0, 0.2])))
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "wrong_object")
