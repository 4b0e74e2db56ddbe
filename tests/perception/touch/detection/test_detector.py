import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from glotouch_bt.perception.touch import (
    ContactGuard,
    GuardParams,
    HardStop,
    TipFusion,
    fit_baseline,
    settled,
)
from glotouch_bt.robot import ParamError, Pose

TIP_P = np.array([0.0, 0.0, 0.13])
POSE_E_P = Pose(np.array([0.0, 0.0, 0.20]))
LEVER = np.array([0.0, 0.0, 0.33])
R_B_S = np.diag([1.0, -1.0, -1.0])
CONDITIONS = {"nominal": (0.05, 0.003, 3), "harsh": (0.15, 0.008, 8)}
APPROACH = {"along x": np.array([1.0, 0.0, 0.0]), "down": np.array([0.0, 0.0, -1.0]), "any": None}


def guard_for(bench, rng, condition, approach):
    sd_force, sd_torque, latency = CONDITIONS[condition]
    noise = {"rng": rng, "lever": LEVER, "sd_force": sd_force, "sd_torque": sd_torque}
    rest = np.vstack([b.wrench_S for b in bench.blocks(np.zeros((120, 3)), **noise)])
    guard = ContactGuard(fit_baseline(rest), approach, TIP_P, POSE_E_P, GuardParams(latency_s=latency * 1e-3))
    return guard, {**noise, "latency": latency}


@pytest.mark.parametrize("condition", CONDITIONS)
@pytest.mark.parametrize("approach", APPROACH)
def test_noise_does_not_trip_the_guard(bench, condition, approach):
    guard, noise = guard_for(bench, np.random.default_rng(3), condition, APPROACH[approach])
    assert all(guard(b) is None for b in bench.blocks(np.zeros((30000, 3)), **noise))


@pytest.mark.parametrize(
    ("condition", "approach", "stiffness", "bound_ms"),
    [
        ("nominal", "along x", 5000.0, 1.0),
        ("nominal", "along x", 300.0, 2.5),
        ("nominal", "any", 5000.0, 1.0),
        ("nominal", "down", 5000.0, 2.5),
        ("harsh", "along x", 5000.0, 2.0),
        ("harsh", "down", 5000.0, 7.0),
    ],
)
def test_onset_time_and_position_are_within_bounds(bench, condition, approach, stiffness, bound_ms):
    """A spring of known stiffness met at 40 mm/s at a known time: stamp and place of the onset, all of 20 trials."""
    speed, u = 0.04, APPROACH[approach]
    along = np.array([1.0, 0.0, 0.0]) if u is None else u
    for seed in range(20):
        rng = np.random.default_rng(seed)
        guard, noise = guard_for(bench, rng, condition, u)
        began = 0.2 + rng.uniform(0, 0.01)
        force = np.minimum(stiffness * speed * np.maximum(np.arange(1, 601) * 1e-3 - began, 0), 5.0)
        stream = bench.blocks((-along * force[:, None]) @ R_B_S, speed=along * speed, **noise)
        onset = next((o for o in map(guard, stream) if o is not None), None)
        assert onset is not None, seed
        assert abs(onset.stamp_s - began) < bound_ms * 1e-3, seed
        where = np.array([0.6, 0.0, 0.3]) + along * speed * began
        assert np.linalg.norm(onset.position_B_P - where) < speed * bound_ms * 1e-3, seed
        assert -onset.force_B @ along > 0.95 * GuardParams().directional_N, seed
        assert onset.detected_s - began < 0.05
        assert guard(stream[0]) is onset


def test_force_not_opposing_the_motion_is_no_contact(bench):
    for direction in ([1.0, 0, 0], [0, 1.0, 0]):
        guard, noise = guard_for(bench, np.random.default_rng(0), "nominal", APPROACH["along x"])
        force = np.where(np.arange(400)[:, None] > 200, 2.0, 0.0) * np.array(direction)
        assert all(guard(b) is None for b in bench.blocks(force @ R_B_S, **noise))


def test_short_spike_is_no_contact(bench):
    """Two samples of 0.3 N: the filter leaves less than the threshold of them."""
    guard, noise = guard_for(bench, np.random.default_rng(0), "nominal", APPROACH["along x"])
    force = np.zeros((400, 3))
    force[200:202, 0] = -0.3
    assert all(guard(b) is None for b in bench.blocks(force @ R_B_S, **noise))


def test_constant_bias_does_not_shift_the_onset(bench):
    """0.08 N of the hand's inertia before the contact, as measured in free motion at 0.3 m/s2."""
    guard, noise = guard_for(bench, np.random.default_rng(5), "nominal", APPROACH["along x"])
    t = np.arange(1, 601) * 1e-3
    force = -np.minimum(0.08 + 200.0 * np.maximum(t - 0.25, 0), 5.0)[:, None] * np.array([1.0, 0, 0])
    onset = next(o for o in map(guard, bench.blocks(force @ R_B_S, **noise)) if o is not None)
    assert abs(onset.stamp_s - 0.25) < 1.5e-3


