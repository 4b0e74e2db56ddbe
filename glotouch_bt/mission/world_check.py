"""Before a resumed mission goes on in a world that went on without it: is that world as the ports say?"""

from __future__ import annotations

from glotouch_bt.mission.build import BuiltTree
from glotouch_bt.robot import GlotouchError
from skills.base import Context, Reason
from skills.recheck import Recheck

NAME = "recheck"


class WorldChanged(GlotouchError):
    """It is not; the reason says what to do before the next attempt."""

    def __init__(self, reason: Reason) -> None:
        super().__init__(f"{reason.code}: {reason.message}" + (f" ({reason.advice})" if reason.advice else ""))
        self.reason = reason


def world_check(tree: BuiltTree, context: Context) -> Recheck:
    """The skill that looks; its inputs are the mission's keys of the usual names, as far as they are written."""
    skill = Recheck(NAME, Recheck.Params(), context)
    skill.setup_ports({port: f"{tree.namespace}/{key}" for port, key in Recheck.default_keys().items()})
    return skill
