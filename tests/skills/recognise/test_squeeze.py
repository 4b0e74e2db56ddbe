"""squeeze on the fake robot, whose jaws stop on a rigid width and whose gels are flat."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from py_trees.common import Status

import glotouch_skills.common.planning.squeeze_motion as motion
from glotouch_bt.perception.touch import ObjectMotion
from glotouch_skills.recognise.squeeze import Squeeze

WIDTH = 0.05


@pytest.fixture
def make(bench, found, things):
    def make_one(candidate=None, known=(), grip_width_m=WIDTH, stuff=(), tip_P_m=0.13, **params):
        b = bench(grip_width_m=grip_width_m, things=stuff, tip_P_m=tip_P_m)
        candidate = candidate or found.round((0.0, 0.02), 0.5 * WIDTH)
        return b, b.make(Squeeze, inputs={"candidate": candidate, "known": (candidate, *known)}, **params)

    return make_one


def test_a_round_thing_is_felt_at_every_height_of_three_sequences(make) -> None:
    b, skill = make()
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    touchset = skill.touchset
    assert len(touchset.sequences) == 3
    first, second, third = (s.yaw_rad for s in touchset.sequences)
    for turn in (second - first, third - second, first - third):  # 60 degrees, but for half turns
        assert abs(np.sin(turn)) == pytest.approx(np.sin(np.pi / 3), abs=1e-6)
    for sequence in touchset.sequences:
        heights = [layer.height_m for layer in sequence.layers]
        assert heights == sorted(heights)
        assert heights[0] >= 0.016 + 0.005 - 2e-4, "the fingertips stay off the floor"
        assert heights[-1] <= 0.06 - 0.008 + 2e-4, "the pads stay below the top"
        assert np.diff(heights).min() >= 0.012 - 2e-4
        for layer in sequence.layers:
            assert layer.stable
            assert layer.aperture_m == pytest.approx(WIDTH, abs=1e-6)
            np.testing.assert_allclose(layer.position_K_m, [0.0, 0.02], atol=1e-4)
            assert layer.left_m.shape == b.arm.description.gripper.pad_shape
    assert not [o for o in b.arm.scene.obstacles if o.startswith("candidate")]
    assert all(c.gripper is None or c.gripper.force_N <= 10.0 for c in b.commands)


def test_a_box_is_felt_on_three_parallel_tracks(make, found) -> None:
    b, skill = make(found.box((0.0, 0.02), (0.08, WIDTH), 0.3))
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    at = np.array([s.position_K_m for s in skill.touchset.sequences])
    np.testing.assert_allclose(at - at[1], np.outer([-0.02, 0, 0.02], [np.cos(0.3), np.sin(0.3)]), atol=1e-6)


def test_a_low_thing_gets_one_closure(make, found) -> None:
    b, skill = make(found.round((0, 0), 0.025, 0.02))
    b.run(skill)
    assert [len(s.layers) for s in skill.touchset.sequences] == [1, 1, 1]


def test_squeeze__nothing_felt(make) -> None:
    b, skill = make(grip_width_m=None)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "nothing_felt")
    (event,) = b.of_kind("touchset")
    assert not any(layer.stable for layer in event["touchset"].layers)


def test_squeeze__no_squeeze(make, found) -> None:
    b, skill = make(found.round((0, 0), 0.045))
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "no_squeeze")
    assert not [c for c in b.commands if c.motion is not None], "nothing moves towards what cannot be squeezed"


def test_squeeze__no_squeeze__neighbours_too_near(make, found) -> None:
    ring = tuple(
        found.round((0.058 * np.cos(a), 0.02 + 0.058 * np.sin(a)), 0.028, index=int(a) + 1) for a in np.arange(6)
    )
    b, skill = make(known=ring)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "no_squeeze")
    assert "candidate" in skill.reason.message
    assert not [o for o in b.arm.scene.obstacles if o.startswith("candidate")]


def test_squeeze__no_squeeze__fingers_touch_and_rise_again(make, things) -> None:
    """Something lies where nothing was traced: every sequence is given up, and the hand is high again."""
    b, skill = make(stuff=[things.floor(0.045)], tip_P_m=0.022)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "no_squeeze")
    assert "came down on something" in skill.reason.message
    assert float(b.arm.pose_B_P.position_m[2]) > -0.2 + 0.13
    assert b.robot.peak_force_N < 10.0


def test_broken_off_anywhere(make, found, preempt_all_along) -> None:
    neighbour = found.round((0.0, -0.12), 0.02, index=1)
    preempt_all_along(lambda: make(known=(neighbour,), layers=2), 6, finish=False)


class Slippery:
    """`make_layer` that finds no plateau at some heights."""

    def __init__(self, bad, plain) -> None:
        self.bad, self.plain = bad, plain

    def __call__(self, blocks, **words):
        layer = self.plain(blocks, **words)
        return replace(layer, stable=layer.stable and not self.bad(layer.height_m), why_not="slipped")


def test_a_layer_that_fails_is_tried_once_beside(make, monkeypatch) -> None:
    """Four heights, the second is bad: half way to the third it works; a bad place is never tried three times."""
    plain = motion.make_layer
    b, skill = make()
    b.run(skill)
    heights = [layer.height_m for layer in skill.touchset.sequences[0].layers]
    bad = heights[1]
    monkeypatch.setattr(motion, "make_layer", Slippery(lambda z: abs(z - bad) < 1e-3, plain))
    b, skill = make()
    b.run(skill)
    layers = skill.touchset.sequences[0].layers
    assert [layer.stable for layer in layers] == [True, False, True, *[True] * (len(heights) - 2)]
    got = [layer.height_m for layer in layers]
    assert got == sorted(got)
    assert got[2] == pytest.approx(0.5 * (heights[1] + heights[2]), abs=1e-4)
    assert layers[1].why_not == "slipped"
    lost = [e for e in b.of_kind("object_moved") if e["lost"]]
    assert [e["height_m"] for e in lost] == pytest.approx([bad] * 3)
    monkeypatch.setattr(motion, "make_layer", Slippery(lambda z: z > bad - 1e-3, plain))
    b, skill = make()
    b.run(skill)
    assert skill.status is Status.SUCCESS
    assert all(sum(layer.stable for layer in s.layers) == 1 for s in skill.touchset.sequences)


def test_what_stands_still_is_not_reported_as_moved(make) -> None:
    b, skill = make()
    b.run(skill)
    assert not b.of_kind("object_moved")
    assert all(abs(layer.slide_m) + abs(layer.turn_rad) + layer.compliance_m < 1e-6 for layer in skill.touchset.layers)


@pytest.mark.parametrize(
    ("slide_m", "stable", "kept"), [(0.0, True, True), (0.005, True, False), (0.0005, True, False), (0.0, False, False)]
)
def test_free_space_beside_an_object_is_kept_until_closures_have_moved_it(
    make, monkeypatch, slide_m: float, stable: bool, kept: bool
) -> None:
    """Each of the closures slides it by `slide_m`; 0.5 mm is little, but there are many."""
    felt_K_m = np.array([[0.06, 0.02, 0.018]])
    slid, plain = ObjectMotion(slide_m, 0.0, 0.0, True), motion.make_layer
    monkeypatch.setattr(motion, "estimate_object_motion", lambda *_, **__: slid)
    if not stable:
        monkeypatch.setattr(motion, "make_layer", Slippery(lambda _: True, plain))
    b, skill = make()
    b.arm.felt.add(felt_K_m)
    b.run(skill)
    assert skill.status is (Status.SUCCESS if stable else Status.FAILURE), skill.feedback_message
    assert np.isfinite(b.arm.felt.free_down_to(felt_K_m[:, :2], 0.001)) is np.bool_(kept)
