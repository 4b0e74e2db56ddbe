"""The operating curve in synthetic signals, against figures worked out by hand."""

import numpy as np
import pytest

from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.bench.detection.curve import false_alarms, force_of, found_share, per_hour
from glotouch_bt.bench.detection.signals import FreeMove, Hand, Wrist
from glotouch_bt.mission.read.worlds import load_conditions
from glotouch_bt.perception.touch import Payload
from glotouch_bt.robot import Conditions, Probe

PROBE = Probe()
HAND = Hand(
    Payload.hand(RIZON4_XENSE.gripper, PROBE),
    np.array([0.0, 0.0, PROBE.grasp_to_tip_m]),
    RIZON4_XENSE.gripper.pose_E_P,
)
SEEDS = range(20)


def test_poisson_interval_against_the_tables():
    """0 events: 3.689 at most; 5 events: 1.623 to 11.668 (standard tables of the exact 95 % interval)."""
    assert per_hour(0, 1.0)["hi"] == pytest.approx(3.689, abs=1e-3)
    five = per_hour(5, 2.0)
    assert (five["lo"], five["hi"], five["rate"]) == pytest.approx((1.623 / 2, 11.668 / 2, 2.5), abs=1e-3)


def test_free_motion_is_silent_because_the_inertia_is_taken_out():
    """Two minutes of each kind of move with the strongest noise; downwards it would trip on every stop without."""
    conditions = load_conditions("harsh")
    quiet = false_alarms(HAND, conditions, SEEDS, hours=0.03)
    assert [r["count"] for r in quiet.values()] == [0, 0, 0]
    loud = false_alarms(HAND, conditions, range(2), hours=0.01, compensate=False)
    assert loud["down"]["rate"] > 300


@pytest.mark.parametrize("push", ["step", "slow"])
@pytest.mark.parametrize("kind", ["sweep", "step", "down"])
def test_what_force_is_found(kind, push):
    """Below the threshold never, above it always; along the probe under harsh noise from 0.4 N."""
    nominal, harsh = load_conditions("nominal"), load_conditions("harsh")
    assert found_share(HAND, nominal, kind, push, 0.06, SEEDS)["rate"] == 0.0
    assert found_share(HAND, nominal, kind, push, 0.2, SEEDS)["rate"] == 1.0
    assert found_share(HAND, harsh, kind, push, 0.4 if kind == "down" else 0.2, SEEDS)["rate"] == 1.0


@pytest.mark.parametrize("kind", ["sweep", "step"])
def test_a_light_push_that_lasts_is_found(kind):
    """0.12 N is below the threshold of a short force (0.15 N) and above that of a lasting one (0.09 N)."""
    assert found_share(HAND, load_conditions("nominal"), kind, "step", 0.12, SEEDS)["rate"] == 1.0


def test_a_push_is_dated_where_it_began():
    """Without noise: a sudden push half a second into the move, to two samples."""
    move = FreeMove("sweep", 0.09, 0.04, np.array([0.0, 1.0, 0.0]))
    wrist = Wrist(HAND, Conditions(wrench_latency_s=0.003), np.random.default_rng(0))
    onset, listened_s = wrist.listen(move, force_of("step", 0.6, -move.direction_B))
    assert listened_s == pytest.approx(0.09 / 0.04, abs=0.15)
    assert onset is not None
    assert onset.stamp_s == pytest.approx(0.5, abs=0.002)
    assert onset.force_B @ move.direction_B < 0
