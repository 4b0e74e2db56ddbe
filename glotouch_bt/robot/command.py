"""Commands for one control period, and slow requests that are started and polled."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from glotouch_bt.errors import ParamError
from glotouch_bt.robot.geometry import Array, Pose, frozen_array


@dataclass(frozen=True, slots=True)
class JointSetpoint:
    """Joint state to reach at the END of the next control period.

    The backend interpolates from the previous setpoint (cubic Hermite, so position and velocity are continuous).

    Attributes:
        q: (dof,) rad.
        dq: (dof,) rad/s.
        ddq: (dof,) rad/s2, feed-forward.
        pose_B_P: Pose of P that `q` realises; sent to Cartesian devices.
    """

    q: Array
    dq: Array
    ddq: Array
    pose_B_P: Pose


@dataclass(frozen=True, slots=True)
class GripperTarget:
    """Drive the jaws to an aperture with limited speed and force.

    Attributes:
        aperture_m: 0 closed .. the gripper's stroke.
        speed_m_s: Largest jaw closing or opening speed (rate of the aperture).
        force_N: Largest force of one jaw.
    """

    aperture_m: float
    speed_m_s: float
    force_N: float


@dataclass(frozen=True, slots=True)
class Command:
    """One control period's command.

    Attributes:
        motion: A joint setpoint, or None to hold the last setpoint at rest.
        gripper: A new gripper target, or None to keep the last one.
        tactile: Request depth maps; they cost computing time, so request them only while squeezing.
        images: Request ONE pair of gel images, taken at the next frame of the sensors. It arrives once, periods later.
            Only a gripper with a `GelCamera` takes them; another robot ignores the request.
    """

    motion: JointSetpoint | None = None
    gripper: GripperTarget | None = None
    tactile: bool = False
    images: bool = False


HOLD = Command()


@dataclass(frozen=True, slots=True)
class Tare:
    """Zero the wrist force sensor: average `duration_s` of samples at rest and subtract them from now on."""

    duration_s: float = 0.2

    def __post_init__(self) -> None:
        if not (math.isfinite(self.duration_s) and self.duration_s > 0):
            raise ParamError("tare.duration_s", self.duration_s, "finite and positive")


@dataclass(frozen=True)
class SetPayload:
    """Tell the controller the payload in the hand, so that it compensates its weight.

    Attributes:
        mass_kg: Mass beyond the gripper itself.
        com_P_m: (3,) centre of mass in P.
    """

    mass_kg: float
    com_P_m: Array

    def __post_init__(self) -> None:
        if not (math.isfinite(self.mass_kg) and self.mass_kg >= 0):
            raise ParamError("payload.mass_kg", self.mass_kg, "finite and not negative")
        object.__setattr__(self, "com_P_m", frozen_array("com_P_m", self.com_P_m, (3,)))


Request = Tare | SetPayload


class Ticket(Protocol):
    """State of a slow request. Poll it between cycles; time passes only in `Robot.cycle`."""

    @property
    def done(self) -> bool:
        """True once the request has succeeded or failed."""
        ...

    @property
    def error(self) -> str | None:
        """Reason of the failure, or None."""
        ...


@dataclass
class PendingTicket:
    """A `Ticket` that a robot completes."""

    done: bool = False
    error: str | None = None
