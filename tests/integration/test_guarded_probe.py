"""Probing with real dynamics: what the hand's own motion leaves in the signal, and how far an object was pushed."""

from __future__ import annotations

import dataclasses

import numpy as np

from glotouch_bt.bench.detection.simulated import SimulatedProbe
from glotouch_bt.perception.touch import GuardParams
from glotouch_bt.robot import Pose
from glotouch_bt.skill.probing.guarded_probe import Prober


def test_the_inertia_taken_out_leaves_less_than_half_of_the_threshold() -> None:
    """Free moves without noise, any direction counting, thresholds at 0.06 N: no contact."""
    rig = SimulatedProbe("ideal", 5)
    with rig.robot:
        tool = dataclasses.replace(rig.tool, latency_s=0.0)
        rig.prober = Prober(rig.context, tool, GuardParams(directional_N=0.06, total_N=0.06))
        start = np.array([0.0, -0.05, 0.08])
        rig.go(rig.prober.hop(start, 0.12, 0.1))
        for way in ([0.06, 0, 0], [-0.06, 0, 0], [0, 0.05, 0], [0, -0.05, 0], [0, 0, -0.05], [0, 0, 0.05]):
            here = rig.prober.tip_K_m
            probed = rig.go(rig.prober.move(here + way, 0.05, any_direction=True))
            assert probed.contact is None, way


def test_how_far_a_free_object_was_pushed() -> None:
    """Against the true displacement of the object's middle, over six touches: nearer than the ball's bare way."""
    rig = SimulatedProbe("nominal", 6)
    with rig.robot:
        K_from_B = rig.world.container.pose_B_K.inverse()

        def middle() -> np.ndarray:
            now = rig.referee.objects()[0]
            turn: Pose = now.pose_B_O
            return K_from_B.apply(np.append(now.outline_B_m.mean(axis=0), turn.position_m[2]))[:2]

        errors, bare = [], []
        for k in range(6):
            before = middle()
            u = np.array([[0.0, 1.0], [0.6, 0.8]][k % 2])
            start = np.append(before - 0.06 * u, 0.018)
            rig.go(rig.prober.hop(start, 0.13, 0.1))
            rig.go(rig.prober.move(start, 0.04))
            probed = rig.go(rig.prober.move(np.append(before, 0.018), (0.04, 0.03)[k // 3]))
            contact = probed.contact
            assert contact is not None
            rig.go(rig.prober.retreat(-contact.approach_K, 0.012, 0.05))
            moved = middle() - before
            errors.append(np.linalg.norm(moved - contact.pushed_K_m))
            bare.append(np.linalg.norm(moved - (probed.path_K_m[-1, :2] - contact.tip_K_m[:2])))
        assert np.mean(errors) < 0.35e-3
        assert np.mean(errors) < np.mean(bare)
