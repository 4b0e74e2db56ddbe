"""The volumes of log ratios agree with sums over each cell."""

import numpy as np

from glotouch_bt.perception.recognition.likelihood.volumes import marginalised, turn_matrix

YAWS, SHIFTS, COMMON = 12, 3, 2


def test_marginals_are_sums_over_each_shift_and_turn() -> None:
    rng = np.random.default_rng(0)
    volume = rng.normal(0, 4, (2, YAWS, SHIFTS, 2)).astype(np.float32)
    turn = turn_matrix(YAWS, 0.4, 0.02)
    shared = rng.dirichlet(np.ones(SHIFTS), COMMON).T.astype(np.float32)
    own = rng.dirichlet(np.ones(SHIFTS), YAWS).T.astype(np.float32)
    with_shared, with_own = np.zeros((2, YAWS, COMMON, 2)), np.zeros((2, YAWS, 1, 2))
    for b, y, z in np.ndindex(2, YAWS, 2):
        for other, d in np.ndindex(YAWS, SHIFTS):
            ratio = turn[other, y] * np.exp(volume[b, other, d, z])
            with_shared[b, y, :, z] += ratio * shared[d]
            with_own[b, y, 0, z] += ratio * own[d, other]
    np.testing.assert_allclose(marginalised(volume, shared, turn), np.log(with_shared), atol=1e-5)
    np.testing.assert_allclose(marginalised(volume, own, turn), np.log(with_own), atol=1e-5)


def test_a_turn_is_a_normal_or_anything() -> None:
    slip, sd = 0.02, 0.2
    turn = turn_matrix(72, sd, slip)
    np.testing.assert_allclose(turn.sum(axis=0, dtype=np.float64), 1.0, rtol=1e-6)
    assert np.isclose(turn[0, 36], slip / 72)
    step = 2 * np.pi / 72
    expected = np.exp(-0.5 * (2 * step / sd) ** 2)
    assert np.isclose((turn[2, 0] - slip / 72) / (turn[0, 0] - slip / 72), expected, rtol=1e-5)
    assert turn[71, 0] == turn[1, 0]
