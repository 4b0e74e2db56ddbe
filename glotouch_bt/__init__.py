"""GLoTouch-BT: a behavior-tree mission executive for robots that work by touch. This is its public API.

    import glotouch_bt as gt

    result = gt.run("retrieve", target="apple", seed=3)
    print(result.status, result.reasons, result.report)

Names are imported on first use, so that `import glotouch_bt` is cheap. Names that are not in `__all__` are private.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from glotouch_bt.lazy import lazy_door
from glotouch_bt.version import __version__

if TYPE_CHECKING:
    from glotouch_bt.api import check, open_robot, run
    from glotouch_bt.faults import FaultPlan
    from glotouch_bt.mission import Mission, load_mission
    from glotouch_bt.mission.spec import Finding, MissionFaults
    from glotouch_bt.report import RunRecord, read_run
    from glotouch_bt.robot import (
        HOLD,
        BackendError,
        BadInput,
        Command,
        GlotouchError,
        MotionRefused,
        Observation,
        Robot,
        SafetyStop,
    )
    from glotouch_bt.runs import RunResult
    from glotouch_bt.skill import Failure, In, Out, Skill, SkillFailed, SkillParams, SkillRun, param

__getattr__ = lazy_door(
    __name__,
    check="api",
    open_robot="api",
    run="api",
    FaultPlan="faults",
    Mission="mission",
    load_mission="mission",
    Finding="mission.spec",
    MissionFaults="mission.spec",
    RunRecord="report",
    read_run="report",
    HOLD="robot",
    BackendError="robot",
    BadInput="robot",
    Command="robot",
    GlotouchError="robot",
    MotionRefused="robot",
    Observation="robot",
    Robot="robot",
    SafetyStop="robot",
    RunResult="runs",
    Failure="skill",
    In="skill",
    Out="skill",
    Skill="skill",
    SkillFailed="skill",
    SkillParams="skill",
    SkillRun="skill",
    param="skill",
)

__all__ = [
    "HOLD",
    "BackendError",
    "BadInput",
    "Command",
    "Failure",
    "FaultPlan",
    "Finding",
    "GlotouchError",
    "In",
    "Mission",
    "MissionFaults",
    "MotionRefused",
    "Observation",
    "Out",
    "Robot",
    "RunRecord",
    "RunResult",
    "SafetyStop",
    "Skill",
    "SkillFailed",
    "SkillParams",
    "SkillRun",
    "__version__",
    "check",
    "load_mission",
    "open_robot",
    "param",
    "read_run",
    "run",
]


def __dir__() -> list[str]:
    return sorted(__all__)
