"""Disturbances of the simulated devices that real ones do not allow; requested through the world's referee."""

from __future__ import annotations

import numpy as np

from glotouch_backends.flexiv_xense.driver import messages
from glotouch_backends.flexiv_xense.simulated.control_box import ControlBox
from glotouch_backends.flexiv_xense.simulated.vendor_api import GripperLink, PadLink
from glotouch_backends.mujoco.simulation import MujocoReferee, Simulated
from glotouch_backends.trial_message import pose_numbers
from glotouch_bt.robot import UnknownName
from glotouch_bt.robot.scene import AXES

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

    def answer(self, request: messages.RefereeRequest) -> messages.RefereeAnswer:
        """Answer a client's question."""
        numbers: tuple[float, ...] = ()
        bodies: list[messages.TrueBody] = []
        match request.method:
            case "objects":
                for o in self.objects():
                    pose, outline = pose_numbers(o.pose_B_O), tuple((x, y) for x, y in o.outline_B_m.tolist())
                    x, y, z = o.size_m.tolist()
                    bodies.append(messages.TrueBody(o.name, pose, o.mass_kg, outline, o.in_gripper, (x, y, z)))
            case "pose_B_K":
                numbers = pose_numbers(self.pose_B_K())
            case "tip_B_m":
                numbers = tuple(self.tip_B_m().tolist())
            case "push_tip":
                self.push_tip(np.array(request.force_B_N))
            case "probe_in_holder":
                numbers = (float(self.probe_in_holder()),)
            case "peak_force_N":
                numbers = (self.peak_force_N(),)
            case "samples_over_limit":
                numbers = (float(self.samples_over_limit()),)
            case "contact_softness_s":
                numbers = (self.contact_softness_s(),)
            case "silent_axes":
                numbers = tuple(float(AXES.index(axis)) for axis in self.silent_axes())
            case "disturb":
                self.disturb(request.name)
        return messages.RefereeAnswer(number=request.number, numbers=numbers, objects=tuple(bodies))

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
