"""Interface to the ground truth of a simulated world, for scoring only. Skills and the mission never import it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from glotouch_bt.robot.geometry import Array, Pose


@dataclass(frozen=True)
class TrueObject:
    """Ground truth of one object.

    Attributes:
        name: STL stem.
        pose_B_O: The mesh frame in B.
        mass_kg: Mass.
        outline_B_m: (n, 2) convex outline of the mesh in its present pose, in the xy plane of B.
        in_gripper: True if it touches both fingers, on the pads or beside them, and not the container.
        size_m: (3,) its true size along the axes of the mesh frame.
    """

    name: str
    pose_B_O: Pose
    mass_kg: float
    outline_B_m: Array
    in_gripper: bool
    size_m: Array


@dataclass(frozen=True)
class BareSteps:
    """Cost of a run's solver steps, repeated with nothing else around them.

    Attributes:
        steps: Solver steps.
        wall_s, cpu_s: Wall time and processor time of the steps.
        same_end_state: True if they ended bit-identically to the run, so that only its controls moved the world.
    """

    steps: int
    wall_s: float
    cpu_s: float
    same_end_state: bool


class Referee(Protocol):
    """Ground truth that a simulation offers for scoring."""

    def objects(self) -> list[TrueObject]:
        """Return the present state of all objects."""
        ...

    def pose_B_K(self) -> Pose:
        """Return the true container frame in B."""
        ...

    def tip_B_m(self) -> Array:
        """Return the true centre (3,) of the probe's ball in B."""
        ...

    def push_tip(self, force_B_N: Array) -> None:
        """Apply a force (3,) in B to the probe at the ball's centre until the next call; zero ends it."""
        ...

    def probe_in_holder(self) -> bool:
        """Return True if the probe stands in its holder."""
        ...

    def peak_force_N(self) -> float:
        """Return the largest norm so far of the true contact force on the hand and what it holds."""
        ...

    def samples_over_limit(self) -> int:
        """Return the largest number so far of consecutive samples of that force beyond the hard limit."""
        ...

    def contact_softness_s(self) -> float:
        """Return the time constant of the world's contacts, which is drawn from the conditions."""
        ...

    def silent_axes(self) -> tuple[str, ...]:
        """Return the axes of the conditions that were set and used, and yet altered nothing so far."""
        ...

    def replay_bare_steps(self) -> BareSteps | None:
        """Repeat the run's solver steps in a copy of the world; None unless the backend was opened with `trace`."""
        ...