def test_fusion_is_the_weighted_least_squares_estimate():
    """Against numpy's lstsq on the stacked, whitened equations, for an oblique tip and a turned pad frame."""
    rng = np.random.default_rng(1)
    quat = Rotation.from_rotvec([0.1, 0.2, 0.3]).as_quat()[[3, 0, 1, 2]]
    pose, tip, sd = Pose(np.array([0.01, 0.02, 0.2]), quat), np.array([0.01, -0.02, 0.13]), rng.uniform(0.01, 0.1, 6)
    lever, w = pose.apply(tip), rng.normal(size=6)
    model = np.vstack([np.eye(3), np.cross(lever, np.eye(3)).T]) / sd[:, None]
    want = np.linalg.lstsq(model, w / sd, rcond=None)[0]
    fusion = TipFusion.for_tip(tip, pose, sd)
    np.testing.assert_allclose(fusion(w[None])[0], want, rtol=1e-9)
    np.testing.assert_allclose(fusion.covariance, np.linalg.inv(model.T @ model), rtol=1e-9)
    np.testing.assert_allclose(fusion(np.r_[want, np.cross(lever, want)][None])[0], want, rtol=1e-9)


def test_hard_stop_reports_the_first_violation(bench):
    rng = np.random.default_rng(0)
    quiet = bench.blocks(np.zeros((120, 3)), rng=rng, lever=LEVER)
    baseline = fit_baseline(np.vstack([b.wrench_S for b in quiet]))
    stop = HardStop(baseline, GuardParams())
    assert all(stop(b) is None for b in quiet)
    force = np.zeros((40, 3))
    force[25:, 0] = 31.0
    trips = [stop(b) for b in bench.blocks(force, rng=rng, lever=LEVER, latency=0)]
    assert trips[0] is None
    assert trips[1] is None
    assert trips[2].quantity == "force_N"
    assert trips[2].stamp_s == pytest.approx(0.026)
    force[:, 0] = 0.0
    force[5:, 2] = 21.0
    assert stop(bench.blocks(force, rng=rng, lever=LEVER, latency=0)[0]).quantity == "residual_force_N"
    broken = bench.blocks(np.full((10, 3), np.nan), rng=rng, lever=LEVER)[0]
    assert stop(broken) is not None


def test_settled_needs_rest_and_a_stable_wrench(bench):
    rng = np.random.default_rng(0)
    rest = bench.blocks(np.zeros((80, 3)), rng=rng, lever=LEVER, sd_force=0.15, sd_torque=0.008)
    moving = bench.blocks(np.zeros((80, 3)), rng=rng, lever=LEVER, speed=(0.01, 0, 0))
    ringing = bench.blocks(np.linspace(2, 0, 80)[:, None] * [1.0, 0, 0], rng=rng, lever=LEVER)
    assert settled(rest)
    assert not settled(moving)
    assert not settled(ringing)
    assert not settled(rest[:1])


@pytest.mark.parametrize(
    ("name", "value"),
    [("directional_N", 0.0), ("total_N", np.nan), ("consecutive", 0), ("cutoff_Hz", 500.0), ("hard_force_N", 0.1)],
)
def test_invalid_thresholds_are_refused(name, value):
    with pytest.raises(ParamError):
        GuardParams(**{name: value})


def test_zero_approach_is_refused():
    baseline = fit_baseline(np.zeros((5, 6)))
    with pytest.raises(ParamError, match="approach_B"):
        ContactGuard(baseline, np.zeros(3), TIP_P, POSE_E_P, GuardParams())


@pytest.mark.parametrize("approach", ["along x", "down"])
@pytest.mark.parametrize("force_N", [0.3, 0.6, 2.0])
def test_step_force_is_dated_at_its_start(bench, approach, force_N):
    """A step that then stays: the filter trips late on a small one, which must not make it look like a ramp."""
    u = APPROACH[approach]
    errors = []
    for seed in range(60):
        guard, noise = guard_for(bench, np.random.default_rng(seed), "nominal", u)
        force = -u * np.where(np.arange(600) >= 300, force_N, 0.0)[:, None]
        onset = next((o for o in map(guard, bench.blocks(force @ R_B_S, **noise)) if o is not None), None)
        errors.append(onset.stamp_s - 0.3)
    bound = 2.5e-3 if force_N > 0.5 or approach == "along x" else 9e-3
    assert np.abs(np.median(errors)) < bound
    assert np.percentile(np.abs(errors), 95) < 2 * bound
