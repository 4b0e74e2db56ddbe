"""Every fault there is: its name, what it does, who should see it, and what counts as naming its cause."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from glotouch_bt.faults.effects import Effect, arm, gripper, model, process, world, wrench
from glotouch_bt.faults.effects import tactile as touch
from glotouch_bt.mission.read import unit_of

CHANNELS = ("wrench", "touch", "gripper", "arm", "world", "model", "process")

NAMED_BY: Mapping[str, str] = {
    "wrench": r"wrench|wrist|force|torque|weigh|off_zero|hard_contact|\btare",
    "touch": r"tactile|depth map|\bpads?\b|taxel|\bgel|\bframes?\b",
    "gripper": r"jaw|gripper|aperture|\bgrip|clos(?:ed|ure)|tool_lost|slipped|\bheld\b|in the hand",
    "arm": r"joint|setpoint|following|overrun|control period|stamps|samples|controller|robot fault|not_at_rest|stale",
    "world": r"object|candidate|container|\bwall|\bfloor|moved|not_met|nothing was|in the way|recognis|\btouched",
    "model": r"recognis|candidate|target|model|\bwide|fits?\b|object",
    "process": r"driver|cycle|overrun|control period|RuntimeError",
}
"""What counts as naming the cause, by channel: one of these words in a guard's finding, a skill's failure or the chain
of reasons, after the fault began. Fixed before anything was measured."""


@dataclass(frozen=True)
class FaultKind:
    """One entry of the catalogue.

    Attributes:
        name: As written in a plan.
        channel: What it is a fault of, one of `CHANNELS`.
        summary: What it does.
        effect: The class at work.
        seen_by: Who should notice it, for people.
        recoverable: A mission can still reach its goal: the fault passes or can be worked round. A device that gives
            no numbers, old ones or ever the same, or goes beside its setpoints, is not trusted again before a person
            has looked: it is not.
    """

    name: str
    channel: str
    summary: str
    effect: type[Effect]
    seen_by: str
    recoverable: bool

    def named_in(self, text: str) -> bool:
        """True if a text names what was faulted."""
        return re.search(NAMED_BY[self.channel], text, re.IGNORECASE) is not None

    def parameters(self) -> list[dict[str, Any]]:
        """Each parameter: name, unit, default, what is valid, description."""
        rows = []
        for name, field in self.effect.Params.model_fields.items():
            rules = [
                f"{symbol} {getattr(m, key)}"
                for m in field.metadata
                for key, symbol in (("gt", ">"), ("ge", ">="), ("lt", "<"), ("le", "<="))
                if getattr(m, key, None) is not None
            ]
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
        """For --json."""
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
    rows: tuple[tuple[str, str, str, type[Effect], str, bool], ...] = (
        ("wrench_off", "wrench", "every component reads zero", wrench.Off, watch, False),
        ("wrench_stuck", "wrench", "the last sample is repeated", wrench.Stuck, watch, False),
        ("wrench_garbage", "wrench", "samples are NaN, infinite or huge", wrench.Garbage, watch, False),
        ("wrench_bias", "wrench", "a constant is added", wrench.Bias, guard + "; a new tare", True),
        ("wrench_drift", "wrench", "a ramp is added", wrench.Drift, guard + "; a new tare", True),
        ("wrench_scale", "wrench", "every component is multiplied", wrench.Scale, tree + ", by a weight", True),
        ("wrench_noise", "wrench", "white noise is added", wrench.Noise, watch + "; " + tree, True),
        ("wrench_delay", "wrench", "samples come late", wrench.Delay, "tool_calibrate, which measures it", True),
        ("wrench_intermittent", "wrench", "whole blocks are lost", wrench.Intermittent, watch, True),
        ("wrench_saturation", "wrench", "components are clipped", wrench.Saturation, watch, True),
        ("wrench_sign_flip", "wrench", "all signs are wrong", wrench.SignFlip, tree + ", by a weight", True),
        ("wrench_frame_flip", "wrench", "axes are turned about z", wrench.FrameFlip, "tool_calibrate", True),
        ("stale_tare", "wrench", "tares are acknowledged, not done", wrench.StaleTare, tree + ", by a weight", True),
        ("touch_dead", "touch", "taxels deliver nothing", touch.Dead, "squeeze: fewer valid taxels", True),
        ("touch_frozen", "touch", "one pair of maps comes again", touch.Frozen, watch + "; squeeze", True),
        ("touch_dropped", "touch", "frames are lost", touch.Dropped, watch + "; squeeze", False),
        ("touch_swapped", "touch", "left is given as right", touch.Swapped, "match", True),
        ("gel_offset", "touch", "untouched gel reads a depth", touch.Offset, "squeeze; match", True),
        ("grip_stall", "gripper", "the jaws stand still", gripper.Stall, tree, True),
        ("grip_short", "gripper", "the jaws stop before what they are told", gripper.Short, tree, True),
        (
            "grip_slip",
            "gripper",
            "the jaws press with a part of the told force",
            gripper.Slip,
            "lift, by a weight",
            True,
        ),
        ("grip_misreport", "gripper", "the reported aperture is wrong", gripper.Misreport, tree, True),
        ("grip_drop", "gripper", "the jaws open for a moment: what they hold falls", gripper.Drop, tree, True),
        ("following_error", "arm", "a joint goes beside its setpoint", arm.FollowingError, watch, False),
        ("joint_limit", "arm", "the device refuses setpoints near its own range", arm.JointLimit, watch, False),
        ("ik_failure", "arm", "the device finds no joint solution", arm.IkFailure, tree, False),
        ("lost_cycle", "arm", "commands do not arrive", arm.LostCycle, watch, True),
        ("slow_cycle", "arm", "cycles overrun, their samples are lost", arm.SlowCycle, watch, True),
        ("stale_data", "arm", "one old block is delivered again", arm.StaleData, watch, False),
        ("robot_fault", "arm", "the controller stops by itself", arm.RobotFault, "the runner", False),
        ("object_shoved", "world", "an object is knocked and slides", world.Shove, tree, True),
        ("object_toppled", "world", "an object is laid on its side", world.Topple, tree, True),
        ("object_added", "world", "an object appears", world.Add, tree, True),
        ("object_removed", "world", "an object is taken away", world.Remove, tree, False),
        ("container_offset", "world", "the container is moved with its content", world.ContainerOffset, tree, True),
        ("wrong_scale_stl", "model", "the target's STL has another size", model.WrongScale, "match", False),
        ("exception", "process", "the driver raises an unknown error", process.Unexpected, "the runner", False),
        ("hang", "process", "one cycle does not come back for a while", process.Hang, watch, True),
        ("kill", "process", "the process is killed (SIGKILL)", process.Kill, "glotouch resume", False),
    )
    return {row[0]: FaultKind(*row) for row in rows}


CATALOGUE: Mapping[str, FaultKind] = _kinds()
