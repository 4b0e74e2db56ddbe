"""What client and driver say to each other: msgpack over one socket. SI units; frames as in `frames`.

The client asks, the driver answers each request once, with the request's number; heartbeats are not numbered. A message
that cannot be decoded is refused, never guessed at.
"""

from __future__ import annotations

import msgspec

PROTOCOL = 1
COLUMNS = 7 + 7 + 3 + 4 + 6
"""One sample: q, dq, position of P in B, quaternion of P in B (w x y z), wrench in S."""

Numbers = tuple[float, ...]


class ToolData(msgspec.Struct, frozen=True, kw_only=True):
    """What is bolted to the flange.

    Attributes:
        mass_kg, com_E_m: All beyond the flange, without a payload.
        pose_E_P: (7,) the pads' mid-point in the flange frame, x y z qw qx qy qz; P is the arm's TCP.
    """

    mass_kg: float
    com_E_m: Numbers
    pose_E_P: Numbers


class ArmLimits(msgspec.Struct, frozen=True, kw_only=True):
    """What the driver enforces on its own account.

    Attributes:
        q_min, q_max, dq_max: (7,) rad, rad/s.
        speed_m_s, acceleration_m_s2: Of P, commanded; a stop may use `stop_acceleration_m_s2`.
        force_N, torque_Nm: Norms of the contact wrench in S that stop the arm.
        max_age_s: The oldest a reading may be.
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
    """Range of the gripper, and of its pads."""

    stroke_m: float
    speed_m_s: float
    force_N: float
    pad_shape: tuple[int, int]
    pad_depth_m: float


class Devices(msgspec.Struct, frozen=True, kw_only=True):
    """Which devices, and where they are.

    Attributes:
        kind: "real", "simulated" (in this process, in lock-step) or "cell" (simulated, in a process of its own).
        robot: Serial number of the arm.
        api: Flexiv interface, "1.9" or "2.0"; empty: by the installed version.
        network: Addresses of this machine's interfaces the arm may be reached through; empty: any.
        gripper: MAC or IP address, or "serial:PORT"; empty: none.
        pads: Serial numbers of the left and right sensor; empty: none.
        world: Simulated only: the file with the world, or the cell's address.
        wrench: "raw" or "filtered".
        feed_forward: Send the setpoint's velocity along with its pose.
        mirror: Which pad's columns run along -x_P: "right", "left" or "none".
        link_loss: What the fitted gripper does when its link is lost: "holds" or "opens". A statement, not a wish.
    """

    kind: str
    robot: str = ""
    api: str = ""
    network: tuple[str, ...] = ()
    gripper: str = ""
    pads: tuple[str, ...] = ()
    world: str = ""
    wrench: str = "raw"
    feed_forward: bool = True
    mirror: str = "right"
    link_loss: str = "holds"


class Setpoint(msgspec.Struct, frozen=True, array_like=True):
    """Where the arm shall be at the end of the coming period.

    Attributes:
        q, dq: (7,) what the plan says, for the checks.
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


# -- requests ----------------------------------------------------------------------------------------------------------


class Open(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """Connect and make ready; the first request."""

    number: int
    protocol: int
    devices: Devices
    tool: ToolData
    arm: ArmLimits
    hand: HandLimits
    posture: Numbers
    period_s: float
    lockstep: bool
    move: bool = True  # False: look only; nothing is enabled, switched or commanded


class Cycle(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """One control period."""

    number: int
    setpoint: Setpoint | None = None
    jaws: JawTarget | None = None
    tactile: bool = False


class TareRequest(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """Zero the wrist sensor; answered by `Accepted`, done when a block says so."""

    number: int
    ticket: int
    duration_s: float


class PayloadRequest(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """What the hand carries beyond itself, (3,) centre of mass in P; as a tare."""

    number: int
    ticket: int
    mass_kg: float
    com_P_m: Numbers


class HoldRequest(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """Stop where you are."""

    number: int


class RefereeRequest(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """Simulated devices only: a question for the world's referee, which alone can read it."""

    number: int
    question: bytes


class Quit(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """Stop the arm, release the devices, end the process."""

    number: int


class Beat(msgspec.Struct, frozen=True, tag=True):
    """I am alive. Both ways."""


# -- answers -----------------------------------------------------------------------------------------------------------


class ArmEvent(msgspec.Struct, frozen=True, array_like=True):
    """An entry of the arm's event log: level, id, description, what to do."""

    level: str
    id: int
    description: str
    advice: str = ""


class JawState(msgspec.Struct, frozen=True, array_like=True):
    """What the gripper last said; the stamp is when it was read."""

    stamp_s: float
    aperture_m: float
    force_N: float
    moving: bool


class Maps(msgspec.Struct, frozen=True, array_like=True):
    """Depth maps, metres, row 0 nearest the flange, columns along +x_P for both; float64 bytes."""

    stamp_s: float
    rows: int
    columns: int
    left: bytes
    right: bytes


class Done(msgspec.Struct, frozen=True, array_like=True):
    """A slow request has ended; `error` is empty if well."""

    ticket: int
    error: str = ""


class Opened(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """Ready. `info` is for people and the doctor; q_min and q_max are the device's own."""

    number: int
    info: dict[str, str]
    q_min: Numbers
    q_max: Numbers


class OpenProgress(msgspec.Struct, frozen=True, tag="Progress"):
    """What opening is busy with."""

    text: str


class Block(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """What was sensed since the last block.

    Attributes:
        stamps: float64 bytes (n,), the driver's clock at which each sample was read.
        samples: float64 bytes (n, COLUMNS).
        late: Control periods that passed without a command since the last block.
        stop: (quantity, value, limit, stamp s) if the hard limit has tripped.
        sent_s, read_s: `time.monotonic` when the command had been handed to the arm, and when the newest sample was
            read: for measuring latencies on one machine.
    """

    number: int
    stamps: bytes
    samples: bytes
    jaws: JawState
    maps: Maps | None = None
    done: tuple[Done, ...] = ()
    late: int = 0
    stop: tuple[str, float, float, float] | None = None
    sent_s: float = 0.0
    read_s: float = 0.0


class Accepted(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """Begun, or done."""

    number: int


class Refused(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """A command that breaks a rule; nothing was sent to the device, the arm holds."""

    number: int
    name: str
    value: str
    rule: str


class Failed(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """A device does not work. `kind`: connect, fault, state, link, stale, vendor, world."""

    number: int
    kind: str
    message: str
    cause: str = ""
    events: tuple[ArmEvent, ...] = ()
    age_s: float = 0.0
    limit_s: float = 0.0


class RefereeAnswer(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """Its answer."""

    number: int
    answer: bytes


Request = Open | Cycle | TareRequest | PayloadRequest | HoldRequest | RefereeRequest | Quit | Beat
Answer = Opened | OpenProgress | Block | Accepted | Refused | Failed | RefereeAnswer | Beat

encode = msgspec.msgpack.Encoder().encode
decode_request = msgspec.msgpack.Decoder(Request).decode
decode_answer = msgspec.msgpack.Decoder(Answer).decode
