"""What a closure did to its object, against objects moved by hand-worked kinematics."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glotouch_bt.perception.touch import watch_yielding
from glotouch_bt.robot import GripperState, Observation, TactileFrame

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
def test_a_block_off_the_middle_slides_by_as_much_as_it_is_off(
    off: float, side: float, width: float, seed: int
) -> None:
    """Jaws of a hand that stands still centre it: it goes from `off` to 0."""
    felt = watch_yielding(pushed(side * off, width, seed), PAD_WIDTH)
    assert felt.felt
    assert felt.slide_m == pytest.approx(-side * off, abs=0.0006)
    assert felt.turn_rad == 0.0
    assert felt.compliance_m < 0.0006
    assert felt.moved == (abs(felt.slide_m) > 0.0025)


def test_a_hand_that_gives_way_does_not_slide_it() -> None:
    """The hand comes to the block: what was pushed is what the hand did not follow."""
    blocks = []
    for i in range(150):
        aperture = 0.08 - 3e-4 * i
        closed = max(0.060 - aperture, 0.0)
        blocks.append(block(0.01 * i, aperture, 0.75 * (closed > 0), 1.5 * (closed > 0), 0.5 * closed))
    blocks += [block(1.5 + 0.01 * k, aperture, 10.0, 0.0, 0.5 * closed) for k in range(10)]
    assert watch_yielding(blocks, PAD_WIDTH).slide_m == pytest.approx(0.0, abs=3e-4)


@pytest.mark.parametrize("lever", [-0.009, -0.005, 0.005, 0.009])
def test_a_box_held_by_two_corners_turns_by_what_the_jaws_close_over_the_lever(lever: float) -> None:
    """Touched at +-lever / 2, closing by 1 mm after that: 1 mm / lever about z_P, so the other way about z_B."""
    blocks = [block(0.01 * i, 0.05 - 3e-4 * i, 0.0, 0.0) for i in range(30)]
    for k in range(30):
        t = 0.3 + 0.01 * k
        blocks.append(block(t, 0.041 - 1e-3 * min(k / 20, 1.0), 3.0, 0.0, 0.0, frame(t + 0.01, -lever / 2, lever / 2)))
    felt = watch_yielding(blocks, PAD_WIDTH)
    assert felt.turn_rad == pytest.approx(-1e-3 / lever, rel=0.15)
    assert felt.moved
    assert felt.slide_m == 0.0


def test_closing_on_nothing_or_on_what_stands_still() -> None:
    empty = [block(0.01 * i, 0.05 - 3e-4 * i, 0.0, 0.0) for i in range(100)]
    felt = watch_yielding(empty, PAD_WIDTH)
    assert (felt.felt, felt.moved, felt.slide_m, felt.turn_rad, felt.compliance_m) == (False, False, 0.0, 0.0, 0.0)
    assert not watch_yielding(empty[:3], PAD_WIDTH).felt
    held = empty + [block(1.0 + 0.01 * k, 0.02, 10.0, 0.0, 0.0, frame(1.0, 0.0, 0.0)) for k in range(20)]
    felt = watch_yielding(held, PAD_WIDTH)
    assert felt.felt
    assert not felt.moved


def test_what_slips_out_under_both_jaws_is_seen_without_depth_maps() -> None:
    """Both jaws press, then they close by another 8 mm: a wedge squeezed out, or something falling over."""
    blocks = [block(0.01 * i, 0.05 - 3e-4 * i, 0.0, 0.0) for i in range(30)]
    blocks += [block(0.3 + 0.01 * k, 0.041 - 4e-4 * min(k, 20), 3.0, 0.0) for k in range(40)]
    felt = watch_yielding(blocks, PAD_WIDTH)
    assert felt.compliance_m == pytest.approx(0.008, abs=5e-4)
    assert felt.moved


@pytest.mark.parametrize("middle", [-0.02, 0.015])
def test_a_push_beside_the_middle_turns_it(middle: float) -> None:
    """5 mm pushed at x from the middle: s x / (c^2 + x^2) about z_P, x = -middle, c = 0.65 x 40 mm; z_B is -z_P."""
    still = watch_yielding(pushed(0.005, 0.04, 0), PAD_WIDTH, 0.0, 0.04)
    felt = watch_yielding(pushed(0.005, 0.04, 0), PAD_WIDTH, middle, 0.04)
    assert still.turn_rad == 0.0
    assert felt.slide_m == still.slide_m < 0
    assert felt.turn_rad == pytest.approx(felt.slide_m * middle / (0.026**2 + middle**2), rel=1e-9)
