"""Connect the devices in the order the vendors require, with bounded waits; release them on every path."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from ..clock import Clock
from ..faults import DeviceFault, vendor_call
from ..messages import Open
from .arm import DriverArm
from .arm_19 import Arm19
from .arm_20 import Arm20
from .gripper import DriverGripper, open_gripper
from .pads import TactileSensors, open_sensor
from .vendor import Served, Vendor, load_vendor

APIS = {"1.9": Arm19, "2.0": Arm20}


@dataclass
class Connected:
    """The devices of one session."""

    clock: Clock
    arm: DriverArm
    gripper: DriverGripper | None
    pads: TactileSensors | None
    vendor: Vendor

    def release(self) -> None:
        """Stop the arm (it ends in IDLE and holds itself); release gripper and sensors. Never raises."""
        with suppress(DeviceFault):  # otherwise the arm has stopped by its own fault, or is unreachable
            self.arm.idle()
        if self.gripper is not None:
            self.gripper.release()
        if self.pads is not None:
            self.pads.release()


def api_of(rdk: Any, wanted: str) -> type[DriverArm]:
    """Return the adapter of the installed flexivrdk.

    Raises:
        DeviceFault: The version has no adapter.
    """
    version = wanted or ".".join(str(getattr(rdk, "__version__", "")).split(".")[:2])
    if not wanted and not version:
        version = "2.0" if hasattr(rdk, "JointGroup") else "1.9"
    if version in APIS:
        return APIS[version]
    why = "; 2.1 has dropped the Rizon arms" if version == "2.1" else ""
    raise DeviceFault("connect", f"flexivrdk {version} is not supported (supported: {', '.join(APIS)}){why}")


def connect_devices(request: Open, served: Served, progress: Callable[[str], None]) -> Connected:
    """Connect all devices and, unless the request only observes, make them ready for the first setpoint.

    Raises:
        DeviceFault: The client expects other devices, or one did not come up; the others have been released.
    """
    s, world = request.devices.settings, request.devices.world
    if (request.devices.kind == "real") != (served.kind == "real") or (world and served.kind != "simulated"):
        raise DeviceFault("connect", f"this driver serves {served.kind} devices only; the client asked for others")
    gripper = "" if s.gripper == "none" else s.gripper
    vendor = load_vendor(served, world, gripper=bool(gripper), pads=bool(s.left_pad))
    clock, rdk = vendor.clock, vendor.flexivrdk
    adapter = api_of(rdk, s.api)
    progress(f"connecting to the arm {s.robot}")
    with vendor_call(f"connecting to the arm {s.robot!r}", "connect"):
        robot = rdk.Robot(s.robot, list(s.network), False)
    arm = adapter(rdk, robot, clock, request)
    connected = Connected(clock, arm, None, None, vendor)
    try:
        if gripper:
            progress(f"connecting to the gripper {gripper}")
            device = open_gripper(vendor.xensegripper, gripper)
            connected.gripper = DriverGripper(device, clock, request.hand, s.link_loss)
            connected.gripper.wait_for_status()
        if s.left_pad:
            progress("opening the tactile sensors")
            left, right = (open_sensor(vendor.xensesdk, serial) for serial in (s.left_pad, s.right_pad))
            connected.pads = TactileSensors(vendor.xensesdk, (left, right), clock, request.hand, s.mirror)
        if request.move:
            arm.enable(progress)
            arm.ready(progress)
    except BaseException:
        if request.move:
            connected.release()
        raise
    return connected
