"""The vendors' modules over one simulated world."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

from backends.flexiv_xense.driver.clock import SteppedClock
from backends.flexiv_xense.simulated import flexivrdk
from backends.flexiv_xense.simulated.control_box import ControlBox
from backends.flexiv_xense.simulated.world import SimulatedWorld

ROBOT_SN = "Rizon4-000001"


@dataclass(frozen=True)
class SimulatedVendor:
    """What `driver.vendor.Vendor` asks for, and the world behind it.

    Attributes:
        flexivrdk, xensesdk, xensegripper: Namespaces with the vendors' names.
        clock: Sleeping on it advances the world.
        world: The world.
        box: The arm's control box.
    """

    flexivrdk: Any
    xensesdk: Any
    xensegripper: Any
    clock: SteppedClock
    world: SimulatedWorld
    box: ControlBox


def open_vendor(world_blob: bytes) -> SimulatedVendor:
    """The vendors' modules over a world of its own in this process.

    Args:
        world_blob: Pickle of (World, Conditions, seed, options).
    """
    world = SimulatedWorld.unpickle(world_blob)
    clock = SteppedClock(world.advance)
    box = ControlBox(ROBOT_SN, world.arm, clock)
    names = {name: getattr(flexivrdk, name) for name in flexivrdk.__all__}
    names["Robot"] = type("Robot", (flexivrdk.Robot,), {"_boxes": {ROBOT_SN: box}, "__doc__": flexivrdk.Robot.__doc__})
    return SimulatedVendor(SimpleNamespace(**names), None, None, clock, world, box)
