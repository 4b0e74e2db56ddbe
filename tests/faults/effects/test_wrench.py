"""Each fault of the force sensor against what it says it does, computed the simple way."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from glotouch_bt.robot import HOLD, Tare
from tests.faults.conftest import Pair

Make = Callable[..., Pair]
N = 30
MOST = np.array([1.2] * 3 + [4.0] * 3)


def test_off_reads_zero(pair: Make) -> None:
    made = pair("  - {fault: wrench_off}")
    _, got = made.wrenches(N)
    assert not got.any()
    assert made.proof.samples == 10 * N


def test_stuck_repeats_the_last_good_sample(pair: Make) -> None:
    true, got = pair("  - {fault: wrench_stuck, when: {cycle: 4}}").wrenches(N)
    assert np.array_equal(got[:40], true[:40])
    assert (got[40:] == true[39]).all()


@pytest.mark.parametrize(("kind", "test"), [("nan", np.isnan), ("inf", np.isinf), ("huge", lambda w: w == 1e9)])
def test_garbage_is_garbage(pair: Make, kind: str, test: Callable[[object], object]) -> None:
    made = pair(f"  - {{fault: wrench_garbage, with: {{kind: {kind}, share: 0.5}}}}")
    true, got = made.wrenches(200)
    hit = np.asarray(test(got)).all(axis=1)
    assert np.array_equal(got[~hit], true[~hit])
    assert hit.sum() == made.proof.samples
    assert abs(hit.mean() - 0.5) < 4 * np.sqrt(0.25 / 2000)


def test_bias_is_added_and_a_tare_takes_it_out(pair: Make) -> None:
    made = pair("  - {fault: wrench_bias, with: {force_N: [1, -2, 3], torque_Nm: [0, 0.5, 0]}}")
    true, got = made.wrenches(N)
    assert np.allclose(got - true, [1, -2, 3, 0, 0.5, 0])
    tickets = made.alone.start(Tare(0.05)), made.injector.start(Tare(0.05))
    while not all(t.done for t in tickets):
        next(made.cycles(1))
    true, got = made.wrenches(N)
    assert np.allclose(got, true)


def test_drift_is_a_ramp_that_a_tare_begins_anew(pair: Make) -> None:
    made = pair("  - {fault: wrench_drift, with: {rate_N_s: [0, 2, 0]}, when: {cycle: 10}}")
    before, got = made.wrenches(10)
    assert np.array_equal(before, got)
    true, got = made.wrenches(100)
    ramp = 2.0 * 0.001 * np.arange(1, 1001)
    assert np.allclose((got - true)[:, 1], ramp)
    made.alone.start(Tare(0.01)), made.injector.start(Tare(0.01))
    made.wrenches(1)
    true, got = made.wrenches(50)
    assert np.allclose((got - true)[:, 1], 2.0 * 0.001 * np.arange(1, 501), atol=1e-9)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("wrench_scale, with: {factor: -0.5}", lambda w: -0.5 * w),
        ("wrench_sign_flip", lambda w: -w),
        ("wrench_saturation, with: {force_N: 1.2, torque_Nm: 4}", lambda w: w.clip(-MOST, MOST)),
        ("wrench_frame_flip, with: {yaw_rad: 90 deg}", lambda w: w[:, [1, 0, 2, 4, 3, 5]] * [-1, 1, 1, -1, 1, 1]),
        ("wrench_delay, with: {delay_s: 25 ms}", lambda w: np.vstack([np.tile(w[0], (25, 1)), w[:-25]])),
    ],
)  # fmt: skip
def test_what_is_a_formula(pair: Make, text: str, expected: Callable[[object], object]) -> None:
    made = pair(f"  - {{fault: {text}}}", seed=3)
    true, got = made.wrenches(N)
    wanted = np.asarray(expected(true))
    skip = 25 if "delay" in text else 0  # before the line is full, the sample before the fault comes
    assert np.allclose(got[skip:], wanted[skip:])
    assert made.proof.samples == (~(got == true)).any(axis=1).sum()


def test_noise_has_its_spread_and_depends_on_the_seed_only(pair: Make) -> None:
    text = "  - {fault: wrench_noise, with: {force_sd_N: 2, torque_sd_Nm: 0.1}}"
    (true, one), (_, two), (_, other) = (pair(text, seed=s).wrenches(300) for s in (5, 5, 6))
    assert np.array_equal(one, two)
    assert not np.array_equal(one, other)
    spread = (one - true).std(axis=0)
    assert np.allclose(spread, [2, 2, 2, 0.1, 0.1, 0.1], rtol=0.1)


@pytest.mark.parametrize("reads", ["held", "zero"])
def test_intermittent_loses_whole_blocks(pair: Make, reads: str) -> None:
    made = pair(f"  - {{fault: wrench_intermittent, with: {{lost: 0.4, reads: {reads}}}}}")
    lost, last = 0, None
    for true, got in made.cycles(400):
        if got.wrench_S is not true.wrench_S and not np.array_equal(got.wrench_S, true.wrench_S):
            lost += 1
            assert (got.wrench_S == (0.0 if reads == "zero" or last is None else last)).all() or last is None
        else:
            last = true.wrench_S[-1]
    assert abs(lost / 400 - 0.4) < 0.1


def test_a_stale_tare_is_acknowledged_and_not_done(pair: Make) -> None:
    made = pair("  - {fault: stale_tare}")
    true, got = made.wrenches(3)
    assert np.array_equal(true, got)
    ticket = made.injector.start(Tare(0.05))
    polls = 0
    while not ticket.done:
        made.injector.cycle(HOLD)
        polls += 1
    assert polls == 5
    assert ticket.error is None
    assert np.abs(made.injector.cycle(HOLD).wrench_S[:, 5]).min() > 3.0  # 5 +- 1: not tared
    assert made.proof.actions.count == 1
