from dataclasses import replace

import numpy as np
import pytest

from glotouch_bt.perception.touch import evidence_weight, find_plateau, make_layer, temporal_median
from glotouch_bt.robot import GripperState, Observation, ParamError, TactileFrame

SHAPE = (35, 20)


def closure(*, opening=0.04, noise=0.0, force=10.0, drift=0.0, arm=0.0, seconds=0.3, depth=4e-4, seed=0):
    """Blocks of a closure that has reached `opening`; frames at every second block, 30 ms late."""
    rng, out = np.random.default_rng(seed), []
    for i in range(round(seconds * 100)):
        stamps = i * 0.01 + np.arange(1, 11) * 1e-3
        frame = None
        if i % 2 == 0:
            maps = [np.full(SHAPE, depth) + rng.normal(0, 2e-5, SHAPE) for _ in range(2)]
            maps[0][3, 4] = np.nan
            if rng.random() < 0.5:
                maps[0][5, 6] = np.nan
            frame = TactileFrame(float(stamps[-1]) - 0.03, *maps)
        aperture = opening + drift * i * 0.01 + rng.normal(0, noise)
        position = np.tile([0.6, 0.0, 0.05], (10, 1)) + np.array([arm * i, 0, 0])
        gripper = GripperState(float(stamps[-1]), aperture, force, False)
        quat = np.tile([0.0, 1, 0, 0], (10, 1))
        zeros = np.zeros((10, 7))
        out.append(Observation(stamps, zeros, zeros, position, quat, np.zeros((10, 6)), gripper, frame))
    return out


def layer(blocks):
    return make_layer(
        blocks, height_m=0.03, position_K_m=np.array([0.1, 0.2]), yaw_rad=0.5, force_N=10.0, pad_shape=SHAPE
    )


@pytest.mark.parametrize("noise", [0.0, 5e-5, 1.5e-4])
def test_plateau_is_found_despite_noise(noise):
    stable = [find_plateau(closure(noise=noise, seed=s), 10.0) for s in range(60)]
    assert sum(p.stable for p in stable) >= 59
    assert np.std([p.aperture_m for p in stable]) <= 0.6 * noise + 1e-12
    assert all(p.force_N == 10.0 for p in stable)


@pytest.mark.parametrize(
    ("fault", "why"),
    [
        ({"drift": -0.01}, "drifts"),
        ({"force": 4.0}, "force"),
        ({"opening": 0.001}, "met"),
        ({"arm": 2e-4}, "arm moved"),
        ({"seconds": 0.05}, "only"),
    ],
)
def test_unstable_closures_name_the_failed_condition(fault, why):
    plateau = find_plateau(closure(**fault), 10.0)
    assert not plateau.stable
    assert why in plateau.why_not
    assert not layer(closure(**fault)).stable


def test_layer_holds_the_median_of_frames_taken_on_the_plateau():
    blocks = closure()
    early = TactileFrame(0.0, np.full(SHAPE, 9e-3), np.full(SHAPE, 9e-3))  # while the jaws moved
    blocks[-1] = replace(blocks[-1], tactile=early)
    got = layer(blocks)
    assert got.stable
    np.testing.assert_allclose(got.right_m, 4e-4, atol=6e-5)
    assert np.isnan(got.left_m[3, 4])
    assert np.isfinite(got.left_m[5, 6])
    assert evidence_weight(got) == 1.0


def test_median_of_no_frame_is_nan_and_wrong_shape_is_refused():
    left, right = temporal_median([], SHAPE)
    assert np.isnan(left).all()
    assert np.isnan(right).all()
    with pytest.raises(ParamError, match="frames"):
        temporal_median([TactileFrame(0.0, np.zeros((3, 3)), np.zeros((3, 3)))], SHAPE)
    with pytest.raises(ParamError, match="blocks"):
        find_plateau([], 10.0)


def test_unilateral_and_empty_layers_weigh_less():
    blocks = closure()
    full = layer(blocks)
    one = type(full)(**{**full.__dict__, "right_m": np.zeros(SHAPE)})
    none = type(full)(**{**full.__dict__, "right_m": np.zeros(SHAPE), "left_m": np.full(SHAPE, np.nan)})
    unstable = type(full)(**{**full.__dict__, "stable": False})
    assert evidence_weight(full) > evidence_weight(one) > evidence_weight(none) == evidence_weight(unstable) == 0.0
