"""The motion of an object under a closure, against objects moved by hand-worked kinematics."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glotouch_bt.perception.touch import ObjectMotion, estimate_object_motion
from glotouch_bt.robot import GripperState, Observation, Pose, TactileFrame

SHAPE, PAD_WIDTH, GEL = (35, 20), 0.0172, 4e-4
DOWN = np.array([0.0, 1.0, 0.0, 0.0])  # x_P = x_B, y_P = -y_B, z_P = -z_B


def block(
    t: float, aperture: float, jaw: float, side: float, hand_y_P: float = 0.0, frame=None, rng=None
) -> Observation:
    stamps = t + np.arange(1, 11) * 1e-3
    wrench = np.zeros((10, 6)) if rng is None else 0.05 * rng.standard_normal((10, 6))
    wrench[:, 1] += side
    at = np.tile([0.6, -hand_y_P, 0.05], (10, 1))
    noise = 0.0 if rng is None else 5e-5 * rng.standard_normal()
    gripper = GripperState(float(stamps[-1]), aperture + noise, jaw, True)
    zeros = np.zeros((10, 7))
    return Observation(stamps, zeros, zeros, at, np.tile(DOWN, (10, 1)), wrench, gripper, frame)


def frame(t: float, left_x: float | None, right_x: float | None) -> TactileFrame:
    """A patch four columns wide in each gel, at places along x_P."""
    x = ((np.arange(SHAPE[1]) + 0.5) / SHAPE[1] - 0.5) * PAD_WIDTH
    maps = []
    for middle in (left_x, right_x):
        depth = np.zeros(SHAPE)
        if middle is not None:
            depth[:, np.abs(x - middle) < 2 * PAD_WIDTH / SHAPE[1]] = GEL
        maps.append(depth)
    return TactileFrame(t, *maps)


def pushed(off_m: float, width_m: float, seed: int) -> list[Observation]:
    """Jaws close at 30 mm/s on a block `off_m` along y_P; the first jaw pushes it until the other one touches.

    Both gels give 0.4 mm in the end.
    """
    rng = np.random.default_rng(seed)
    blocks: list[Observation] = []
    aperture, first = 0.08, width_m + 2 * abs(off_m)
    while aperture > width_m:
        pushing = aperture < first
        blocks.append(block(0.01 * len(blocks), aperture, 0.75 * pushing, 1.5 * pushing * np.sign(off_m), rng=rng))
        aperture -= 3e-4
    for _ in range(20):
        t = 0.01 * len(blocks)
        blocks.append(block(t, width_m - 2 * GEL, 10.0, 0.0, 0.0, frame(t, 0.0, 0.0), rng=rng))
    return blocks


@settings(max_examples=30, deadline=None)
@given(
    off=st.floats(0.001, 0.012),
    side=st.sampled_from([-1.0, 1.0]),
    width=st.floats(0.02, 0.05),
    seed=st.integers(0, 99),
)
def test_off_centre_block_slides_to_the_centre(off: float, side: float, width: float, seed: int) -> None:
    """Jaws of a hand that stands still centre it: it goes from `off` to 0."""
    motion = estimate_object_motion(pushed(side * off, width, seed), PAD_WIDTH)
    assert motion.detected
    assert motion.slide_m == pytest.approx(-side * off, abs=0.0006)
    assert motion.turn_rad == 0.0
    assert motion.compliance_m < 0.0006
    assert motion.moved == (abs(motion.slide_m) > 0.0025)


@pytest.mark.parametrize("yaw_deg", [0.0, 35.0, 90.0, 180.0])
def test_a_sensor_that_is_turned_against_the_jaws(yaw_deg: float) -> None:
    """Closed form: P is turned about z_E by the yaw, so y_P is (-sin, cos, 0) along the sensor's axes."""
    axes = Pose.planar((0.0, 0.0, 0.17), np.deg2rad(yaw_deg)).rotation
    blocks = [
        dataclasses.replace(b, wrench_S=np.hstack([b.wrench_S[:, :3] @ axes.T, b.wrench_S[:, 3:]]))
        for b in pushed(0.008, 0.04, 3)
    ]
    motion = estimate_object_motion(blocks, PAD_WIDTH, y_P_S=axes[:, 1])
    assert motion.slide_m == pytest.approx(-0.008, abs=0.0006)


