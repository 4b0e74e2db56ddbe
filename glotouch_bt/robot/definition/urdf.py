"""Read the chain of an arm from a URDF: joint frames, axes, limits and inertias. Meshes are not read.

URDF states lengths in m, angles in rad, forces in N and torques in Nm. A link's frame is that of the joint before it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from glotouch_bt.errors import BadInput, UnknownName
from glotouch_bt.robot.description import Joint, Link, Vec3
from glotouch_bt.robot.geometry import Array, Pose, rpy_to_matrix
from glotouch_bt.untrusted import read_file

MAX_URDF_BYTES = 4_000_000
"""Largest URDF. Source: ours; those of single arms have 10 to 100 kB."""
MAX_JOINT_RAD = 4 * math.pi
"""Largest limit of a joint's position. Source: ours; a larger number was probably in degrees."""
MAX_JOINT_RAD_S = 30.0
"""Largest limit of a joint's velocity. Source: ours; a larger number was probably in degrees per second."""
MAX_CHAIN_M = 4.0
"""Largest sum of the distances between joints. Source: ours; a larger number was probably in millimetres."""
INERTIA_SLACK = 1e-9
"""Relative rounding error that the test of an inertia tolerates. Source: ours."""
LIMITS = {
    "lower": "smallest position, rad",
    "upper": "largest position, rad",
    "velocity": "largest speed, rad/s",
    "effort": "largest torque, Nm",
}
"""Attributes of a joint's <limit> that must be there."""

