"""What can be done to simulated devices that cannot well be done to real ones; asked through the world's referee."""

from __future__ import annotations

from glotouch_backends.flexiv_xense.simulated.arm import SimulatedArm
from glotouch_backends.flexiv_xense.simulated.control_box import ControlBox
from glotouch_backends.flexiv_xense.simulated.vendor_api import GripperLink, PadLink
from glotouch_backends.mujoco.simulation import MujocoReferee, Simulated
from glotouch_bt.robot import UnknownName

COLLISION = 200101  # ours


class DisturbingReferee(MujocoReferee):
    """The referee of a simulated cell, who can also disturb it.

    Args:
        world: The world.
        box, gripper, pads: Its devices.
    """

    def __init__(self, world: Simulated, box: ControlBox, gripper: GripperLink, pads: tuple[PadLink, PadLink]) -> None:
        super().__init__(world)
        self._box, self._gripper, self._pads = box, gripper, pads

    def disturb(self, name: str) -> None:
        """Do it, from now on.

        Args:
            name: fault, estop, reduced: of the arm, which brakes. link: the arm's is lost, it brakes LINK_LOST_S later.
                frozen: the arm repeats its last state. gripper: its link is lost. pads frozen, pads missing: as named.

        Raises:
            UnknownName: None of these.
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
