"""Record of one call of a scripted leaf."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from glotouch_bt.skill import SkillParams

Ending = Literal["SUCCESS", "FAILURE", "PREEMPTED", "RAISED", "RUNNING"]


@dataclass
class Call:
    """One call of a leaf.

    Attributes:
        node: Name of the node.
        path: Path in the tree.
        skill: Name of the skill.
        number: Number of earlier calls of the node.
        start_s: Robot time since the start of the mission.
        params: The skill's parameters.
        inputs: Values of the input ports that are written.
        outputs: Values of the output ports it wrote.
        ending: How it ended.
        code: Failure code, or empty.
        end_s: Robot time at its end.
    """

    node: str
    path: str
    skill: str
    number: int
    start_s: float
    params: SkillParams
    inputs: Mapping[str, Any]
    outputs: dict[str, Any] = field(default_factory=dict)
    ending: Ending = "RUNNING"
    code: str = ""
    end_s: float = 0.0
