"""The state of a mission at one time, as the page draws it. Values only; lengths in metres, frames as in the record.

Frames: B arm base, K container, P mid-point of the pads.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from glotouch_bt.robot import Array

OutlineState = Literal["found", "best", "excluded", "rejected", "taken"]
"""State of a candidate: found; the most probable; excluded by the target's STL; rejected; lifted."""
Phase = Literal["waiting", "running", "pausing", "paused", "ended"]
"""Phase of a mission: nothing recorded yet; a pause was requested; the arm stands; the record is complete."""


@dataclass(frozen=True)
class TouchPoint:
    """A contact of the probe.

    Attributes:
        stamp_s: Robot clock at its onset.
        point_K_m: (3,) touched point.
        outward_K: (3,) direction of the force on the probe, a unit vector; zero if unknown.
        force_N: Force that counted as a touch.
    """

    stamp_s: float
    point_K_m: Array
    outward_K: Array
    force_N: float


@dataclass(frozen=True)
class CandidateOutline:
    """A candidate as far as it is known.

    Attributes:
        index: Order of discovery.
        outline_K_m: (n, 2) closed polyline.
        normal_K: (n, 2) outward normal at each corner.
        sd_m: (n,) standard deviation of the outline along its normal, zero if unknown.
        size_m: Length and width of the fitted shape.
        height_m: Top above the floor; the sensing height until it was measured.
        kind: Fitted shape: circle, rectangle or free.
    """

    index: int
    outline_K_m: Array
    normal_K: Array
    sd_m: Array
    size_m: tuple[float, float]
    height_m: float
    kind: str


@dataclass(frozen=True)
class PlannedGrasp:
    """A grasp that is planned.

    Attributes:
        candidate: Index of the candidate.
        position_K_m: (3,) mid-point of the pads.
        yaw_rad: Direction of x_P in K; the jaws close across it.
        opening_m: Opening of the jaws on the way down.
        aperture_m: Expected opening on the object.
    """

    candidate: int
    position_K_m: Array
    yaw_rad: float
    opening_m: float
    aperture_m: float


@dataclass(frozen=True)
class FeltPatch:
    """The taxels that one closure of the jaws indented.

    Attributes:
        points_K_m: (n, 3) points of the object's surface.
        depth_m: (n,) indentation.
    """

    points_K_m: Array
    depth_m: Array


@dataclass(frozen=True)
class GhostObject:
    """A true object of a simulation.

    Attributes:
        name: STL stem.
        position_B_m: (3,) origin of its mesh frame.
        quat: (4,) orientation w x y z.
        outline_B_m: (n, 2) convex outline from above.
        size_m: (3,) its true size along the axes of its mesh frame; None if unknown.
    """

    name: str
    position_B_m: Array
    quat: Array
    outline_B_m: Array
    size_m: Array | None = None


@dataclass(frozen=True)
class FittedTarget:
    """The target at the pose that the recognition accepted.

    Attributes:
        candidate: Index of the candidate.
        name: STL stem of the target.
        pose_K_O: (x, y, yaw) of the mesh, turned by `quat`.
        quat: (w, x, y, z) rotation of the mesh onto the side on which it is taken to stand.
    """

    candidate: int
    name: str
    pose_K_O: tuple[float, float, float]
    quat: tuple[float, float, float, float]


@dataclass(frozen=True)
class Share:
    """The probability that a candidate, or none of them (index None), is the target."""

    index: int | None
    probability: float


@dataclass(frozen=True)
class LogLine:
    """One event in words; `tone` is its colour: "", good, warn or bad."""

    stamp_s: float
    kind: str
    text: str
    tone: str = ""


@dataclass(frozen=True)
class SceneState:
    """A mission at one time.

    Attributes:
        t_s: Robot clock.
        phase: See `Phase`.
        q: (dof,) joint positions, rad; None before the first observation.
        aperture_m, jaw_force_N: Last report of the gripper.
        force_N: Norm of the wrist force.
        tip_m: Distance from P to the ball of the probe in the jaws; None if it stands in its holder.
        probe_lost: The probe is neither in the jaws nor in its holder, so nobody knows where it is.
        touches, patches, outlines: Everything found until then.
        states: State of each candidate.
        shares: The posterior, most probable first; empty before the first decision.
        grasp: The planned grasp, until the object is lifted or put back.
        fit: The target where it was recognised, until it is lifted.
        pads: Newest depth maps (left, right), each (rows, cols), or None if older than `PADS_S`.
        nodes: Status of each node by its path, in the order of the tree; "" for one that has not run yet.
        log: Events until then, oldest first.
    """

    t_s: float
    phase: Phase = "waiting"
    q: Array | None = None
    aperture_m: float = 0.0
    jaw_force_N: float = 0.0
    force_N: float = 0.0
    tip_m: float | None = None
    probe_lost: bool = False
    touches: tuple[TouchPoint, ...] = ()
    patches: tuple[FeltPatch, ...] = ()
    outlines: tuple[CandidateOutline, ...] = ()
    states: dict[int, OutlineState] = field(default_factory=dict)
    shares: tuple[Share, ...] = ()
    grasp: PlannedGrasp | None = None
    fit: FittedTarget | None = None
    pads: tuple[Array, Array] | None = None
    nodes: dict[str, str] = field(default_factory=dict)
    log: tuple[LogLine, ...] = ()
