"""Options of the backend `flexiv_xense`; those of the devices are declared in the driver's `DeviceSettings`."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal

from glotouch_backends.flexiv_xense.driver import messages
from glotouch_backends.options import WorldOptions, convert_options
from glotouch_bt.robot import BadInput

SIMULATED = {"robot": "Rizon4-000001", "gripper": "000000000001", "left_pad": "OG000001", "right_pad": "OG000002"}
"""Default addresses of the simulated devices."""
SIMULATED_ONLY = ("pace", *(f.name for f in fields(WorldOptions)))
"""Options that real devices do not have."""


@dataclass(frozen=True, kw_only=True)
class ClientOptions(WorldOptions):
    """Options that the client itself uses.

    Attributes:
        devices: real or simulated.
        python: Interpreter that runs the driver (real devices need Python 3.10 with the vendors' packages).
        driver: tcp://HOST:PORT of a running driver, instead of starting one.
        keys: Folder with client.key_secret and driver.key, needed with `driver`.
        pace: Simulated devices only: lockstep (as fast as possible) or real (wall time, as on hardware).
        log: File to which the driver appends its events.
    """

    devices: Literal["real", "simulated"] = "real"
    python: str = sys.executable
    driver: str = ""
    keys: str = ""
    pace: Literal["lockstep", "real"] = "lockstep"
    log: str = ""

    @property
    def lockstep(self) -> bool:
        """True if time passes only in cycles."""
        return self.devices == "simulated" and self.pace == "lockstep"

    @property
    def world(self) -> WorldOptions:
        """The options of the simulated world."""
        return WorldOptions(**{f.name: getattr(self, f.name) for f in fields(WorldOptions)})


def read_options(given: Mapping[str, object]) -> tuple[ClientOptions, messages.DeviceSettings]:
    """Check and convert the options of one session.

    Raises:
        BadInput: An unknown option, an invalid value, or real devices without their addresses.
    """
    values = convert_options("flexiv_xense", given, ClientOptions, messages.DeviceSettings)
    simulated = values.get("devices") == "simulated"
    if simulated:
        values = SIMULATED | values
    own = {f.name for f in fields(ClientOptions)}
    options = ClientOptions(**{name: value for name, value in values.items() if name in own})
    settings = messages.DeviceSettings(**{name: value for name, value in values.items() if name not in own})
    if not simulated:
        _check_real(options, settings, given)
    elif options.driver:
        raise BadInput("option driver: simulated devices run in a driver of our own; leave the option out")
    return options, settings


def _check_real(options: ClientOptions, settings: messages.DeviceSettings, given: Mapping[str, object]) -> None:
    for name in SIMULATED_ONLY:
        if name in given:
            raise BadInput(f"option {name}: only simulated devices have it")
    if not settings.robot:
        raise BadInput(
            "real devices need their addresses: --set robot=Rizon4-XXXXXX --set gripper=ADDRESS "
            "--set left_pad=SERIAL --set right_pad=SERIAL (see docs/guides/hardware.md), or --set devices=simulated"
        )
    if bool(settings.left_pad) != bool(settings.right_pad):
        raise BadInput("options left_pad and right_pad: give both or none")
    if options.driver and not options.keys:
        raise BadInput("option driver: a driver on the network needs keys=DIR")
    if options.keys and not Path(options.keys).is_dir():
        raise BadInput(f"option keys: {options.keys} is not a folder")
