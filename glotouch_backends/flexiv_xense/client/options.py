"""What `--set name=value` may say to this backend, checked and as one value."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from glotouch_bt.robot import BadInput, ParamError, UnknownName

CHOICES = {
    "devices": ("real", "simulated"),
    "pace": ("lockstep", "real"),
    "wrench": ("raw", "filtered"),
    "mirror": ("right", "left", "none"),
    "link_loss": ("holds", "opens"),
    "api": ("", "1.9", "2.0"),
}
SIMULATED = {"robot": "Rizon4-000001", "gripper": "000000000001", "left_pad": "OG000001", "right_pad": "OG000002"}
"""Where the simulated devices answer unless told otherwise."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """One session's options.

    Attributes:
        devices: real or simulated.
        robot: Serial number of the arm, e.g. "Rizon4-123456".
        gripper: Its MAC or IP address, or serial:PORT; "none" for an arm without one.
        left_pad, right_pad: Serial numbers of the tactile sensors; both or none.
        network: Addresses of this machine's network interfaces the arm may be reached through, with commas.
        api: The vendor's interface, 1.9 or 2.0; by default the installed one's.
        wrench: raw (no filter delay) or filtered.
        feed_forward: Send velocities along with poses.
        mirror: The pad whose columns run along -x_P.
        link_loss: What the fitted gripper does when its link is lost.
        python: The interpreter that runs the driver (real devices need Python 3.10 with the vendor's packages).
        driver: tcp://HOST:PORT of a driver that runs already, instead of one of our own.
        keys: Folder with client.key_secret and driver.key, needed with `driver`.
        pace: Simulated devices only: lockstep (as fast as possible) or real (the wall's clock, as on hardware).
        log: File the driver appends its events to.
        simulated: Everything else, for the simulated world (layout, fixed, ...).
    """

    devices: str = "real"
    robot: str = ""
    gripper: str = ""
    left_pad: str = ""
    right_pad: str = ""
    network: tuple[str, ...] = ()
    api: str = ""
    wrench: str = "raw"
    feed_forward: bool = True
    mirror: str = "right"
    link_loss: str = "holds"
    python: str = sys.executable
    driver: str = ""
    keys: str = ""
    pace: str = "lockstep"
    log: str = ""
    simulated: Mapping[str, object] = field(default_factory=dict)

    @property
    def lockstep(self) -> bool:
        """True if time passes only in cycles."""
        return self.devices == "simulated" and self.pace == "lockstep"


SIMULATED_OPTIONS = ("fixed", "layout")
NAMES = tuple(f.name for f in fields(Options) if f.name != "simulated")


def _value(name: str, given: object) -> Any:
    if name == "network":
        return tuple(part.strip() for part in str(given).split(",") if part.strip())
    if name == "feed_forward":
        words = {"true": True, "false": False}
        if str(given).lower() not in words:
            raise ParamError(f"option {name}", given, "true or false")
        return words[str(given).lower()]
    text = str(given)
    if name in CHOICES and text not in CHOICES[name]:
        raise ParamError(f"option {name}", given, "one of " + ", ".join(c for c in CHOICES[name] if c))
    return text


def read_options(given: Mapping[str, object]) -> Options:
    """Check what was given.

    Raises:
        BadInput: An unknown option, a value that is none, or devices without their addresses.
    """
    known: dict[str, Any] = {}
    extra: dict[str, object] = {}
    for name, value in given.items():
        if name in NAMES:
            known[name] = _value(name, value)
        elif name in SIMULATED_OPTIONS:
            extra[name] = value
        else:
            raise UnknownName("option of backend flexiv_xense", name, (*NAMES, *SIMULATED_OPTIONS))
    if known.get("devices") != "simulated":
        return _real(Options(**known, simulated=extra), known)
    if "driver" in known:
        raise BadInput("option driver: simulated devices run in a driver of our own; leave it away")
    return Options(**(SIMULATED | known), simulated=extra)


def _real(options: Options, known: Mapping[str, object]) -> Options:
    if options.simulated:
        raise BadInput(f"option {next(iter(options.simulated))}: only simulated devices know it")
    if "pace" in known:
        raise BadInput("option pace: only simulated devices know it")
    if not options.robot:
        raise BadInput(
            "real devices need their addresses: --set robot=Rizon4-XXXXXX --set gripper=ADDRESS "
            "--set left_pad=SERIAL --set right_pad=SERIAL (see docs/guides/hardware.md), or --set devices=simulated"
        )
    if bool(options.left_pad) != bool(options.right_pad):
        raise BadInput("options left_pad and right_pad: both or none")
    if options.driver and not options.keys:
        raise BadInput("option driver: a driver on the network needs keys=DIR")
    if options.keys and not Path(options.keys).is_dir():
        raise BadInput(f"option keys: {options.keys} is no folder")
    return replace(options, gripper="" if options.gripper == "none" else options.gripper)
