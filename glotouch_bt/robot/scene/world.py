"""The nominal world: container, probe, holder, and the objects that may be inside.

Frames: B arm base, z up. K container: origin at the centre of the interior floor, z up, x along its first side.
The true world differs from the nominal one by the conditions (registration, payload, grasp offset).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from glotouch_bt.errors import ParamError
from glotouch_bt.robot.geometry import Pose

MAX_SIDE_M = 3.0
"""Largest side of a container: three times the reach of an arm. A larger number was probably in millimetres."""


def _positive(name: str, *values: float) -> None:
    for v in values:
        if not (np.isfinite(v) and v > 0):
            raise ParamError(name, v, "finite and positive")


@dataclass(frozen=True, kw_only=True)
class Container:
    """An open box.

    Attributes:
        pose_B_K: The container frame in B.
        interior_m: Interior size along x_K, y_K and up.
        wall_m: Thickness of walls and floor.
    """

    pose_B_K: Pose
    interior_m: tuple[float, float, float]
    wall_m: float = 0.008

    def __post_init__(self) -> None:
        _positive("container.interior_m", *self.interior_m)
        if max(self.interior_m) > MAX_SIDE_M:
            raise ParamError("container.interior_m", self.interior_m, f"in metres, up to {MAX_SIDE_M:g} each")
        _positive("container.wall_m", self.wall_m)


@dataclass(frozen=True, kw_only=True)
class Probe:
    """The passive probe: a ball tip on a round shaft, with a prismatic handle for the jaws.

    Probe frame T: origin at the centre of the ball, z towards the tip's far end (down when held tip-down).

    Attributes:
        tip_radius_m: Ball radius.
        shaft_diameter_m: Shaft diameter.
        length_m: From the handle's lower face to the far end of the ball.
        handle_m: Handle size (x, y, z); the jaws close along its y.
        grasp_to_tip_m: From the handle's centre, where P should be, to the ball's centre.
        mass_kg: Mass of the whole probe.
        com_below_grasp_m: Centre of mass, from the handle's centre towards the tip.
    """

    tip_radius_m: float = 0.006
    shaft_diameter_m: float = 0.008
    length_m: float = 0.120
    handle_m: tuple[float, float, float] = (0.020, 0.016, 0.032)
    mass_kg: float = 0.060
    com_below_grasp_m: float = 0.030

    def __post_init__(self) -> None:
        _positive("probe", self.tip_radius_m, self.shaft_diameter_m, self.length_m, self.mass_kg, *self.handle_m)

    @property
    def grasp_to_tip_m(self) -> float:
        """From the handle's centre to the ball's centre."""
        return 0.5 * self.handle_m[2] + self.length_m - self.tip_radius_m


@dataclass(frozen=True, kw_only=True)
class Holder:
    """The place of the stowed probe.

    Attributes:
        pose_B_grasp: Pose of P to grasp the stowed probe (z down); the handle's centre.
        half_m: Half size of the holder block, a box centred on the shaft whose top is just below the handle.
    """

    pose_B_grasp: Pose
    half_m: tuple[float, float, float] = (0.025, 0.025, 0.03)


@dataclass(frozen=True, kw_only=True)
class ObjectSet:
    """The objects to put into the container.

    Attributes:
        folder: Directory of watertight STL files in metres, upright (z up).
        names: File stems to use, in order; empty means every STL of the folder, sorted.
        min_gap_m: Least gap between two objects.
        min_wall_gap_m: Least gap between an object and a wall.
        touching_share: Share of the objects that touch another object or a wall.
        stance: "upright" as in the file, or "any": each object on a random one of its stable sides.
        lying_share: With stance "any", share of the objects that lie on a side other than upright; None: as the
            probabilities of the sides give it.
    """

    folder: Path
    names: tuple[str, ...] = ()
    min_gap_m: float = 0.030
    min_wall_gap_m: float = 0.030
    touching_share: float = 0.0
    stance: Literal["upright", "any"] = "upright"
    lying_share: float | None = None


@dataclass(frozen=True, kw_only=True)
class World:
    """Everything that a backend needs to open and that a skill may know.

    A simulator places `objects`. A skill may use them only to load the STL of a target that was given by name.
    """

    name: str
    container: Container
    probe: Probe
    holder: Holder
    objects: ObjectSet
