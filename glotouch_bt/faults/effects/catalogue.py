"""The catalogue of faults: name, summary, effect, expected detector, and the words that name the cause."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from glotouch_bt.faults.effects import arm, gripper, model, process, tactile, world, wrench
from glotouch_bt.faults.effects.base import Effect
from glotouch_bt.mission.read import limits_of, unit_of

CAUSE_PATTERNS: Mapping[str, str] = {
    "wrench": r"wrench|wrist|force|torque|weigh|off_zero|hard_contact|\btare",
    "touch": r"tactile|depth map|\bpads?\b|taxel|\bgel|\bframes?\b",
    "gripper": r"jaw|gripper|aperture|\bgrip|clos(?:ed|ure)|tool_lost|slipped|\bheld\b|in the hand",
    "arm": r"joint|setpoint|following|overrun|control period|stamps|samples|controller|robot fault|not_at_rest|stale",
    "world": r"object|candidate|container|\bwall|\bfloor|moved|not_met|nothing was|in the way|recognis|\btouched",
    "model": r"recognis|candidate|target|model|\bwide|fits?\b|object",
    "process": r"driver|cycle|overrun|control period|RuntimeError",
}
"""Words that name the cause of a fault, by channel, in a guard's finding, a skill's failure or the chain of reasons
after the fault began. Fixed before the first measurement."""


@dataclass(frozen=True)
class FaultKind:
    """One entry of the catalogue.

    Attributes:
        name: As written in a plan.
        channel: Faulted part of the system, a key of `CAUSE_PATTERNS`.
        summary: One line for people.
        effect: The class that applies it.
        seen_by: Expected detector, for people.
        recoverable: A mission can still reach its goal, because the fault passes or can be worked around. False for a
            device that delivers no, old or constant data or leaves its setpoints: a person must check it first.
    """

    name: str
    channel: str
    summary: str
    effect: type[Effect[Any]]
    seen_by: str
    recoverable: bool

    def named_in(self, text: str) -> bool:
        """Return True if a text names the faulted part."""
        return re.search(CAUSE_PATTERNS[self.channel], text, re.IGNORECASE) is not None

    def parameters(self) -> list[dict[str, Any]]:
        """Return name, unit, default, valid range and description of each parameter."""
        rows = []
        for name, field in self.effect.Params.model_fields.items():
            rules = [f"{symbol} {limit}" for symbol, limit, _ in limits_of(field)]
            choices = getattr(field.annotation, "__args__", ())
            if not rules and choices and all(isinstance(c, str) for c in choices):
                rules = [" or ".join(choices)]
            rows.append(
                {
                    "name": name,
                    "unit": unit_of(field),
                    "default": field.default,
                    "valid": ", ".join(rules),
                    "description": field.description or "",
                }
            )
        return rows

    def as_dict(self) -> dict[str, Any]:
        """Return the entry as JSON data."""
        return {
            "name": self.name,
            "channel": self.channel,
            "summary": self.summary,
            "parameters": self.parameters(),
            "seen_by": self.seen_by,
            "recoverable": self.recoverable,
            "simulation_only": self.channel == "world",
        }


def _kinds() -> Mapping[str, FaultKind]:
    watch, guard, tree = "supervision", "the guarded move or the hard limit", "the skill that meets it"
    rows: tuple[tuple[str, str, str, type[Effect[Any]], str, bool], ...] = (
        ("wrench_off", "wrench", "every component reads zero", wrench.WrenchOff, watch, False),
        ("wrench_stuck", "wrench", "the last sample is repeated", wrench.WrenchStuck, watch, False),
        ("wrench_garbage", "wrench", "samples are NaN, infinite or huge", wrench.WrenchGarbage, watch, False),
        ("wrench_bias", "wrench", "a constant is added", wrench.WrenchBias, guard + "; a new tare", True),
        ("wrench_drift", "wrench", "a ramp is added", wrench.WrenchDrift, guard + "; a new tare", True),
        ("wrench_scale", "wrench", "every component is multiplied", wrench.WrenchScale, tree + ", by a weight", True),
        ("wrench_noise", "wrench", "white noise is added", wrench.WrenchNoise, watch + "; " + tree, True),
        ("wrench_delay", "wrench", "samples come late", wrench.WrenchDelay, "tool_calibrate, which measures it", True),
        ("wrench_intermittent", "wrench", "whole blocks are lost", wrench.WrenchIntermittent, watch, True),
        ("wrench_saturation", "wrench", "components are clipped", wrench.WrenchSaturation, watch, True),
        ("wrench_sign_flip", "wrench", "all signs are inverted", wrench.WrenchSignFlip, tree + ", by a weight", True),
        ("wrench_frame_flip", "wrench", "axes are rotated about z", wrench.WrenchFrameFlip, "tool_calibrate", True),
        ("stale_tare", "wrench", "tares are acknowledged, not done", wrench.StaleTare, tree + ", by a weight", True),
        ("touch_dead", "touch", "taxels deliver nothing", tactile.TouchDead, "squeeze: fewer valid taxels", True),
        ("touch_frozen", "touch", "one pair of maps is repeated", tactile.TouchFrozen, watch + "; squeeze", True),
        ("touch_dropped", "touch", "frames are lost", tactile.TouchDropped, watch + "; squeeze", False),
        ("touch_swapped", "touch", "left is given as right", tactile.TouchSwapped, "match", True),
        ("gel_offset", "touch", "untouched gel reads a depth", tactile.GelOffset, "squeeze; match", True),
        ("grip_stall", "gripper", "the jaws do not move", gripper.GripStall, tree, True),
        ("grip_short", "gripper", "the jaws stop short of their target", gripper.GripShort, tree, True),
        (
            "grip_slip",
            "gripper",
            "the jaws press with a fraction of the commanded force",
            gripper.GripSlip,
            "lift, by a weight",
            True,
        ),
        ("grip_misreport", "gripper", "the reported aperture is wrong", gripper.GripMisreport, tree, True),
        ("grip_drop", "gripper", "the jaws open briefly and drop what they hold", gripper.GripDrop, tree, True),
        ("following_error", "arm", "a joint deviates from its setpoint", arm.FollowingError, watch, False),
        ("joint_limit", "arm", "the device refuses setpoints near its own range", arm.JointLimit, watch, False),
        ("ik_failure", "arm", "the device finds no joint solution", arm.IkFailure, tree, False),
        ("lost_cycle", "arm", "commands are lost", arm.LostCycle, watch, True),
        ("slow_cycle", "arm", "cycles overrun, their samples are lost", arm.SlowCycle, watch, True),
        ("stale_data", "arm", "one old block is delivered again", arm.StaleData, watch, False),
        ("robot_fault", "arm", "the controller stops by itself", arm.RobotFault, "the runner", False),
        ("object_shoved", "world", "an object is knocked and slides", world.ObjectShoved, tree, True),
        ("object_toppled", "world", "an object is laid on its side", world.ObjectToppled, tree, True),
        ("object_added", "world", "an object appears", world.ObjectAdded, tree, True),
        ("object_removed", "world", "an object is taken away", world.ObjectRemoved, tree, False),
        ("container_offset", "world", "the container is moved with its content", world.ContainerOffset, tree, True),
        ("wrong_scale_stl", "model", "the target's STL has another size", model.WrongScaleStl, "match", False),
        ("exception", "process", "the driver raises an unknown error", process.DriverException, "the runner", False),
        ("hang", "process", "one cycle blocks for a while", process.Hang, watch, True),
        ("kill", "process", "the process is killed (SIGKILL)", process.Kill, "glotouch resume", False),
    )
    return {row[0]: FaultKind(*row) for row in rows}


CATALOGUE: Mapping[str, FaultKind] = _kinds()
