"""The cases of `bench faults`: each class of fault with its parameters, duration, and the skills it can affect."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from glotouch_bt.faults import CATALOGUE, Duration, FaultPlan, FaultSpec, Repeat, When
from glotouch_bt.mission.spec import Place
from glotouch_bt.robot import BadInput, UnknownName

SKILLS = ("tool_pickup", "guarded_sweep", "orbit_probe", "touch_top", "tool_return", "touch_next", "grasp", "lift")
_PROBING = ("guarded_sweep", "orbit_probe", "touch_top")
_JAWS = ("tool_pickup", "tool_return", "touch_next", "grasp")
_AMONG_OBJECTS = ("guarded_sweep", "orbit_probe", "touch_top", "touch_next", "grasp")


@dataclass(frozen=True)
class Case:
    """One class of fault with fixed parameters.

    Attributes:
        fault: Name in the catalogue, and of the case.
        given: Parameters that differ from the defaults.
        duration: Duration.
        skills: Skills it can affect.
        warm_up_s: Least run time before the fault begins.
    """

    fault: str
    given: Mapping[str, Any] = field(default_factory=dict)
    duration: Duration = field(default_factory=lambda: Duration(duration_s=2.0))
    skills: tuple[str, ...] = SKILLS
    warm_up_s: float = 0.5

    @property
    def recoverable(self) -> bool:
        """Return True if a mission can still reach its goal."""
        return CATALOGUE[self.fault].recoverable

    def plan(self, skill: str, after_s: float) -> FaultPlan:
        """Return the plan of one trial: once, in the skill's first run, `after_s` after its start."""
        kind = CATALOGUE[self.fault]
        spec = FaultSpec(
            self.fault,
            kind,
            kind.effect.Params(**self.given),
            When(node=skill, after_s=after_s),
            self.duration,
            Repeat(),
            Place("bench faults"),
        )
        return FaultPlan(f"{self.fault} in {skill}", (spec,))


def _s(seconds: float) -> Duration:
    return Duration(duration_s=seconds)


LEARNING_S = 8.0
"""Warm-up of faults seen by noise: supervision learns the sensor's noise in 5 s, again after a resume."""
EVER = Duration(until="ever")
_NODE = Duration(until="node")  # a world fault may wait for free space while the skill runs; it is never undone
CASES: tuple[Case, ...] = (
    Case("wrench_off", warm_up_s=LEARNING_S),
    Case("wrench_stuck", warm_up_s=LEARNING_S),
    Case("wrench_garbage", duration=_s(0.2)),
    Case("wrench_bias", {"force_N": (2.0, 1.0, 3.0)}, EVER),
    Case("wrench_drift", duration=_s(10.0)),
    Case("wrench_scale"),
    Case("wrench_noise"),
    Case("wrench_delay"),
    Case("wrench_intermittent"),
    Case("wrench_saturation", {"force_N": 0.5, "torque_Nm": 0.05}, _s(6.0)),
    Case("wrench_sign_flip"),
    Case("following_error", {"offset_rad": 0.03}),
    Case("lost_cycle"),
    Case("slow_cycle", {"periods": 2, "share": 0.02}),
    Case("stale_data", duration=_s(0.3)),
    Case("robot_fault"),
    Case("exception"),
    Case("stale_tare", duration=EVER, skills=("tool_pickup", "tool_return")),
    Case("touch_dead", duration=EVER, skills=("touch_next",)),
    Case("touch_frozen", duration=EVER, skills=("touch_next",)),
    Case("touch_dropped", duration=_s(5.0), skills=("touch_next",)),
    Case("touch_swapped", duration=EVER, skills=("touch_next",)),
    Case("gel_offset", duration=EVER, skills=("touch_next",)),
    Case("grip_stall", duration=_NODE, skills=_JAWS),
    Case("grip_short", duration=_NODE, skills=_JAWS),
    Case("grip_slip", duration=EVER, skills=("tool_pickup", "grasp")),
    Case("grip_drop", duration=_s(1.0), skills=(*_PROBING, "tool_return", "lift")),
    Case("object_shoved", duration=_NODE, skills=_AMONG_OBJECTS),
    Case("object_toppled", duration=_NODE, skills=_AMONG_OBJECTS),
    Case("object_removed", duration=_NODE, skills=_AMONG_OBJECTS),
    Case("wrong_scale_stl", duration=EVER, skills=("tool_pickup",)),
    Case("container_offset", duration=_NODE, skills=_AMONG_OBJECTS),
)


def chosen_cases(names: Iterable[str]) -> tuple[Case, ...]:
    """Return the cases of these names; all without names.

    Raises:
        UnknownName: A name is no case.
    """
    known = {c.fault: c for c in CASES}
    wanted = tuple(names)
    for name in wanted:
        if name not in known:
            raise UnknownName("class of faults", name, known)
    return tuple(known[n] for n in wanted) if wanted else CASES


def chosen_skills(names: Iterable[str], cases: Sequence[Case]) -> tuple[str, ...]:
    """Return the skills to break; all without names.

    Raises:
        UnknownName: A name is none of `SKILLS`.
        BadInput: No case affects any of them.
    """
    wanted = tuple(names) or SKILLS
    for name in wanted:
        if name not in SKILLS:
            raise UnknownName("skill that is broken here", name, SKILLS)
    if not any(name in case.skills for case in cases for name in wanted):
        acts = sorted({name for case in cases for name in case.skills})
        raise BadInput(f"--skill {', '.join(wanted)}: no chosen fault acts there (they act in {', '.join(acts)})")
    return wanted
