"""Messages between client and driver: msgpack over one socket. SI units; frames as in `frames`.

The driver answers each request once, with the request's number; heartbeats have no number. A message that cannot be
decoded is refused.
"""

from __future__ import annotations

from typing import Literal

import msgspec

PROTOCOL = 2
"""Version of the messages; client and driver must have the same."""
COLUMNS = 7 + 7 + 3 + 4 + 6
"""Columns of a sample: q, dq, position of P in B, quaternion of P in B (w x y z), wrench in S."""

Numbers = tuple[float, ...]


class ToolData(msgspec.Struct, frozen=True, kw_only=True):
    """The tool on the flange: the bare hand.

    Attributes:
        mass_kg, com_E_m: Mass and centre of mass (3,) beyond the flange, without a payload.
        pose_E_P: (7,) P, the arm's TCP, in the flange frame: x y z qw qx qy qz.
    """

    mass_kg: float
    com_E_m: Numbers
    pose_E_P: Numbers


class ArmLimits(msgspec.Struct, frozen=True, kw_only=True):
    """Limits that the driver itself enforces.

    Attributes:
        q_min, q_max, dq_max: (7,) rad, rad/s.
        speed_m_s, acceleration_m_s2: Commanded motion of P; a stop may use `stop_acceleration_m_s2`.
        force_N, torque_Nm: Norms of the contact wrench in S at which the arm stops.
        max_age_s: Largest age of a reading.
    """

    q_min: Numbers
    q_max: Numbers
    dq_max: Numbers
    speed_m_s: float
    acceleration_m_s2: float
    stop_acceleration_m_s2: float
    force_N: float
    torque_Nm: float
    max_age_s: float


class HandLimits(msgspec.Struct, frozen=True, kw_only=True):
    """Ranges of the gripper and its pads."""

    stroke_m: float
    speed_m_s: float
    force_N: float
    pad_shape: tuple[int, int]
    pad_depth_m: float


class DeviceSettings(msgspec.Struct, frozen=True, kw_only=True):
    """Options of the devices; a user sets each by `--set name=value`.

    Attributes:
        robot: Serial number of the arm, e.g. "Rizon4-123456".
        gripper: MAC or IP address, or serial:PORT; "none" or empty for an arm without one.
        left_pad, right_pad: Serial numbers of the tactile sensors; both or none.
        network: Addresses of this machine's interfaces through which the arm may be reached; empty: any.
        api: Flexiv interface; empty: that of the installed version.
        wrench: raw (no filter delay) or filtered.
        feed_forward: Send the setpoint's velocity along with its pose.
        mirror: Pad whose columns run along -x_P.
        link_loss: Behaviour of the fitted gripper when its link is lost. This describes the device; it sets nothing.
    """

    robot: str = ""
    gripper: str = ""
    left_pad: str = ""
    right_pad: str = ""
    network: tuple[str, ...] = ()
    api: Literal["", "1.9", "2.0"] = ""
    wrench: Literal["raw", "filtered"] = "raw"
    feed_forward: bool = True
    mirror: Literal["right", "left", "none"] = "right"
    link_loss: Literal["holds", "opens"] = "holds"


class Devices(msgspec.Struct, frozen=True, kw_only=True):
    """The devices of a session.

    Attributes:
        kind: "real", "simulated" (in this process, in lock-step) or "cell" (simulated, in a process of its own).
        settings: Addresses and options.
        world: Simulated only: the file with the world, or the cell's address.
    """

    kind: str
    settings: DeviceSettings = DeviceSettings()
    world: str = ""


class Setpoint(msgspec.Struct, frozen=True, array_like=True):
    """State of the arm at the end of the next period.

    Attributes:
        q, dq: (7,) planned joints, for the checks.
        pose: (7,) of P in B, x y z qw qx qy qz.
        twist: (6,) of P, linear and angular, written in B.
    """

    q: Numbers
    dq: Numbers
    pose: Numbers
    twist: Numbers


class JawTarget(msgspec.Struct, frozen=True, array_like=True):
    """Gripper target: aperture m, speed m/s, force N."""

    aperture_m: float
    speed_m_s: float
    force_N: float


