"""Bringing the devices up, in the order the vendor wants, with every wait bounded; and down again on every path."""

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
from .vendor import Vendor, load_vendor

APIS = {"1.9": Arm19, "2.0": Arm20}


@dataclass
class Connected:
    """The devices of one session; `referee` only where they are simulated."""

    clock: Clock
    arm: DriverArm
    gripper: DriverGripper | None
    pads: TactileSensors | None
    vendor: Vendor

    def release(self) -> None:
        """Stop the arm (it ends in IDLE, holding itself), let go of gripper and sensors. Never raises."""
        with suppress(DeviceFault):  # else it stands by its own fault, or is out of reach
            self.arm.idle()
        if self.gripper is not None:
            self.gripper.release()
        if self.pads is not None:
            self.pads.release()


def api_of(rdk: Any, wanted: str) -> type[DriverArm]:
    """The adapter for an installed flexivrdk.

    Raises:
        DeviceFault: A version we have none for; says why where we know.
    """
    version = wanted or ".".join(str(getattr(rdk, "__version__", "")).split(".")[:2])
    if not wanted and not version:
        version = "2.0" if hasattr(rdk, "JointGroup") else "1.9"
    if version in APIS:
        return APIS[version]
    why = "; 2.1 has dropped the Rizon arms" if version == "2.1" else ""
    raise DeviceFault("connect", f"flexivrdk {version} is not supported (supported: {', '.join(APIS)}){why}")


def connect_devices(request: Open, progress: Callable[[str], None]) -> Connected:
    """Everything up and, unless the request only looks, ready for the first setpoint.

    Raises:
        DeviceFault: What did not come up; what had come up has been released again.
    """
    d = request.devices
    vendor = load_vendor(d.kind, d.world, gripper=bool(d.gripper), pads=bool(d.pads))
    clock, rdk = vendor.clock, vendor.flexivrdk
    adapter = api_of(rdk, d.api)
    progress(f"connecting to the arm {d.robot}")
    with vendor_call(f"connecting to the arm {d.robot!r}", "connect"):
        robot = rdk.Robot(d.robot, list(d.network), False)
    arm = adapter(
        rdk,
        robot,
        clock,
        request.tool,
        request.arm,
        request.posture,
        raw=d.wrench == "raw",
        feed_forward=d.feed_forward,
    )
    connected = Connected(clock, arm, None, None, vendor)
    try:
        if d.gripper:
            progress(f"connecting to the gripper {d.gripper}")
            connected.gripper = DriverGripper(
                open_gripper(vendor.xensegripper, d.gripper), clock, request.hand, d.link_loss
            )
            connected.gripper.wait_for_status()
        if d.pads:
            progress("opening the tactile sensors")
            left, right = (open_sensor(vendor.xensesdk, serial) for serial in d.pads)
            connected.pads = TactileSensors(vendor.xensesdk, (left, right), clock, request.hand, d.mirror)
        if request.move:
            arm.enable(progress)
            arm.ready(progress)
    except BaseException:
        if request.move:
            connected.release()
        raise
    return connected
