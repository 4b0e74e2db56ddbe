"""The inertia of what is carried, against Newton's law on point masses, and taken out of the guard's signal."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backends.rizon4 import RIZON4_XENSE
from glotouch_bt.motion.timing import rest_to_rest
from glotouch_bt.robot import ParamError, Pose, Probe
from glotouch_bt.touch import Carried, CommandedInertia, ContactGuard, GuardParams, fit_baseline

TIP_P, POSE_E_P, LEVER = np.array([0.0, 0.0, 0.13]), Pose(np.array([0.0, 0.0, 0.20])), np.array([0.0, 0.0, 0.33])
R_B_S = np.diag([1.0, -1.0, -1.0])
HAND = Carried.hand(RIZON4_XENSE.gripper, Probe())


def test_wrench_is_newtons_law_on_many_points():
    """Each point of a rigid cloud needs m a; the sensor feels the opposite, and its moment about S."""
    rng = np.random.default_rng(0)
    masses, points, a = rng.uniform(0.01, 0.1, 40), rng.normal(0, 0.1, (40, 3)), rng.normal(0, 1, 3)
    body = Carried.of(list(zip(masses, points, strict=True)))
    forces = -masses[:, None] * a
    want = np.r_[forces.sum(axis=0), np.cross(points, forces).sum(axis=0)]
    np.testing.assert_allclose(body.wrench_S(a), want, atol=1e-12)
    np.testing.assert_allclose(body.wrench_S(np.tile(a, (5, 1))), np.tile(want, (5, 1)), atol=1e-12)


def test_the_hand_has_all_its_parts():
    g, probe = RIZON4_XENSE.gripper, Probe()
    bare = Carried.hand(g)
    assert bare.mass_kg == pytest.approx(g.mass_kg + 2 * g.finger_mass_kg)
    assert HAND.mass_kg == pytest.approx(bare.mass_kg + probe.mass_kg)
    assert HAND.com_S_m[2] > bare.com_S_m[2]


@pytest.mark.parametrize("mass", [0.0, -1.0, np.nan])
def test_bad_mass_is_refused(mass):
    with pytest.raises(ParamError):
        Carried(mass, np.zeros(3))


@given(st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=12), st.integers(0, 9))
def test_commanded_inertia_is_the_plan_drawn_straight_and_late(plan, late):
    """Against np.interp over the whole plan at once; standing still before it and after its end."""
    plan = [*plan, 0.0, 0.0]
    newest = [0.0]
    u = np.array([0.0, 0.0, 1.0])
    inertia = CommandedInertia(HAND, u, lambda: newest[0], late * 1e-3)
    stamps = 5.0 + 1e-3 * np.arange(1, 10 * len(plan) + 1)
    got = []
    for k, newest[0] in enumerate(plan):
        got.append(inertia(stamps[10 * k : 10 * k + 10])[:, 2])
    want = -HAND.mass_kg * np.interp(stamps - late * 1e-3, 5.0 + 1e-2 * np.arange(len(plan) + 1), [0.0, *plan])
    np.testing.assert_allclose(np.concatenate(got), want, atol=1e-9)


@given(st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=12), st.integers(0, 2**32 - 1))
def test_missing_samples_change_nothing_for_the_others(plan, seed):
    """Each sample's wrench depends on its stamp alone; a period in which the arm stood waiting counts as standing."""
    rng = np.random.default_rng(seed)
    plan, newest, lag = [*plan, 0.0, 0.0], [0.0], 0.0035
    ends = 0.01 * np.arange(1, len(plan) + 1) + np.cumsum(rng.choice([0.0, 0.0, 0.3], len(plan)))
    inertias = [CommandedInertia(HAND, np.array([0.0, 0.0, 1.0]), lambda: newest[0], lag) for _ in range(2)]
    before = 0.0
    for newest[0], end in zip(plan, ends, strict=True):
        stamps = np.arange(before + 1e-3, end + 5e-4, 1e-3)
        kept = rng.random(len(stamps)) < 0.6
        kept[-1] = True
        whole, thinned = inertias[0](stamps), inertias[1](stamps[kept])
        np.testing.assert_allclose(whole[kept], thinned, atol=1e-9)
        before = stamps[-1]


@pytest.mark.parametrize("direction", [[1.0, 0, 0], [0, 0, -1.0], [0.6, 0, -0.8]])
def test_a_start_and_a_stop_are_no_contact_but_would_be_one(bench, direction):
    """1 m/s2 with the payload 5 % and 5 mm wrong: no alarm if the inertia is taken out, an alarm if not."""
    u, rng = np.array(direction), np.random.default_rng(4)
    plan = rest_to_rest(0.06, 0.05, 1.0, 20.0, 0.01).a
    true = Carried(HAND.mass_kg * 1.05, HAND.com_S_m + np.array([0.005, -0.005, 0.005]))
    along = np.interp(np.arange(10 * len(plan)) - 4, np.arange(len(plan) + 1) * 10 - 1, [0.0, *plan])
    added = along[:, None] * true.wrench_S(R_B_S.T @ u)
    rest = np.vstack([b.wrench_S for b in bench.blocks(np.zeros((120, 3)), rng=rng, lever=LEVER)])
    blocks = bench.blocks(np.zeros((len(added), 3)), rng=rng, lever=LEVER)
    outcome = []
    for taken_out in (True, False):
        newest = [0.0]
        inertia = CommandedInertia(HAND, R_B_S.T @ u, lambda newest=newest: newest[0], 0.004) if taken_out else None
        guard = ContactGuard(fit_baseline(rest), u, TIP_P, POSE_E_P, GuardParams(), inertia)
        onset = None
        for k, b in enumerate(blocks):
            newest[0] = plan[k]
            moved = type(b)(
                **{f: getattr(b, f) for f in ("stamp_s", "q", "dq", "position_B_P", "quat_B_P", "gripper")},
                wrench_S=b.wrench_S + added[10 * k : 10 * k + 10],
            )
            onset = guard(moved)
        outcome.append(onset)
    assert outcome[0] is None
    assert outcome[1] is not None
