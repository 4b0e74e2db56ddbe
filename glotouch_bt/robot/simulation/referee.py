"""The truth of a simulated world, for scoring only. Nothing below `study` and `report` may import this but the seam."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from glotouch_bt.robot.geometry import Array, Pose


@dataclass(frozen=True)
class TrueObject:
    """One object as it really is.

    Attributes:
        name: STL stem.
        pose_B_O: The mesh frame in B.
        mass_kg: Mass.
        outline_B_m: (n, 2) convex outline of the mesh as it lies, in B's xy plane.
        in_gripper: True if both pads touch it and it does not touch the container.
    """

    name: str
    pose_B_O: Pose
    mass_kg: float
    outline_B_m: Array
    in_gripper: bool


@dataclass(frozen=True)
class BareSteps:
    """The physics of a run done once more with nothing round it.

    Attributes:
        steps: Solver steps.
        wall_s, cpu_s: What they took on the wall's clock and of the processor.
        same_end_state: They ended bit for bit where the run ended, so that nothing but its controls moved the world.
    """

    steps: int
    wall_s: float
    cpu_s: float
    same_end_state: bool


class Referee(Protocol):
    """What a simulation backend offers to those who score a run."""

    def objects(self) -> list[TrueObject]:
        """All objects, now."""
        ...

    def pose_B_K(self) -> Pose:
        """The true container frame in B."""
        ...

    def tip_B_m(self) -> Array:
        """(3,) true centre of the probe's ball, wherever the probe is."""
        ...

    def push_tip(self, force_B_N: Array) -> None:
        """From now on pull the probe by a force (3,) at the ball's centre, until told otherwise; zero ends it."""
        ...

    def probe_in_holder(self) -> bool:
        """True if the probe stands in its holder."""
        ...

    def peak_force_N(self) -> float:
        """Largest norm of the true contact force on the hand and what it holds, so far."""
        ...

    def replay_bare_steps(self) -> BareSteps | None:
        """Repeat the run's physics in a copy of the world; None unless the backend was opened with `trace`."""
        ...
