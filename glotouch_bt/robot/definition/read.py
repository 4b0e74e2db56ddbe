"""A robot's file and its URDF -> `RobotDescription`."""

from __future__ import annotations

import difflib
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, get_args

import numpy as np
import yaml
from pydantic import BaseModel, ValidationError

from glotouch_bt.errors import BadInput
from glotouch_bt.robot.definition.robot_file import BoxSection, GelCameraSection, GripperSection, RobotFile
from glotouch_bt.robot.definition.urdf import UrdfChain, read_chain
from glotouch_bt.robot.description import Box, Capsule, GelCamera, Gripper, Joint, Link, RobotDescription, forward
from glotouch_bt.robot.geometry import Pose
from glotouch_bt.untrusted import read_file

MAX_FILE_BYTES = 1_000_000
"""Largest YAML file. Source: ours; a robot's file has about 4 kB."""
MIN_JOINTS = 6
"""Fewest joints with which the hand can take any pose."""
MAX_HOME_TILT_DEG = 5.0
"""Largest angle between the hand and the vertical at home. Source: ours; the skills work with the hand pointing down,
and inverse kinematics starts from home."""


def read_robot(path: Path) -> RobotDescription:
    """Read a robot from its YAML file and the URDF that the file names.

    Raises:
        BadInput: A file cannot be read, or the robot has faults. The message has one line for each fault, with the
            file, the place, and what is valid.
    """
    given = _read_file(path)
    urdf = path.parent / given.urdf
    chain = read_chain(urdf, given.base, given.flange)
    faults = [f"{path}: {fault}" for fault in _faults_of(given, chain, urdf)]
    if faults:
        raise BadInput("\n".join(faults))
    robot = _described(given, chain)
    _require_home(path, robot)
    return robot


def _read_file(path: Path) -> RobotFile:
    text = read_file(path, MAX_FILE_BYTES, what="a robot's file", links=True)
    try:
        is_mapping, plain = _as_json(text)
    except (yaml.YAMLError, UnicodeDecodeError, ValueError, RecursionError, TypeError) as e:
        raise BadInput(f"{path}: is not YAML ({' '.join(str(e).split())})") from e
    if not is_mapping:
        raise BadInput(f"{path}: a robot's file must be a mapping with {', '.join(RobotFile.model_fields)}")
    try:
        return RobotFile.model_validate_json(plain, strict=True)
    except ValidationError as e:
        raise BadInput("\n".join(f"{path}: {_in_words(error)}" for error in e.errors())) from e


@lru_cache(maxsize=8)
def _as_json(text: bytes) -> tuple[bool, str]:
    """Return whether a YAML text is a mapping, and what it holds as JSON."""
    data = yaml.safe_load(text)
    return isinstance(data, dict), json.dumps(data, default=str)


