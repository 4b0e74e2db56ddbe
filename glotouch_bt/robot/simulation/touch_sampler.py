"""Protocol for touching a simulated object that stands still, without a robot: geometry and sensors alone."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from glotouch_bt.robot.description import Gripper
from glotouch_bt.robot.geometry import Array
from glotouch_bt.robot.observation import GelImages, TactileFrame
from glotouch_bt.robot.scene import Mesh

Place = tuple[float, float, float]
"""(x m, y m, yaw rad) in the container frame K: of an object's frame O, or of the hand's x_P axis."""


@dataclass(frozen=True)
class SampledClosure:
    """One closure of the jaws.

    Attributes:
        aperture_m: Reported aperture.
        frame: Reported depth maps.
        place: Where the object stands afterwards: the jaws centre and align it.
        images: Gel images, if they were asked for and the gripper takes them.
    """

    aperture_m: float
    frame: TactileFrame
    place: Place
    images: GelImages | None = None


class TouchSampler(ABC):
    """Touches the objects of one trial. The same seed and conditions give the same objects and sensors as a run.

    Objects slide and turn on the floor while the jaws close. They do not tilt, and nothing is known about forces.

    Attributes:
        names: The objects.
        gripper: The hand that touches them.
    """

    names: tuple[str, ...]
    gripper: Gripper

    @abstractmethod
    def solid(self, name: str) -> Mesh:
        """Return the true solid as it stands at (0, 0, 0)."""

    @abstractmethod
    def probe_errors_m(self, approach: Array) -> Array:
        """Return the errors (n, 2) of the ball's measured centre, for contacts in the directions (n, 2)."""

    @abstractmethod
    def untouched(self) -> TactileFrame:
        """Return the maps of pads that touch nothing."""

    @abstractmethod
    def untouched_images(self) -> GelImages | None:
        """Return gel images of pads that touch nothing, or None if the gripper takes none."""

    @abstractmethod
    def close(
        self, name: str, place: Place, hand: Place, height_m: float, force_N: float, *, images: bool = False
    ) -> SampledClosure | None:
        """Close the jaws once.

        Args:
            name: The object.
            place: Where it stands.
            hand: The pads' mid-point and the direction of x_P.
            height_m: Pads' mid-point above the floor.
            force_N: Closing force that the gripper is asked for.
            images: Take gel images, too. They change neither the aperture nor the maps, of this closure or later ones.

        Returns:
            The closure, or None if a pad meets nothing or the object is wider than the jaws.
        """
