"""Messages between client and driver: msgpack over one socket. SI units; frames as in `frames`.

The driver answers each request once, with the request's number; heartbeats have no number. A message that cannot be
decoded is refused. No message names a file or a program: addresses of devices are serial numbers, network addresses and
serial ports.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal

import msgspec

PROTOCOL = 7
"""Version of the messages; client and driver must have the same."""
MAX_REQUEST_BYTES = 64 * 1024
"""Largest request without the world of simulated devices; `Open` with all its limits has 1 kB. Source: ours."""
MAX_WORLD_BYTES = 64 * 1024 * 1024
"""Largest world of simulated devices; the shipped objects have 1 MB in all. Source: ours."""
MAX_ANSWER_BYTES = 64 * 1024 * 1024
"""Largest answer: a minute of samples has 13 MB, the largest pair of depth maps 16 MB."""
COLUMNS = 7 + 7 + 3 + 4 + 6
"""Columns of a sample: q, dq, position of P in B, quaternion of P in B (w x y z), wrench in S."""

Numbers = tuple[float, ...]
Three = Annotated[Numbers, msgspec.Meta(min_length=3, max_length=3)]
Seven = Annotated[Numbers, msgspec.Meta(min_length=7, max_length=7)]
Gripper = Annotated[
    str, msgspec.Meta(max_length=200, pattern=r"^(serial:(/dev/(tty|cu\.|serial/by-(id|path)/))?)?[\w.:+-]*\Z")
]
"""Address of a gripper: one word, or a serial port; any other path is refused."""
PixelCount = Annotated[int, msgspec.Meta(ge=1, le=1000)]
# Ranges of the limits that a client sets: none may be so large, or NaN, that it limits nothing.
Speed = Annotated[float, msgspec.Meta(gt=0.0, le=2.0)]
Acceleration = Annotated[float, msgspec.Meta(gt=0.0, le=20.0)]
Force = Annotated[float, msgspec.Meta(gt=0.0, le=200.0)]
Torque = Annotated[float, msgspec.Meta(gt=0.0, le=50.0)]
Length = Annotated[float, msgspec.Meta(gt=0.0, le=1.0)]
Seconds = Annotated[float, msgspec.Meta(gt=0.0, le=1.0)]
Mass = Annotated[float, msgspec.Meta(ge=0.0, le=50.0)]
Point = Annotated[tuple[Annotated[float, msgspec.Meta(ge=-1.0, le=1.0)], ...], msgspec.Meta(min_length=3, max_length=3)]
Angle = Annotated[float, msgspec.Meta(ge=-12.6, le=12.6)]
Angles = Annotated[tuple[Angle, ...], msgspec.Meta(min_length=7, max_length=7)]
JointSpeed = Annotated[float, msgspec.Meta(gt=0.0, le=10.0)]
JointSpeeds = Annotated[tuple[JointSpeed, ...], msgspec.Meta(min_length=7, max_length=7)]


class ToolData(msgspec.Struct, frozen=True, kw_only=True):
    """The tool on the flange: the bare hand.

    Attributes:
        mass_kg, com_E_m: Mass and centre of mass (3,) beyond the flange, without a payload.
        pose_E_P: (7,) P, the arm's TCP, in the flange frame: x y z qw qx qy qz.
    """

    mass_kg: Mass
    com_E_m: Point
    pose_E_P: Seven


class ArmLimits(msgspec.Struct, frozen=True, kw_only=True):
    """Limits that the driver itself enforces.

    Attributes:
        q_min, q_max, dq_max: (7,) rad, rad/s.
        speed_m_s, acceleration_m_s2: Commanded motion of P; a stop may use `stop_acceleration_m_s2`.
        force_N, torque_Nm: Norms of the contact wrench in S at which the arm stops.
        max_age_s: Largest age of a reading.
    """

    q_min: Angles
    q_max: Angles
    dq_max: JointSpeeds
    speed_m_s: Speed
    acceleration_m_s2: Acceleration
    stop_acceleration_m_s2: Acceleration
    force_N: Force
    torque_Nm: Torque
    max_age_s: Seconds


class HandLimits(msgspec.Struct, frozen=True, kw_only=True):
    """Ranges of the gripper and its pads; `image_shape` is None if no gel images are wanted."""

    stroke_m: Length
    speed_m_s: Speed
    force_N: Force
    pad_shape: tuple[PixelCount, PixelCount]
    pad_depth_m: Length
    image_shape: tuple[PixelCount, PixelCount] | None = None


class DeviceSettings(msgspec.Struct, frozen=True, kw_only=True):
    """Options of the devices; a user sets each by `--set name=value`.

    Attributes:
        robot: Serial number of the arm, e.g. "Rizon4-123456".
        gripper: MAC or IP address, or serial:PORT (a name, or /dev/tty..., /dev/serial/by-id/...); "none" or empty for
            an arm without one.
        left_pad, right_pad: Serial numbers of the tactile sensors; both or none.
        network: Addresses of this machine's interfaces through which the arm may be reached; empty: any.
        api: Flexiv interface; empty: that of the installed version.
        wrench: raw (no filter delay) or filtered.
        feed_forward: Send the setpoint's velocity along with its pose.
        mirror: Pad whose columns run along -x_P.
        link_loss: Behaviour of the fitted gripper when its link is lost. This describes the device; it sets nothing.
    """

    robot: str = ""
    gripper: Gripper = ""
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
        kind: Devices that the client expects; the driver serves the kind that its command line names.
        settings: Addresses and options.
        world: For devices that the driver itself simulates: their world, which the simulation decodes.
    """

    kind: Literal["real", "simulated"]
    settings: DeviceSettings = DeviceSettings()
    world: Annotated[bytes, msgspec.Meta(max_length=MAX_WORLD_BYTES)] = b""


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
    posture: Seven
    period_s: Seconds
    lockstep: bool
    move: bool = True  # False: observe only; nothing is enabled, switched or commanded


