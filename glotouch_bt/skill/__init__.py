"""TODO door of glotouch_bt/skill."""

from glotouch_bt.skill.context import Context, Journal, RobotRequests, SkillRun, come_to_rest
from glotouch_bt.skill.failures import Reason, SkillFailed, UndeclaredFailure
from glotouch_bt.skill.params import SkillParams, param
from glotouch_bt.skill.ports import In, Out
from glotouch_bt.skill.skill import UNCHANGED, Skill

__all__ = [
    "UNCHANGED",
    "Context",
    "In",
    "Journal",
    "Out",
    "Reason",
    "RobotRequests",
    "Skill",
    "SkillFailed",
    "SkillParams",
    "SkillRun",
    "UndeclaredFailure",
    "come_to_rest",
    "param",
]
