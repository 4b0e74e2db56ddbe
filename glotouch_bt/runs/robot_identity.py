"""Identity of a run's robot: its name, the digest of its numbers, and the refusal of another one."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from glotouch_bt.mission.record import to_json
from glotouch_bt.robot import BadInput, RobotDescription
from glotouch_bt.untrusted import require_type


def robot_identity(description: RobotDescription) -> dict[str, str]:
    """Return the name of a robot and the digest of its kinematics, limits, inertias and shapes."""
    numbers = json.dumps(to_json(description), sort_keys=True).encode()
    return {"name": description.name, "digest": hashlib.sha256(numbers).hexdigest()[:16]}


def require_same_robot(folder: Path, stored: Mapping[str, Any], description: RobotDescription) -> None:
    """Require that a run goes on with the robot that it began with. Runs of older versions do not state theirs.

    Args:
        folder: The run's folder.
        stored: The description of the run, as its checkpoints hold it.
        description: The robot that was opened now.

    Raises:
        BadInput: It is another robot, or one whose files have changed.
    """
    began = stored.get("robot")
    if began is None:
        return
    require_type(began, dict[str, str], f"{folder}: the robot of the run")
    now = robot_identity(description)
    if began != now:
        same = began.get("name") == now["name"]
        how = "its files have changed since" if same else f"this is {now['name']!r}"
        raise BadInput(
            f"{folder}: this run was made with the robot {began.get('name')!r}, and {how}: "
            "give that robot's file (--set robot=FILE)"
        )