class _Numbered(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """A request with its number, or the answer to the request of that number."""

    number: int


# -- requests ----------------------------------------------------------------------------------------------------------


class Open(_Numbered, frozen=True, kw_only=True):
    """Connect to the devices and make them ready; the first request."""

    protocol: int
    devices: Devices
    tool: ToolData
    arm: ArmLimits
    hand: HandLimits
    posture: Numbers
    period_s: float
    lockstep: bool
    move: bool = True  # False: observe only; nothing is enabled, switched or commanded


class Cycle(_Numbered, frozen=True, kw_only=True):
    """Run one control period."""

    setpoint: Setpoint | None = None
    jaws: JawTarget | None = None
    tactile: bool = False


class TareRequest(_Numbered, frozen=True, kw_only=True):
    """Zero the wrist sensor. The answer is `Accepted`; a later block reports the end."""

    ticket: int
    duration_s: float


class PayloadRequest(_Numbered, frozen=True, kw_only=True):
    """Set the payload, with its centre of mass (3,) in P. Answered like a tare."""

    ticket: int
    mass_kg: float
    com_P_m: Numbers


class HoldRequest(_Numbered, frozen=True):
    """Stop the arm."""


class RefereeRequest(_Numbered, frozen=True, kw_only=True):
    """Simulated devices only: a question to the world's referee, which alone can decode it."""

    question: bytes


class Quit(_Numbered, frozen=True):
    """Stop the arm, release the devices, end the process."""


class Beat(msgspec.Struct, frozen=True, tag=True):
    """Heartbeat, in both directions."""


# -- answers -----------------------------------------------------------------------------------------------------------


class ArmEvent(msgspec.Struct, frozen=True, array_like=True):
    """An entry of the arm's event log: level, id, description, advice."""

    level: str
    id: int
    description: str
    advice: str = ""


class JawState(msgspec.Struct, frozen=True, array_like=True):
    """Last report of the gripper, with the time at which it was read."""

    stamp_s: float
    aperture_m: float
    force_N: float
    moving: bool


class Maps(msgspec.Struct, frozen=True, array_like=True):
    """Depth maps in metres as float64 bytes: row 0 nearest the flange, columns along +x_P for both."""

    stamp_s: float
    rows: int
    columns: int
    left: bytes
    right: bytes


class Done(msgspec.Struct, frozen=True, array_like=True):
    """A slow request has ended; `error` is empty if it succeeded."""

    ticket: int
    error: str = ""


class Opened(_Numbered, frozen=True, kw_only=True):
    """The devices are ready. `info` is for display; q_min and q_max are the device's own limits."""

    info: dict[str, str]
    q_min: Numbers
    q_max: Numbers


class OpenProgress(msgspec.Struct, frozen=True, tag=True):
    """Present step of opening."""

    text: str


class Block(_Numbered, frozen=True, kw_only=True):
    """Readings since the last block.

    Attributes:
        stamps: float64 bytes (n,), driver clock at which each sample was measured.
        samples: float64 bytes (n, COLUMNS).
        late: Control periods without a command since the last block.
        stop: (quantity, value, limit, stamp s) if the hard limit has tripped.
        sent_s, read_s: `time.monotonic` when the arm had received the command, and when the newest sample was read; for
            measuring latencies on one machine.
    """

    stamps: bytes
    samples: bytes
    jaws: JawState
    maps: Maps | None = None
    done: tuple[Done, ...] = ()
    late: int = 0
    stop: tuple[str, float, float, float] | None = None
    sent_s: float = 0.0
    read_s: float = 0.0


class Accepted(_Numbered, frozen=True):
    """The request was started or done."""


class Refused(_Numbered, frozen=True, kw_only=True):
    """The command is invalid; nothing was sent to the device, and the arm holds."""

    name: str
    value: str
    rule: str


class Failed(_Numbered, frozen=True, kw_only=True):
    """A device failed. `kind`: connect, fault, state, link, stale, vendor, world."""

    kind: str
    message: str
    cause: str = ""
    events: tuple[ArmEvent, ...] = ()
    age_s: float = 0.0
    limit_s: float = 0.0


class RefereeAnswer(_Numbered, frozen=True, kw_only=True):
    """Answer of the referee."""

    answer: bytes


Request = Open | Cycle | TareRequest | PayloadRequest | HoldRequest | RefereeRequest | Quit | Beat
Answer = Opened | OpenProgress | Block | Accepted | Refused | Failed | RefereeAnswer | Beat

encode = msgspec.msgpack.Encoder().encode
decode_request = msgspec.msgpack.Decoder(Request).decode
decode_answer = msgspec.msgpack.Decoder(Answer).decode
