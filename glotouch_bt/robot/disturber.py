"""Hands inside a simulated world: what a fault may do to it. Only `faults` and `study` may import this but the seam."""

from __future__ import annotations

from typing import Protocol

from glotouch_bt.robot.geometry import Array


class Disturber(Protocol):
    """What a simulation backend offers to those who break things on purpose. Objects go by their index."""

    def places_B_m(self) -> Array:
        """(n, 3) where the objects' centres of mass are, in B."""
        ...

    def shove(self, index: int, velocity_B_m_s: Array) -> None:
        """Give an object a velocity (2,) in B's plane, as a knock does; friction ends it."""
        ...

    def topple(self, index: int, about_rad: float) -> float:
        """Lay an object on its side, turned about a horizontal axis at this angle in B; how far its centre moved, m."""
        ...

    def remove(self, index: int) -> None:
        """Take an object out of the container."""
        ...

    def put_back(self, index: int) -> None:
        """Put a removed object where it was."""
        ...

    def shift_container(self, shift_B_m: Array, yaw_rad: float) -> None:
        """Move the container, and all that is in it, by (2,) m and an angle about its own z axis."""
        ...
