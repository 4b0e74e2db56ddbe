"""End safely: rise clear of everything and return the probe if it is held."""

from __future__ import annotations

from typing import ClassVar

from glotouch_bt.motion import Motion
from glotouch_bt.robot import Probe
from glotouch_bt.skill import MOTION_REFUSED, UNCHANGED, Failure, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.hand import (
    GRAVITY_M_S2,
    MIN_GRIP_M,
    MIN_GRIP_N,
    RISE_M_S,
    WRIST_STATES,
    rise_clear,
    set_payload_and_tare,
    weigh_N,
)
from glotouch_skills.common.probe import HELD_TOLERANCE_M, RETURN_PROBE_FAILURES, return_probe


class StowParams(SkillParams):
    """Parameters of `stow`."""

    rise_speed_m_s: float = param("Speed of rising", unit="m/s", default=RISE_M_S, gt=0.0, le=0.15)
    speed_m_s: float = param("Speed with the probe in the hand", unit="m/s", default=0.10, gt=0.0, le=0.15)
    insert_speed_m_s: float = param("Speed into the holder", unit="m/s", default=0.02, gt=0.0, le=0.1)


class Stow(Skill):
    """Rise clear of the container and return a held probe to its holder, to end a mission or go on without the probe.

    The skill has no input port and may start with anything in the hand. If aperture and weight show that the probe was
    lost, the hand counts as empty. An object in the jaws is kept, so that it does not fall.

    SUCCESS: the hand is high and empty, the wrist tared.
    """

    Params = StowParams
    params: StowParams

    PRECONDITIONS: ClassVar = {
        "hand": frozenset({"empty", "fingers", "untared", "probe", "object"}),
        "wrist": WRIST_STATES,
    }
    POSTCONDITIONS: ClassVar = {"hand": "empty", "wrist": "tared"}
    FAILURE_STATES: ClassVar = {"hand": frozenset({UNCHANGED, "untared"}), "wrist": frozenset({UNCHANGED})}
    USES: ClassVar = frozenset({"arm"})

    OBJECT_HELD = Failure(
        "object_held",
        "the jaws hold something that is not the probe, and keep it; the hand is high",
        advice="remove the object from the jaws by hand",
    )
    FAILURES: ClassVar = (
        *RETURN_PROBE_FAILURES,
        MOTION_REFUSED.with_meaning("the hand cannot rise, or the holder cannot be reached"),
    )

    def run(self) -> SkillRun:
        """See the class."""
        arm, p = self.context.arm, self.params
        yield from rise_clear(arm, p.rise_speed_m_s)
        apart, pressed, probe = arm.aperture_m, self.context.observation.gripper.force_N, self.context.world.probe
        handle_wide = abs(apart - probe.handle_m[1]) <= HELD_TOLERANCE_M
        if arm.scene.holding_tool and (handle_wide or (yield from self._weighs(probe))):
            yield from return_probe(
                self.context, arm.pose_B_P.yaw_rad, apart, speed_m_s=p.speed_m_s, insert_speed_m_s=p.insert_speed_m_s
            )
            self.event("tool", held=False)
            return
        if not arm.scene.holding_tool and apart > MIN_GRIP_M and pressed > MIN_GRIP_N:
            raise self.OBJECT_HELD(
                f"the jaws are {apart * 1e3:.1f} mm apart and press with {pressed:.0f} N: they keep what they hold",
                aperture_m=apart,
                force_N=pressed,
            )
        arm.scene.hold_tool(False)
        yield from set_payload_and_tare(self.context)

    def _weighs(self, probe: Probe) -> Motion[bool]:
        """Return True if the wrist, tared with the probe in the hand, does not miss its weight."""
        missing_N = -(yield from weigh_N(self.context.arm))
        return missing_N < 0.5 * probe.mass_kg * GRAVITY_M_S2
