"""Tare the wrist sensor."""

from __future__ import annotations

from typing import ClassVar

from glotouch_bt.robot import Tare
from glotouch_bt.skill import MOTION_REFUSED, UNCHANGED, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.hand import REQUEST_FAILED, RISE_M_S, WRIST_STATES, finish, rise_clear


class TareParams(SkillParams):
    """Parameters of `tare`."""

    settle_s: float = param("Time of standing still first", unit="s", default=0.2, ge=0.0, le=2.0)
    speed_m_s: float = param("Speed of rising to free air", unit="m/s", default=RISE_M_S, gt=0.0, le=0.15)


class TareWrist(Skill):
    """Rise to free air if necessary, stand still, and tare the wrist sensor with the payload that the controller knows.

    SUCCESS: the sensor reads zero.
    """

    Params = TareParams
    params: TareParams

    # The weight of an object in the hand, unknown to the controller, would be tared away.
    PRECONDITIONS: ClassVar = {"hand": frozenset({"empty", "fingers", "probe"}), "wrist": WRIST_STATES}
    POSTCONDITIONS: ClassVar = {"wrist": "tared"}
    FAILURE_STATES: ClassVar = {"wrist": frozenset({UNCHANGED})}
    USES: ClassVar = frozenset({"arm"})
    FAILURES: ClassVar = (REQUEST_FAILED, MOTION_REFUSED.with_meaning("the hand cannot rise"))

    def run(self) -> SkillRun:
        """See the class."""
        arm = self.context.arm
        yield from rise_clear(arm, self.params.speed_m_s)
        yield from arm.hold(self.params.settle_s)
        yield from finish(self.context.requests.start(Tare()), "tare")
        self.event("tare")
