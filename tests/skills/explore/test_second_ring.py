"""second_ring round an elastic cylinder: only where one height is ambiguous, and then at its own height."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_bt.perception.search.ring import outline_of
from glotouch_bt.perception.touch import Candidate, Contact
from glotouch_skills.explore.second_ring import SecondRing

POST, RADIUS, TOP, BALL = np.array([0.02, -0.03]), 0.028, 0.055, 0.006


def candidate(rough_m: float) -> Candidate:
    """A disc's, two contacts at each bearing: one so far in, one so far out."""
    made = []
    for k, a in enumerate(np.repeat(np.linspace(0.0, 2 * np.pi, 6, endpoint=False), 2)):
        u = np.array([np.cos(a), np.sin(a), 0.0])
        tip = np.array([*POST, 0.018]) + (RADIUS + BALL + rough_m * (-1) ** k) * u
        made.append(Contact(0.0, tip, -u, u, (tip - BALL * u)[:2], 1.0))
    return Candidate(2, outline_of(made, BALL).contour, TOP, 0.9, tuple(made))


@pytest.fixture
def make(bench, things, tool):
    def make_one(known, **params):
        b = bench(things=[things.floor(), things.post(tuple(POST), RADIUS, TOP)], grip_width_m=tool.aperture_m)
        b.go(b.arm.jaws(0.0, speed_m_s=0.2))
        b.arm.scene.hold_tool(True)
        above = np.array([*POST, TOP + 0.03])
        b.go(b.arm.joints(b.arm.kinematics.ik(tool.pose_B_P(b.world, above), b.arm.q)))
        return b, b.make(SecondRing, inputs={"tool": tool, "candidate": known}, **params)

    return make_one


def test_where_nothing_is_ambiguous_nothing_moves(make) -> None:
    known = candidate(0.0)
    b, skill = make(known)
    assert b.run(skill) <= 1
    assert (skill.status, skill.ringed) == (Status.SUCCESS, known)
    assert not b.of_kind("contact")


@pytest.mark.parametrize("known", [replace(candidate(0.003), height_m=0.03), replace(candidate(0.003), contacts=())])
def test_without_room_or_contacts_nothing_moves(make, known) -> None:
    b, skill = make(known)
    assert b.run(skill) <= 1
    assert skill.ringed is known


def test_the_second_ring_is_felt_at_its_own_height(make, tool) -> None:
    b, skill = make(candidate(0.003))
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    (ring,) = skill.ringed.rings
    assert ring.height_m == pytest.approx(0.6 * TOP)
    np.testing.assert_allclose(ring.contour.centre_K_m, POST, atol=1e-3)
    assert ring.contour.size_m[0] == pytest.approx(2 * RADIUS, abs=1e-3)
    heights = np.array([c.tip_K_m[2] for c in ring.contacts]) - tool.floor_z_K_m
    np.testing.assert_allclose(heights, ring.height_m, atol=3e-3)
    assert np.linalg.norm(skill.ringed.contour.centre_K_m - POST) < 1e-3
    (event,) = b.of_kind("candidate")
    assert "off the outline" in event["why"]
    assert b.robot.peak_force_N < 6.0
