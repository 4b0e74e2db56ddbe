"""The inertia of what is carried, against Newton's law on point masses, and taken out of the guard's signal."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.motion.timing import rest_to_rest
from glotouch_bt.perception.touch import ContactGuard, GuardParams, LowPass, MeasuredInertia, Payload, fit_baseline
from glotouch_bt.robot import GripperState, Observation, ParamError, Pose, Probe

TIP_P, POSE_E_P, LEVER = np.array([0.0, 0.0, 0.13]), Pose(np.array([0.0, 0.0, 0.20])), np.array([0.0, 0.0, 0.33])
R_B_S = np.diag([1.0, -1.0, -1.0])
HAND = Payload.hand(RIZON4_XENSE.gripper, Probe())


def test_wrench_is_newtons_law_on_many_points():
    """Each point of a rigid cloud needs m a; the sensor feels the opposite, and its moment about S."""
    rng = np.random.default_rng(0)
    masses, points, a = rng.uniform(0.01, 0.1, 40), rng.normal(0, 0.1, (40, 3)), rng.normal(0, 1, 3)
    body = Payload.of(list(zip(masses, points, strict=True)))
    forces = -masses[:, None] * a
    want = np.r_[forces.sum(axis=0), np.cross(points, forces).sum(axis=0)]
    np.testing.assert_allclose(body.wrench_S(a), want, atol=1e-12)
    np.testing.assert_allclose(body.wrench_S(np.tile(a, (5, 1))), np.tile(want, (5, 1)), atol=1e-12)


def test_hand_payload_includes_all_parts():
    g, probe = RIZON4_XENSE.gripper, Probe()
    bare = Payload.hand(g)
    assert bare.mass_kg == pytest.approx(g.mass_kg + 2 * g.finger_mass_kg)
    assert HAND.mass_kg == pytest.approx(bare.mass_kg + probe.mass_kg)
    assert HAND.com_S_m[2] > bare.com_S_m[2]


@pytest.mark.parametrize("mass", [0.0, -1.0, np.nan])
def test_invalid_mass_is_refused(mass):
    with pytest.raises(ParamError):
        Payload(mass, np.zeros(3))


def block(stamps, position, yaw=0.0) -> Observation:
    """Samples of a hand that points down."""
    n, idle = len(stamps), np.zeros((len(stamps), 7))
    quat = Pose.pointing_down(np.zeros(3), yaw).quat
    state = GripperState(0.0, 0.016, 60.0, False)
    return Observation(stamps, idle, idle, position, np.tile(quat, (n, 1)), np.zeros((n, 6)), state)


def swing(t):
    """(n, 3) positions of a smooth motion that begins at rest at 5 s and lasts 0.3 s: up to 1 m/s2 and 21 m/s3."""
    part = np.clip((t - 5.0) / 0.3, 0.0, 1.0)[:, None]
    return np.array([0.6, -0.3, 0.74]) * 0.0143 * (part - np.sin(2 * np.pi * part) / (2 * np.pi))


def accelerations(t, h=1e-5):
    return (swing(t + h) - 2 * swing(t) + swing(t - h)) / h**2


@settings(max_examples=40, deadline=None)
@given(st.floats(0.004, 0.012), st.floats(0.0, 0.25), st.floats(-3.0, 3.0), st.integers(0, 2**32 - 1))
def test_measured_inertia_is_newtons_law_at_the_lag(lag, lost, yaw, seed):
    """Against the second derivative of a smooth motion; blocks of any length, samples missing."""
    rng = np.random.default_rng(seed)
    stamps = np.arange(4.9, 5.5, 1e-3)
    stamps = stamps[rng.random(len(stamps)) >= lost]
    inertia = MeasuredInertia(HAND, POSE_E_P, lag)
    cuts = np.sort(rng.choice(np.arange(1, len(stamps)), 40, replace=False))
    got = np.concatenate([inertia(block(b, swing(b), yaw)) for b in np.split(stamps, cuts)])
    R = Pose.pointing_down(np.zeros(3), yaw).rotation @ POSE_E_P.rotation.T
    want = HAND.wrench_S(accelerations(stamps - lag) @ R)
    assert np.abs(LowPass(6)(got - want)[:, :3]).max() < 0.08, "N, of 0.9; a guard's least threshold is 0.15"


def test_position_noise_gives_the_documented_force_noise():
    rng = np.random.default_rng(0)
    stamps = np.arange(0.0, 4.0, 1e-3)
    still = np.tile([0.5, 0.0, 0.2], (len(stamps), 1)) + 1e-6 * rng.standard_normal((len(stamps), 3))
    inertia = MeasuredInertia(HAND, POSE_E_P, 0.004)
    got = np.concatenate(
        [inertia(block(b, p)) for b, p in zip(np.split(stamps, 400), np.split(still, 400), strict=True)]
    )
    assert got[20:, 0].std() == pytest.approx(0.11 * HAND.mass_kg, rel=0.1)


@pytest.mark.parametrize("direction", [[1.0, 0, 0], [0, 0, -1.0], [0.6, 0, -0.8]])
def test_inertia_compensation_prevents_false_alarms(bench, direction):
    """1 m/s2 with the payload 5 % and 5 mm wrong: no alarm if the inertia is taken out, an alarm if not."""
    u, rng = np.array(direction), np.random.default_rng(4)
    plan = rest_to_rest(0.06, 0.05, 1.0, 20.0, 0.01).a
    true = Payload(HAND.mass_kg * 1.05, HAND.com_S_m + np.array([0.005, -0.005, 0.005]))
    along = np.interp(np.arange(10 * len(plan)) - 4, np.arange(len(plan) + 1) * 10 - 1, [0.0, *plan])
    added = along[:, None] * true.wrench_S(R_B_S.T @ u)
    rest = np.vstack([b.wrench_S for b in bench.blocks(np.zeros((120, 3)), rng=rng, lever=LEVER)])
    blocks = bench.blocks(np.zeros((len(added), 3)), rng=rng, lever=LEVER)
    outcome = []
    way = np.cumsum(np.cumsum(np.interp(np.arange(len(added)), np.arange(len(plan) + 1) * 10 - 1, [0.0, *plan]))) * 1e-6
    for taken_out in (True, False):
        inertia = MeasuredInertia(HAND, POSE_E_P, 0.004) if taken_out else None
        guard = ContactGuard(fit_baseline(rest), u, TIP_P, POSE_E_P, GuardParams(), inertia)
        onset = None
        for k, b in enumerate(blocks):
            part = slice(10 * k, 10 * k + 10)
            moved = dataclasses.replace(
                b, wrench_S=b.wrench_S + added[part], position_B_P=b.position_B_P[:1] + way[part, None] * u
            )
            onset = guard(moved)
        outcome.append(onset)
    assert outcome[0] is None
    assert outcome[1] is not None
