"""The matrix of `bench forces --following`: a joint leaves its setpoint, at each rate, in each direction and moment."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from glotouch_bt.campaign import Campaign
from glotouch_bt.faults import Duration, FaultPlan, When
from glotouch_bt.robot import UnknownName
from glotouch_bt.runs import RunFolder
from glotouch_bt.validation.forces.draw import fault_of, plan_of
from glotouch_bt.validation.forces.scenes import block_scene

JOINTS = tuple(range(7))
"""Indices of the joints, from the base."""
RATES_RAD_S = (0.03, 0.06, 0.12, 0.24)
"""Rates at which a joint leaves its setpoint, rad/s."""
RISE_S = 1.0
"""Time for which the deviation grows, s."""

_PICKUP = """mission: pickup
world: worlds/container_five.yaml
leaves: {hand: probe}
tree:
  sequence:
    - tool_pickup: {floor_touch: false}
"""
_SWEEP = _PICKUP.replace("pickup\n", "sweep\n", 1) + "    - guarded_sweep: {expected_objects: 1}\n"
MISSIONS = {"pickup": _PICKUP, "sweep": _SWEEP}
"""Short missions of this experiment."""


@dataclass(frozen=True)
class Moment:
    """A moment of a short mission.

    Attributes:
        name: Its name.
        mission: One of `MISSIONS`, or a shipped mission.
        when: Start of the fault.
    """

    name: str
    mission: str
    when: When


MOMENTS = (
    Moment("sweep", "sweep", When(node="guarded_sweep", after_s=4.0)),
    Moment("contact", "sweep", When(node="guarded_sweep", force_above_N=1.0)),
    Moment("draw", "pickup", When(node="tool_pickup", aperture_below_m=0.03)),
    Moment("squeeze", "pick_at", When(node="grasp", after_s=2.0, aperture_below_m=0.05)),
    Moment("lift", "pick_at", When(node="lift", after_s=0.5)),
)
"""Moments: sweeping with the probe in free space, and at a contact; drawing the probe from its holder; jaws that close
on an object; lifting it."""


@dataclass(frozen=True)
class MatrixCell:
    """One trial of the matrix: `rate_rad_s` has the sign of its direction."""

    moment: Moment
    joint: int
    rate_rad_s: float

    @property
    def name(self) -> str:
        """Name of the trial's folder."""
        sign = "minus" if self.rate_rad_s < 0.0 else "plus"
        return f"{self.moment.name}-joint{self.joint}-{sign}-{abs(self.rate_rad_s):.2f}"

    def plan(self) -> FaultPlan:
        """Return the plan: from the moment until the end of the run."""
        given = {"joint": self.joint, "offset_rad": self.rate_rad_s * RISE_S, "rise_s": RISE_S}
        return plan_of([fault_of("following_error", given, self.moment.when, Duration(until="ever"))])


def chosen_moments(names: Iterable[str]) -> tuple[Moment, ...]:
    """Return the moments of these names; all without names.

    Raises:
        UnknownName: A name is no moment.
    """
    known = {m.name: m for m in MOMENTS}
    wanted = tuple(dict.fromkeys(names))
    for name in wanted:
        if name not in known:
            raise UnknownName("moment", name, known)
    return tuple(known[n] for n in wanted) if wanted else MOMENTS


def chosen_joints(numbers: Iterable[int]) -> tuple[int, ...]:
    """Return these joints; all without numbers.

    Raises:
        UnknownName: A number is none of `JOINTS`.
    """
    wanted = tuple(dict.fromkeys(numbers))
    for number in wanted:
        if number not in JOINTS:
            raise UnknownName("joint", str(number), map(str, JOINTS))
    return wanted or JOINTS


def matrix(moments: Sequence[Moment], joints: Sequence[int]) -> Iterator[MatrixCell]:
    """Yield every trial of these moments and joints."""
    for moment, joint, rate, sign in itertools.product(moments, joints, RATES_RAD_S, (1.0, -1.0)):
        yield MatrixCell(moment, joint, sign * rate)


def scene_of(moment: Moment, base: Campaign) -> Campaign:
    """Return the campaign of a moment's mission, with its files written to the folder of `base`."""
    if moment.mission not in MISSIONS:
        return block_scene(moment.mission, base)
    name = f"{moment.mission}.yaml"
    folder = RunFolder(base.out / "missions")
    folder.write_text(name, MISSIONS[moment.mission])
    return block_scene(str(folder.path / name), base)
