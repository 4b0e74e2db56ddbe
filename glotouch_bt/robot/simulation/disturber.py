"""Interface through which faults change a simulated world. Only `faults` and `bench` may import it."""

from __future__ import annotations

from typing import Protocol

from glotouch_bt.robot.geometry import Array


class PathBlocked(Exception):
    """The robot touches the body to move, or something is in its way. Nothing was changed; try again later."""


class Disturber(Protocol):
    """Changes that a simulation can make to its world on request. Objects are numbered by their index.

    No body is moved through the robot, out of its jaws or into another body: such a change raises `PathBlocked` and can
        be
    requested again later. A force from a body that jumps into the hand would be an artefact of the simulation.
    """

    def places_B_m(self) -> Array:
        """Return the objects' centres of mass (n, 3) in B."""
        ...

    def shove(self, index: int, velocity_B_m_s: Array) -> None:
        """Give an object a velocity (2,) in the xy plane of B, as a knock does; friction ends it.

        Raises:
            PathBlocked: The robot touches it, or it would slide into the robot.
        """
        ...

    def topple(self, index: int, about_rad: float) -> float:
        """Lay an object on its side about a horizontal axis at this angle in B; return how far its centre moved, m.

        Raises:
            PathBlocked: The robot touches it or is in its way, or something is where it would lie.
        """
        ...

    def remove(self, index: int) -> None:
        """Take an object out of the container.

        Raises:
            PathBlocked: The robot touches it.
        """
        ...

    def put_back(self, index: int) -> None:
        """Return a removed object to its place.

        Raises:
            PathBlocked: Something is there.
        """
        ...

    def shift_container(self, shift_B_m: Array, yaw_rad: float) -> None:
        """Move the container with its content by (2,) m and by an angle about its own z axis.

        Raises:
            PathBlocked: The robot touches a part of it or is in its way.
        """
        ...
