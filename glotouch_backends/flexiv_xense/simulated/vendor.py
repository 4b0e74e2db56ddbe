"""The vendors' modules over one simulated world."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

from glotouch_backends.flexiv_xense.driver import Clock, SteppedClock, Vendor, messages
from glotouch_backends.flexiv_xense.simulated.control_box import ControlBox
from glotouch_backends.flexiv_xense.simulated.disturbances import DisturbingReferee
from glotouch_backends.flexiv_xense.simulated.vendor_api import GripperLink, PadLink, flexivrdk, xensegripper, xensesdk
from glotouch_backends.flexiv_xense.simulated.world import SimulatedWorld
from glotouch_bt.robot import BadInput

ROBOT_SN = "Rizon4-000001"
GRIPPER_ADDRESS = "000000000001"  # network address and serial port
PAD_SNS = ("OG000001", "OG000002")  # left, right
UNUSABLE = BadInput
"""Error of a world that cannot be built, for a driver that imports nothing else of this project."""


@dataclass(frozen=True)
class SimulatedVendor(Vendor):
    """The vendors' modules with the simulated devices behind them. Sleeping on the clock advances the world."""

    world: SimulatedWorld
    box: ControlBox
    gripper: GripperLink
    pads: tuple[PadLink, PadLink]

    def referee(self, request: messages.RefereeRequest) -> messages.RefereeAnswer:
        """Ask the world's referee."""
        return DisturbingReferee(self.world, self.box, self.gripper, self.pads).answer(request)


def bound(cls: type[Any], **values: object) -> Any:
    """Return a subclass of a stand-in that is bound to one world and has the vendor's name."""
    return type(cls.__name__, (cls,), {"__doc__": cls.__doc__, **values})


def modules(box: ControlBox, gripper: GripperLink, pads: tuple[PadLink, PadLink]) -> tuple[Any, Any, Any]:
    """Return `flexivrdk`, `xensesdk` and `xensegripper` over these devices."""
    arm = {name: getattr(flexivrdk, name) for name in flexivrdk.__all__}
    arm["Robot"] = bound(flexivrdk.Robot, _boxes={box.serial: box})
    links = {GRIPPER_ADDRESS: gripper}
    tcp = bound(xensegripper.XenseTCPGripper, _links=links)
    serial = bound(xensegripper.XenseSerialGripper, _links=links)
    either = bound(xensegripper.XenseGripper, _tcp=tcp, _serial=serial)
    inner = SimpleNamespace(XenseGripper=either, XenseTCPGripper=tcp, XenseSerialGripper=serial)
    sensor = bound(xensesdk.Sensor, _links=dict(zip(PAD_SNS, pads, strict=True)))
    return (
        SimpleNamespace(**arm),
        SimpleNamespace(Sensor=sensor),
        SimpleNamespace(XenseGripper=either, xense_gripper=inner),
    )


def open_vendor(message: bytes) -> SimulatedVendor:
    """Return the vendors' modules over a new world in this process.

    Args:
        message: From `trial_message`.

    Raises:
        BadInput: The world cannot be built from it.
        BackendError: MuJoCo failed.
    """
    world = SimulatedWorld.of_message(message)
    return assemble(world, SteppedClock(world.advance))


def assemble(world: SimulatedWorld, clock: Clock) -> SimulatedVendor:
    """Return the vendors' modules over a world that advances with a clock."""
    box = ControlBox(ROBOT_SN, world.arm, clock)
    gripper = GripperLink(world.hand, clock)
    pads = PadLink(world.hand, clock, right=False, camera=0), PadLink(world.hand, clock, right=True, camera=1)
    return SimulatedVendor(*modules(box, gripper, pads), clock, world, box, gripper, pads)