def _in_words(error: Any) -> str:
    """Return one error of pydantic as a sentence."""
    *above, last = error["loc"]
    where = ".".join(map(str, above))
    if error["type"] == "missing":
        field = _section(above).model_fields.get(str(last))
        what = f" ({field.description})" if field is not None else ""
        return f"{where or 'the robot'} needs {last!r}{what}"
    if error["type"] == "extra_forbidden":
        valid = list(_section(above).model_fields)
        near = difflib.get_close_matches(str(last), valid, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        return f"{where or 'the robot'} has no key {last!r}{hint} (valid: {', '.join(valid)})"
    message = str(error["msg"])
    return f"{'.'.join(map(str, error['loc']))} = {error['input']!r:.80}: {message[:1].lower()}{message[1:]}"


def _section(above: Iterable[int | str]) -> type[BaseModel]:
    """Return the section of the file at a place, such as gripper.finger or joints.joint1."""
    section: type[BaseModel] = RobotFile
    for step in above:
        field = section.model_fields.get(str(step))
        if field is None:  # the name of a joint or a link, or a number in a list
            continue
        inside = [field.annotation]
        while inside and not (isinstance(inside[0], type) and issubclass(inside[0], BaseModel)):
            inside = [a for outer in inside for a in get_args(outer) if a is not str and a is not Ellipsis]
        section = inside[0] if inside else section  # type: ignore[assignment]
    return section


def _faults_of(given: RobotFile, chain: UrdfChain, urdf: Path) -> list[str]:
    """Return what does not fit between the two files."""
    joints = [j.name for j in chain.joints]
    links = [chain.base.name, *(j.link.name for j in chain.joints)]
    faults = [
        *_unlike("joints", "joint", given.joints, joints, urdf),
        *_unlike("capsules", "link", given.capsules, links, urdf),
    ]
    if len(joints) < MIN_JOINTS:
        faults.append(
            f"{len(joints)} joints move between base {given.base!r} and flange {given.flange!r}; "
            f"the hand needs at least {MIN_JOINTS} to take any pose"
        )
    for joint in chain.joints:
        home = given.joints[joint.name].home_rad if joint.name in given.joints else joint.lower_rad
        if not joint.lower_rad <= home <= joint.upper_rad:
            faults.append(
                f"joints.{joint.name}.home_rad = {home:g} is outside of its range in the URDF, "
                f"{joint.lower_rad:g} .. {joint.upper_rad:g} rad"
            )
    return faults


def _unlike(section: str, kind: str, given: Mapping[str, object], there: list[str], urdf: Path) -> list[str]:
    """Return the names that only the file or only the URDF has."""
    faults = []
    for name in given:
        if name not in there:
            near = difflib.get_close_matches(name, there, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            faults.append(
                f"{section}.{name}: {urdf.name} has no {kind} {name!r} between base and flange{hint} "
                f"(valid: {', '.join(there)})"
            )
    missing = [name for name in there if name not in given]
    if missing:
        faults.append(f"{section} lacks {', '.join(missing)}; every {kind} between base and flange needs an entry")
    return faults


def _described(given: RobotFile, chain: UrdfChain) -> RobotDescription:
    def dressed(link: Link) -> Link:
        return replace(link, capsules=tuple(Capsule(**c.model_dump()) for c in given.capsules[link.name]))

    def driven(joint: Joint) -> Joint:
        more = given.joints[joint.name]
        return replace(
            joint,
            armature_kgm2=more.armature_kgm2,
            servo_stiffness_Nm_rad=more.servo_stiffness_Nm_rad,
            link=dressed(joint.link),
        )

    return RobotDescription(
        name=given.robot,
        base=dressed(chain.base),
        joints=tuple(map(driven, chain.joints)),
        pose_last_E=chain.pose_last_E,
        home_q=tuple(given.joints[j.name].home_rad for j in chain.joints),
        gripper=_gripper(given.gripper),
        source=given.source,
    )


def _gripper(given: GripperSection) -> Gripper:
    def box(section: BoxSection) -> Box:
        return Box(centre_m=section.centre_m, half_m=section.half_m)

    names = ("mass_kg", "com_E_m", "finger_mass_kg", "stroke_m", "force_N", "speed_m_s", "pad_window_m", "pad_shape",
             "pad_depth_m")  # fmt: skip
    place = given.pose_E_P
    return Gripper(
        pose_E_P=Pose.planar(place.position_m, math.radians(place.yaw_deg)),
        body=tuple(map(box, given.body)),
        finger=box(given.finger),
        camera=None if given.camera is None else _camera(given.camera),
        **{name: getattr(given, name) for name in names},
    )


def _camera(given: GelCameraSection) -> GelCamera:
    up = math.radians(given.elevation_deg)
    red, green, blue = (
        (math.cos(a) * math.cos(up), math.sin(a) * math.cos(up), math.sin(up))
        for a in map(math.radians, given.azimuth_deg)
    )
    return GelCamera(shape=given.shape, lights=(red, green, blue))


def _require_home(path: Path, robot: RobotDescription) -> None:
    """Refuse a home posture in which the hand does not point down."""
    approach = forward(robot, robot.home_q).rotation[:, 2]
    tilt_deg = float(np.degrees(np.arccos(np.clip(-approach[2], -1.0, 1.0))))
    if tilt_deg > MAX_HOME_TILT_DEG:
        raise BadInput(
            f"{path}: at home (joints.*.home_rad) z_P is {approach.round(3).tolist()} in B, {tilt_deg:.1f} deg "
            f"from straight down, at most {MAX_HOME_TILT_DEG:g} deg: choose a posture with the hand pointing down"
        )
