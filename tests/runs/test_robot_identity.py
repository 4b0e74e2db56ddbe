"""A run goes on with the robot that it began with."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from glotouch_backends.robots import load_robot
from glotouch_bt.robot import BadInput
from glotouch_bt.runs import robot_identity
from glotouch_bt.runs.robot_identity import require_same_robot

RIZON, IIWA = load_robot("rizon4"), load_robot("iiwa14")
RUN = Path("a_run")


def test_the_same_robot_goes_on() -> None:
    require_same_robot(RUN, {"robot": robot_identity(IIWA)}, load_robot("iiwa14"))


def test_another_robot_is_refused_with_both_names() -> None:
    with pytest.raises(BadInput, match=f"made with the robot '{IIWA.name}', and this is '{RIZON.name}'"):
        require_same_robot(RUN, {"robot": robot_identity(IIWA)}, RIZON)


def test_changed_files_are_refused() -> None:
    joint = replace(IIWA.joints[3], velocity_rad_s=0.1)
    changed = replace(IIWA, joints=(*IIWA.joints[:3], joint, *IIWA.joints[4:]))
    with pytest.raises(BadInput, match="its files have changed since"):
        require_same_robot(RUN, {"robot": robot_identity(IIWA)}, changed)


def test_runs_of_older_versions_state_no_robot() -> None:
    require_same_robot(RUN, {}, IIWA)


def test_a_damaged_statement_is_refused() -> None:
    with pytest.raises(BadInput, match="the robot of the run"):
        require_same_robot(RUN, {"robot": ["iiwa14"]}, IIWA)
