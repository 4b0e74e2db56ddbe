"""Check that the wrist sensor reads zero in free air; a drifted or stale tare shows there."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from glotouch_bt.skill import MOTION_REFUSED, UNCHANGED, Failure, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.hand import RISE_M_S, STAND_S, WRIST_STATES, rise_clear


class WristCheckParams(SkillParams):
    """Parameters of `wrist_check`.

    In five minutes the force drifts by half a newton at worst (harsh: 0.1 N/sqrt(min), two standard deviations). A
    closure reacts to 3 N.
    """

    force_N: float = param("Largest force in free air", unit="N", default=0.5, gt=0.0, le=10.0)
    torque_Nm: float = param("Largest torque about the sensor in free air", unit="Nm", default=0.10, gt=0.0, le=3.0)
    measure_s: float = param("Time over which the wrench is averaged", unit="s", default=0.15, ge=0.02, le=2.0)
    speed_m_s: float = param("Speed of rising to free air", unit="m/s", default=RISE_M_S, gt=0.0, le=0.15)


class WristCheck(Skill):
    """Rise to free air if necessary, stand still, and check the tared wrist.

    SUCCESS: force and torque are within bounds.
    """

    Params = WristCheckParams
    params: WristCheckParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"empty", "fingers", "probe"}), "wrist": WRIST_STATES}
    POSTCONDITIONS: ClassVar = {"wrist": "tared"}  # whatever it was: it reads zero
    FAILURE_STATES: ClassVar = {"wrist": frozenset({UNCHANGED})}
    USES: ClassVar = frozenset({"arm"})

    OFF_ZERO = Failure(
        "off_zero",
        "the wrist reads a force or torque in free air: the tare drifted or was taken during a contact, or "
        "the payload is not what the controller believes (a lost probe reads as its weight, upwards)",
        advice="zero it again with tare; if it drifts on, the sensor is faulty",
    )
    FAILURES: ClassVar = (MOTION_REFUSED.with_meaning("the hand cannot rise"),)

    def run(self) -> SkillRun:
        """See the class."""
        arm, p = self.context.arm, self.params
        yield from rise_clear(arm, p.speed_m_s)
        yield from arm.hold(STAND_S)
        blocks = yield from arm.hold(p.measure_s)
        mean = np.concatenate([b.wrench_S for b in blocks]).mean(axis=0)
        force, torque = float(np.linalg.norm(mean[:3])), float(np.linalg.norm(mean[3:]))
        if not (force <= p.force_N and torque <= p.torque_Nm):  # false for NaN, too
            raise self.OFF_ZERO(
                f"in free air the wrist reads {force:.2f} N and {torque:.3f} Nm; "
                f"{p.force_N:g} N and {p.torque_Nm:g} Nm are allowed",
                force_N=force,
                force_limit_N=p.force_N,
                torque_Nm=torque,
                torque_limit_Nm=p.torque_Nm,
            )