class Cycle(_Numbered, frozen=True, kw_only=True):
    """Run one control period; `images` requests one pair of gel images, which comes with a later block."""

    setpoint: Setpoint | None = None
    jaws: JawTarget | None = None
    tactile: bool = False
    images: bool = False


class TareRequest(_Numbered, frozen=True, kw_only=True):
    """Zero the wrist sensor. The answer is `Accepted`; a later block reports the end."""

    ticket: int
    duration_s: Annotated[float, msgspec.Meta(gt=0.0, le=60.0)]


class PayloadRequest(_Numbered, frozen=True, kw_only=True):
    """Set the payload, with its centre of mass (3,) in P. Answered like a tare."""

    ticket: int
    mass_kg: Mass
    com_P_m: Point


class HoldRequest(_Numbered, frozen=True):
    """Stop the arm."""


class RefereeRequest(_Numbered, frozen=True, kw_only=True):
    """Simulated devices only: a question to the world's referee.

    Attributes:
        method: The question; see `robot.simulation.Referee` and, for `disturb`, the simulated devices.
        force_B_N: (3,) for `push_tip`.
        name: Name for `disturb`.
    """

    method: Literal[
        "objects",
        "pose_B_K",
        "tip_B_m",
        "push_tip",
        "probe_in_holder",
        "peak_force_N",
        "samples_over_limit",
        "contact_softness_s",
        "silent_axes",
        "disturb",
    ]
    force_B_N: Three = (0.0, 0.0, 0.0)
    name: str = ""


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


class Images(msgspec.Struct, frozen=True, array_like=True):
    """Gel images as bytes red, green, blue of each pixel: row 0 nearest the flange, columns along +x_P for both."""

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
    images: Images | None = None
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
    """A device failed; `kind` as in `faults.DeviceFault`."""

    kind: str
    message: str
    cause: str = ""
    events: tuple[ArmEvent, ...] = ()
    age_s: float = 0.0
    limit_s: float = 0.0


class TrueBody(msgspec.Struct, frozen=True, array_like=True):
    """One object as `robot.simulation.TrueObject` has it; the pose as x y z qw qx qy qz."""

    name: str
    pose_B_O: Seven
    mass_kg: float
    outline_B_m: tuple[tuple[float, float], ...]
    in_gripper: bool
    size_m: tuple[float, float, float]


class RefereeAnswer(_Numbered, frozen=True, kw_only=True):
    """Answer of the referee: the objects, or the numbers of a pose, a point, a force or a truth value."""

    numbers: Numbers = ()
    objects: tuple[TrueBody, ...] = ()


Request = Open | Cycle | TareRequest | PayloadRequest | HoldRequest | RefereeRequest | Quit | Beat
Answer = Opened | OpenProgress | Block | Accepted | Refused | Failed | RefereeAnswer | Beat


class BadMessage(Exception):
    """The bytes are no message of this protocol."""


def _reader(kind: Any) -> Callable[[bytes], Any]:
    """Return the decoder of a union of messages; whatever the bytes are, it raises nothing but `BadMessage`."""
    decode = msgspec.msgpack.Decoder(kind).decode

    def read(body: bytes) -> Any:
        try:
            return decode(body)
        except (msgspec.MsgspecError, ValueError, RecursionError, OverflowError) as e:  # text that is no UTF-8, nesting
            raise BadMessage(str(e)) from e

    return read


def _plain_number(value: Any) -> object:
    """Return a number of numpy as one of Python."""
    if not hasattr(value, "item"):
        raise TypeError(f"a {type(value).__name__} cannot be sent")
    return value.item()


encode = msgspec.msgpack.Encoder(enc_hook=_plain_number).encode
decode_request = _reader(Request)
decode_answer = _reader(Answer)
