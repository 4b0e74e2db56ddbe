"""The record holds exactly, to the bit, what skills are given."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from glotouch_bt.mission.record.recorder import Recorder
from glotouch_bt.mission.record.rounding import Rounding
from glotouch_bt.report import read_run
from glotouch_bt.robot import HOLD, GripperState, Observation, TactileFrame


def observation(rng: np.random.Generator, start_s: float, n: int = 10) -> Observation:
    quat = rng.normal(size=(n, 4))
    quat /= np.linalg.norm(quat, axis=1)[:, None]
    maps = rng.uniform(0.0, 1e-3, size=(2, 5, 4))
    return Observation(
        start_s + 0.001 * np.arange(1, n + 1) + rng.uniform(-1e-4, 1e-4),
        rng.uniform(-3.0, 3.0, (n, 7)),
        rng.normal(size=(n, 7)),
        rng.uniform(-1.0, 1.0, (n, 3)),
        quat,
        rng.normal(scale=10.0, size=(n, 6)),
        GripperState(start_s - 0.013, rng.uniform(0.0, 0.085), rng.uniform(0.0, 40.0), True),
        TactileFrame(start_s - 0.007, maps[0], maps[1]),
    )


@settings(max_examples=25, deadline=None)
@example(seed=1, start_s=-0.01)
@given(seed=st.integers(0, 2**32 - 1), start_s=st.floats(-0.01, 3600.0))
def test_a_record_gives_back_what_the_skills_were_given(
    seed: int, start_s: float, tmp_path_factory: pytest.TempPathFactory
) -> None:
    rng, rounding = np.random.default_rng(seed), Rounding(7)
    given_ = [rounding(observation(rng, start_s + 0.01 * i)) for i in range(7)]
    path: Path = tmp_path_factory.mktemp("record") / "run.mcap"
    with Recorder(path, {}, batch_cycles=3) as record:
        for o in given_:
            record.block(o, HOLD)
    back = read_run(path)
    for name in ("stamp_s", "q", "dq", "position_B_P", "quat_B_P"):
        np.testing.assert_array_equal(back.samples[name], np.concatenate([getattr(o, name) for o in given_]))
    wrench = np.concatenate([back.samples["force_S_N"], back.samples["torque_S_Nm"]], axis=1)
    np.testing.assert_array_equal(wrench, np.concatenate([o.wrench_S for o in given_]))
    jaws = np.column_stack([back.cycles[f"gripper_{n}"] for n in ("stamp_s", "aperture_m", "force_N")])
    np.testing.assert_array_equal(jaws, [(o.gripper.stamp_s, o.gripper.aperture_m, o.gripper.force_N) for o in given_])
    frames = [o.tactile for o in given_ if o.tactile is not None]
    np.testing.assert_array_equal(back.tactile["left_m"], [f.left_m for f in frames])
    np.testing.assert_array_equal(back.tactile["stamp_s"], [f.stamp_s for f in frames])
    np.testing.assert_array_equal(back.tactile["arrived_s"], [o.now_s for o in given_])


def test_rounding_is_far_below_every_sensor_s_noise() -> None:
    rng = np.random.default_rng(1)
    o = observation(rng, 12.0)
    r = Rounding(7)(o)
    np.testing.assert_allclose(r.wrench_S, o.wrench_S, atol=5.1e-5)
    np.testing.assert_allclose(r.q, o.q, atol=5.1e-8)
    assert r.tactile is not None
    assert o.tactile is not None
    np.testing.assert_allclose(r.tactile.left_m, o.tactile.left_m, atol=5.1e-7)


def test_what_is_no_number_stays_what_it_is() -> None:
    o = observation(np.random.default_rng(2), 1.0)
    o.wrench_S[3, 2], o.wrench_S[4, 2] = np.nan, np.inf
    r = Rounding(7)(o)
    assert np.isnan(r.wrench_S[3, 2])
    assert np.isinf(r.wrench_S[4, 2])