def test_compliant_hand_does_not_slide_the_object() -> None:
    """The hand comes to the block: what was pushed is what the hand did not follow."""
    blocks = []
    for i in range(150):
        aperture = 0.08 - 3e-4 * i
        closed = max(0.060 - aperture, 0.0)
        blocks.append(block(0.01 * i, aperture, 0.75 * (closed > 0), 1.5 * (closed > 0), 0.5 * closed))
    blocks += [block(1.5 + 0.01 * k, aperture, 10.0, 0.0, 0.5 * closed) for k in range(10)]
    assert estimate_object_motion(blocks, PAD_WIDTH).slide_m == pytest.approx(0.0, abs=3e-4)


@pytest.mark.parametrize("lever", [-0.009, -0.005, 0.005, 0.009])
def test_box_held_at_two_corners_turns_by_closing_over_lever(lever: float) -> None:
    """Touched at +-lever / 2, closing by 1 mm after that: 1 mm / lever about z_P, so the other way about z_B."""
    blocks = [block(0.01 * i, 0.05 - 3e-4 * i, 0.0, 0.0) for i in range(30)]
    for k in range(30):
        t = 0.3 + 0.01 * k
        blocks.append(block(t, 0.041 - 1e-3 * min(k / 20, 1.0), 3.0, 0.0, 0.0, frame(t + 0.01, -lever / 2, lever / 2)))
    motion = estimate_object_motion(blocks, PAD_WIDTH)
    assert motion.turn_rad == pytest.approx(-1e-3 / lever, rel=0.15)
    assert motion.moved
    assert motion.slide_m == 0.0


def test_empty_closure_and_fixed_object_do_not_move() -> None:
    empty = [block(0.01 * i, 0.05 - 3e-4 * i, 0.0, 0.0) for i in range(100)]
    motion = estimate_object_motion(empty, PAD_WIDTH)
    assert motion == ObjectMotion(0.0, 0.0, 0.0, False)
    assert not motion.moved
    assert not estimate_object_motion(empty[:3], PAD_WIDTH).detected
    held = empty + [block(1.0 + 0.01 * k, 0.02, 10.0, 0.0, 0.0, frame(1.0, 0.0, 0.0)) for k in range(20)]
    motion = estimate_object_motion(held, PAD_WIDTH)
    assert motion.detected
    assert not motion.moved


def test_slip_between_both_jaws_is_detected_without_depth_maps() -> None:
    """Both jaws press, then they close by another 8 mm: a wedge squeezed out, or something falling over."""
    blocks = [block(0.01 * i, 0.05 - 3e-4 * i, 0.0, 0.0) for i in range(30)]
    blocks += [block(0.3 + 0.01 * k, 0.041 - 4e-4 * min(k, 20), 3.0, 0.0) for k in range(40)]
    motion = estimate_object_motion(blocks, PAD_WIDTH)
    assert motion.compliance_m == pytest.approx(0.008, abs=5e-4)
    assert motion.moved


@pytest.mark.parametrize("middle", [-0.02, 0.015])
def test_off_centre_push_turns_the_object(middle: float) -> None:
    """5 mm pushed at x from the middle: s x / (c^2 + x^2) about z_P, x = -middle, c = 0.65 x 40 mm; z_B is -z_P."""
    still = estimate_object_motion(pushed(0.005, 0.04, 0), PAD_WIDTH, 0.0, 0.04)
    motion = estimate_object_motion(pushed(0.005, 0.04, 0), PAD_WIDTH, middle, 0.04)
    assert still.turn_rad == 0.0
    assert motion.slide_m == still.slide_m < 0
    assert motion.turn_rad == pytest.approx(motion.slide_m * middle / (0.026**2 + middle**2), rel=1e-9)