Element = ET.Element
Inertia = tuple[float, float, float, float, float, float]
NO_LINK = Link(name="", mass_kg=1.0, com_m=(0.0, 0.0, 0.0), inertia_kgm2=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
"""Stands for a link with a fault, so that the other faults can be found."""


@dataclass(frozen=True)
class UrdfChain:
    """The arm as its URDF states it: links without collision shapes, joints without armature and servo.

    Attributes:
        base: The fixed link; its frame is B.
        joints: The revolute joints from the base to the flange.
        pose_last_E: Flange frame in the last joint's frame.
    """

    base: Link
    joints: tuple[Joint, ...]
    pose_last_E: Pose


def read_chain(path: Path, base: str, flange: str) -> UrdfChain:
    """Read the chain between two links. Links and joints beside it are ignored.

    Args:
        path: The URDF.
        base, flange: Names of the links whose frames are B and E.

    Raises:
        BadInput: It is no URDF, or the chain has faults (all of them in one message).
        UnknownName: A link does not exist; lists those that do.
    """
    root = _parse(path)
    links = {e.get("name", ""): e for e in root.findall("link")}
    for name in (base, flange):
        if name not in links:
            raise UnknownName(f"link of {path}:", name, links)
    reader = _ChainReader(links)
    chain = reader.chain(base, _joints_between(path, root, base, flange))
    if reader.faults:
        raise BadInput("\n".join(f"{path}: {fault}" for fault in reader.faults))
    return chain


def _parse(path: Path) -> Element:
    text = read_file(path, MAX_URDF_BYTES, what="a URDF", links=True)
    if b"<!ENTITY" in text:
        raise BadInput(f"{path}: defines XML entities, which a URDF does not need: remove them")
    try:
        root = ET.fromstring(text)
    except (ET.ParseError, ValueError) as e:
        raise BadInput(f"{path}: is not XML ({e}); a xacro file must be expanded to a URDF first") from e
    if root.tag != "robot":
        raise BadInput(f"{path}: begins with <{root.tag}>; a URDF begins with <robot>")
    return root


def _joints_between(path: Path, root: Element, base: str, flange: str) -> list[Element]:
    """Return the joints on the way from one link to another."""
    above = {_link_of(j, "child"): j for j in root.findall("joint")}
    way: list[Element] = []
    link = flange
    while link != base:
        joint = above.pop(link, None)
        if joint is None:
            raise BadInput(
                f"{path}: no joints lead from base {base!r} to flange {flange!r}: the way up from the flange ends at "
                f"link {link!r}; name a link on that way as the base, or add the missing joint"
            )
        way.append(joint)
        link = _link_of(joint, "parent")
    return way[::-1]


def _link_of(joint: Element, end: str) -> str:
    found = joint.find(end)
    return "" if found is None else found.get("link", "")


class _ChainReader:
    """Reads elements and collects their faults, so that all of them are reported at once."""

    def __init__(self, links: dict[str, Element]) -> None:
        self._links = links
        self.faults: list[str] = []

    def chain(self, base: str, way: list[Element]) -> UrdfChain:
        """Return the chain along joints, from the base to the flange."""
        joints: list[Joint] = []
        fixed: list[Element] = []
        for element in way:
            kind = element.get("type", "")
            if kind == "fixed":
                fixed.append(element)
                continue
            if kind != "revolute":
                why = "; state the range that its cables allow" if kind == "continuous" else ""
                self.faults.append(f"{_shown(element)} is {kind or 'without a type'}, but must be revolute{why}")
            if fixed:
                self.faults.append(
                    f"{_shown(fixed[0])} is fixed and comes before {_shown(element)}: merge the two links that it joins"
                    ", or name a later link as the base"
                )
                fixed = []
            joints.append(self._joint(element))
        pose_last_E = self._pose(fixed[0]) if fixed else Pose(np.zeros(3))
        for element in fixed[1:]:
            pose_last_E = pose_last_E @ self._pose(element)
        for element in fixed:
            self._require_massless(element, joints)
        length = sum(math.hypot(*joint.origin_m) for joint in joints)
        if length > MAX_CHAIN_M:
            self.faults.append(f"its joints are {length:g} m apart in all; lengths are in m, at most {MAX_CHAIN_M:g} m")
        return UrdfChain(self._link(base), tuple(joints), pose_last_E)

    def _joint(self, element: Element) -> Joint:
        axis = self._numbers(element, "axis", "xyz", (1.0, 0.0, 0.0))
        length = math.hypot(*axis)
        if length == 0.0:
            self.faults.append(f"{_shown(element)}: its axis is zero")
        elif abs(length - 1.0) > 1e-12:
            axis = (axis[0] / length, axis[1] / length, axis[2] / length)
        lower, upper, velocity, effort = self._limits(element)
        return Joint(
            name=element.get("name", ""),
            origin_m=self._numbers(element, "origin", "xyz"),
            origin_rpy_rad=self._numbers(element, "origin", "rpy"),
            axis=axis,
            lower_rad=lower,
            upper_rad=upper,
            velocity_rad_s=velocity,
            torque_Nm=effort,
            armature_kgm2=0.0,
            link=self._link(_link_of(element, "child")),
        )

    def _limits(self, joint: Element) -> list[float]:
        """Return lower rad, upper rad, velocity rad/s and effort Nm of a joint."""
        limit = joint.find("limit")
        given = {} if limit is None else limit.attrib
        missing = [f"{name} ({what})" for name, what in LIMITS.items() if name not in given]
        if missing:
            self.faults.append(f"{_shown(joint)}: its <limit> needs {', '.join(missing)}")
            return [-1.0, 1.0, 1.0, 1.0]
        values = [self._number(f"{_shown(joint)}: limit {name}", given[name]) for name in LIMITS]
        lower, upper, velocity, effort = values
        if not lower < upper:
            self.faults.append(f"{_shown(joint)}: its lower limit {lower:g} must be below its upper limit {upper:g}")
        if max(-lower, upper) > MAX_JOINT_RAD or velocity > MAX_JOINT_RAD_S:
            self.faults.append(
                f"{_shown(joint)}: limits of {lower:g} .. {upper:g} rad and {velocity:g} rad/s; are they in degrees? "
                f"At most {MAX_JOINT_RAD:.1f} rad and {MAX_JOINT_RAD_S:g} rad/s are valid"
            )
        for name, value in (("velocity", velocity), ("effort", effort)):
            if not value > 0.0:
                self.faults.append(f"{_shown(joint)}: its limit {name} = {value:g} must be positive ({LIMITS[name]})")
        return values

    def _link(self, name: str) -> Link:
        element = self._links.get(name)
        inertial = None if element is None else element.find("inertial")
        mass, inertia = (None if inertial is None else inertial.find(tag) for tag in ("mass", "inertia"))
        if inertial is None or mass is None or inertia is None:
            self.faults.append(f"link {name!r} needs <inertial> with <mass> and <inertia>; the simulation moves it")
            return NO_LINK
        mass_kg = self._number(f"link {name!r}: mass", mass.get("value", ""))
        words = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        xx, yy, zz, xy, xz, yz = (self._number(f"link {name!r}: inertia {w}", inertia.get(w, "")) for w in words)
        moments: Inertia = (xx, yy, zz, xy, xz, yz)
        rpy = self._numbers(inertial, "origin", "rpy")
        if any(rpy):
            turn = rpy_to_matrix(rpy)
            m = turn @ _matrix(moments) @ turn.T
            xx, yy, zz, xy, xz, yz = (float(m[i]) for i in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
            moments = (xx, yy, zz, xy, xz, yz)
        if not mass_kg > 0.0:
            self.faults.append(f"link {name!r}: its mass {mass_kg:g} kg must be positive")
        principal = np.linalg.eigvalsh(_matrix(moments))
        if not (principal[0] > 0.0 and principal[0] + principal[1] >= principal[2] * (1.0 - INERTIA_SLACK)):
            self.faults.append(
                f"link {name!r}: no body has the principal moments of inertia {principal.tolist()} kg m2; each must be "
                "positive and at most the sum of the other two"
            )
        return Link(name=name, mass_kg=mass_kg, com_m=self._numbers(inertial, "origin", "xyz"), inertia_kgm2=moments)

    def _require_massless(self, fixed: Element, joints: list[Joint]) -> None:
        """Refuse a mass behind the last moving joint: it would be lost."""
        name = _link_of(fixed, "child")
        if self._links[name].find("inertial") is not None and joints:
            last = joints[-1].link.name
            self.faults.append(
                f"link {name!r} has a mass, but {_shown(fixed)} before it is fixed: add the mass to link {last!r}"
            )

    def _pose(self, element: Element) -> Pose:
        xyz, (roll, pitch, yaw) = (self._numbers(element, "origin", name) for name in ("xyz", "rpy"))
        if roll == pitch == 0.0:
            return Pose.planar(xyz, yaw)
        return Pose.from_matrix(xyz, rpy_to_matrix((roll, pitch, yaw)))

    def _numbers(self, element: Element, tag: str, name: str, default: Vec3 = (0.0, 0.0, 0.0)) -> Vec3:
        """Return three numbers of a child's attribute."""
        child = element.find(tag)
        text = None if child is None else child.get(name)
        if text is None:
            return default
        words = text.split()
        if len(words) != 3:
            self.faults.append(f"{_shown(element)}: {name} of its <{tag}> = {text!r} must be three numbers")
            return default
        x, y, z = (self._number(f"{_shown(element)}: {name} of its <{tag}>", word) for word in words)
        return x, y, z

    def _number(self, what: str, text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            self.faults.append(f"{what} = {text!r} must be a finite number")
            return 1.0
        return value


def _shown(element: Element) -> str:
    name = element.get("name")
    return f"{element.tag} {name!r}" if name else f"an <{element.tag}>"


def _matrix(inertia: Inertia) -> Array:
    """Return the matrix (3, 3) of (ixx, iyy, izz, ixy, ixz, iyz)."""
    xx, yy, zz, xy, xz, yz = inertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
