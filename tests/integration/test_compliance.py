"""The compliance that tool_calibrate measures, against the deflection of the true ball under a known force."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from glotouch_bt.bench.detection.simulated import SimulatedProbe
from glotouch_bt.report import read_run
from glotouch_bt.runs.launch import RunRequest, launch

SEED, FORCE_N = 23, 1.0
WALL_M_N = 5e-5
"""Bound of what the wall's contact itself gives (simulated: 0.03 mm/N), which is counted as the probe's."""


def deflection_m_N(conditions: str) -> list[float]:
    """Displacement of the true ball against the true hand along x_P and y_P, per force on it, by the referee."""
    rig = SimulatedProbe(conditions, SEED)
    found = []
    with rig.robot:
        for axis in (0, 1):
            places = []
            for force_N in (0.0, FORCE_N):
                rig.referee.push_tip(force_N * rig.arm.pose_B_P.rotation[:, axis])
                rig.go(rig.arm.hold(0.6))
                seen = rig.context.observation
                along = seen.pose_B_P.rotation[:, axis]
                places.append(float(along @ (rig.referee.tip_B_m() - seen.position_B_P.mean(axis=0))))
            rig.referee.push_tip(np.zeros(3))
            found.append((places[1] - places[0]) / FORCE_N)
    return found


@pytest.mark.parametrize("conditions", [pytest.param("nominal", marks=pytest.mark.study), "realistic"])
def test_the_measured_compliance_is_that_of_the_held_probe(conditions: str, tmp_path: Path) -> None:
    done = launch(RunRequest("calibrate", seed=SEED, conditions=conditions, out=tmp_path / "run"))
    assert done.status == "success"
    measured = done.result["calibration"]["compliance_P_m_N"]
    assert measured == read_run(done.folder).of_kind("calibration")[-1].data["compliance_P_m_N"]
    assert measured == pytest.approx(deflection_m_N(conditions), rel=0.1, abs=WALL_M_N)
    assert done.result["peak_force_N"] < 15.0
