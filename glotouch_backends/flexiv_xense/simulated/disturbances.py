"""Disturbances of the simulated devices that real ones do not allow; requested through the world's referee."""

from __future__ import annotations

from glotouch_backends.flexiv_xense.simulated.arm import SimulatedArm
from glotouch_backends.flexiv_xense.simulated.control_box import ControlBox
from glotouch_backends.flexiv_xense.simulated.vendor_api import GripperLink, PadLink
from glotouch_backends.mujoco.simulation import MujocoReferee, Simulated
from glotouch_bt.robot import UnknownName

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
        ways = {
            "fault": self._fault,
            "estop": self._estop,
            "reduced": self._reduced,
            "link": self._link,
            "frozen": self._frozen,
            "gripper": self._gripper_link,
            "pads frozen": self._pads_frozen,
            "pads missing": self._pads_missing,
        }
        if name not in ways:
            raise UnknownName("disturbance", name, ways)
        ways[name]()

    @property
    def _arm(self) -> SimulatedArm:
        return self._box.arm

    def _fault(self) -> None:
        self._box.fail(COLLISION, "a collision has been detected")

    def _estop(self) -> None:
        self._box.estop_released = self._box.enabled = False
        self._box.halt()

    def _reduced(self) -> None:
        self._box.reduced = True
        self._box.halt()

    def _link(self) -> None:
        self._box.linked = False
        self._arm.lose_link()

    def _frozen(self) -> None:
        self._box.frozen = True

    def _gripper_link(self) -> None:
        self._gripper.linked = False

    def _pads_frozen(self) -> None:
        for pad in self._pads:
            pad.frozen = True

    def _pads_missing(self) -> None:
        for pad in self._pads:
            pad.missing = True
