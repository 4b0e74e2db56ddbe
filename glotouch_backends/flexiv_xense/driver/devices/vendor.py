"""The vendors' modules, real or simulated; no other file distinguishes them."""

from __future__ import annotations

import importlib
import sys
from dataclasses import dataclass
from typing import Any, Literal, cast

from ..clock import Clock, WallClock
from ..faults import DeviceFault

SIMULATED = "glotouch_backends.flexiv_xense.simulated"


@dataclass(frozen=True)
class Served:
    """The devices that a driver serves; its command line says so, never a client.

    Attributes:
        kind: real; simulated: a world in this process that its clock advances; cell: a world in a process of its own on
            wall time.
        cell: Socket of the cell.
    """

    kind: Literal["real", "simulated", "cell"] = "real"
    cell: str = ""


@dataclass(frozen=True)
class Vendor:
    """The vendors' modules: interfaces of the arm, the pads and the gripper; and the clock of their devices."""

    flexivrdk: Any
    xensesdk: Any
    xensegripper: Any
    clock: Clock


def _module(name: str, needed: bool) -> Any:
    if not needed:
        return None
    try:
        return importlib.import_module(name)
    except ImportError as e:
        why = f"the vendor's package {name!r} cannot be imported by {sys.executable} ({e})"
        raise DeviceFault("connect", f"{why}; choose an interpreter that has it by --set python=INTERPRETER") from e


def load_vendor(served: Served, world: bytes = b"", *, gripper: bool = True, pads: bool = True) -> Vendor:
    """Load the vendors' modules.

    Args:
        served: The devices of this driver.
        world: From the client, for devices that this process simulates.
        gripper, pads: False if there is none; then its package need not be installed.

    Raises:
        DeviceFault: A package is not installed, or the world cannot be built.
    """
    if served.kind == "real":
        return Vendor(
            _module("flexivrdk", True),
            _module("xensesdk", pads),
            _module("xensegripper", gripper),
            WallClock(),
        )
    try:
        simulated = importlib.import_module(SIMULATED)
    except ImportError as e:
        raise DeviceFault("connect", f"simulated devices need the whole project installed here: {e}") from e
    try:
        if served.kind == "cell":
            return cast("Vendor", simulated.open_remote_vendor(served.cell))
        return cast("Vendor", simulated.open_vendor(world))
    except simulated.UNUSABLE as e:
        raise DeviceFault("input", str(e)) from e
    except Exception as e:
        raise DeviceFault("world", f"the simulated world cannot be opened: {type(e).__name__}: {e}") from e
