"""The parts of a skill: ports, parameters, failures, its context, and the base class `Skill`."""

from glotouch_bt.skill.context import Context, Journal, RobotRequests, SkillRun, come_to_rest
from glotouch_bt.skill.failures import MOTION_REFUSED, Failure, Reason, SkillFailed, UndeclaredFailure
from glotouch_bt.skill.params import SkillParams, param
from glotouch_bt.skill.ports import In, Out
from glotouch_bt.skill.skill import UNCHANGED, Skill
