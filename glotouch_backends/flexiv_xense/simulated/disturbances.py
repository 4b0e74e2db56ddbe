"""Disturbances of the simulated devices that real ones do not allow; requested through the world's referee."""

from __future__ import annotations

from glotouch_backends.flexiv_xense.simulated.control_box import ControlBox
from glotouch_backends.flexiv_xense.simulated.vendor_api import GripperLink, PadLink
from glotouch_backends.mujoco.simulation import MujocoReferee, Simulated
from glotouch_bt.robot import UnknownName

NAMES = ("fault", "estop", "reduced", "link", "frozen", "gripper", "pads frozen", "pads missing")
COLLISION = 200101
"""Number of the collision event. Source: ours."""


class DisturbingReferee(MujocoReferee):
    """A referee that can also disturb the devices.

    Args:
        world: The world.
        box, gripper, pads: The devices.
    """

    def __init__(self, world: Simulated, box: ControlBox, gripper: GripperLink, pads: tuple[PadLink, PadLink]) -> None:
        super().__init__(world)
        self._box, self._gripper, self._pads = box, gripper, pads

    def disturb(self, name: str) -> None:
        """Start a disturbance.

        Args:
            name: fault, estop, reduced: state of the arm, which brakes. link: the arm's link is lost, and it brakes
                LINK_LOST_S later. frozen: the arm repeats its last state. gripper: the gripper's link is lost.
                pads frozen, pads missing: as named.

        Raises:
            UnknownName: There is no such disturbance.
        """
        box = self._box
        match name:
            case "fault":
                box.fail(COLLISION, "a collision has been detected")
            case "estop":
                box.estop_released = box.enabled = False
                box.halt()
            case "reduced":
                box.reduced = True
                box.halt()
            case "link":
                box.linked = False
                box.arm.lose_link()
            case "frozen":
                box.frozen = True
            case "gripper":
                self._gripper.linked = False
            case "pads frozen":
                for pad in self._pads:
                    pad.frozen = True
            case "pads missing":
                for pad in self._pads:
                    pad.missing = True
            case _:
                raise UnknownName("disturbance", name, NAMES)
