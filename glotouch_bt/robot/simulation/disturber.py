"""Hands inside a simulated world: what a fault may do to it. Only `faults` and `study` may import this but the seam."""

from __future__ import annotations

from typing import Protocol

from glotouch_bt.robot.geometry import Array


class NoRoom(Exception):
    """Not now: the robot touches what would be moved, or something is in its way. Nothing has been changed."""


class Disturber(Protocol):
    """What a simulation backend offers to those who break things on purpose. Objects go by their index.

    Nothing is moved through the robot, nor out of its jaws, nor into anything else: all that moves something raises
    `NoRoom` instead, and may be asked again later. What a hand pressed by a jump of the world would feel is no fault
    of the world but of the simulation.
    """

    def places_B_m(self) -> Array:
        """(n, 3) where the objects' centres of mass are, in B."""
        ...

    def shove(self, index: int, velocity_B_m_s: Array) -> None:
        """Give an object a velocity (2,) in B's plane, as a knock does; friction ends it.

        Raises:
            NoRoom: The robot touches it, or it would slide into the robot.
        """
        ...

    def topple(self, index: int, about_rad: float) -> float:
        """Lay an object on its side, turned about a horizontal axis at this angle in B; how far its centre moved, m.

        Raises:
            NoRoom: The robot touches it or is in its way, or something is where it would lie.
        """
        ...

    def remove(self, index: int) -> None:
        """Take an object out of the container.

        Raises:
            NoRoom: The robot touches it.
        """
        ...

    def put_back(self, index: int) -> None:
        """Put a removed object where it was.

        Raises:
            NoRoom: Something is there.
        """
        ...

    def shift_container(self, shift_B_m: Array, yaw_rad: float) -> None:
        """Move the container, and all that stands in it, by (2,) m and an angle about its own z axis.

        Raises:
            NoRoom: The robot touches some of it or is in its way.
        """
        ...
